// Pictures: 16-bit linear words of R G B A, kept in the page as text, unpacked when they are first seen.
let blob = null;
const unpacked = new Map(); // key -> promise of { w, h, s, words, box }
const has = (key) => key in data.pictures;

// Deflated planes R G B A of 16-bit words, each row as differences, low bytes before high bytes.
function picture(key) {
  if (unpacked.has(key)) return unpacked.get(key);
  if (!has(key)) return Promise.resolve(null);
  const { w, h, s, at, size } = data.pictures[key];
  blob ??= $('packed').textContent;
  const made = inflated(fromBase64(blob.slice(at, at + size))).then((bytes) => {
    const planes = new Uint8Array(bytes), n = w * h, words = new Uint16Array(4 * n);
    for (let i = 0; i < 4 * n; ++i) words[i] = (i % w ? words[i - 1] : 0) + (planes[i] | planes[i + 4 * n] << 8);
    return { w, h, s, words, box: boxOf(words, w, h) };
  });
  unpacked.set(key, made);
  if (unpacked.size > 400) unpacked.delete(unpacked.keys().next().value);
  return made;
}
// Where there is something to see, in the full picture's units of one: [left, top, right, bottom].
function boxOf(words, w, h) {
  let left = w, top = h, right = 0, bottom = 0;
  for (let y = 0, i = 3 * w * h; y < h; ++y) {
    for (let x = 0; x < w; ++x, ++i) if (words[i]) left = Math.min(left, x), right = Math.max(right, x + 1), top = Math.min(top, y), bottom = Math.max(bottom, y + 1);
  }
  return right ? [left / w, top / h, right / w, bottom / h] : [0, 0, 1, 1];
}
// Both boxes and a margin, no narrower or flatter than half of it.
function cropOf(...images) {
  const wide = images.map((i) => i.box), [w, h] = [images[0].w, images[0].h];
  const edge = (from, to, size) => {
    const margin = 0.04 * Math.max(to - from, 0.1);
    return [Math.max(0, Math.floor((from - margin) * size)) / size, Math.min(1, Math.ceil((to + margin) * size) / size)];
  };
  const [left, right] = edge(Math.min(...wide.map((b) => b[0])), Math.max(...wide.map((b) => b[2])), w);
  const [top, bottom] = edge(Math.min(...wide.map((b) => b[1])), Math.max(...wide.map((b) => b[3])), h);
  return { left, top, right, bottom };
}
const kWhole = { left: 0, top: 0, right: 1, bottom: 1 };

const kCodes = new Uint8ClampedArray(4097).map((_, i) => { const x = i / 4096; return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055) + 0.5; });
// colorOf(x, y, out, at) writes three bytes for each pixel kept of an image within the crop.
function paintPixels(canvas, image, crop, colorOf) {
  const x0 = Math.round(crop.left * image.w), y0 = Math.round(crop.top * image.h), w = Math.max(1, Math.round(crop.right * image.w) - x0), h = Math.max(1, Math.round(crop.bottom * image.h) - y0);
  canvas.width = w, canvas.height = h;
  const context = canvas.getContext('2d'), out = context.createImageData(w, h);
  for (let y = 0, at = 0; y < h; ++y) for (let x = 0; x < w; ++x, at += 4) colorOf(x0 + x, y0 + y, out.data, at), out.data[at + 3] = 255;
  context.putImageData(out, 0, 0);
}
function paint(canvas, image, crop) {
  const n = image.w * image.h, { words } = image;
  paintPixels(canvas, image, crop, (x, y, out, at) => {
    const i = y * image.w + x;
    for (let c = 0; c < 3; ++c) out[at + c] = kCodes[words[c * n + i] >> 4];
  });
}

// ---------------------------------------------------------------- what is compared

