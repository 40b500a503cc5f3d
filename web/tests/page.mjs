// Every control of a page: node page.mjs page.html. The model's name ends a script and has a tag.
import { launch, open } from './browser.mjs';

const browser = await launch();
const check = (is, what) => {
  if (!is) throw new Error(what);
};
try {
  const { page, problems, requests } = await open(browser, `file://${process.argv[2]}`, { width: 240, height: 420 });
  await page.evaluate(() => foliagePage.then((page) => { globalThis.tree = page; }));
  const frame = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))));
  const text = (selector) => page.$eval(selector, (element) => element.textContent);
  const leaves = async () => parseInt((await text('#count')).replace(/,/g, ''));
  const state = () => page.evaluate(() => ({ ...tree.orbit, model: null, isAuto: tree.isAuto, count: tree.count, mode: tree.mode }));
  await frame();

  // The name is text, wherever it stands.
  check((await text('#name')).startsWith('</script><img'), 'the name is not shown');
  check(await page.$('img') === null && !(await page.title()).startsWith('broken'), 'the name broke out');
  check(await text('#message') === '' && await page.$eval('#message', (element) => element.hidden), 'a message is left');

  // The slider from end to end in each view: fewer leaves, and triangles that follow.
  for (const mode of ['prefix', 'levels', 'random', 'compare']) {
    await page.evaluate((mode) => document.querySelector(`input[value=${mode}]`).click(), mode);
    let before = Infinity;
    for (const at of [1000, 800, 450, 220, 0]) {
      await page.$eval('#amount', (slider, at) => {
        slider.value = at;
        slider.dispatchEvent(new Event('input', { bubbles: true }));
      }, at);
      await frame();
      const now = await leaves();
      check(now <= before && now >= 1, `${now} leaves after ${before} in ${mode}`);
      before = now;
    }
    const most = mode === 'levels' ? await page.evaluate(() => tree.model.foliage.leaves / 80) : 10;
    check(before < most, `${before} leaves at the end in ${mode}`);
    check((await page.$$('.label')).length === (mode === 'compare' ? 3 : 0), `labels in ${mode}`);
  }
  check(!(await state()).isAuto, 'the slider leaves the automatic on');

  // Automatic: fewer leaves from afar, all of them nearby, and the slider follows.
  await page.click('#auto');
  await page.evaluate(() => document.querySelector('input[value=prefix]').click());
  await page.focus('#view');
  for (let i = 0; i < 12; i++) await page.keyboard.press('-');
  await page.waitForFunction(() => tree.count === tree.wanted && !tree.isPending);
  const far = await leaves();
  for (let i = 0; i < 30; i++) await page.keyboard.press('+');
  await page.waitForFunction(() => tree.count === tree.wanted && !tree.isPending);
  check(far < (await leaves()) / 4, `${far} leaves from afar, ${await leaves()} nearby`);
  check(await page.$eval('#amount', (slider) => slider.value) === '1000', 'the slider does not follow');

  // Keys, wheel, drag and pinch move the camera; Home brings it back.
  await page.keyboard.press('Home');
  const home = JSON.stringify(await state());
  const moves = async (what, act) => {
    const before = JSON.stringify(await state());
    await act();
    await frame();
    check(JSON.stringify(await state()) !== before, `${what} moves nothing`);
  };
  await moves('an arrow', () => page.keyboard.press('ArrowLeft'));
  await page.mouse.move(150, 120);
  await moves('the wheel', () => page.mouse.wheel({ deltaY: -300 }));
  await moves('a drag', async () => {
    await page.mouse.down();
    await page.mouse.move(200, 140, { steps: 3 });
    await page.mouse.up();
  });
  const { distance } = await state();
  await moves('a pinch', () => page.evaluate(() => {
    const view = document.querySelector('#view');
    const send = (type, pointerId, clientX) => view.dispatchEvent(new PointerEvent(type, { pointerId, clientX, clientY: 100, isPrimary: pointerId === 8 }));
    view.setPointerCapture = undefined;
    send('pointerdown', 8, 100), send('pointerdown', 9, 140), send('pointermove', 9, 220), send('pointerup', 8, 100), send('pointerup', 9, 220);
  }));
  check((await state()).distance < distance, 'fingers that part do not zoom in');
  await page.click('#reset');
  const pose = (text) => ['yaw', 'pitch', 'distance', 'pan'].map((key) => JSON.parse(text)[key]).join();
  check(pose(JSON.stringify(await state())) === pose(home), 'the whole tree is not shown again');

  // Another size, in device pixels; then a lost context that comes back.
  await page.setViewport({ width: 500, height: 300, deviceScaleFactor: 2 });
  await frame();
  const [width, wanted] = await page.$eval('#view', (view) => [view.width, 2 * view.clientWidth]);
  check(width === wanted, `the picture is ${width} pixels wide, not ${wanted}`);
  await page.evaluate(() => { globalThis.loss = tree.gl.getExtension('WEBGL_lose_context'); loss.loseContext(); });
  await page.waitForFunction(() => document.querySelector('#message').textContent.includes('graphics driver'));
  await page.evaluate(() => loss.restoreContext());
  await page.waitForFunction(() => document.querySelector('#message').hidden);
  await frame();
  check(await page.evaluate(() => tree.gl.getError()) === 0, 'WebGL reports an error');
  const colors = await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => {
    tree.renderer.draw([{ mode: 'prefix', count: tree.count, rect: [0, 0, 64, 64] }], tree.orbit);
    const pixels = new Uint8Array(4 * 64 * 64);
    tree.gl.readPixels(0, 0, 64, 64, tree.gl.RGBA, tree.gl.UNSIGNED_BYTE, pixels);
    done(new Set(new Uint32Array(pixels.buffer)).size);
  })));
  check(colors > 100, `${colors} colours after the context came back`);

  const bad = problems.filter((problem) => !problem.includes('ReadPixels') && !problem.includes('CONTEXT_LOST'));
  check(!bad.length, bad.join('\n'));
  const outside = requests.filter((url) => !/^(file|blob|data):/.test(url));
  check(!outside.length && requests.filter((url) => url.startsWith('file:')).length === 1, `requests: ${requests}`);
  console.log('every control works');
} finally {
  await browser.close();
}
