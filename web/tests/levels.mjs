// Files as three.js shows them: node levels.mjs a.glb b.glb ... Prints a line of JSON for each: its
// triangles, bounds and materials, and what shows of it on average over six views from the side of
// 64 pixels, all with the frame of the first file: the covered share and the mean colour. A last
// argument that ends in .png is where the first views go.
import { readFileSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { launch, open } from './browser.mjs';

const files = process.argv.slice(2).filter((file) => file.endsWith('.glb'));
const picture = process.argv.at(-1).endsWith('.png') ? process.argv.at(-1) : undefined;
const html = `<!doctype html><script type="importmap">{ "imports": {
  "three": "/node_modules/three/build/three.module.js", "three/addons/": "/node_modules/three/examples/jsm/" } }</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
const SIDE = 64, VIEWS = 6;
const renderer = new THREE.WebGLRenderer({ alpha: true, antialias: true, preserveDrawingBuffer: true });
renderer.setSize(SIDE, SIDE);
const camera = new THREE.OrthographicCamera();
let frame;
function box(scene) {
  const box = new THREE.Box3().setFromObject(scene, true);
  return [box.min.toArray(), box.max.toArray()];
}
window.show = async (url, row, rows) => {
  const { scene } = await new GLTFLoader().loadAsync(url);
  const bounds = box(scene);
  frame ??= new THREE.Box3().setFromObject(scene).getBoundingSphere(new THREE.Sphere());
  const materials = new Map();
  let triangles = 0, meshes = 0;
  scene.traverse((node) => {
    if (!node.isMesh) return;
    meshes++;
    triangles += (node.geometry.index ?? node.geometry.attributes.position).count / 3;
    const { name, alphaTest, side, map } = node.material;
    materials.set(name, { name, alphaTest, side, texture: map ? [map.image.width, map.image.height] : null });
  });
  const world = new THREE.Scene();
  world.add(scene, new THREE.HemisphereLight(0xffffff, 0x888877, 1.5));
  const sun = new THREE.DirectionalLight(0xffffff, 1.5);
  sun.position.set(1, 2, 1);
  world.add(sun);
  const reach = frame.radius;
  Object.assign(camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: reach, far: 5 * reach });
  camera.updateProjectionMatrix();
  const gl = renderer.getContext(), bytes = new Uint8Array(4 * SIDE * SIDE), shots = [];
  let covered = 0, color = [0, 0, 0];
  for (let view = 0; view < VIEWS; view++) {
    const turn = 0.3 + view * 2 * Math.PI / VIEWS;
    camera.position.copy(frame.center).add(new THREE.Vector3(Math.sin(turn), 0.2, Math.cos(turn)).setLength(3 * reach));
    camera.lookAt(frame.center);
    renderer.render(world, camera);
    gl.readPixels(0, 0, SIDE, SIDE, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    for (let i = 0; i < bytes.length; i += 4) {
      covered += bytes[i + 3] / 255;
      for (let c = 0; c < 3; c++) color[c] += bytes[i + c];
    }
    shots.push(renderer.domElement.toDataURL());
  }
  color = color.map((sum) => sum / covered);
  return { told: { meshes, triangles, bounds, materials: [...materials.values()], covered: covered / VIEWS / SIDE ** 2, color }, shots };
};
window.ready = true;
</script>`;
const server = createServer((asked, answer) => {
  const { pathname } = new URL(asked.url, 'http://localhost');
  if (pathname === '/') return answer.setHeader('Content-Type', 'text/html').end(html);
  const number = /^\/(\d+)\.glb$/.exec(pathname)?.[1];
  try {
    const bytes = readFileSync(number ? files[number] : new URL(`..${pathname}`, import.meta.url));
    answer.setHeader('Content-Type', pathname.endsWith('.js') ? 'text/javascript' : 'application/octet-stream').end(bytes);
  } catch {
    answer.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
const browser = await launch();
try {
  const { page, problems } = await open(browser, `http://127.0.0.1:${server.address().port}/`, { width: 200, height: 200 });
  await page.waitForFunction('window.ready');
  const rows = [];
  for (const [number] of files.entries()) {
    const { told, shots } = await page.evaluate((url) => window.show(url), `${number}.glb`);
    console.log(JSON.stringify(told));
    rows.push(shots);
  }
  if (picture) {
    await page.setContent(rows.map((shots) => shots.map((shot) => `<img width=192 style="image-rendering:pixelated" src="${shot}">`).join('')).join('<br>'));
    await page.setViewport({ width: 1220, height: 20 + 200 * rows.length });
    writeFileSync(picture, await page.screenshot());
  }
  const bad = problems.filter((problem) => !/ReadPixels|favicon|404/.test(problem));
  if (bad.length) throw new Error(bad.join('\n'));
} finally {
  await browser.close();
  server.close();
}
