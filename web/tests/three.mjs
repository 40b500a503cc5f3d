// The three.js page with a file: node three.mjs tree.glb [picture.png]
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { launch, open } from './browser.mjs';

const [, , glb, picture] = process.argv;
const types = { html: 'text/html', js: 'text/javascript', glb: 'model/gltf-binary' };
const server = createServer((asked, answer) => {
  const { pathname } = new URL(asked.url, 'http://localhost');
  const file = pathname === '/tree.glb' ? glb : new URL(`..${pathname}`, import.meta.url);
  if (pathname === '/favicon.ico') return answer.writeHead(204).end();
  try {
    answer.setHeader('Content-Type', types[pathname.split('.').pop()] ?? 'text/plain').end(readFileSync(file));
  } catch {
    answer.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
const browser = await launch();
try {
  const { page, problems } = await open(browser, `http://127.0.0.1:${server.address().port}/three.html?tree.glb`, { width: 480, height: 360 });
  const counts = [];
  for (const share of [1, 0.67, 0.37]) {
    await page.evaluate((share) => { document.querySelector('#share').value = share; }, share);
    await page.waitForFunction((before) => {
      const text = document.querySelector('#count').textContent;
      return text && text !== before;
    }, {}, counts.at(-1)?.text);
    const text = await page.$eval('#count', (count) => count.textContent);
    const shot = await page.screenshot(picture ? { path: picture.replace('.png', `_${share}.png`) } : {});
    counts.push({ text, shot });
    console.log(text);
  }
  // SwiftShader tells that reads of its pixels are slow.
  const bad = problems.filter((problem) => !problem.includes('ReadPixels'));
  if (bad.length) throw new Error(bad.join('\n'));
  const leaves = counts.map(({ text }) => parseInt(text));
  if (!(leaves[0] > leaves[1] && leaves[1] > leaves[2] && leaves[2] > 0)) throw new Error(`counts are ${leaves}`);
  if (counts[0].shot.equals(counts[2].shot)) throw new Error('the picture does not change');
} finally {
  await browser.close();
  server.close();
}
