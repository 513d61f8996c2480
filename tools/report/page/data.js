// The run's figures: they lie in the page, deflated; nothing is fetched.
const $ = (id) => document.getElementById(id);
let data, points, entries; // entries: one a line of the sweep, { point, values, varied }
const byHash = new Map();
const state = { against: '', channel: 'color', figure: 'rmse', cost: 'bits', filter: null, a: null, b: null, sort: null, down: false, thumbnails: 48, rows: 60 };

const kFigures = { rmse: 'RMSE in LSB8', max: 'greatest error in LSB8', bias: 'bias in LSB8', psnr: 'PSNR in dB', ssim: 'SSIM' };
const kChannels = { color: 'colour, linear light', alpha: 'opacity', color_srgb: 'colour on an sRGB display' };
const kCosts = { bits: 'bits (words + operations)', word_bits: 'bits of words', multiplier_bits: 'bits of multipliers', divider_bits: 'bits of dividers', rounding_bits: 'bits of roundings', mean_bits: 'bits in a sample, mean (words + operations)', lookup_bits: 'bits looked up', table_bits: 'bits of tables', table_bytes: 'bytes of tables', pixel_bits: 'bits of a pixel', ms: 'ms a frame' };
// LSB8: what was asked for, or what rounding to 8 bits may cost anyway.
const bound = () => data.answer.bound;
const boundName = () => bound() === 0.5 ? 'half an LSB8' : `${number(bound())} LSB8`;
const stageNames = () => Object.keys(data.stages), wireNames = () => Object.values(data.stages).flat();
const stageOfWire = (wire) => stageNames().find((stage) => data.stages[stage].includes(wire));

async function inflated(bytes) {
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();
}
function fromBase64(text) {
  const bytes = atob(text), made = new Uint8Array(bytes.length);
  for (let i = 0; i < bytes.length; ++i) made[i] = bytes.charCodeAt(i);
  return made;
}
const readJson = async (id) => JSON.parse(new TextDecoder().decode(await inflated(fromBase64($(id).textContent))));

async function readData() {
  data = await readJson('data');
  ({ points, entries } = data);
  state.against = data.answer.against ?? data.against[0];
  state.figure = data.answer.figure;
  if (data.search?.transfer === 'srgb') state.channel = 'color_srgb';
  const first = new Map(); // point -> its first entry: what it is called
  for (const entry of entries) if (!first.has(entry.point)) first.set(entry.point, entry);
  points.forEach((p, i) => {
    p.entry = first.get(i);
    p.label = labelOf(p.entry);
    byHash.set(p.hash, p);
  });
}

// Of a search: seen from where nothing was tuned.
const heldOut = (p) => data.search?.other_degrees?.includes(p.entry?.values.degrees) ?? false;
const done = (p) => p.status === 'done';
const kept = (p) => state.filter === null || state.filter.has(p.hash);
const figuresOf = (p) => p.error?.[state.against]?.[state.channel];
function errorOf(p) {
  const value = figuresOf(p)?.[state.figure];
  return value === undefined ? null : state.figure === 'bias' && value !== null ? Math.abs(value) : value;
}
const costOf = (p) => (state.cost === 'ms' ? p.ms : p.cost?.[state.cost]) ?? null;
const moreIsBetter = () => state.figure === 'psnr' || state.figure === 'ssim';
const logarithmic = () => !moreIsBetter();
const inLsb8 = () => state.figure === 'rmse' || state.figure === 'max';
// Less is better.  Identical pictures have no PSNR: they are the best there is.
function badness(p) {
  const error = errorOf(p);
  if (error === null) return state.figure === 'psnr' && figuresOf(p) ? -Infinity : Infinity;
  return moreIsBetter() ? -error : error;
}

function number(x) {
  if (x === null || x === undefined) return '';
  return Number.isInteger(x) || Math.abs(x) >= 1e5 ? String(Math.round(x)) : String(+x.toPrecision(4));
}
const valueText = (value) => typeof value === 'string' ? value.split('/').pop().replace(/\.toml$/, '') : String(value);
const kBits = / (fraction_bits|fraction_offset|integer_bits|integer_offset)$/;
const kShort = { fraction_bits: 'F', fraction_offset: 'F', integer_bits: 'I', integer_offset: 'I' };
function labelOf(entry) {
  const parts = Object.entries(entry?.values ?? {}).map(([axis, value]) => {
    if (axis === 'together') return value;
    const bits = kBits.exec(axis)?.[1];
    if (bits) return `${axis.replace(kBits, '')} ${kShort[bits]}${bits.endsWith('offset') ? (value < 0 ? '' : '+') : ' '}${value}`;
    return `${axis.replace(/^.*\.(?=[a-z_]+$)/, '')} ${valueText(value)}`;
  });
  return parts.join(', ') || 'base point';
}
const formatOf = (p, wire) => /^[us](\d+)\.(\d+)/.exec(p.wires?.[wire] ?? '');
function median(list) {
  const sorted = [...list].sort((x, y) => x - y), middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
function grouped(list, keyOf, valueOf) {
  const groups = new Map();
  for (const item of list) {
    const key = keyOf(item);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(valueOf(item));
  }
  return groups;
}

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in made && typeof value !== 'string') made[name] = value; else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}
function fill(select, options, chosen) {
  select.replaceChildren(...options.map(([value, text]) => element('option', { value }, text)));
  if (chosen !== undefined) select.value = chosen;
}
