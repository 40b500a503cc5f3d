// Changes a file as other tools do: node tools.mjs in.glb reordered.glb stale.glb. The first has
// vertices in gltf-transform's order, triangles in any, as tools leave them that sort by place, and
// all but POSITION quantised; the second has POSITION quantised.
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { quantize, reorder, weld } from '@gltf-transform/functions';
import { MeshoptEncoder } from 'meshoptimizer';

const [, , file, reordered, stale] = process.argv;
await MeshoptEncoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS);

const document = await io.read(file);
await document.transform(weld(), reorder({ encoder: MeshoptEncoder, target: 'performance' }), quantize({ pattern: /^(?!POSITION)/ }));
let falls = 0;
for (const primitive of document.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
  const [indices, leaf] = [primitive.getIndices().getArray(), primitive.getAttribute('_LEAF')];
  let seed = 1;
  for (let i = indices.length / 3 - 1; i > 0; i--) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    const other = 3 * (seed % (i + 1));
    for (let corner = 0; corner < 3; corner++) {
      [indices[3 * i + corner], indices[other + corner]] = [indices[other + corner], indices[3 * i + corner]];
    }
  }
  for (let i = 3; leaf && i < indices.length; i += 3) {
    if (leaf.getScalar(indices[i]) < leaf.getScalar(indices[i - 3])) falls++;
  }
}
await io.write(reordered, document);
console.log(`${falls} leaf triangles out of order`);
if (!falls) process.exit(1);

const other = await io.read(file);
await other.transform(quantize({ pattern: /^POSITION$/ }));
await io.write(stale, other);
