// The reader without a browser: types of components, the timeline, and what it refuses.
import assert from 'node:assert/strict';
import { Foliage, cook, follow, load, lodFor } from '../foliage-lod.js';

const attribute = (array, itemSize, more) => ({ array, itemSize, ...more });

/** `count` triangles as leaves, each a leaf, in a shuffled order, with random targets. */
function leaves(count, seed = 1) {
  const random = () => (seed = (Math.imul(seed, 48271) >>> 0) % 2147483647) / 2147483647;
  const order = Array.from({ length: count }, (_, i) => i).sort(() => random() - 0.5);
  const targets = Array.from({ length: count }, (_, i) => i ? Math.floor(random() * i) : -1);
  const scales = targets.map(() => 1 + 3 * random());
  const per = (values) => Float32Array.from(order.flatMap((leaf) => [leaf, leaf, leaf]).flatMap(values));
  const corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
  const attributes = {
    POSITION: attribute(Float32Array.from(order.flatMap((leaf) => corner.flatMap(([x, y, z]) => [x + leaf, y, z]))), 3),
    _LEAF: attribute(per((leaf) => leaf), 1),
    _TARGET: attribute(per((leaf) => targets[leaf]), 1),
    _SCALE: attribute(per((leaf) => scales[leaf]), 1),
    _PIVOT: attribute(per((leaf) => [leaf, 0, 0]), 3),
  };
  return { targets, scales, primitive: { attributes } };
}

/** Scales of all leaves with n of them, by removing one after the other; the last by a part. */
function replayed({ targets, scales }, n) {
  const areas = targets.map(() => 1);
  for (let i = targets.length - 1; i >= Math.floor(n); i--) {
    const gone = Math.min(i + 1 - n, 1);
    if (targets[i] >= 0) areas[targets[i]] += gone * (Math.fround(scales[i]) ** 2 - areas[targets[i]]);
  }
  return areas.map((area, i) => i < Math.floor(n) ? Math.sqrt(area) : i === Math.floor(n) ? Math.sqrt(area * (n - i)) : 0);
}

const refused = (change, says) => {
  const { primitive } = leaves(5);
  change(primitive.attributes);
  assert.throws(() => new Foliage([primitive]), (error) => error.message.includes(says) && !error.message.includes('\n'), says);
};

{ // Scales equal the replay of all events, at whole counts and between them.
  const made = leaves(40);
  const foliage = new Foliage([made.primitive]);
  for (const n of [0, 1, 7, 7.25, 20, 33.5, 39, 39.9, 40]) {
    replayed(made, n).forEach((scale, i) => assert.ok(Math.abs(foliage.scale(i, n) - scale) < 1e-6, `leaf ${i} at ${n}`));
  }
  const [part] = foliage.parts;
  assert.deepEqual([...part.leaf], Array.from({ length: 120 }, (_, i) => Math.floor(i / 3)));
  assert.deepEqual([...part.indices], Array.from({ length: 120 }, (_, i) => i));
  assert.deepEqual([0, 7, 7.25, 40, 99].map((n) => part.indexEnd(n)), [0, 21, 24, 120, 120]);
  const { width, leaves: texels, events } = foliage.textures(16);
  assert.deepEqual([width, texels.height, events.height], [16, 3, 3]);
  for (let i = 0; i < 40; i++) assert.deepEqual([...texels.data.subarray(4 * i, 4 * i + 4)], [i, 0, 0, foliage.starts[i]]);
}

{ // Integers, normalised or not, interleaved, and names in lower case give the same.
  const { primitive: { attributes: a } } = leaves(6);
  const plain = new Foliage([{ attributes: a }]);
  const wide = (array, type, scale = 1) => type.from(array, (x) => Math.round(x * scale));
  const count = a._LEAF.array.length;
  const mixed = new Int16Array(8 * count);
  for (let i = 0; i < count; i++) {
    mixed.set(a.POSITION.array.subarray(3 * i, 3 * i + 3), 8 * i);
    mixed.set(a._PIVOT.array.subarray(3 * i, 3 * i + 3), 8 * i + 3);
    mixed[8 * i + 6] = a._TARGET.array[i];
  }
  const typed = new Foliage([{
    attributes: {
      position: attribute(mixed, 3, { stride: 8, count }),
      _pivot: { array: mixed, itemSize: 3, count, data: { stride: 8 }, offset: 3 },
      _target: attribute(mixed, 1, { stride: 8, offset: 6, count }),
      _leaf: attribute(wide(a._LEAF.array, Uint16Array), 1),
      _scale: a._SCALE,
    },
    indices: Uint16Array.from({ length: count }, (_, i) => i),
  }]);
  assert.deepEqual([typed.starts, typed.events, typed.scales, typed.pivots], [plain.starts, plain.events, plain.scales, plain.pivots]);
  assert.deepEqual(typed.parts[0].position, plain.parts[0].position);
  const halves = new Foliage([{
    attributes: {
      ...a,
      POSITION: attribute(wide(a.POSITION.array, Int16Array, 32767 / 8), 3, { normalized: true }),
      _PIVOT: attribute(wide(a._PIVOT.array, Int16Array, 32767 / 8), 3, { normalized: true }),
    },
  }]);
  assert.ok(halves.pivots.every((x, i) => Math.abs(x - plain.pivots[i] / 8) < 1e-4));
}

// What is wrong is named, and so is the fix.
refused((a) => delete a._LEAF, 'no primitive has the attribute _LEAF');
refused((a) => delete a._TARGET, 'leaves lack the attribute _TARGET');
refused((a) => { a._LEAF = attribute(Uint32Array.from(a._LEAF.array), 1); }, '_LEAF is of type u32');
refused((a) => { a._LEAF.array[3] = 0.5; }, 'not a whole number');
refused((a) => { a._LEAF.array[0] = a._LEAF.array[3]; }, 'corners of several leaves');
refused((a) => { a._TARGET.array.fill(4); }, '_TARGET must be -1 or below _LEAF');
refused((a) => { a.POSITION = attribute(Int16Array.from(a.POSITION.array), 3); }, 'left _PIVOT behind');
refused((a) => { a.POSITION.array.forEach((x, i) => { a.POSITION.array[i] = x / 20; }); }, 'left _PIVOT behind');
assert.throws(() => load(new Uint8Array(100)), /no binary glTF.*foliage-lod export/);
{
  const json = new TextEncoder().encode(JSON.stringify({ extensionsRequired: ['EXT_meshopt_compression'] }).padEnd(60));
  const glb = new Uint8Array(20 + json.length);
  new Uint32Array(glb.buffer).set([0x46546c67, 2, glb.length, json.length, 0x4e4f534a]);
  glb.set(json, 20);
  assert.throws(() => load(glb.buffer), /compressed with EXT_meshopt_compression; decompress/);
  assert.throws(() => load(glb.slice(0, 40)), /ends early/);
}

// The policy: all leaves nearby, half of them where Cook's law says, half inside the crown.
assert.equal(cook(0.4), 0.5);
assert.equal(cook(2), 1);
const at = (radii, fovY = Math.PI / 3) => lodFor({ distance: radii, radius: 1, fovY });
assert.deepEqual([at(0), at(1), at(3)], [1, 1, 1]);
assert.ok(Math.abs(at(3 / Math.sqrt(0.4)) - 0.5) < 1e-12 && at(30) < at(20) && at(30, 0.2) > at(30));
assert.deepEqual([follow(100, 101, 300), follow(100, 200, 300), follow(100, 50, 300), follow(299, 300, 300)], [100, 196, 51, 300]);
console.log('the reader is right');
