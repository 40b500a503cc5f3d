/**
 * Reader of continuous glTF files (docs/CONTINUOUS_GLTF.md): leaves in drawing order, of which any
 * first `n` are a good tree. An ES module without dependencies.
 *
 *     const { foliage, materials, images } = load(await (await fetch('oak.glb')).arrayBuffer());
 *     const { width, leaves, events } = foliage.textures(); // RGBA32F and RG32F, see `GLSL`
 *     for (const part of foliage.parts) upload(part.position, part.normal, part.leaf, part.indices);
 *     // At a count of n, which may be a fraction:
 *     drawElements(TRIANGLES, part.indexEnd(n), UNSIGNED_INT, 0);
 *
 * The vertex shader moves each corner to `foliagePosition(position, leaf, n)`.
 */

const ARRAYS = {
  5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array,
};
const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
/** Extensions that change nothing that this reader reads, or that it understands. */
const KNOWN = /^(KHR_mesh_quantization|KHR_materials_.*|KHR_lights_punctual|EXT_texture_webp)$/;
const COMPRESSED = /draco|meshopt/i;
/** Greatest number of leaves of a model. */
const MAX_LEAVES = 1 << 22;

function refuse(what) {
  throw new Error(`foliage-lod: ${what}`);
}

/** Reads a GLB (ArrayBuffer or Uint8Array): its `Foliage`, name, extras, materials and images. */
export function load(glb) {
  const file = readGlb(glb);
  return { ...file, foliage: new Foliage(file.primitives, file.extras) };
}

/**
 * Reads a GLB without looking at its leaves. Images are `{ bytes, mimeType }`; a material has
 * `{ name, color, cutoff (null if opaque), isTwoSided, image (or -1), wrap, filters }`; a primitive
 * is what `Foliage` takes.
 */
export function readGlb(glb) {
  let bytes = glb instanceof ArrayBuffer ? new Uint8Array(glb) : glb;
  if (bytes.byteOffset % 4) bytes = bytes.slice();
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 20 || view.getUint32(0, true) !== 0x46546c67) {
    refuse('this is no binary glTF (.glb); write one with `foliage-lod export MODEL -o tree.glb`');
  }
  let json, bin;
  for (let at = 12; at + 8 <= bytes.length;) {
    const [length, type] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    const chunk = bytes.subarray(at + 8, at + 8 + length);
    if (chunk.length < length) refuse('the file ends early; copy or download it again');
    if (type === 0x4e4f534a) json = JSON.parse(new TextDecoder().decode(chunk));
    if (type === 0x004e4942) bin ??= chunk;
    at += 8 + length;
  }
  for (const name of json?.extensionsRequired ?? []) {
    if (COMPRESSED.test(name)) {
      refuse(`meshes are compressed with ${name}; decompress the file (\`gltf-transform copy\`), or let a loader decode it and give Foliage its attributes`);
    }
    if (!KNOWN.test(name)) refuse(`the file needs ${name}, which this reader lacks; export it without`);
  }
  const range = (index) => {
    const { buffer = 0, byteOffset = 0, byteLength } = json.bufferViews[index];
    if (buffer !== 0 || !bin || byteOffset + byteLength > bin.length) refuse('data lies outside of the file; pack it into one .glb');
    return bin.subarray(byteOffset, byteOffset + byteLength);
  };
  const attribute = (index) => {
    const { bufferView, byteOffset = 0, componentType, count, type, normalized = false, sparse } = json.accessors[index];
    if (sparse || bufferView === undefined) refuse('an accessor is sparse or empty; write the file with dense accessors');
    const [bytes, Type, itemSize] = [range(bufferView), ARRAYS[componentType], COMPONENTS[type]];
    const step = Type.BYTES_PER_ELEMENT;
    const stride = (json.bufferViews[bufferView].byteStride ?? itemSize * step) / step;
    const length = count ? (count - 1) * stride + itemSize : 0;
    if (byteOffset + length * step > bytes.length) refuse('an accessor reaches beyond its data; the file is damaged');
    return { array: new Type(bytes.buffer, bytes.byteOffset + byteOffset, length), itemSize, count, stride, normalized };
  };
  const primitives = [];
  let [extras, name] = [{}, ''];
  const visit = (index, above) => {
    const node = json.nodes[index];
    const matrix = product(above, node.matrix ?? composed(node));
    if (node.extras?.foliageLod) [extras, name] = [node.extras.foliageLod, node.name ?? ''];
    for (const p of json.meshes?.[node.mesh]?.primitives ?? []) {
      if (COMPRESSED.test(Object.keys(p.extensions ?? {}))) refuse('meshes are compressed with Draco; decompress the file first');
      if ((p.mode ?? 4) !== 4) refuse('a primitive is no list of triangles; export triangles');
      const attributes = {};
      for (const key in p.attributes) attributes[key] = attribute(p.attributes[key]);
      const indices = p.indices === undefined ? undefined : attribute(p.indices).array;
      primitives.push({ attributes, indices, material: p.material ?? -1, matrix });
    }
    node.children?.forEach((child) => visit(child, matrix));
  };
  json.scenes?.[json.scene ?? 0]?.nodes?.forEach((node) => visit(node, IDENTITY));
  if (extras.version > 1) refuse(`the file has version ${extras.version}, this reader knows version 1; take a newer foliage-lod.js`);
  const materials = (json.materials ?? []).map((m) => {
    const { baseColorFactor: color = [1, 1, 1, 1], baseColorTexture: at } = m.pbrMetallicRoughness ?? {};
    const texture = json.textures?.[at?.index] ?? {};
    const { wrapS = 10497, wrapT = 10497 } = json.samplers?.[texture.sampler] ?? {};
    const image = texture.extensions?.EXT_texture_webp?.source ?? texture.source ?? -1;
    const cutoff = !m.alphaMode || m.alphaMode === 'OPAQUE' ? null : m.alphaCutoff ?? 0.5;
    return { name: m.name ?? '', color, cutoff, isTwoSided: !!m.doubleSided, image, wrap: [wrapS, wrapT] };
  });
  const images = (json.images ?? []).map((i) => i.bufferView === undefined ? null : { bytes: range(i.bufferView), mimeType: i.mimeType });
  return { json, name, extras, primitives, materials, images };
}

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** Product of two matrices, column by column. */
function product(a, b) {
  return a.map((_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[(i % 4) + 4 * k] * b[4 * (i >> 2) + k], 0));
}

