// page_test.js KIND LAMINA SAMPLE CHROMIUM WORK SOURCE: a report in headless Chromium, used as people use
// it. KIND: sample (a map made by hand), simulated (a room), real (a recording of mrpt-common).
'use strict';
const { spawnSync } = require('child_process');
const fs = require('fs');
const path = require('path');
const { skip, playwright, launch, open, Problems } = require('./browser.js');

const [kind, lamina, sample, executable, work] = process.argv.slice(2);
const problems = new Problems();
const expect = (holds, what) => problems.expect(holds, what);

function run(program, ...words) {
  const made = spawnSync(program, words, { encoding: 'utf8', maxBuffer: 1 << 28 });
  if (made.status !== 0) throw new Error(`${program} ${words.join(' ')}: ${made.status} ${made.stderr}`);
}

// The folder of the map to look at.
function makeMap() {
  const folder = path.join(work, kind);
  if (kind === 'sample') run(sample, folder);
  if (kind === 'simulated') {
    const data = path.join(work, 'room');
    run(lamina, 'simulate', 'room', '--output', data, '--seed', '3', '--duration', '12', '--quiet');
    run(lamina, 'map', data, '--output', folder, '--quiet');
    run(lamina, 'view', folder, '--truth', data);
  }
  if (kind === 'real') {
    const shipped = '/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog';
    if (!fs.existsSync(shipped)) skip(`${shipped} is absent (mrpt-common)`);
    run(lamina, 'map', shipped, '--output', folder, '--quiet');
  }
  return folder;
}

// What the panel beside the view says, against planes.json.
const close = (text, value) => Math.abs(parseFloat(text) - value) <= Math.max(5e-3 * Math.abs(value), 5e-5, Math.abs(value) >= 100 ? 0.5 : 0, Math.abs(value) >= 1 ? 5e-3 : 0);
async function expectChosen(page, planes, name) {
  const id = Number(await page.getAttribute('#chosen', 'data-plane'));
  const plane = planes.find((p) => p.id === id);
  expect(plane, `${name}: shows plane ${id}, which planes.json does not have`);
  if (!plane) return id;
  const shown = await page.$$eval('#chosen tr', (rows) => Object.fromEntries(rows.map((r) => [r.children[0].textContent, r.children[1].textContent])));
  const deg = 180 / Math.PI;
  expect(shown.id === String(id) && shown.label === plane.label && shown.observations === String(plane.observations), `${name}: ${JSON.stringify(shown)}`);
  const pair = (key, value, sigma) => {
    const parts = (shown[key] || '').split('\u00b1');
    expect(close(parts[0], value), `${name}: plane ${id}: ${key} ${shown[key]}, expected ${value}`);
    if (sigma != null) expect(close(parts[1], sigma), `${name}: plane ${id}: sigma of ${key} ${shown[key]}, expected ${sigma}`);
  };
  pair('\u03c1', plane.rho, plane.sigma_rho);
  pair('\u03b8', plane.theta * deg, plane.sigma_angle * deg);
  pair('\u03c6', plane.phi * deg);
  pair('area', plane.area);
  return id;
}

const picture = (page) => page.locator('#view3d canvas').screenshot();

async function expectLayers(page, name) {
  const keys = await page.$$eval('#toggles input', (all) => all.map((i) => i.dataset.layer));
  for (const must of ['trajectory', 'wall']) expect(keys.includes(must), `${name}: no switch for ${must} among ${keys}`);
  await page.getByRole('button', { name: 'From above' }).click();
  for (const key of keys) {
    const box = page.locator(`#toggles input[data-layer="${key}"]`), first = await picture(page);
    await box.focus();
    await page.keyboard.press('Space');
    const second = await picture(page);
    await page.keyboard.press('Space');
    const third = await picture(page);
    expect(!first.equals(second), `${name}: switching ${key} changes no pixel`);
    expect(first.equals(third), `${name}: switching ${key} twice does not bring the picture back`);
  }
  return keys;
}

