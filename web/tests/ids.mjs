// Numbers of the leaves at each pixel of a page: node ids.mjs page.html jobs.json, of the arguments
// of `Renderer.ids` and the file `out` that the numbers go to.
import { readFileSync, writeFileSync } from 'node:fs';
import { launch, open } from './browser.mjs';

const [, , file, jobs] = process.argv;
const browser = await launch();
try {
  const { page, problems } = await open(browser, `file://${file}`, { width: 200, height: 300 });
  await page.evaluate(() => foliagePage.then(() => null));
  for (const { out, ...job } of JSON.parse(readFileSync(jobs, 'utf8'))) {
    const numbers = await page.evaluate(async (job) => {
      const bytes = new Uint8Array((await foliagePage).renderer.ids(job).buffer);
      let text = '';
      for (let at = 0; at < bytes.length; at += 4096) text += String.fromCharCode(...bytes.subarray(at, at + 4096));
      return btoa(text);
    }, job);
    writeFileSync(out, Buffer.from(numbers, 'base64'));
  }
  if (problems.length) throw new Error(problems.join('\n'));
} finally {
  await browser.close();
}
