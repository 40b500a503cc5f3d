// Headless Chromium for the tests, with software WebGL or WebGPU.
import puppeteer from 'puppeteer-core';

const WEBGL = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const WEBGPU = [
  '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-features=Vulkan', '--use-vulkan=swiftshader',
  '--disable-vulkan-surface',
];

/** Starts a browser; `kind` is `webgl` or `webgpu`. */
export function launch(kind = 'webgl') {
  return puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    pipe: true,
    protocolTimeout: 600_000,
    args: ['--no-sandbox', '--allow-file-access-from-files', ...(kind === 'webgpu' ? WEBGPU : WEBGL)],
  });
}

/** Opens an address; `problems` collects what the console complains about and every request. */
export async function open(browser, url, { width = 640, height = 480, scale = 1, isMobile = false } = {}) {
  const page = await browser.newPage();
  page.setDefaultTimeout(120_000); // Software WebGL takes up to a second a frame.
  await page.setViewport({ width, height, deviceScaleFactor: scale, isMobile, hasTouch: isMobile });
  const [problems, requests] = [[], []];
  page.on('console', (message) => ['error', 'warn', 'warning'].includes(message.type()) && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('request', (request) => requests.push(request.url()));
  await page.goto(url);
  return { page, problems, requests };
}