// Clicks on planes in 3D until each of three was hit where it was aimed at.
async function expectClicks(page, planes, name) {
  await page.getByRole('button', { name: 'Orbit' }).click();
  const largest = [...planes].filter((p) => p.boundary.length && p.label !== 'ceiling').sort((a, b) => b.area - a.area).slice(0, 30);
  let hits = 0;
  for (const plane of largest) {
    if (hits >= 3) break;
    await page.locator('#view3d').scrollIntoViewIfNeeded();
    const n = plane.boundary.length;
    const middle = [0, 1, 2].map((k) => plane.boundary.reduce((sum, p) => sum + p[k], 0) / n);
    const [x, y] = await page.evaluate((at) => Lamina.view.place(...at), middle);
    await page.mouse.click(x, y);
    if (!(await page.getAttribute('#chosen', 'data-plane'))) continue;
    if (await expectChosen(page, planes, `${name}, 3D`) === plane.id) ++hits;
  }
  expect(hits >= Math.min(3, largest.length), `${name}: clicks in 3D hit ${hits} planes`);
}

async function expectPlan(page, planes, name) {
  const drawn = new Set(await page.$$eval('#plan polygon.plane', (all) => all.map((p) => p.dataset.plane)));
  const wanted = planes.filter((p) => p.boundary.length >= 3);
  expect(wanted.every((p) => drawn.has(String(p.id))), `${name}: the plan draws ${drawn.size} of ${wanted.length} planes`);
  const wall = wanted.filter((p) => p.label === 'wall').sort((a, b) => b.area - a.area)[0];
  if (!wall) return;
  const [x, y] = await page.$eval(`#plan polygon[data-plane="${wall.id}"]`, (shape) => {
    shape.scrollIntoView({ block: 'center' });
    const corners = [...shape.points], m = shape.getScreenCTM(), at = shape.ownerSVGElement.createSVGPoint();
    at.x = corners.reduce((s, p) => s + p.x, 0) / corners.length;
    at.y = corners.reduce((s, p) => s + p.y, 0) / corners.length;
    const screen = at.matrixTransform(m);
    return [screen.x, screen.y];
  });
  await page.mouse.click(x, y);
  await expectChosen(page, planes, `${name}, plan`);
  const before = await page.getAttribute('#plan svg', 'viewBox');
  await page.getByRole('button', { name: 'Closer' }).click();
  expect(before !== await page.getAttribute('#plan svg', 'viewBox'), `${name}: the plan does not come closer`);
  await page.getByRole('button', { name: 'Whole map' }).click();
  expect(before === await page.getAttribute('#plan svg', 'viewBox'), `${name}: the plan does not go back`);
}

async function expectGrids(page, name) {
  const tabs = await page.$$eval('#tabs [role=tab]', (all) => all.map((t) => t.textContent));
  expect(tabs.join() === 'navigability,height,slope,confidence,occupancy', `${name}: tabs ${tabs}`);
  await page.locator('#tabs [role=tab]').first().click();
  for (let i = 1; i < tabs.length; ++i) {
    await page.keyboard.press('ArrowRight');
    const chosen = await page.textContent('#tabs [aria-selected=true]');
    expect(chosen === tabs[i], `${name}: arrow key went to ${chosen}, not ${tabs[i]}`);
    expect(await page.textContent('.legend') !== '', `${name}: ${tabs[i]} has no legend`);
  }
  await page.getByRole('tab', { name: 'height' }).click();
  await page.locator('.grid-box canvas').hover();
  const pointed = await page.textContent('.readout');
  expect(/^x -?[\d.]+ m, y -?[\d.]+ m: navigability .*height .*slope .*confidence/.test(pointed), `${name}: cursor says ${pointed}`);
  await page.locator('.grid-box canvas').focus();
  await page.keyboard.press('ArrowLeft');
  expect(await page.textContent('.readout') !== pointed, `${name}: arrow keys do not move the cursor`);
}

