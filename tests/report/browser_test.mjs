// The page of `squint report` in a headless browser: node browser_test.mjs SQUINT.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { cpus, loadavg } from 'node:os';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import * as is from './browser.mjs';

const kBase = 'image.width = 64\nimage.height = 64\nvolume.dims = 24\n';
const kWires = `title = "Wires <b>&amp; @DATA@"\nnote = "One at a time."\n[base]\n${kBase}precision.preset = "squeeze"\n
[wires]\nnames = ["color", "transparency", "weight", "slab_alpha"]\nfraction_bits = [6, 8, 11, 14]\n
[measure]\nreference = true\nsrgb = true\naudit = true\nconservation = true\nrepeats = 1\n`;
const kProduct = `[base]\n${kBase}\n[[axis]]\nkey = "sampling.step"\nvalues = [0.5, 1.0, 2.0]\n
[[axis]]\nkey = "precision.color"\nvalues = ["u1.6", "u1.8", "u1.10", "u1.14"]\n
[[axis]]\nkey = "precision.sample"\nvalues = ["u12.4", "u1.4"]\n`; // u1.4 fails: it is too narrow for the values

// Wires of a stage varied as one, more and fewer bits than they have, on two scenes' worth of steps.
const kGroups = `mode = "one_at_a_time"\n[base]\n${kBase}\n[[axis]]\nkey = "sampling.step"\nvalues = [1, 0.5]\ncross = true\n
[[axis]]\nwires = ["location", "direction", "weight", "length"]\nfraction_offset = [-6, -2, 2]\n
[[axis]]\nwires = ["contribution", "color", "transparency"]\nfraction_offset = [-6, -2, 2]\n`;

// The browser first: without one nothing here runs, and that is no failure.
const browser = await is.browser();
let wires, product, groups;

before(() => {
  is.sweep('wires', kWires), is.sweep('product', kProduct), is.sweep('groups', kGroups);
  wires = is.report('wires'), product = is.report('product'), groups = is.report('groups');
});
after(async () => {
  await browser.close();
  rmSync(is.folder, { recursive: true });
});
const recordOf = (run, hash) => JSON.parse(readFileSync(join(is.folder, run, 'points', hash + '.json')));
const data = (run) => JSON.parse(is.squint('report', run, '--format', 'json'));

test('two thousand points with their pictures load in under two seconds', async () => {
  is.sweep('seed', kWires.replaceAll('= 64', '= 128').replace('[6, 8, 11, 14]', '[5, 6, 7, 8, 9, 10, 11, 12, 13, 14]'));
  is.manyPoints('seed', 'many', 2000);
  const file = is.report('many'), times = [], busy = loadavg()[0] > cpus().length;
  // Other work on this machine can only add to a load: one of some must do.  On a machine with more to do than it has
  // processors, the time that counts is what the page itself keeps one busy for.
  while (times.length < 5 && !(Math.min(...times) < 2000)) {
    const page = await browser.newPage({ viewport: { width: 1280, height: 900 } }), inside = await page.context().newCDPSession(page);
    await inside.send('Performance.enable', { timeDomain: 'threadTicks' });
    const began = performance.now();
    await page.goto('file://' + file, { waitUntil: 'commit' });
    await page.waitForFunction(() => document.documentElement.dataset.ready === 'yes');
    const wall = performance.now() - began, { metrics } = await inside.send('Performance.getMetrics');
    times.push(busy ? 1000 * metrics.find((m) => m.name === 'TaskDuration').value : wall);
    assert.match(await page.textContent('#facts'), /^2000 points/);
    assert.notEqual(await is.shown(page, '#pareto-time canvas'), null);
    await page.close();
  }
  console.log(`loaded in ${times.map((t) => Math.round(t)).join(', ')} ms${busy ? ' of processor time, on a busy machine' : ''}`);
  assert.ok(Math.min(...times) < 2000, `${times} ms`);
});

