// Starts headless Chromium with Playwright for the page's tests; exit code 77 (skipped) with a message
// where one of them cannot be had. Playwright comes from npm by the committed lock file, the browser
// from Debian.
'use strict';
const { spawnSync } = require('child_process');
const fs = require('fs');
const path = require('path');

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

// playwright-core, installed in `folder` when it is not there yet. Tests that run at the same time wait
// for the one that installs.
function playwright(folder) {
  fs.mkdirSync(folder, { recursive: true });
  const there = path.join(folder, 'node_modules', '.complete'), lock = path.join(folder, 'lock');
  for (let waited = 0; !fs.existsSync(there); ++waited) {
    try {
      fs.mkdirSync(lock);
    } catch (taken) {
      if (waited > 240) skip('another test did not finish installing playwright-core');
      Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 1000);
      continue;
    }
    for (const file of ['package.json', 'package-lock.json']) fs.copyFileSync(path.join(__dirname, file), path.join(folder, file));
    const run = spawnSync('npm', ['ci', '--ignore-scripts', '--no-audit', '--no-fund', '--fetch-retries=1', '--fetch-timeout=30000'],
      { cwd: folder, encoding: 'utf8', timeout: 200000 });
    if (run.status === 0) fs.writeFileSync(there, '');
    fs.rmSync(lock, { recursive: true });
    if (run.status !== 0) skip(`playwright-core cannot be had from npm (${(run.stderr || String(run.error)).trim().split('\n').pop()})`);
  }
  return require(path.join(folder, 'node_modules', 'playwright-core')).chromium;
}

const kWebGl = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
const kNoWebGl = ['--disable-gpu', '--disable-3d-apis'];

async function launch(chromium, executable, webgl = true) {
  return chromium.launch({ executablePath: executable, timeout: 120000,
    args: ['--no-sandbox', '--disable-dev-shm-usage', ...(webgl ? kWebGl : kNoWebGl)] });
}

// Gathers what does not hold.
class Problems {
  constructor() { this.list = []; this.checks = 0; }
  expect(holds, what) { ++this.checks; if (!holds) this.list.push(what); }
  end(done) {
    this.list.forEach((problem) => console.error(problem));
    console.log(this.list.length ? `${this.list.length} of ${this.checks} checks failed` : `${done}: ${this.checks} checks hold`);
    process.exit(this.list.length ? 1 : 0);
  }
}

// A page that notes every error on its console, and every request beyond `origin`.
async function open(browser, problems, name, url, options = {}) {
  const { webgl = true, ...context } = options;
  const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 }, ...context })).newPage();
  page.setDefaultTimeout(60000);
  page.on('console', (m) => {
    // three.js itself says on the console that there is no WebGL.
    if (m.type() === 'error' && (webgl || !/webgl/i.test(m.text()))) problems.expect(false, `${name}: console: ${m.text()}`);
  });
  page.on('pageerror', (e) => problems.expect(false, `${name}: ${e.message}`));
  page.on('request', (r) => {
    const origin = url.startsWith('file:') ? 'file:' : new URL(url).origin;
    problems.expect(/^(data|blob):/.test(r.url()) || r.url().startsWith(origin), `${name}: asked for ${r.url()}`);
  });
  await page.goto(url, { waitUntil: 'load', timeout: 120000 });
  await page.waitForSelector('body[data-ready="true"]', { timeout: 120000 });
  return page;
}

module.exports = { skip, playwright, launch, open, Problems };
