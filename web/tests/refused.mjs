// Prints what a page says that cannot draw its tree: node refused.mjs page.html
import { launch, open } from './browser.mjs';

const browser = await launch();
try {
  const { page } = await open(browser, `file://${process.argv[2]}`);
  const said = await page.evaluate(() => foliagePage.then(() => 'it draws', () => document.querySelector('#message').textContent));
  console.log(said);
} finally {
  await browser.close();
}