const baselines = new Map(); // key -> { name, p }
let manyBaselines = false;
const kAgainst = { real: 'double, nothing rounded', reference: 'the exact integral' };
const nameOf = (key) => byHash.get(key)?.label ?? (baselines.has(key) ? (kAgainst[baselines.get(key).name] ?? baselines.get(key).name) + (manyBaselines ? ` of ${baselines.get(key).p.label}` : '') : key);
function startPictures() {
  for (const p of points) for (const [name, key] of Object.entries(p.baselines ?? {})) if (!baselines.has(key)) baselines.set(key, { name, p });
  manyBaselines = baselines.size > data.against.length;
  fill($('gain'), [['0', 'auto'], ...[1, 4, 16, 64, 256, 1024, 4096].map((g) => [String(g), String(g)])], '0');
  // Lists of thousands of points are filled when somebody opens them.
  for (const id of ['a', 'b']) {
    for (const event of ['pointerdown', 'focus']) $(id).addEventListener(event, fillChoices, { once: true });
    $(id).addEventListener('change', () => { state[id] = $(id).value; show(); });
  }
  $('swap').addEventListener('click', () => { [state.a, state.b] = [state.b, state.a]; show(); });
  $('gain').addEventListener('change', difference);
  $('whole').addEventListener('change', () => pair && drawPair());
  $('order').addEventListener('change', grid);
  $('more').addEventListener('click', () => { state.thumbnails += 120; grid(); });
  $('chosen-copy').addEventListener('click', () => copy(byHash.get(state.a).command, $('chosen-copy')));
}
let filled = false;
function fillChoices() {
  if (filled) return;
  filled = true;
  const options = (list) => list.filter(has).map((key) => element('option', { value: key }, nameOf(key)));
  for (const id of ['a', 'b']) {
    $(id).replaceChildren(element('optgroup', { label: 'what points are compared with' }, ...options([...baselines.keys()])), element('optgroup', { label: 'points' }, ...options(points.map((p) => p.hash))));
    $(id).value = state[id];
  }
}
function select(id) {
  if (!filled) fill($(id), [[state[id], nameOf(state[id])]]);
  $(id).value = state[id];
}

// A point's picture against what it is measured against.
function choose(hash) {
  const p = byHash.get(hash);
  if (!p || !done(p)) return;
  state.a = hash;
  const other = p.baselines?.[state.against] ?? Object.values(p.baselines ?? {})[0];
  if (other && has(other)) state.b = other;
  show();
}
function show() {
  const p = byHash.get(state.a);
  $('chosen').hidden = !p;
  if (p) chosen(p);
  for (const e of document.querySelectorAll('[data-hash]')) e.setAttribute(e.tagName === 'TR' ? 'aria-selected' : 'aria-pressed', String(e.dataset.hash === state.a));
  if (has(state.a) && has(state.b)) showPair();
  drawWhenNear($('range-chart'), ranges);
}
function chosen(p) {
  $('chosen-label').textContent = p.label;
  const facts = [[kFigures[state.figure], errorOf(p)], ...(p.ms === undefined ? [] : [['ms a frame', p.ms]]), ['bits', p.cost?.bits], ['table bytes', p.cost?.table_bytes], ['samples', p.samples], ['path', p.path]];
  $('chosen-facts').replaceChildren(...facts.filter(([, v]) => v !== undefined && v !== null).flatMap(([name, v]) => [element('dt', {}, name), element('dd', {}, typeof v === 'number' ? number(v) : v)]));
  $('chosen-command').textContent = p.command;
  const canvas = $('chosen-picture');
  canvas.hidden = !has(p.hash);
  picture(p.hash).then((image) => image && state.a === p.hash && paint(canvas, image, cropOf(image)));
}

// ---------------------------------------------------------------- two pictures

let pair = null, pairTurn = 0;
async function showPair() {
  const turn = ++pairTurn;
  select('a'), select('b');
  const keys = [state.a, state.b], [a, b] = await Promise.all(keys.map(picture));
  if (turn !== pairTurn || !a || !b) return;
  const fine = a.s <= b.s ? a : b;
  pair = { a, b, keys, of: fine === a ? b : a }; // compared at the coarser one's pixels
  drawPair();
}
function drawPair() {
  const { a, b } = pair;
  pair.crop = $('whole').checked ? kWhole : cropOf(pair.of, a, b);
  const slider = element('img-comparison-slider', { id: 'slider', 'aria-label': 'A left of the handle, B right of it' });
  for (const [slot, image] of [['first', a], ['second', b]]) {
    const canvas = element('canvas', { slot, role: 'img', 'aria-label': slot === 'first' ? 'Picture A' : 'Picture B' });
    paint(canvas, image, pair.crop);
    slider.append(canvas);
  }
  // No taller than a window likes: narrow pictures stay narrow.
  const { left, right, top, bottom } = pair.crop, shape = (right - left) * a.w / ((bottom - top) * a.h);
  for (const place of document.querySelectorAll('.compare .picture')) place.style.maxWidth = `${Math.round(Math.min(560, 460 * shape))}px`;
  const before = $('slider')?.value;
  $('slider-place').replaceChildren(slider);
  if (before !== undefined) slider.value = before;
  slider.addEventListener('pointermove', (event) => under(event, slider));
  $('difference').onpointermove = (event) => under(event, $('difference'));
  difference();
}