for (const width of [1280, 800]) {
  test(`at ${width} pixels nothing is asked for, nothing complained of, nothing overlaps`, async () => {
    for (const file of [wires, product, groups]) {
      const page = await is.open(browser, file, width);
      await is.seeAll(page);
      assert.deepEqual(page.said, []);
      assert.deepEqual(page.asked, ['file://' + file]);
      assert.deepEqual(await is.overlaps(page), []);
      assert.deepEqual(await is.overlapsInCharts(page), []);
      const charts = await page.$$eval('.chart > canvas', (all) => all.length);
      assert.ok(charts >= (file === wires ? 8 : 3), `${charts} charts`);
      await page.close();
    }
  });
}

test('a profile shows the wires of one picture, and nothing of sweeps', async () => {
  const file = join(is.folder, 'profile.html');
  is.squint('render', '--size', '48x48', '--set', 'volume.dims=24', '--set', 'lights=[]', '--profile', file, '-q');
  for (const width of [1280, 800]) {
    const page = await is.open(browser, file, width);
    await is.seeAll(page);
    assert.deepEqual(page.said, []);
    assert.deepEqual(await is.overlaps(page), []);
    assert.equal(await page.isVisible('#pareto'), false);
    assert.notEqual(await is.shown(page, '#range-chart canvas'), null);
    assert.match(await page.textContent('#answer'), /proven/);
    const head = await page.$$eval('#range-table th', (all) => all.map((cell) => cell.textContent));
    assert.deepEqual(head.slice(0, 4), ['wire', 'format', 'enough', 'share of the bound']);
    const wires = await page.$$eval('#range-table tbody tr', (all) => all.map((line) => line.cells[0].textContent));
    assert.equal(wires[0], 'voxels');
    assert.ok(wires.includes('transparency') && wires.length > 12, wires.join(' '));
    await page.close();
  }
});