function composed({ translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: s = [1, 1, 1] }) {
  return [
    s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
    s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
    s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
    ...t, 1,
  ];
}

/** Numbers of an attribute, item by item: dequantised, and without what lies between them. */
function numbers({ array, itemSize, count, normalized, stride, offset = 0, data }) {
  stride ??= data?.stride ?? itemSize;
  count ??= array.length / stride;
  const most = { Int8Array: 127, Uint8Array: 255, Int16Array: 32767, Uint16Array: 65535 }[array.constructor.name] ?? 1;
  const scale = normalized ? 1 / most : 1;
  const out = new Float32Array(count * itemSize);
  for (let i = 0; i < count; i++) {
    for (let c = 0; c < itemSize; c++) out[i * itemSize + c] = Math.max(array[i * stride + offset + c] * scale, normalized ? -1 : -Infinity);
  }
  return out;
}

/** Leaves in drawing order, and the scale of each at any count. */
export class Foliage {
  /**
   * `primitives`: each `{ attributes, indices, material, matrix }`. Attributes are named as in glTF
   * (in upper or lower case), each with `array` (typed, of any component type), `itemSize`, and
   * optionally `normalized`, `stride` and `offset` in components; three.js's attributes will do.
   * Primitives without `_LEAF` are wood. `leaves`: their number, if the last may be missing.
   *
   * Takes time in proportion to the vertices. Throws an Error of one line that names problem and
   * fix.
   */
  constructor(primitives, { leaves = 0 } = {}) {
    const sources = primitives.map((primitive) => {
      const found = {};
      for (const key in primitive.attributes) found[key.toUpperCase()] = primitive.attributes[key];
      return { ...primitive, attributes: found };
    });
    const foliage = sources.filter((source) => source.attributes._LEAF);
    if (!foliage.length) refuse('no primitive has the attribute _LEAF; write the file with `foliage-lod export`, and keep custom attributes in tools');
    for (const source of foliage) {
      check(source.attributes);
      source.leaf = numbers(source.attributes._LEAF);
      if (String(source.matrix) !== String(foliage[0].matrix)) refuse('leaves lie in nodes with different transforms; apply the transforms first');
      for (const leaf of source.leaf) {
        if (!Number.isInteger(leaf) || leaf < 0 || leaf >= MAX_LEAVES) refuse(`_LEAF is ${leaf}, not a whole number from 0 to ${MAX_LEAVES - 1}; a tool has quantised it: leave _LEAF as it is`);
        leaves = Math.max(leaves, leaf + 1);
      }
    }
    /** Number of leaves, N. */
    this.leaves = leaves;
    /** Point about which each leaf grows, in the space of positions: 3 numbers a leaf. */
    this.pivots = new Float32Array(3 * leaves);
    const targets = new Int32Array(leaves).fill(-1);
    const slots = new Float32Array(leaves).fill(1);
    for (const { leaf, attributes } of foliage) {
      const [target, scale, pivot] = [numbers(attributes._TARGET), numbers(attributes._SCALE), numbers(attributes._PIVOT)];
      leaf.forEach((i, vertex) => {
        [targets[i], slots[i]] = [target[vertex], scale[vertex]];
        this.pivots.set(pivot.subarray(3 * vertex, 3 * vertex + 3), 3 * i);
      });
    }
    this.#timeline(targets, slots);
    /** Leaf primitives, then wood, each with arrays ready for upload. */
    this.parts = sources.sort((a, b) => !a.leaf - !b.leaf).map((source) => new Part(source, leaves));
  }

