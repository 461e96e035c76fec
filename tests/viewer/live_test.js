// live_test.js LAMINA CHROMIUM WORK: `lamina map --live` with a browser looking on.
'use strict';
const { spawn, spawnSync } = require('child_process');
const fs = require('fs');
const http = require('http');
const path = require('path');
const { skip, playwright, launch, open, Problems } = require('./browser.js');

const [lamina, executable, work] = process.argv.slice(2);
const problems = new Problems();
const expect = (holds, what) => problems.expect(holds, what);

// The status of GET `url` for a request that calls the host `name`.
const status = (url, name) => new Promise((resolve, reject) => {
  http.get(url, { headers: { Host: name } }, (answer) => { answer.resume(); resolve(answer.statusCode); }).on('error', reject);
});

async function main() {
  if (!executable || !fs.existsSync(executable)) skip('there is no Chromium');
  const chromium = playwright(path.join(work, 'npm'));
  const data = path.join(work, 'live_room'), folder = path.join(work, 'live');
  const made = spawnSync(lamina, ['simulate', 'room', '--output', data, '--seed', '4', '--set', 'path.laps=4', '--duration', '130', '--quiet'], { encoding: 'utf8' });
  if (made.status !== 0) throw new Error(made.stderr);
  const browser = await launch(chromium, executable);

  const run = spawn(lamina, ['map', data, '--output', folder, '--mode', 'online', '--quiet', '--live', '0'], { stdio: ['ignore', 'ignore', 'pipe'] });
  let over = 0;  // ms: when the run ended
  const ended = new Promise((resolve) => run.on('exit', (code) => { over = Date.now(); resolve(code); }));
  const url = await new Promise((resolve, reject) => {
    let said = '';
    run.stderr.on('data', (text) => {
      said += text;
      const found = /live map: (http:\S+)/.exec(said);
      if (found) resolve(found[1]);
    });
    run.on('exit', () => reject(new Error(`no address: ${said}`)));
  });
  expect(/^http:\/\/127\.0\.0\.1:\d+\/$/.test(url), `it listens at ${url}, not on loopback`);
  expect(await status(url, new URL(url).host) === 200, 'the page is not served');
  expect(await status(url, 'elsewhere.example') === 403, 'a page from elsewhere may read the map');

  const page = await open(browser, problems, 'live', url);
  const seen = [];
  for (;;) {
    const now = await page.evaluate(() => ({ doing: Lamina.data.live.doing, version: Number(document.getElementById('live').dataset.version),
      poses: Lamina.trajectory ? Lamina.trajectory.total : 0, planes: Lamina.planes.length }));
    if (!seen.length || seen[seen.length - 1].version !== now.version) seen.push(now);
    if (now.doing === 'finished' || seen.length > 1000 || (over && Date.now() - over > 20000)) break;
    if (seen.length === 3) await page.screenshot({ path: path.join(work, 'live.png') });
    await page.waitForTimeout(200);
  }
  const growing = seen.filter((s) => s.doing === 'mapping');
  expect(growing.length >= 2, `the page changed ${growing.length} times while mapping: ${JSON.stringify(seen)}`);
  for (let i = 1; i < growing.length; ++i) expect(growing[i].poses > growing[i - 1].poses, `no new poses: ${JSON.stringify(growing.slice(i - 1, i + 1))}`);
  expect(await ended === 0, 'the run failed');
  const planes = JSON.parse(fs.readFileSync(path.join(folder, 'planes.json'), 'utf8')).planes;
  expect(await page.getAttribute('body', 'data-planes') === String(planes.length), 'the last picture is not the finished map');
  expect((await page.textContent('#live')).startsWith('Finished'), 'the page does not say that it is finished');
  await browser.close();
  problems.end(`live: ${seen.length} pictures`);
}
main().catch((e) => { console.error(e); process.exit(1); });
