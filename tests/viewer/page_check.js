// page_check.js SAMPLE_PROGRAM FOLDER CHROMIUM: opens the sample's report in headless Chromium, with
// WebGL and without. Exit 0 when all holds, 1 with what does not, 77 when Chromium is not there.
'use strict';
const { spawnSync } = require('child_process');
const fs = require('fs');
const path = require('path');

const [program, folder, chromium] = process.argv.slice(2);
if (!chromium || !fs.existsSync(chromium)) {
  console.log('no Chromium: skipped');
  process.exit(77);
}
const made = spawnSync(program, [folder], { encoding: 'utf8' });
if (made.status !== 0) {
  console.error(`the sample could not be written: ${made.stderr}`);
  process.exit(1);
}
const report = path.join(folder, 'report.html');
const planes = JSON.parse(fs.readFileSync(path.join(folder, 'planes.json'), 'utf8')).planes;
const has3d = fs.readFileSync(report, 'utf8').includes('laminaView3d=');
const problems = [];
const expect = (holds, what) => { if (!holds) problems.push(what); };

function open(name, flags) {
  const profile = fs.mkdtempSync(path.join(folder, 'profile-'));
  const run = spawnSync(chromium, ['--headless', '--no-sandbox', '--disable-dev-shm-usage', `--user-data-dir=${profile}`,
    '--enable-logging=stderr', '--v=0', '--virtual-time-budget=8000', '--dump-dom', ...flags, `file://${path.resolve(report)}#plane=7`],
  { encoding: 'utf8', timeout: 50000, maxBuffer: 1 << 28 });
  fs.rmSync(profile, { recursive: true, force: true });
  const dom = run.stdout || '';
  const body = (dom.match(/<body[^>]*>/) || [''])[0];
  const attribute = (key) => (body.match(new RegExp(`data-${key}="([^"]*)"`)) || [])[1];
  const console_ = (run.stderr || '').split('\n').filter((line) => /CONSOLE/.test(line) && /error|refused|uncaught/i.test(line));
  expect(attribute('ready') === 'true', `${name}: the page did not get ready (${body})`);
  expect(attribute('error') === undefined, `${name}: ${attribute('error')}`);
  expect(attribute('planes') === String(planes.length), `${name}: ${attribute('planes')} planes in the table, ${planes.length} in planes.json`);
  const drawn = new Set([...dom.matchAll(/<polygon class="plane[^"]*" data-plane="(\d+)"/g)].map((m) => m[1]));
  expect(planes.every((p) => drawn.has(String(p.id))), `${name}: the plan draws ${[...drawn]}`);
  const tabs = [...dom.matchAll(/role="tab"[^>]*>(\w+)</g)].map((m) => m[1]).join();
  expect(tabs === 'navigability,height,slope,confidence,occupancy', `${name}: tabs ${tabs}`);
  expect((dom.match(/<figure>/g) || []).length === 5, `${name}: ${(dom.match(/<figure>/g) || []).length} charts, expected 5`);
  // The chosen plane's numbers are those of planes.json.
  const chosen = (dom.match(/<aside[^>]*data-plane="7"[\s\S]*?<\/aside>/) || [''])[0];
  const seven = planes.find((p) => p.id === 7);
  expect(chosen.includes(`<td>${seven.observations}</td>`) && chosen.includes(`<td>${seven.label}</td>`)
    && chosen.includes(`<td>${(seven.theta * 180 / Math.PI).toFixed(2)} \u00b0</td>`), `${name}: chosen plane shows ${chosen}`);
  return { attribute, errors: console_ };
}

const gl = open('with WebGL', ['--use-angle=swiftshader', '--enable-unsafe-swiftshader']);
expect(gl.errors.length === 0, `console: ${gl.errors.join(' | ')}`);
if (has3d) {
  expect(gl.attribute('planes3d') === String(planes.length), `3D view: ${gl.attribute('planes3d')} planes of ${planes.length}`);
}
// Three.js itself reports on the console that there is no WebGL; the page has to stand all the same.
const plain = open('without WebGL', ['--disable-gpu', '--disable-3d-apis']);
expect(plain.attribute('planes3d') === '0', 'without WebGL there was a 3D view');

problems.forEach((problem) => console.error(problem));
console.log(problems.length ? `${problems.length} problems` : `page holds ${planes.length} planes, 3D ${has3d ? 'built in' : 'not built in'}`);
process.exit(problems.length ? 1 : 0);