  #timeline(targets, slots) {
    targets.forEach((target, i) => {
      if (target >= i || target < -1 || !(slots[i] > 0)) refuse(`leaf ${i} has target ${target} and scale ${slots[i]}; _TARGET must be -1 or below _LEAF and _SCALE above 0: export the file again`);
    });
    /** Leaf t owns the events `starts[t]` to `starts[t + 1]`. */
    this.starts = new Uint32Array(this.leaves + 1);
    for (const target of targets) if (target >= 0) this.starts[target + 1]++;
    for (let i = 0; i < this.leaves; i++) this.starts[i + 1] += this.starts[i];
    const next = this.starts.slice();
    /** The leaf whose removal each event is, ascending within an owner; and the owner's scale then. */
    this.events = new Uint32Array(this.starts[this.leaves]);
    this.scales = new Float32Array(this.events.length);
    targets.forEach((target, i) => {
      if (target >= 0) [this.events[next[target]], this.scales[next[target]++]] = [i, slots[i]];
    });
    /** Greatest scale of any leaf at any count. */
    this.maxScale = this.scales.reduce((most, scale) => Math.max(most, scale), 1);
  }

  /** Scale of leaf `i` about its pivot with `n` leaves, of which the last may be a fraction. */
  scale(i, n) {
    const [whole, part] = [Math.floor(n), n - Math.floor(n)];
    const share = i < whole ? 1 : i === whole ? part : 0;
    if (!share) return 0;
    let [low, high] = [this.starts[i], this.starts[i + 1]];
    const end = high;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.events[middle] < whole) low = middle + 1; else high = middle;
    }
    const at = (event) => event < end ? this.scales[event] : 1;
    let area = at(low) ** 2;
    if (part && this.events[low] === whole && low < end) area += part * (at(low + 1) ** 2 - area);
    return Math.sqrt(area * share);
  }

  /** Number of leaf triangles with `n` leaves; with wood, that of the whole tree. */
  triangles(n, withWood = true) {
    return this.parts.reduce((sum, part) => sum + (part.leaf || withWood ? part.indexEnd(n) / 3 : 0), 0);
  }

  /**
   * Data of two float textures of `width` texels a row, for nearest sampling. `leaves` is RGBA32F:
   * pivot and first event of each leaf, and one texel after the last; `events` is RG32F: leaf and
   * scale. Each is `{ data, height }`.
   */
  textures(width = 1024) {
    const texture = (items, size) => {
      const height = Math.max(Math.ceil(items / width), 1);
      return { data: new Float32Array(width * height * size), height };
    };
    const [leaves, events] = [texture(this.leaves + 1, 4), texture(this.events.length, 2)];
    this.starts.forEach((start, i) => {
      leaves.data.set(this.pivots.subarray(3 * i, 3 * i + 3), 4 * i);
      leaves.data[4 * i + 3] = start;
    });
    this.events.forEach((leaf, i) => events.data.set([leaf, this.scales[i]], 2 * i));
    return { width, leaves, events };
  }
}

