// What the tests of the page share: a browser, runs of sweeps, and readers of what stands on the page.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync, copyFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const parts = join(dirname(fileURLToPath(import.meta.url)), '..', '..', 'tools', 'report');
const kSkipped = 77; // what ctest takes for "not run"
const kBrowsers = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

export const program = process.argv[2];
export const folder = mkdtempSync(join(tmpdir(), 'squint-report-'));

function skip(why) {
  rmSync(folder, { recursive: true });
  console.log(`Skipped: ${why}`);
  process.exit(kSkipped);
}
function playwright() {
  const require = createRequire(join(parts, 'package.json'));
  try { return require('playwright-core'); } catch { /* not installed yet */ }
  try {
    execFileSync('npm', ['ci', '--ignore-scripts', '--loglevel=error'], { cwd: parts, stdio: 'pipe' });
    return require('playwright-core');
  } catch (error) { return skip(`playwright-core is not installed and npm ci in tools/report failed: ${String(error.stderr ?? error).trim().split('\n')[0]}`); }
}

export async function browser() {
  const executablePath = kBrowsers.find(existsSync) ?? skip('no Chromium: install chromium');
  return playwright().chromium.launch({ executablePath, args: process.getuid() === 0 ? ['--no-sandbox'] : [] });
}

/// The page of a report, ready, with everything that it says, asks for or throws kept in page.said.
export async function open(browser, file, width, height = 900) {
  const page = await browser.newPage({ viewport: { width, height } });
  page.said = [], page.asked = [];
  page.on('console', (message) => page.said.push(message.text()));
  page.on('pageerror', (error) => page.said.push(String(error)));
  page.on('request', (request) => page.asked.push(request.url()));
  await page.goto('file://' + file);
  await page.waitForFunction(() => document.documentElement.dataset.ready === 'yes');
  return page;
}

/// Everything that is drawn only when it is seen.
export async function seeAll(page) {
  const height = () => page.evaluate(() => document.documentElement.scrollHeight);
  for (let y = 0; y < await height(); y += 500) {
    await page.evaluate((to) => scrollTo(0, to), y);
    await page.waitForTimeout(60);
  }
  await page.waitForTimeout(200);
}

export const report = (run) => {
  squint('report', run);
  return join(folder, run, 'report.html');
};
export function squint(...words) {
  return execFileSync(program, words, { cwd: folder, stdio: ['ignore', 'pipe', 'pipe'] }).toString();
}
/// A run of that sweep file; exit code 3, some points failed, is a run as well.
export function sweep(name, text) {
  writeFileSync(join(folder, name + '.toml'), text);
  try { squint('sweep', name + '.toml', '-o', name, '-q'); } catch (error) { if (error.status !== 3) throw error; }
}

/// A run as large as wanted, made of a small one: its points under new names, their errors and costs moved.
export function manyPoints(from, to, count) {
  const old = join(folder, from), made = join(folder, to), read = (path) => JSON.parse(readFileSync(path));
  for (const room of ['points', 'pictures', 'baselines', 'runs']) mkdirSync(join(made, room), { recursive: true });
  for (const room of ['baselines', 'runs']) for (const file of readdirSync(join(old, room))) copyFileSync(join(old, room, file), join(made, room, file));
  const whole = read(join(old, 'sweep.json')), points = [];
  let random = 1;
  const factor = () => { random = random * 48271 % 2147483647; return 0.5 + random / 2147483647; };
  for (let i = 0; i < count; ++i) {
    const entry = whole.points[i % whole.points.length], hash = i.toString(16).padStart(32, '0'), record = read(join(old, 'points', entry.hash + '.json'));
    record.hash = hash;
    for (const against of Object.values(record.error ?? {})) for (const channel of Object.values(against)) for (const figure of ['rmse_lsb8', 'max_error_lsb8', 'bias_lsb8']) channel[figure] *= factor();
    if (record.time) record.time.ms *= factor();
    if (record.cost) record.cost.bits = Math.round(record.cost.bits * factor());
    writeFileSync(join(made, 'points', hash + '.json'), JSON.stringify(record));
    copyFileSync(join(old, 'pictures', entry.hash + '.values'), join(made, 'pictures', hash + '.values'));
    points.push({ ...entry, hash });
  }
  writeFileSync(join(made, 'sweep.json'), JSON.stringify({ ...whole, points }));
}