// A's or B's R G B A at a pixel of the coarser: a coarse picture holds every s-th pixel of a full one.
function valuesAt(image, x, y) {
  const s = pair.of.s, px = Math.min(image.w - 1, Math.floor(x * s / image.s)), py = Math.min(image.h - 1, Math.floor(y * s / image.s)), n = image.w * image.h;
  return [0, 1, 2, 3].map((c) => image.words[c * n + py * image.w + px] / 65535);
}
function difference() {
  if (!pair) return;
  const { a, b, of } = pair, minus = (x, y) => { const p = valuesAt(a, x, y), q = valuesAt(b, x, y); return [p[0] - q[0], p[1] - q[1], p[2] - q[2]]; };
  let gain = +$('gain').value;
  if (!gain) {
    const sizes = [];
    for (let y = 0; y < of.h; ++y) for (let x = 0; x < of.w; ++x) for (const d of minus(x, y)) if (d) sizes.push(Math.abs(d));
    const typical = sizes.length ? sizes.sort((p, q) => p - q)[Math.floor(sizes.length * 0.98)] : 1;
    gain = 2 ** Math.max(0, Math.min(14, Math.floor(Math.log2(0.5 / typical))));
    $('gain').options[0].textContent = `auto (${gain})`;
  }
  paintPixels($('difference'), of, pair.crop, (x, y, out, at) => minus(x, y).forEach((d, c) => { out[at + c] = 128 + 255 * gain * d; }));
}
function under(event, place) {
  const box = place.getBoundingClientRect(), { a, b, of, crop } = pair, part = (v) => Math.max(0, Math.min(1 - 1e-9, v));
  const x = Math.floor((crop.left + (crop.right - crop.left) * part((event.clientX - box.left) / box.width)) * of.w), y = Math.floor((crop.top + (crop.bottom - crop.top) * part((event.clientY - box.top) / box.height)) * of.h);
  const p = valuesAt(a, x, y), q = valuesAt(b, x, y);
  $('under-at').textContent = `column ${x * of.s}, row ${y * of.s}`;
  const lines = [['A', p.map((v) => v.toFixed(5))], ['B', q.map((v) => v.toFixed(5))], ['A - B in LSB8', p.map((v, c) => (v >= q[c] ? '+' : '') + (255 * (v - q[c])).toFixed(3))]];
  lines.forEach(([, cells], row) => cells.forEach((cell, c) => { $('under').tBodies[0].rows[row].cells[c + 1].textContent = cell; }));
}

// ---------------------------------------------------------------- thumbnails

const watcher = new IntersectionObserver((seen) => {
  for (const { isIntersecting, target } of seen) {
    if (!isIntersecting) continue;
    watcher.unobserve(target);
    picture(target.dataset.key).then((image) => image && paint(target, image, cropOf(image)));
  }
}, { rootMargin: '300px' });
// All that are shown, seen or not: unpacking takes its time, for which printing does not wait.
async function paintThumbnails() {
  drawStale($('grid'));
  for (const canvas of $('grid').querySelectorAll('canvas')) {
    watcher.unobserve(canvas);
    const image = await picture(canvas.dataset.key);
    if (image) paint(canvas, image, cropOf(image));
  }
}
function grid() {
  const by = { error: (p, q) => badness(p) - badness(q), cost: (p, q) => (costOf(p) ?? Infinity) - (costOf(q) ?? Infinity), sweep: () => 0 }[$('order').value];
  const list = points.filter((p) => done(p) && kept(p) && has(p.hash)).sort(by);
  $('grid').replaceChildren(...list.slice(0, state.thumbnails).map((p) => {
    const canvas = element('canvas', { width: 1, height: 1 });
    canvas.dataset.key = p.hash;
    watcher.observe(canvas);
    const button = element('button', { type: 'button', title: p.label, 'aria-pressed': String(p.hash === state.a) }, canvas, element('b', {}, number(errorOf(p))), element('span', {}, p.label));
    button.dataset.hash = p.hash;
    button.addEventListener('click', () => choose(p.hash));
    return button;
  }));
  $('more').hidden = list.length <= state.thumbnails;
  $('more').textContent = `show ${Math.min(120, list.length - state.thumbnails)} more of ${list.length}`;
  if (!list.length) $('grid').replaceChildren(element('p', { class: 'nothing' }, 'No pictures were kept (measure.picture_size).'));
}