/** What the attributes of a leaf primitive must hold, and the fix where they do not. */
function check({ POSITION, _LEAF, _TARGET, _SCALE, _PIVOT }) {
  for (const [name, attribute, size] of [['_TARGET', _TARGET, 1], ['_SCALE', _SCALE, 1], ['_PIVOT', _PIVOT, 3], ['POSITION', POSITION, 3]]) {
    if (attribute?.itemSize !== size) refuse(`leaves lack the attribute ${name}; write the file with \`foliage-lod export\`, and keep custom attributes in tools`);
  }
  for (const [name, { array }] of Object.entries({ _LEAF, _TARGET, _SCALE, _PIVOT })) {
    if (array instanceof Uint32Array) refuse(`${name} is of type u32, which glTF does not allow for attributes; write it as f32`);
  }
  const stale = 'positions were quantised by a tool that left _PIVOT behind; quantise all but POSITION, or let `foliage-lod export` do it';
  const kind = ({ array, normalized }) => array.constructor.name + !!normalized;
  if (!(POSITION.array instanceof Float32Array) && kind(POSITION) !== kind(_PIVOT)) refuse(stale);
  const [position, pivot] = [numbers(POSITION), numbers(_PIVOT)];
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  position.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3], x);
    high[i % 3] = Math.max(high[i % 3], x);
  });
  // A pivot is a leaf's attachment, which may lie somewhat beside the leaves.
  const beside = 0.25 * Math.max(...high.map((x, axis) => x - low[axis]));
  if (!pivot.every((x, i) => x >= low[i % 3] - beside && x <= high[i % 3] + beside)) refuse(stale);
}

/** One primitive in drawing order: `position`, `normal`, `uv`, `color` and `leaf` are Float32Arrays. */
class Part {
  #ends;

  constructor({ attributes, indices, material = -1, matrix = IDENTITY, leaf }, leaves) {
    const { POSITION, NORMAL, TEXCOORD_0, UV = TEXCOORD_0, COLOR_0, COLOR = COLOR_0 } = attributes;
    const position = numbers(POSITION ?? refuse('a primitive lacks POSITION; export the file again'));
    const old = indices?.array ?? indices ?? Uint32Array.from({ length: position.length / 3 }, (_, i) => i);
    const order = leaf ? this.#sorted(old, leaf, leaves) : old;
    const vertices = position.length / 3;
    const newIndex = new Int32Array(vertices).fill(-1);
    const used = new Uint32Array(vertices);
    let count = 0;
    /** Three indices a triangle. */
    this.indices = Uint32Array.from(order, (vertex) => {
      if (vertex >= vertices) refuse('an index reaches beyond the vertices; the file is damaged');
      if (newIndex[vertex] < 0) used[newIndex[vertex] = count++] = vertex;
      return newIndex[vertex];
    });
    const picked = (array, size) => {
      if (!array) return null;
      const out = new Float32Array(count * size);
      for (let i = 0; i < count; i++) for (let c = 0; c < size; c++) out[i * size + c] = array[used[i] * size + c];
      return out;
    };
    const read = (attribute) => attribute && picked(numbers(attribute), attribute.itemSize);
    Object.assign(this, { material, matrix, position: picked(position, 3), normal: read(NORMAL), uv: read(UV), color: read(COLOR), leaf: picked(leaf, 1) });
    /** Components of a colour, 3 or 4. */
    this.colorSize = COLOR?.itemSize ?? 0;
  }