/// Pairs of things that a reader sees and that lie on one another; parts of one another do not count.
export function overlaps(page) {
  return page.evaluate(() => {
    const seen = (e) => e.getClientRects().length > 0 && getComputedStyle(e).visibility !== 'hidden' && !e.closest('nav, #tip');
    const name = (e) => `${e.tagName.toLowerCase()}${e.id ? '#' + e.id : ''} "${e.textContent.trim().slice(0, 30)}"`;
    const parts = [...document.querySelectorAll('h1, h2, h3, p, label, button, figcaption, .picture, .chart, canvas, dt, dd, table, li, summary, .nothing')].filter(seen).map((e) => ({ e, box: e.getBoundingClientRect() })).filter(({ box }) => box.width > 0 && box.height > 0);
    const found = [];
    // What a scrolled box hides cannot lie on anything.
    const within = ({ e, box }) => { const frame = e.closest('.scroll')?.getBoundingClientRect(); return frame ? { left: Math.max(box.left, frame.left), right: Math.min(box.right, frame.right), top: Math.max(box.top, frame.top), bottom: Math.min(box.bottom, frame.bottom) } : box; };
    parts.forEach((a, i) => parts.slice(i + 1).forEach((b) => {
      if (a.e.contains(b.e) || b.e.contains(a.e) || a.e.closest('img-comparison-slider') && b.e.closest('img-comparison-slider')) return;
      const p = within(a), q = within(b), wide = Math.min(p.right, q.right) - Math.max(p.left, q.left), high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (wide > 1 && high > 1) found.push(`${name(a.e)} on ${name(b.e)}`);
    }));
    for (const { e, box } of parts) if (!e.closest('.scroll') && (box.right > innerWidth + 1 || box.left < -1)) found.push(`${name(e)} beyond the window`);
    if (document.documentElement.scrollWidth > innerWidth) found.push('the page is wider than the window');
    return found;
  });
}

/// Texts in the charts that lie on one another or are cut off.
export function overlapsInCharts(page) {
  return page.evaluate(() => {
    const found = [];
    for (const holder of document.querySelectorAll('.chart')) {
      if (!holder.view) continue;
      const texts = [], padding = holder.view.padding(), left = holder.view.origin()[0] + padding.left, top = holder.view.origin()[1] + padding.top;
      const walk = (mark, x, y) => {
        for (const item of mark.items ?? []) {
          if (mark.marktype === 'group') for (const inner of item.items) walk(inner, x + (item.x ?? 0), y + (item.y ?? 0));
          else if (mark.marktype === 'text' && item.opacity !== 0 && item.text && !item.stroke) {
            const b = item.bounds;
            texts.push({ text: String(item.text), x1: x + b.x1, x2: x + b.x2, y1: y + b.y1, y2: y + b.y2 });
          }
        }
      };
      walk(holder.view.scenegraph().root, left, top);
      const canvas = holder.querySelector('canvas'), wide = canvas.clientWidth, high = canvas.clientHeight;
      texts.forEach((a, i) => {
        // A glyph's box is wider than its ink by a pixel or two on either side.
        if (a.x1 < -3 || a.x2 > wide + 3 || a.y1 < -3 || a.y2 > high + 3) found.push(`${a.text} is cut off`);
        for (const b of texts.slice(i + 1)) if (Math.min(a.x2, b.x2) - Math.max(a.x1, b.x1) > 1 && Math.min(a.y2, b.y2) - Math.max(a.y1, b.y1) > 3) found.push(`${a.text} on ${b.text}`);
      });
    }
    return found;
  });
}

/// Where the points of a chart lie in the window: [{ hash, x, y }].
export function marks(page, id) {
  return page.evaluate((id) => {
    const holder = document.querySelector(`#${id} > .chart`), { view } = holder, box = holder.querySelector('canvas').getBoundingClientRect(), [left, top] = view.origin(), padding = view.padding();
    const found = [];
    const walk = (mark, x, y) => {
      for (const item of mark.items ?? []) {
        if (mark.marktype === 'group') for (const inner of item.items) walk(inner, x + (item.x ?? 0), y + (item.y ?? 0));
        else if (mark.marktype === 'symbol' && item.datum?.hash) found.push({ hash: item.datum.hash, front: item.datum.front, x: box.left + padding.left + x + item.x, y: box.top + padding.top + y + item.y });
      }
    };
    walk(view.scenegraph().root, left, top);
    return found;
  }, id);
}
/// A digest of what a canvas shows; null where it is of one colour.
export function shown(page, selector) {
  return page.evaluate((selector) => {
    const canvas = document.querySelector(selector), { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0, same = true;
    for (let i = 0; i < data.length; ++i) {
      sum = (Math.imul(sum, 31) + data[i]) | 0;
      same &&= data[i] === data[i % 4];
    }
    return same ? null : `${canvas.width}x${canvas.height} ${sum}`;
  }, selector);
}
