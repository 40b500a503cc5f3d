// Builds the page of a GLB as the exporter does, for a look at it without a build:
// node web/tests/build.mjs tree.glb page.html
import { readFileSync, writeFileSync } from 'node:fs';
import { deflateSync } from 'node:zlib';

const [, , glb, out] = process.argv;
const read = (name) => readFileSync(new URL(`../${name}`, import.meta.url), 'utf8');
const model = deflateSync(readFileSync(glb), { level: 9 }).toString('base64');
const fill = { title: 'tree', model, script: read('foliage-lod.js') + read('page.js') };
writeFileSync(out, read('page.html').replace(/{{(\w+)}}/g, (_, name) => fill[name]));