  /** Indices with triangles sorted by leaf; tools may have reordered them. A counting sort. */
  #sorted(indices, leaf, leaves) {
    const ends = this.#ends = new Uint32Array(leaves + 1);
    for (let i = 0; i < indices.length; i += 3) {
      const of = leaf[indices[i]];
      if (leaf[indices[i + 1]] !== of || leaf[indices[i + 2]] !== of) refuse('a triangle has corners of several leaves; a tool has merged vertices: weld with _LEAF kept apart');
      ends[of + 1] += 3;
    }
    for (let i = 0; i < leaves; i++) ends[i + 1] += ends[i];
    const next = ends.slice();
    const sorted = new Uint32Array(indices.length);
    for (let i = 0; i < indices.length; i += 3) {
      const at = next[leaf[indices[i]]];
      sorted.set([indices[i], indices[i + 1], indices[i + 2]], at);
      next[leaf[indices[i]]] += 3;
    }
    return sorted;
  }

  /** Number of indices to draw with `n` leaves; all of them for wood. */
  indexEnd(n) {
    return this.#ends ? this.#ends[Math.min(Math.max(Math.ceil(n), 0), this.#ends.length - 1)] : this.indices.length;
  }
}

/**
 * Share of the leaves that remain where a plant covers `area`, relative to that at full detail; half
 * of them at `halfArea`. R. Cook et al., "Stochastic Simplification of Aggregate Detail" (2007),
 * Equation 2. For sizes in pixels, `area` is `(px / pxOfAllLeaves) ** 2`.
 */
export function cook(area, halfArea = 0.4) {
  return area < 1 ? Math.max(area, 0) ** (Math.log(0.5) / Math.log(halfArea)) : 1;
}

/**
 * Share of the leaves for a camera at `distance` from the centre of the bounding sphere: all of them
 * within `start` radii at a vertical field of view of 60 degrees, then by Cook's law; inside the
 * crown at least half.
 */
export function lodFor({ distance, radius, fovY }, { start = 3, halfArea = 0.4 } = {}) {
  const radii = distance / radius;
  const area = (start / radii * Math.tan(Math.PI / 6) / Math.tan(fovY / 2)) ** 2;
  const inwards = Math.min(Math.max((1.5 - radii) / 0.5, 0), 1);
  return Math.max(cook(area, halfArea), 0.5 * inwards * inwards * (3 - 2 * inwards));
}

/**
 * Count that follows `wanted` from `current` with some slack, so that a trembling camera is calm.
 * All leaves, `most`, are always reached.
 */
export function follow(current, wanted, most, slack = 0.02) {
  return wanted >= most ? most : Math.min(Math.max(current, wanted * (1 - slack)), wanted * (1 + slack));
}

/**
 * GLSL ES 3.00 of the look-up. `foliagePosition` gives a corner's place with `n` leaves; the textures
 * are those of `Foliage.textures`, with nearest sampling.
 */
export const GLSL = `
uniform highp sampler2D foliageLeaves;
uniform highp sampler2D foliageEvents;

vec4 foliageTexel(highp sampler2D from, int i) {
  int width = textureSize(from, 0).x;
  return texelFetch(from, ivec2(i % width, i / width), 0);
}

// Scale of a leaf about its pivot with n leaves, of which the last may be a fraction.
float foliageScale(int leaf, float n) {
  int whole = int(floor(n));
  float part = n - floor(n);
  float share = leaf < whole ? 1.0 : leaf == whole ? part : 0.0;
  if (share == 0.0) return 0.0;
  int low = int(foliageTexel(foliageLeaves, leaf).w);
  int end = int(foliageTexel(foliageLeaves, leaf + 1).w);
  int high = end;
  while (low < high) {
    int middle = (low + high) / 2;
    if (int(foliageTexel(foliageEvents, middle).x) < whole) low = middle + 1; else high = middle;
  }
  if (low == end) return sqrt(share);
  vec2 event = foliageTexel(foliageEvents, low).xy;
  if (share == 1.0 && (part == 0.0 || int(event.x) != whole)) return event.y;
  float area = event.y * event.y;
  if (int(event.x) == whole) {
    float next = low + 1 < end ? foliageTexel(foliageEvents, low + 1).y : 1.0;
    area += part * (next * next - area);
  }
  return sqrt(area * share);
}

vec3 foliagePosition(vec3 position, float leaf, float n) {
  vec3 pivot = foliageTexel(foliageLeaves, int(leaf)).xyz;
  float scale = foliageScale(int(leaf), n);
  return scale == 1.0 ? position : pivot + scale * (position - pivot);
}
`;
