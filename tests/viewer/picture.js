// picture.js REPORT.html OUT.png CHROMIUM WORK [LAYER ...]: the top of a report as the documents show it,
// with these layers switched on, or off where a minus stands before the name. WORK is where playwright-core is, or is installed.
'use strict';
const path = require('path');
const { playwright, launch, open, Problems } = require('./browser.js');

const [report, out, executable, work, ...layers] = process.argv.slice(2);
const problems = new Problems();

async function main() {
  const browser = await launch(playwright(path.join(work, 'npm')), executable);
  const page = await open(browser, problems, 'picture', `file://${path.resolve(report)}`, { viewport: { width: 1100, height: 1150 } });
  for (const layer of layers) await page.locator(`#toggles input[data-layer="${layer.replace(/^-/, '')}"]`).setChecked(layer[0] !== '-');
  await page.evaluate(() => window.scrollTo(0, 0));
  await page.screenshot({ path: out });
  await browser.close();
  problems.end(out);
}
main().catch((e) => { console.error(e); process.exit(1); });