test('the policy allows no other script or style, and no inline one', () => {
  const policy = /Content-Security-Policy" content="([^"]*)"/.exec(readFileSync(wires, 'utf8'))[1];
  assert.match(policy, /default-src 'none'/);
  assert.doesNotMatch(policy, /unsafe|https?:|\*/);
});

test('titles from a sweep file are shown as they are written', async () => {
  const page = await is.open(browser, wires, 1280);
  assert.equal(await page.title(), 'Wires <b>&amp; @DATA@');
  assert.equal(await page.textContent('h1'), 'Wires <b>&amp; @DATA@');
  await page.close();
});

test('a click on a point shows its picture and figures', async () => {
  const page = await is.open(browser, wires, 1280), before = await is.shown(page, '#slider canvas[slot=first]');
  for (const id of ['pareto-time', 'pareto-cost']) {
    const marks = await is.marks(page, id), worst = marks.reduce((m, p) => p.y < m.y ? p : m);
    await page.mouse.click(worst.x, worst.y);
    // Points can lie on one another: the one on top is chosen.
    await page.waitForFunction(() => document.querySelector('#slider canvas[slot=first]')?.width > 1);
    await page.waitForTimeout(300);
    const hash = await page.inputValue('#a'), record = recordOf('wires', hash), at = marks.find((m) => m.hash === hash);
    assert.ok(Math.hypot(at.x - worst.x, at.y - worst.y) < 1, `${hash} lies elsewhere`);
    assert.ok((await page.textContent('#chosen-command')).includes(hash.slice(0, 12)));
    assert.ok((await page.textContent('#chosen-facts')).includes(String(+record.error.real.color.rmse_lsb8.toPrecision(4))));
    assert.notEqual(await is.shown(page, '#slider canvas[slot=first]'), before);
    assert.notEqual(await is.shown(page, '#chosen-picture'), null);
  }
  await page.close();
});

test('the slider drags, and arrow keys move it', async () => {
  const page = await is.open(browser, wires, 1280), slider = page.locator('#slider');
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox(), middle = box.y + box.height / 2, value = () => slider.evaluate((e) => e.value);
  await page.mouse.move(box.x + box.width / 2, middle);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 4, middle, { steps: 8 });
  await page.mouse.up();
  assert.ok(Math.abs(await value() - 25) < 1.5, `${await value()}`); // a pixel of a box of 200 and more is half a percent
  await slider.focus();
  await page.keyboard.down('ArrowRight');
  await page.waitForFunction(() => document.querySelector('#slider').value > 30);
  await page.keyboard.up('ArrowRight');
  await page.close();
});

test('the pointer over a picture reads both and their difference', async () => {
  const page = await is.open(browser, wires, 1280);
  const read = () => page.$$eval('#under tbody td', (cells) => cells.map((c) => c.textContent));
  for (const place of ['#difference', '#slider']) {
    await page.locator(place).scrollIntoViewIfNeeded();
    const box = await page.locator(place).boundingBox();
    await page.mouse.move(box.x + 3, box.y + 3);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    const cells = await read(), [a, b, lsb8] = [cells.slice(0, 4), cells.slice(4, 8), cells.slice(8)].map((row) => row.map(Number));
    assert.ok(a[3] > 0 && b[3] > 0, `${cells}`); // the middle of the picture is not empty
    // Shown values are rounded to 5e-6, differences to 5e-4 LSB8.
    lsb8.forEach((d, c) => assert.ok(Math.abs(d - 255 * (a[c] - b[c])) <= 255 * 1e-5 + 5e-4, `${cells}`));
    assert.match(await page.textContent('#under-at'), /^column \d+, row \d+$/);
  }
  assert.notEqual(await is.shown(page, '#difference'), null);
  await page.focus('#b'); // the lists are filled when they are opened
  await page.selectOption('#b', await page.inputValue('#a'));
  await page.waitForFunction(() => document.querySelector('#under') && document.querySelector('#b').value === document.querySelector('#a').value);
  await page.waitForTimeout(200);
  assert.equal(await is.shown(page, '#difference'), null); // a picture less itself is one grey
  await page.close();
});

test('a box in a chart filters the rest of the page', async () => {
  const page = await is.open(browser, wires, 1280), marks = await is.marks(page, 'pareto-cost');
  const canvas = await page.locator('#pareto-cost canvas').boundingBox(), all = data('wires');
  // From the right end of the chart to its left, from its top to between two points.
  const rows = [...new Set(marks.map((m) => m.y))].sort((p, q) => p - q), middle = rows.findIndex((y, i) => i > 0 && i + 1 < rows.length && rows[i + 1] - y > 6);
  const box = { x1: canvas.x + canvas.width - 8, y1: canvas.y + 8, x2: canvas.x + 52, y2: (rows[middle] + rows[middle + 1]) / 2 };
  const inside = new Set(marks.filter((m) => m.y < box.y2).map((m) => m.hash));
  assert.ok(inside.size > 0 && inside.size < marks.length, `${inside.size} of ${marks.length}`);
  await page.mouse.move(box.x1, box.y1);
  await page.mouse.down();
  await page.mouse.move(box.x2, box.y2, { steps: 10 });
  await page.mouse.up();
  await page.waitForSelector('#filtered:not([hidden])');
  assert.equal(await page.textContent('#filtered-text'), `${inside.size} of ${all.points.length} points`);
  await is.seeAll(page);
  assert.deepEqual(new Set(await page.$$eval('#grid button', (all) => all.map((b) => b.dataset.hash))), inside);
  assert.deepEqual(new Set(await page.$$eval('#rows tbody tr', (all) => all.map((r) => r.dataset.hash))), inside);
  await page.click('#clear');
  await is.seeAll(page);
  assert.equal(await page.$$eval('#rows tbody tr', (all) => all.length), all.entries.length);
  assert.deepEqual(page.said, []);
  await page.close();
});

test('everything can be done from the keyboard', async () => {
  const page = await is.open(browser, wires, 1280), focused = () => page.evaluate(() => document.activeElement.id || document.activeElement.tagName);
  await is.seeAll(page);
  await page.evaluate(() => scrollTo(0, 0));
  const reached = [];
  for (let i = 0; i < 200 && (await focused()) !== 'SUMMARY'; ++i) await page.keyboard.press('Tab'), reached.push(await focused());
  for (const id of ['against', 'channel', 'figure', 'cost', 'chosen-copy', 'a', 'b', 'swap', 'gain', 'slider', 'order', 'heat-x', 'TR', 'SUMMARY']) assert.ok(reached.includes(id), `${id} is not among ${reached}`);
  const heading = page.locator('#rows th button', { hasText: 'RMSE' }), column = () => page.$$eval('#rows tbody tr', (rows) => rows.map((r) => r.cells[3].textContent).filter(Boolean).map(Number));
  for (const [direction, way] of [['ascending', 1], ['descending', -1]]) {
    await heading.focus();
    await page.keyboard.press('Enter');
    assert.equal(await page.getAttribute('#rows th:nth-child(4)', 'aria-sort'), direction);
    const values = await column();
    assert.ok(values.length > 10 && values.every((v, i) => !i || way * (v - values[i - 1]) >= 0), `${values}`);
  }
  await page.locator('#rows tbody tr').first().focus();
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('Enter');
  assert.equal(await page.inputValue('#a'), await page.getAttribute('#rows tbody tr:nth-child(2)', 'data-hash'));
  await page.focus('#figure');
  await page.keyboard.press('p'); // PSNR
  assert.equal(await page.inputValue('#figure'), 'psnr');
  assert.deepEqual(page.said, []);
  await page.close();
});

test('a copied command gives the same picture again', async () => {
  const page = await is.open(browser, product, 1280);
  await is.seeAll(page);
  const rows = page.locator('#rows tbody tr');
  for (const i of [0, 4, await rows.count() - 2]) {
    const hash = await rows.nth(i).getAttribute('data-hash');
    if (recordOf('product', hash).status !== 'done') continue;
    await rows.nth(i).locator('button').click();
    await rows.nth(i).locator('button', { hasText: 'copied' }).waitFor(); // a busy machine takes its time
    // What lies on the clipboard, as a person gets at it.
    await page.evaluate(() => { const box = document.createElement('textarea'); box.id = 'pasted'; document.body.prepend(box); box.focus(); });
    await page.keyboard.press('Control+V');
    const command = await page.inputValue('#pasted');
    await page.evaluate(() => document.querySelector('#pasted').remove());
    assert.match(command, /^squint render /);
    const PATH = `${dirname(is.program)}:${process.env.PATH}`;
    execFileSync('sh', ['-c', command + ' --json again.json -q'], { cwd: is.folder, env: { ...process.env, PATH } });
    const again = JSON.parse(readFileSync(join(is.folder, 'again.json')));
    assert.equal(again.pictures[0].hash, recordOf('product', hash).picture_hash, command);
  }
  await page.close();
});

test('a search stands with its formats beside the scene\'s own and those of Squeeze', async () => {
  is.manyPoints('wires', 'found', 20);
  const file = join(is.folder, 'found', 'sweep.json'), candidate = (bits, format) => ({ bits, table_bytes: 100, error_lsb8: 0.4, other_views_error_lsb8: 0.45, margin_lsb8: 0.1, other_views_margin_lsb8: 0.05, wires: { color: format } });
  const search = { max_error_lsb8: 0.5, figure: 'rms', cost: 'bits', trials: 77, pictures: 99, other_degrees: [45], found: candidate(9000, 'u1.9 rnd_conv'), scene: candidate(16000, 'u1.15'), squeeze: candidate(12000, 'u1.14 trn') };
  writeFileSync(file, JSON.stringify({ ...JSON.parse(readFileSync(file)), search }));
  const page = await is.open(browser, is.report('found'), 1280), text = await page.innerText('#search');
  assert.match(text, /an rms error of at most 0\.5 LSB8.* 77 sets of formats tried in 99 pictures/);
  assert.match(text, /bits\s+9000\s+16000\s+12000/);
  assert.match(text, /fewer bits than Squeeze's\s+25 %\s+-33.3 %\s+-/);
  assert.match(text, /color\s+u1\.9 rnd_conv\s+u1\.15\s+u1\.14 trn/);
  assert.deepEqual(page.said, []);
  await page.close();
});

test('the first line is the answer, red where nothing keeps the bound', async () => {
  for (const [run, file] of [['wires', wires], ['product', product], ['groups', groups]]) {
    const page = await is.open(browser, file, 1280), { answer } = data(run);
    assert.equal(await page.textContent('#answer'), answer.text);
    assert.equal(await page.$eval('#answer', (e) => e.classList.contains('bad')), !answer.good);
    await page.close();
  }
});

test('printing draws every section, seen or not', async () => {
  const page = await is.open(browser, wires, 1280);
  // Nobody scrolls: thumbnails are unpacked while the page lies there.
  await page.waitForFunction(() => { const all = [...document.querySelectorAll('#grid canvas')]; return all.length && all.every((c) => c.width > 1); });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  const blank = await page.$$eval('section:not([hidden])', (all) => all.filter((s) => [...s.querySelectorAll('.chart:not(.chart .chart)')].some((c) => !c.hidden && !c.querySelector('canvas, .nothing')) || (s.id === 'pictures' && (!s.querySelector('.grid canvas') || [...s.querySelectorAll('.grid canvas')].some((c) => c.width < 2))) || (s.id === 'table' && !s.querySelector('tbody tr'))).map((s) => s.id));
  assert.deepEqual(blank, []);
  // On paper, narrower than the window was, no chart is cut off.
  await page.emulateMedia({ media: 'print' });
  await page.setViewportSize({ width: 720, height: 1000 });
  const cut = await page.$$eval('.chart canvas', (all) => all.filter((c) => c.getBoundingClientRect().right > 720).map((c) => c.getAttribute('aria-label')));
  assert.deepEqual(cut, []);
  assert.deepEqual(page.said, []);
  await page.close();
});

test('formats that stand alone are told from all of them at once', async () => {
  const page = await is.open(browser, wires, 1280);
  await is.seeAll(page);
  assert.match(await page.textContent('#first-hint'), /^Wire by wire:/);
  // The sweep has measured them together: the table ends with that, its command gives that picture.
  const { points, entries } = data('wires'), together = points[entries.find((e) => e.varied === 'together').point];
  assert.match(await page.textContent('#first-format tr.together'), new RegExp(`${together.cost.bits} bits.*${+together.error.real.color.rmse.toPrecision(4)}$`));
  const run = (command) => {
    const PATH = `${dirname(is.program)}:${process.env.PATH}`;
    execFileSync('sh', ['-c', command.replace(/ -o \S+$/, '') + ' --json combined.json -q -o combined.exr'], { cwd: is.folder, env: { ...process.env, PATH } });
    return JSON.parse(readFileSync(join(is.folder, 'combined.json'))).pictures[0];
  };
  assert.equal(run(await page.textContent('#combined-command')).hash, together.picture_hash);
  // As another figure they are other formats, which nobody has measured: their command does.
  await page.selectOption('#figure', 'max');
  await page.locator('#curves').scrollIntoViewIfNeeded(); // what is not near is not drawn again
  await page.waitForFunction(() => !document.querySelector('#first-format tr.together'));
  const command = await page.textContent('#combined-command');
  assert.match(command, /^squint render .*--set 'precision\.color=.* --error$/);
  assert.ok(run(command).error.against_real);
  await page.close();
});

test('points that failed stand in the table with their reasons', async () => {
  const page = await is.open(browser, product, 1280), failed = data('product').points.filter((p) => p.status === 'failed');
  assert.ok(failed.length > 0);
  await is.seeAll(page);
  const reasons = await page.$$eval('td.reason', (all) => all.map((e) => e.textContent));
  assert.deepEqual(reasons.sort(), failed.map((p) => p.reason).sort());
  assert.match(await page.textContent('#facts'), new RegExp(`${failed.length} failed`));
  await page.close();
});

test('the ranges of the base point are drawn, asked for or not', async () => {
  const page = await is.open(browser, product, 1280), audited = data('product').points.filter((p) => p.audit);
  assert.equal(audited.length, 1);
  await page.locator('#range-chart').scrollIntoViewIfNeeded();
  await page.waitForSelector('#range-chart canvas');
  assert.notEqual(await is.shown(page, '#range-chart canvas'), null);
  await page.close();
});

test('the page names machine, version, command, sweep file, licences, and what was not measured', async () => {
  const page = await is.open(browser, product, 1280), { runs } = data('product');
  const about = await page.textContent('#about');
  for (const part of [runs[0].machine.cpu, runs[0].version, runs[0].command, 'measure.repeats', 'measure.audit', 'sampling.step', 'img-comparison-slider', 'BSD-3-Clause']) assert.ok(about.includes(part), part);
  await page.close();
});