async function expectViews(page, name) {
  await page.getByRole('button', { name: 'Orbit' }).click();
  const orbit = await picture(page);
  await page.getByRole('button', { name: 'From above' }).click();
  const above = await picture(page);
  expect(!orbit.equals(above), `${name}: from above looks as before`);
  await page.getByRole('button', { name: 'Orbit' }).click();
  await page.getByRole('button', { name: 'Fly', exact: true }).click();
  await page.keyboard.down('w');
  await page.waitForTimeout(400);
  await page.keyboard.up('w');
  expect(!orbit.equals(await picture(page)), `${name}: flying ahead changes nothing`);
  expect(await page.locator('#fly-keys').isVisible(), `${name}: flying has no buttons`);
  await page.getByRole('button', { name: 'Orbit' }).click();
  expect(orbit.equals(await picture(page)), `${name}: orbit does not come back`);
}

async function expectWords(page, name, keys) {
  const words = await page.textContent('#summary');
  for (const must of [/The sensor went [\d.]+ m/, /\d+ planes?: /]) expect(must.test(words), `${name}: summary lacks ${must}: ${words}`);
  expect((await page.$$('#worries li')).length > 0, `${name}: nothing about worries`);
  const charts = await page.$$eval('figcaption', (all) => all.map((c) => c.textContent));
  const must = ['Drift corrected', 'Time of each stage', 'Squared residuals', 'Size of the sliding window', ...(kind === 'sample' ? ['Skipped input'] : []),
    ...(kind === 'real' ? [] : ['Error of position'])];
  for (const title of must) expect(charts.some((c) => c.startsWith(title)), `${name}: no chart '${title}' among ${charts}`);
  for (const key of ['keyframes', 'points']) expect(keys.includes(key), `${name}: no layer ${key}`);
}

async function main() {
  if (!executable || !fs.existsSync(executable)) skip('there is no Chromium');
  const chromium = playwright(path.join(work, 'npm'));
  const folder = makeMap();
  const url = `file://${path.resolve(folder, 'report.html')}`;
  const planes = JSON.parse(fs.readFileSync(path.join(folder, 'planes.json'), 'utf8')).planes;
  const has3d = fs.readFileSync(path.join(folder, 'report.html'), 'utf8').includes('laminaView3d=');
  const shot = (page, name) => page.screenshot({ path: path.join(work, `${kind}_${name}.png`), fullPage: true });

  const browser = await launch(chromium, executable);
  const page = await open(browser, problems, 'desktop', url);
  expect(await page.getAttribute('body', 'data-planes') === String(planes.length), 'desktop: the table has not all planes');
  await shot(page, 'desktop');
  let keys = [];
  if (has3d) {
    const drawn = planes.filter((p) => p.boundary.length >= 3).length;
    expect(await page.getAttribute('body', 'data-planes3d') === String(drawn), '3D: not all planes are drawn');
    keys = await expectLayers(page, 'desktop');
    await expectClicks(page, planes, 'desktop');
    await expectViews(page, 'desktop');
    await expectWords(page, 'desktop', keys);
  }
  await expectPlan(page, planes, 'desktop');
  await expectGrids(page, 'desktop');
  await page.close();

  const phone = await open(browser, problems, 'phone', `${url}#plane=${planes[0].id}`, { viewport: { width: 390, height: 844 }, colorScheme: 'dark', hasTouch: true });
  const [wide, dark] = await phone.evaluate(() => [document.documentElement.scrollWidth, getComputedStyle(document.body).backgroundColor]);
  expect(wide <= 390, `phone: the page is ${wide} pixels wide`);
  expect(dark === 'rgb(22, 25, 28)', `phone: the dark page is ${dark}`);
  expect(await expectChosen(phone, planes, 'phone') === planes[0].id, 'phone: the plane of the link is not chosen');
  await shot(phone, 'phone_dark');
  await browser.close();

  const flat = await launch(chromium, executable, false);
  const plain = await open(flat, problems, 'without WebGL', url, { webgl: false });
  expect(await plain.getAttribute('body', 'data-planes3d') === '0', 'without WebGL there is a 3D view');
  expect(await plain.locator('#no3d').isVisible(), 'without WebGL the page does not say so');
  await expectPlan(plain, planes, 'without WebGL');
  await expectGrids(plain, 'without WebGL');
  await flat.close();
  problems.end(`${kind}: ${planes.length} planes, 3D ${has3d ? 'built in' : 'not built in'}`);
}
main().catch((e) => { console.error(e); process.exit(1); });
