// Compiles WGSL modules in Chromium: node webgpu.mjs modules.json, an object of text -> name.
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { launch, open } from './browser.mjs';

const modules = Object.entries(JSON.parse(readFileSync(process.argv[2], 'utf8')));
// WebGPU needs a secure context, which localhost is.
const server = createServer((_, answer) => answer.setHeader('Content-Type', 'text/html').end('<!doctype html>'));
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
const browser = await launch('webgpu');
let errors = [];
try {
  const { page } = await open(browser, `http://127.0.0.1:${server.address().port}/`);
  await page.evaluate(async () => {
    const adapter = await navigator.gpu?.requestAdapter();
    if (!adapter) throw new Error('Chromium has no WebGPU adapter');
    globalThis.device = await adapter.requestDevice();
    globalThis.compiled = async (modules) => {
      const found = await Promise.all(modules.map(async ([code, name]) => {
        device.pushErrorScope('validation');
        const module = device.createShaderModule({ code });
        const [{ messages }, error] = await Promise.all([module.getCompilationInfo(), device.popErrorScope()]);
        const bad = messages.filter((message) => message.type === 'error');
        const lines = bad.map((message) => `${name}: ${message.message}: ${code.split('\n')[message.lineNum - 1]}`);
        return lines.length || !error ? lines : [`${name}: ${error.message}`];
      }));
      return found.flat();
    };
  });
  // What is no WGSL must be refused, else nothing was tested.
  const refused = await page.evaluate(() => compiled([['fn f() -> u32 { return 1u << 2u | 3u; }', 'probe']]));
  if (!refused.length) throw new Error('Chromium accepts WGSL that mixes << and |');
  for (let at = 0; at < modules.length; at += 40) {
    errors.push(...await page.evaluate((some) => compiled(some), modules.slice(at, at + 40)));
  }
} finally {
  await browser.close();
  server.close();
}
for (const error of new Set(errors.slice(0, 20))) console.error(error);
console.log(`${modules.length} modules, ${errors.length} errors`);
if (errors.length) process.exit(1);
