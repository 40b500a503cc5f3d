// The page of `foliage-lod export MODEL -o page.html`: WebGL2 without dependencies. The reader
// foliage-lod.js precedes this text in the page.

const $ = (id) => document.getElementById(id);
const canvas = $('view');
const FOV_Y = 35 * Math.PI / 180;
/** Diameter of the tree in device pixels from which all leaves are drawn automatically. */
const FULL_PX = 1000;
/** Shares of the leaves that the levels have, for comparison. */
const LEVELS = [1, 1 / 3, 1 / 9, 1 / 27, 1 / 81];
/** Least share of the leaves on the slider. */
const LEAST = 0.002;
/** Multiplier of hashes: 2^32 over the golden ratio. */
const HASH = 2654435761;
const TOWARDS_SUN = unit([0.62, 0.72, 0.42]);
const MODES = { prefix: 'Continuous', levels: 'Levels', random: 'Random' };

function unit(v) {
  const length = Math.hypot(...v) || 1;
  return v.map((x) => x / length);
}
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/** Product of two matrices, column by column. */
function times(a, b) {
  return Float32Array.from(b, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[(i % 4) + 4 * k] * b[4 * (i >> 2) + k], 0));
}

/** View matrix of an eye with axes to the right, up and back. */
function viewOf(eye, right, up, back) {
  const axes = [right, up, back];
  const columns = [0, 1, 2].flatMap((i) => [...axes.map((axis) => axis[i]), 0]);
  return [...columns, ...axes.map((axis) => -dot(axis, eye)), 1];
}

// ---------------------------------------------------------------------------------------- shaders

const VERTEX = `
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 color;
layout(location = 4) in float leaf;
// Seed of its partial coverage, from 0 to 1, and the coarsest mip level that shows it.
layout(location = 5) in vec2 grain;
uniform mat4 clipFromWorld;
uniform float count;
// Scale of all leaves alike; 0 to look up that of each.
uniform float evenScale;
out vec3 vPosition;
out vec3 vNormal;
out vec2 vUv;
out vec4 vColor;
flat out float vLeaf;
flat out vec2 vGrain;
#ifdef IS_LEAF
${GLSL}
#endif
void main() {
  vec3 at = position;
#ifdef IS_LEAF
  if (evenScale > 0.0) {
    vec3 pivot = foliageTexel(foliageLeaves, int(leaf)).xyz;
    at = pivot + evenScale * (position - pivot);
  } else {
    at = foliagePosition(position, leaf, count);
  }
#endif
  vPosition = at;
  vNormal = normal;
  vUv = uv;
  vColor = color;
  vLeaf = leaf;
  vGrain = grain;
  gl_Position = clipFromWorld * vec4(at, 1.0);
}`;

const LIGHT = `
uniform highp sampler2DShadow shadowMap;
uniform mat4 lightFromWorld;
uniform vec3 towardsSun;
const vec3 SUN = vec3(1.75, 1.65, 1.4);
const vec3 SKY = vec3(0.42, 0.50, 0.62);
const vec3 BELOW = vec3(0.16, 0.16, 0.12);
float sunlit(vec3 at) {
  vec3 light = (lightFromWorld * vec4(at, 1.0)).xyz * 0.5 + 0.5;
  float texel = 1.0 / float(textureSize(shadowMap, 0).x);
  float sum = 0.0;
  for (int y = -1; y <= 1; y++) for (int x = -1; x <= 1; x++) {
    sum += texture(shadowMap, vec3(light.xy + 1.2 * texel * vec2(x, y), min(light.z - 1.5 * texel, 1.0)));
  }
  vec2 edge = abs(light.xy * 2.0 - 1.0);
  return mix(sum / 9.0, 1.0, smoothstep(0.9, 1.0, max(edge.x, edge.y)));
}
vec3 sky(vec3 normal) { return mix(BELOW, SKY, normal.y * 0.5 + 0.5); }
vec3 encoded(vec3 c) {
  // A shoulder keeps sunlit leaves from clipping.
  c = mix(c, 1.0 - 0.35 * exp(-(c - 0.65) / 0.35), step(0.65, c));
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

// How many of a pixel's samples a cut-out covers, as a share. Mip levels hold coverage instead of
// alpha; where they are used, it is rounded up or down by a hash of the texel and of the leaf, so that
// it is right on average, and sampled more finely than colours are. As in shaders/surface.wgsl.
const OPACITY = `
uniform sampler2D albedo;
uniform vec4 baseColor;
// Below 0 for an opaque material.
uniform float cutoff;
uniform float samples;
float hash(ivec3 cell) {
  uint mixed = 0u;
  for (int i = 0; i < 3; i++) mixed = (mixed ^ (mixed >> 15) ^ uint(cell[i])) * ${HASH}u;
  return float((mixed ^ (mixed >> 15)) >> 8) / 16777216.0;
}
float opacity(vec2 uv, float factor, vec2 grain) {
  if (cutoff < 0.0) return 1.0;
  vec2 size = vec2(textureSize(albedo, 0));
  vec2 right = dFdx(uv) * size;
  vec2 up = dFdy(uv) * size;
  float level = min(0.5 * log2(max(max(dot(right, right), dot(up, up)), 1e-12)) - 2.0, grain.y);
  float minified = clamp(level, 0.0, 1.0);
  float full = textureLod(albedo, uv, 0.0).a;
  float rise = max(min(fwidth(full * factor), 2.0 * min(cutoff, 1.0 - cutoff)), 1e-4);
  float edge = samples > 1.0 ? clamp((full * factor - cutoff) / rise + 0.5, 0.0, 1.0) : step(cutoff, full * factor);
  float filtered = textureLod(albedo, uv, max(level, 0.0)).a;
  float coverage = clamp(filtered + (1.0 - minified) * (edge - full), 0.0, 1.0);
  float whole = floor(max(level, 0.0)) + 2.0;
  ivec3 cell = ivec3(ivec2(floor(uv * size * exp2(-whole))), int(whole));
  float dither = mix(0.5, fract(hash(cell) + grain.x), minified);
  return min(floor(coverage * samples + dither) / samples, 1.0);
}`;

// A mip level from the one above it, which is the only one that is bound: coverage, and the mean
// colour of what is covered. The full texture is cut out as it is filtered.
const MIP_FRAGMENT = `
uniform sampler2D above;
uniform vec2 size;
// Below 0 for levels that hold coverage already.
uniform float cutoff;
out vec4 color;
void main() {
  vec4 sum = vec4(0.0);
  for (int i = 0; i < 16; i++) {
    vec2 at = (gl_FragCoord.xy - 0.5 + (vec2(i & 3, i >> 2) + 0.5) / 4.0) / size;
    vec4 texel = cutoff < 0.0 ? texelFetch(above, ivec2(at * vec2(textureSize(above, 0))), 0) : texture(above, at);
    float covered = cutoff < 0.0 ? texel.a : step(cutoff, texel.a);
    // What is clear keeps a colour.
    sum += vec4(texel.rgb * (covered + 1e-5), covered);
  }
  color = vec4(sum.rgb / (sum.a + 16e-5), sum.a / 16.0);
}`;

const FRAGMENT = `
in vec3 vPosition;
in vec3 vNormal;
in vec2 vUv;
in vec4 vColor;
flat in vec2 vGrain;
uniform vec3 eye;
uniform vec3 crownCenter;
uniform vec3 crownInverse;
out vec4 color;
${OPACITY}
${LIGHT}
void main() {
  vec4 texel = texture(albedo, vUv) * baseColor * vColor;
  float alpha = opacity(vUv, baseColor.a * vColor.a, vGrain);
  if (alpha == 0.0) discard;
  vec3 normal = normalize(vNormal);
#ifdef IS_LEAF
  if (dot(normal, vPosition - eye) > 0.0) normal = -normal;
#else
  if (!gl_FrontFacing) normal = -normal;
#endif
  vec3 inCrown = (vPosition - crownCenter) * crownInverse;
  float open = mix(0.42, 1.0, smoothstep(0.15, 1.0, length(inCrown)));
  float cosine = dot(normal, towardsSun);
  vec3 sun = SUN * sunlit(vPosition + 0.02 * normal / max(crownInverse.x, 1e-6) * 0.2);
#ifdef IS_LEAF
  vec3 leaning = normalize(normal + 0.45 * normalize(inCrown * crownInverse + 1e-6));
  float facing = max((dot(leaning, towardsSun) + 0.25) / 1.25, 0.0);
  float against = max(dot(normalize(vPosition - eye), towardsSun), 0.0);
  vec3 through = 0.45 * vec3(1.0, 1.05, 0.55) * max(-cosine, 0.0) * (1.0 + pow(against, 4.0));
  vec3 light = sun * (facing + through) + sky(leaning);
#else
  vec3 light = sun * max(cosine, 0.0) + sky(normal);
#endif
  color = vec4(encoded(texel.rgb * light * open), alpha);
}`;

const DEPTH_FRAGMENT = `
in vec2 vUv;
in vec4 vColor;
flat in vec2 vGrain;
${OPACITY}
void main() {
  if (opacity(vUv, baseColor.a * vColor.a, vGrain) == 0.0) discard;
}`;

// Number of the leaf at each pixel, from 1; wood is 0xffffff.
const ID_FRAGMENT = `
in vec2 vUv;
in vec4 vColor;
flat in float vLeaf;
flat in vec2 vGrain;
out vec4 color;
${OPACITY}
void main() {
  if (opacity(vUv, baseColor.a * vColor.a, vGrain) == 0.0) discard;
#ifdef IS_LEAF
  int number = int(vLeaf) + 1;
#else
  int number = 0xffffff;
#endif
  color = vec4(number & 255, (number >> 8) & 255, number >> 16, 255) / 255.0;
}`;

const COVER = `
out vec2 vAt;
void main() {
  vAt = vec2(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0);
  gl_Position = vec4(vAt, 0.0, 1.0);
}`;

const SURROUNDINGS = `
in vec2 vAt;
uniform vec3 eye;
uniform vec3 forward;
uniform vec3 right;
uniform vec3 up;
uniform float floorY;
uniform float radius;
uniform vec3 middle;
uniform mat4 clipFromWorld;
out vec4 color;
${LIGHT}
void main() {
  vec3 ray = forward + vAt.x * right + vAt.y * up;
  vec3 far = normalize(ray);
  vec3 horizon = vec3(0.78, 0.85, 0.90);
  vec3 above = mix(horizon, vec3(0.33, 0.53, 0.80), smoothstep(0.0, 0.9, max(far.y, 0.0)));
  above += vec3(0.5, 0.4, 0.25) * pow(max(dot(far, towardsSun), 0.0), 12.0);
  gl_FragDepth = 1.0;
  if (far.y < -1e-4) {
    vec3 at = eye + ray * ((floorY - eye.y) / ray.y);
    vec2 from = (at - middle).xz / radius;
    vec3 earth = vec3(0.215, 0.25, 0.13);
    // Less of the sky is seen under the crown.
    float open = mix(0.62, 1.0, smoothstep(0.0, 1.0, length(from)));
    vec3 lit = earth * (SUN * sunlit(at) * max(towardsSun.y, 0.0) + SKY * open);
    float haze = 1.0 - exp(-pow(length(at - eye) / (radius * 60.0), 1.3));
    above = mix(lit, horizon, clamp(haze, 0.0, 1.0));
    vec4 clip = clipFromWorld * vec4(at, 1.0);
    gl_FragDepth = clamp(clip.z / clip.w * 0.5 + 0.5, 0.0, 1.0);
  }
  color = vec4(encoded(above), 1.0);
}`;

// ------------------------------------------------------------------------------------------ model

/** Moves all positions, pivots and normals of the file into the space of the scene. */
function placed({ foliage, materials, images, name, extras }) {
  const moved = new Set();
  const move = (points, m) => {
    for (let i = 0; i < points.length; i += 3) {
      const [x, y, z] = points.subarray(i, i + 3);
      for (let k = 0; k < 3; k++) points[i + k] = m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k];
    }
  };
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  const crown = { low: [...low], high: [...high] };
  for (const part of foliage.parts) {
    const m = part.matrix;
    move(part.position, m);
    if (part.leaf && !moved.has('pivots')) move(foliage.pivots, m), moved.add('pivots');
    // Normals turn with the cofactors.
    const columns = [0, 4, 8].map((i) => [m[i], m[i + 1], m[i + 2]]);
    const [x, y, z] = [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])];
    for (let i = 0; part.normal && i < part.normal.length; i += 3) {
      const [a, b, c] = part.normal.subarray(i, i + 3);
      part.normal.set(unit([0, 1, 2].map((k) => x[k] * a + y[k] * b + z[k] * c)), i);
    }
    for (let i = 0; i < part.position.length; i++) {
      const [axis, value] = [i % 3, part.position[i]];
      low[axis] = Math.min(low[axis], value);
      high[axis] = Math.max(high[axis], value);
      if (part.leaf) {
        crown.low[axis] = Math.min(crown.low[axis], value);
        crown.high[axis] = Math.max(crown.high[axis], value);
      }
    }
  }
  const center = low.map((x, i) => (x + high[i]) / 2);
  let radius = 1e-6;
  for (const { position } of foliage.parts) {
    for (let i = 0; i < position.length; i += 3) {
      radius = Math.max(radius, Math.hypot(position[i] - center[0], position[i + 1] - center[1], position[i + 2] - center[2]));
    }
  }
  // Roots may reach below the ground that the tree stands on.
  const floorY = Math.abs(low[1]) < 0.1 * radius ? Math.max(low[1], 0) : low[1];
  return { foliage, materials, images, name: name || extras.name || 'tree', center, radius, crown, floorY };
}

/** The bytes of the page's model: base64 of a zlib stream. */
async function embedded() {
  const text = $('model').textContent.trim();
  const packed = Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  if (typeof DecompressionStream !== 'function') throw new Error('This browser is too old to unpack the tree (it lacks DecompressionStream).');
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * Of each leaf, seed of its partial coverage and coarsest mip level, for the leaf parts and the size of
 * each part's picture. Seeds are spread evenly over the crown, by ranks along a Z-order curve.
 */
function grains(foliage, parts, sizes) {
  const middles = new Float64Array(3 * foliage.leaves);
  const corners = new Uint32Array(foliage.leaves);
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  const shown = Float64Array.from({ length: 4 * foliage.leaves }, (_, i) => i & 2 ? -Infinity : Infinity);
  parts.forEach(({ position, uv, leaf, indices }, i) => {
    position.forEach((x, at) => {
      low[at % 3] = Math.min(low[at % 3], x);
      high[at % 3] = Math.max(high[at % 3], x);
    });
    for (const corner of indices) {
      const of = leaf[corner];
      corners[of]++;
      for (let k = 0; k < 3; k++) middles[3 * of + k] += position[3 * corner + k];
      for (let k = 0; k < 2 && uv; k++) {
        const texels = uv[2 * corner + k] * sizes[i][k];
        shown[4 * of + k] = Math.min(shown[4 * of + k], texels);
        shown[4 * of + 2 + k] = Math.max(shown[4 * of + 2 + k], texels);
      }
    }
  });
  const places = Uint32Array.from(corners, (count, of) => {
    let code = 0;
    for (let k = 0; k < 3; k++) {
      const inverse = Math.fround(2 / Math.max(Math.fround(high[k] - low[k]), 1e-30));
      const cell = clamp(Math.floor(((middles[3 * of + k] / count - (low[k] + high[k]) / 2) * inverse * 0.5 + 0.5) * 256), 0, 255);
      for (let bit = 0; bit < 8; bit++) code |= (cell >> bit & 1) << (3 * bit + k);
    }
    return code;
  });
  const grain = new Float32Array(2 * foliage.leaves);
  Uint32Array.from(places.keys()).sort((a, b) => places[a] - places[b] || a - b).forEach((of, rank) => {
    const across = Math.min(...[0, 1].map((k) => Math.max(shown[4 * of + 2 + k] - shown[4 * of + k], 1)));
    grain.set([(Math.imul(rank, HASH) >>> 16) / 65536, Math.log2(across) - 2], 2 * of);
  });
  return grain;
}

/** Leaf triangles in a random order of leaves, the same each time. */
function shuffled(foliage) {
  const rank = Uint32Array.from({ length: foliage.leaves }, (_, i) => i);
  let seed = 1;
  for (let i = rank.length - 1; i > 0; i--) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    const other = Math.floor(seed / 4294967296 * (i + 1));
    [rank[i], rank[other]] = [rank[other], rank[i]];
  }
  return foliage.parts.filter((part) => part.leaf).map(({ leaf, indices }) => {
    const ends = new Uint32Array(foliage.leaves + 1);
    for (let i = 0; i < indices.length; i += 3) ends[rank[leaf[indices[i]]] + 1] += 3;
    for (let i = 0; i < foliage.leaves; i++) ends[i + 1] += ends[i];
    const [next, sorted] = [ends.slice(), new Uint32Array(indices.length)];
    for (let i = 0; i < indices.length; i += 3) {
      const of = rank[leaf[indices[i]]];
      sorted.set(indices.subarray(i, i + 3), next[of]);
      next[of] += 3;
    }
    return { indices: sorted, ends };
  });
}

// --------------------------------------------------------------------------------------- renderer

/** Everything that lives in a WebGL2 context; made anew after the context was lost. */
class Renderer {
  constructor(gl, model, bitmaps) {
    Object.assign(this, { gl, model });
    const program = (vertex, fragment, isLeaf) => this.#program(vertex, fragment, isLeaf);
    const both = (fragment) => [program(VERTEX, fragment, false), program(VERTEX, fragment, true)];
    this.programs = { color: both(FRAGMENT), depth: both(DEPTH_FRAGMENT), id: both(ID_FRAGMENT) };
    this.surroundings = program(COVER, SURROUNDINGS, false);
    this.mip = program(COVER, MIP_FRAGMENT, false);
    this.samples = gl.getParameter(gl.SAMPLES) || 1;
    this.empty = gl.createVertexArray();
    this.#foliage();
    const orders = shuffled(model.foliage);
    const leafParts = model.foliage.parts.filter((part) => part.leaf);
    const sizes = leafParts.map(({ material }) => bitmaps[model.materials[material]?.image] ?? { width: 1, height: 1 });
    const grain = grains(model.foliage, leafParts, sizes.map(({ width, height }) => [width, height]));
    this.parts = model.foliage.parts.map((part, i) => this.#part(part, orders[i], grain));
    const masks = bitmaps.map((_, i) => model.materials.find(({ image, cutoff }) => image === i && cutoff !== null));
    this.textures = bitmaps.map((bitmap, i) => bitmap && this.#image(bitmap, masks[i]));
    this.white = this.#image(new ImageData(new Uint8ClampedArray([255, 255, 255, 255]), 1, 1));
    this.shadows = new Map();
    this.#sun();
    this.timer = gl.getExtension('EXT_disjoint_timer_query_webgl2');
  }

  #program(vertex, fragment, isLeaf) {
    const { gl } = this;
    const head = `#version 300 es\nprecision highp float;\nprecision highp int;\n${isLeaf ? '#define IS_LEAF\n' : ''}`;
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, head + text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      program.log = () => gl.getShaderInfoLog(shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`a shader was refused: ${gl.getProgramInfoLog(program)} ${program.log()}`);
    }
    const at = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i) ?? {};
      if (name) at[name] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  #foliage() {
    const { gl } = this;
    const width = Math.min(1024, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    const { leaves, events } = this.model.foliage.textures(width);
    const texture = ({ data, height }, internal, format) => {
      const made = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, made);
      gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, gl.FLOAT, data);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      return made;
    };
    this.leaves = texture(leaves, gl.RGBA32F, gl.RGBA);
    this.events = texture(events, gl.RG32F, gl.RG);
  }

  #part(part, order, grain) {
    const { gl } = this;
    const buffer = (target, data) => {
      const made = gl.createBuffer();
      gl.bindBuffer(target, made);
      gl.bufferData(target, data, gl.STATIC_DRAW);
      return made;
    };
    const white = [1, 1, 1, 1];
    const inputs = [[part.position, 3], [part.normal, 3, [0, 1, 0, 0]], [part.uv, 2, [0, 0, 0, 0]], [part.color, part.colorSize, white], [part.leaf, 1, [0, 0, 0, 0]]];
    const ofCorners = part.leaf && Float32Array.from({ length: 2 * part.leaf.length }, (_, i) => grain[2 * part.leaf[i >> 1] + (i & 1)]);
    inputs.push([ofCorners, 2, [0, 30, 0, 0]]);
    gl.bindVertexArray(null);
    const buffers = inputs.map(([data]) => data && buffer(gl.ARRAY_BUFFER, data));
    const array = (indices) => {
      const made = gl.createVertexArray();
      gl.bindVertexArray(made);
      inputs.forEach(([data, size], location) => {
        if (!data) return;
        gl.bindBuffer(gl.ARRAY_BUFFER, buffers[location]);
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
      });
      buffer(gl.ELEMENT_ARRAY_BUFFER, indices);
      return made;
    };
    const made = { part, array: array(part.indices), random: order && array(order.indices), ends: order?.ends };
    made.absent = inputs.flatMap(([data, , value], location) => data ? [] : [[location, value]]);
    gl.bindVertexArray(null);
    return made;
  }

  /** A texture; of a material with a cutoff, if there is one, whose coverage its levels keep. */
  #image(bitmap, mask) {
    const { gl } = this;
    const texture = gl.createTexture();
    const { width, height } = bitmap;
    const levels = 1 + Math.floor(Math.log2(Math.max(width, height)));
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.texStorage2D(gl.TEXTURE_2D, levels, gl.SRGB8_ALPHA8, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    if (mask) this.#cutOut(texture, [width, height], levels, mask); else gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    const sharper = gl.getExtension('EXT_texture_filter_anisotropic');
    if (sharper) gl.texParameterf(gl.TEXTURE_2D, sharper.TEXTURE_MAX_ANISOTROPY_EXT, 4);
    return texture;
  }

  /** Draws the levels of the bound texture from one another. */
  #cutOut(texture, [width, height], levels, { cutoff, color, wrap }) {
    const { gl } = this;
    const { program, at } = this.mip;
    const target = gl.createFramebuffer();
    gl.useProgram(program);
    gl.bindVertexArray(this.empty);
    gl.uniform1i(at.above, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap[0]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap[1]);
    for (let level = 1; level < levels; level++) {
      const size = [width, height].map((side) => Math.max(side >> level, 1));
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_BASE_LEVEL, level - 1);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAX_LEVEL, level - 1);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, level);
      gl.viewport(0, 0, ...size);
      gl.uniform2f(at.size, ...size);
      gl.uniform1f(at.cutoff, level > 1 ? -1 : cutoff / Math.max(color[3], 1e-6));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_BASE_LEVEL, 0);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAX_LEVEL, levels - 1);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
  }

  /** The sun's orthographic view around the tree, with room for leaves that grow. */
  #sun() {
    const { center, radius } = this.model;
    const reach = 1.15 * radius;
    const right = unit(cross([0, 1, 0], TOWARDS_SUN));
    const view = viewOf(center, right, cross(TOWARDS_SUN, right), TOWARDS_SUN);
    const s = 1 / reach;
    this.lightFromWorld = times([s, 0, 0, 0, 0, s, 0, 0, 0, 0, -s, 0, 0, 0, 0, 1], view);
  }

  /** Shadow map of a pane's leaves; drawn again only when these change. */
  #shadow(key, pane, side) {
    const { gl } = this;
    let shadow = this.shadows.get(key);
    if (shadow?.side !== side) {
      if (shadow) gl.deleteTexture(shadow.texture), gl.deleteFramebuffer(shadow.target);
      shadow = { texture: gl.createTexture(), target: gl.createFramebuffer(), side };
      gl.bindTexture(gl.TEXTURE_2D, shadow.texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, side, side);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
      for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
      gl.bindFramebuffer(gl.FRAMEBUFFER, shadow.target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, shadow.texture, 0);
      this.shadows.set(key, shadow);
    }
    const state = `${pane.mode} ${pane.count}`;
    if (shadow.state !== state) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, shadow.target);
      gl.viewport(0, 0, side, side);
      gl.disable(gl.SCISSOR_TEST);
      gl.enable(gl.DEPTH_TEST);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(1, 2);
      this.#plant('depth', pane, this.lightFromWorld);
      gl.disable(gl.POLYGON_OFFSET_FILL);
      shadow.state = state;
    }
    return shadow.texture;
  }

  /** Draws wood and leaves with the programs of a kind. */
  #plant(kind, pane, clipFromWorld, set = () => {}) {
    const { gl, model } = this;
    const bound = new Set();
    for (const { part, array, random, ends, absent } of this.parts) {
      const isRandom = part.leaf && pane.mode === 'random';
      const end = isRandom ? ends[Math.ceil(pane.count)] : part.indexEnd(pane.count);
      if (!end || (pane.leavesOnly && !part.leaf)) continue;
      const { program, at } = this.programs[kind][part.leaf ? 1 : 0];
      gl.useProgram(program);
      if (!bound.has(program)) {
        bound.add(program);
        gl.uniformMatrix4fv(at.clipFromWorld, false, clipFromWorld);
        gl.uniform1f(at.count, pane.count);
        gl.uniform1f(at.evenScale, isRandom ? Math.sqrt(model.foliage.leaves / pane.count) : 0);
        gl.uniform1i(at.albedo, 0);
        gl.uniform1i(at.foliageLeaves, 1);
        gl.uniform1i(at.foliageEvents, 2);
        gl.activeTexture(gl.TEXTURE1);
        gl.bindTexture(gl.TEXTURE_2D, this.leaves);
        gl.activeTexture(gl.TEXTURE2);
        gl.bindTexture(gl.TEXTURE_2D, this.events);
        set(at);
      }
      const material = model.materials[part.material] ?? { color: [1, 1, 1, 1], cutoff: null, image: -1, isTwoSided: true, wrap: [10497, 10497] };
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[material.image] ?? this.white);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, material.wrap[0]);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, material.wrap[1]);
      gl.uniform4fv(at.baseColor, material.color);
      gl.uniform1f(at.cutoff, material.cutoff ?? -1);
      gl.uniform1f(at.samples, kind === 'color' ? this.samples : 1);
      for (const [location, value] of absent) gl.vertexAttrib4fv(location, value);
      const isMasked = kind === 'color' && material.cutoff !== null;
      if (isMasked) gl.enable(gl.SAMPLE_ALPHA_TO_COVERAGE);
      gl.bindVertexArray(isRandom ? random : array);
      gl.drawElements(gl.TRIANGLES, end, gl.UNSIGNED_INT, 0);
      if (isMasked) gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
    }
    gl.bindVertexArray(null);
  }

  /** Draws panes, each `{ mode, count, rect: [x, y, width, height] from below }`. */
  draw(panes, camera) {
    const { gl, model } = this;
    const query = this.timer && !this.query ? gl.createQuery() : null;
    if (query) gl.beginQuery(this.timer.TIME_ELAPSED_EXT, query);
    const side = Math.min(panes.length > 1 ? 1024 : 2048, gl.getParameter(gl.MAX_TEXTURE_SIZE));
    const maps = panes.map((pane, i) => this.#shadow(i, pane, side));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.SCISSOR_TEST);
    panes.forEach((pane, i) => {
      gl.viewport(...pane.rect);
      gl.scissor(...pane.rect);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      const sight = camera.sight(pane.rect[2] / pane.rect[3]);
      const light = (at) => {
        gl.activeTexture(gl.TEXTURE3);
        gl.bindTexture(gl.TEXTURE_2D, maps[i]);
        gl.uniform1i(at.shadowMap, 3);
        gl.uniformMatrix4fv(at.lightFromWorld, false, this.lightFromWorld);
        gl.uniform3fv(at.towardsSun, TOWARDS_SUN);
        gl.uniform3fv(at.eye, sight.eye);
      };
      const { program, at } = this.surroundings;
      gl.useProgram(program);
      light(at);
      for (const name of ['forward', 'right', 'up']) gl.uniform3fv(at[name], sight[name]);
      gl.uniform3fv(at.middle, model.center);
      gl.uniform1f(at.floorY, model.floorY);
      gl.uniform1f(at.radius, model.radius);
      gl.uniformMatrix4fv(at.clipFromWorld, false, sight.clipFromWorld);
      gl.bindVertexArray(this.empty);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      const { low, high } = model.crown;
      this.#plant('color', pane, sight.clipFromWorld, (at) => {
        light(at);
        gl.uniform3fv(at.crownCenter, low.map((x, k) => (x + high[k]) / 2));
        gl.uniform3fv(at.crownInverse, low.map((x, k) => 2 / Math.max(high[k] - x, 1e-6)));
      });
    });
    gl.disable(gl.SCISSOR_TEST);
    if (query) {
      gl.endQuery(this.timer.TIME_ELAPSED_EXT);
      this.query = query;
    }
  }

  /** Milliseconds that the device took for a frame, once known; `null` before, and without timers. */
  milliseconds() {
    const { gl, query, timer } = this;
    if (!query || !gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE)) return null;
    const time = gl.getParameter(timer.GPU_DISJOINT_EXT) ? null : gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6;
    gl.deleteQuery(query);
    this.query = null;
    return time;
  }

  /** Number of the leaf at each pixel, from 1, rows from the bottom; 0xffffff for wood, 0 for none. */
  ids({ clipFromWorld, count, width, height, leavesOnly = false, mode = 'prefix' }) {
    const { gl } = this;
    const target = gl.createFramebuffer();
    const [color, depth] = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    for (const [buffer, format, place] of [[color, gl.RGBA8, gl.COLOR_ATTACHMENT0], [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    }
    gl.viewport(0, 0, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.#plant('id', { mode, count, leavesOnly }, new Float32Array(clipFromWorld));
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteRenderbuffer(color);
    gl.deleteRenderbuffer(depth);
    return Uint32Array.from({ length: width * height }, (_, i) => pixels[4 * i] | pixels[4 * i + 1] << 8 | pixels[4 * i + 2] << 16);
  }
}

// ----------------------------------------------------------------------------------------- camera

/** Turns around the tree; distances are in its radii. */
class Orbit {
  constructor(model) {
    this.model = model;
    this.reset();
  }

  reset() {
    Object.assign(this, { yaw: 0.5, pitch: 0.12, distance: 0.9 / Math.sin(FOV_Y / 2), pan: [0, 0] });
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -0.6, 1.5);
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.25, 80);
  }

  /** Moves the point in the middle of the picture, in radii. */
  move(x, y) {
    this.pan = [clamp(this.pan[0] + x, -1.5, 1.5), clamp(this.pan[1] + y, -1.5, 1.5)];
  }

  /** Radii from the centre at which a pane of this aspect sees as much as a square one. */
  #away(aspect) {
    return this.distance * Math.max(1, 1 / aspect);
  }

  sight(aspect) {
    const { center, radius, floorY } = this.model;
    const back = [Math.sin(this.yaw) * Math.cos(this.pitch), Math.sin(this.pitch), Math.cos(this.yaw) * Math.cos(this.pitch)];
    const side = [Math.cos(this.yaw), 0, -Math.sin(this.yaw)];
    const tip = cross(back, side);
    const away = this.#away(aspect) * radius;
    const target = center.map((x, i) => x + radius * (this.pan[0] * side[i] + this.pan[1] * tip[i]));
    const eye = target.map((x, i) => x + away * back[i]);
    // The eye stays above the ground; it then looks upwards from there.
    eye[1] = Math.max(eye[1], floorY + 0.02 * radius);
    const b = unit(eye.map((x, i) => x - target[i]));
    const r = unit(cross([0, 1, 0], b));
    const u = cross(b, r);
    const tangent = Math.tan(FOV_Y / 2);
    const [near, far] = [Math.max(0.02 * radius, away - 4 * radius), away + 400 * radius];
    const projection = [
      1 / (tangent * aspect), 0, 0, 0, 0, 1 / tangent, 0, 0,
      0, 0, -(far + near) / (far - near), -1, 0, 0, -2 * far * near / (far - near), 0,
    ];
    return {
      eye,
      clipFromWorld: times(projection, viewOf(eye, r, u, b)),
      forward: b.map((x) => -x),
      right: r.map((x) => x * tangent * aspect),
      up: u.map((x) => x * tangent),
    };
  }

  /** Diameter of the tree's sphere in a pane, in pixels. */
  diameterPx(width, height) {
    const away = this.#away(width / height);
    return away > 1.01 ? height / (Math.tan(FOV_Y / 2) * Math.sqrt(away * away - 1)) : Infinity;
  }
}

// ------------------------------------------------------------------------------------------- page

const whole = (x) => Math.round(x).toLocaleString('en');
const percent = (share) => `${share >= 0.1 ? Math.round(share * 100) : (share * 100).toPrecision(2)}\u00a0%`;

class Page {
  constructor(model, bitmaps) {
    Object.assign(this, { model, bitmaps, mode: 'prefix', isAuto: true, count: model.foliage.leaves, times: [], isPending: false });
    this.wanted = this.count;
    this.orbit = new Orbit(model);
    this.gl = canvas.getContext('webgl2', { antialias: true, alpha: false, powerPreference: 'high-performance' });
    if (!this.gl) throw new Error('This page needs WebGL2, which this browser or its graphics driver does not offer.');
    this.renderer = new Renderer(this.gl, model, bitmaps);
    const leaves = model.foliage.leaves;
    $('name').textContent = model.name;
    $('size').textContent = `${whole(leaves)} leaves, ${whole(model.foliage.triangles(leaves))} triangles`;
    document.title = model.name;
    this.#hash();
    this.#listen();
    this.draw();
  }

  /** State from the address: `#leaves=0.3&view=compare&yaw=1&pitch=0.2&distance=4`. */
  #hash() {
    const given = new URLSearchParams(location.hash.slice(1));
    const number = (name) => given.has(name) && Number.isFinite(+given.get(name)) ? +given.get(name) : null;
    const share = number('leaves');
    if (share !== null) this.setLeaves(clamp(share, 0, 1) * this.model.foliage.leaves);
    for (const name of ['yaw', 'pitch', 'distance']) this.orbit[name] = number(name) ?? this.orbit[name];
    this.orbit.turn(0, 0);
    this.orbit.zoom(1);
    if (given.get('view') in MODES || given.get('view') === 'compare') this.setMode(given.get('view'));
  }

  setLeaves(count) {
    this.isAuto = $('auto').checked = false;
    this.count = this.wanted = clamp(count, 1, this.model.foliage.leaves);
    this.draw();
  }

  setAuto(isAuto) {
    this.isAuto = $('auto').checked = isAuto;
    this.draw();
  }

  setMode(mode) {
    this.mode = document.querySelector(`input[value=${mode}]`).value;
    document.querySelector(`input[value=${mode}]`).checked = true;
    this.draw();
  }

  #listen() {
    const { orbit } = this;
    const changed = (what) => (event) => (what(event), this.draw());
    const pointers = new Map();
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture?.(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const up = (event) => pointers.delete(event.pointerId);
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) canvas.addEventListener(name, up);
    canvas.addEventListener('pointermove', changed((event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
      const perPixel = 2 * orbit.distance * Math.tan(FOV_Y / 2) / canvas.clientHeight;
      if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const span = (at) => Math.max(Math.hypot(at[0] - other[0], at[1] - other[1]), 10);
        orbit.zoom(span(before) / span(now));
        orbit.move(-dx * perPixel / 2, dy * perPixel / 2);
      } else if (event.shiftKey || event.buttons & 6) {
        orbit.move(-dx * perPixel, dy * perPixel);
      } else {
        orbit.turn(-dx * 0.006, dy * 0.006);
      }
      pointers.set(event.pointerId, now);
    }));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', changed((event) => {
      event.preventDefault();
      const lines = [1, 16, 400][event.deltaMode];
      orbit.zoom(Math.exp(clamp(event.deltaY * lines, -300, 300) * (event.ctrlKey ? 0.01 : 0.0015)));
    }), { passive: false });
    canvas.addEventListener('dblclick', changed(() => orbit.reset()));
    canvas.addEventListener('keydown', (event) => {
      const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] }[event.key];
      const zoom = { '+': 0.85, '=': 0.85, '-': 1 / 0.85, PageUp: 0.85, PageDown: 1 / 0.85 }[event.key];
      if (turn) orbit.turn(...turn); else if (zoom) orbit.zoom(zoom); else if (event.key === 'Home') orbit.reset(); else return;
      event.preventDefault();
      this.draw();
    });
    $('reset').addEventListener('click', changed(() => orbit.reset()));
    $('panel').addEventListener('submit', (event) => event.preventDefault());
    $('panel').addEventListener('change', (event) => event.target.name === 'mode' && this.setMode(event.target.value));
    $('auto').addEventListener('change', () => this.setAuto($('auto').checked));
    $('amount').addEventListener('input', () => this.setLeaves(this.model.foliage.leaves * LEAST ** (1 - $('amount').value / 1000)));
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.renderer = null;
      say('The graphics driver dropped the picture. It comes back by itself; if not, reload the page.');
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.renderer = new Renderer(this.gl, this.model, this.bitmaps);
      say('');
      this.draw();
    });
  }

  /** Draws at the next frame. */
  draw() {
    if (this.isPending) return;
    this.isPending = true;
    requestAnimationFrame((now) => {
      this.isPending = false;
      try {
        this.#frame(now);
      } catch (error) {
        say(error.message);
        throw error;
      }
    });
  }

  #panes(width, height) {
    if (this.mode !== 'compare') return [[this.mode, [0, 0, width, height]]];
    const isWide = width >= height;
    return Object.keys(MODES).map((mode, i) => {
      const [from, to] = [i, i + 1].map((x) => Math.round((isWide ? width : height) * x / 3));
      return [mode, isWide ? [from, 0, to - from, height] : [0, height - to, width, to - from]];
    });
  }

  #countOf(mode) {
    const { leaves } = this.model.foliage;
    if (mode === 'prefix') return this.count;
    if (mode === 'random') return Math.max(Math.round(this.count), 1);
    const away = (level) => Math.abs(Math.log(level * leaves / this.count));
    return Math.max(Math.round(leaves * LEVELS.reduce((best, level) => away(level) < away(best) ? level : best)), 1);
  }

  #frame(now) {
    if (!this.renderer) return;
    const ratio = Math.min(devicePixelRatio || 1, 2.5);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(Math.round(x * ratio), 1));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const rects = this.#panes(width, height);
    const { leaves } = this.model.foliage;
    if (this.isAuto) {
      const [, [, , w, h]] = rects[0];
      this.wanted = clamp(follow(this.wanted, leaves * cook((this.orbit.diameterPx(w, h) / FULL_PX) ** 2), leaves), 1, leaves);
      const step = Math.log(this.wanted / this.count);
      const seconds = clamp((now - (this.last ?? now)) / 1000, 1 / 120, 1 / 20);
      this.count = Math.abs(step) < 1e-3 ? this.wanted : this.count * Math.exp(step * (1 - Math.exp(-9 * seconds)));
      if (this.count !== this.wanted) this.draw();
    }
    const panes = rects.map(([mode, rect]) => ({ mode, rect, count: this.#countOf(mode) }));
    this.renderer.draw(panes, this.orbit);
    this.#time(now);
    this.#show(panes, ratio);
  }

  #time(now) {
    const gpu = this.renderer.milliseconds();
    const isFlowing = this.last && now - this.last < 250 && this.wasFlowing;
    const time = this.renderer.timer ? gpu : isFlowing ? now - this.last : null;
    this.wasFlowing = this.last && now - this.last < 250;
    this.last = now;
    if (time !== null) this.times = [...this.times.slice(-14), time];
    // A device's time is known only after its frame.
    if (this.renderer.query) setTimeout(() => this.renderer && (this.#late(), this.#facts()), 60);
  }

  #late() {
    const time = this.renderer.milliseconds();
    if (time !== null) this.times = [...this.times.slice(-14), time];
  }

  #facts() {
    const middle = [...this.times].sort((a, b) => a - b)[this.times.length >> 1];
    const time = middle === undefined ? '' : `, ${middle.toFixed(middle < 10 ? 1 : 0)} ms/frame`;
    $('facts').textContent = `${whole(this.model.foliage.triangles(this.shown))} triangles${time}`;
  }

  #show(panes, ratio) {
    const { leaves } = this.model.foliage;
    const main = panes[0].count;
    this.shown = main;
    $('count').innerHTML = `<strong>${whole(main)}</strong> <span>leaves, ${percent(main / leaves)}</span>`;
    const slider = $('amount');
    if (this.isAuto || document.activeElement !== slider) slider.value = Math.round(1000 * (1 - Math.log(main / leaves) / Math.log(LEAST)));
    slider.setAttribute('aria-valuetext', `${whole(main)} leaves, ${percent(main / leaves)}`);
    this.#facts();
    document.body.classList.toggle('is-split', panes.length > 1);
    const [labels, height] = [$('labels'), canvas.clientHeight];
    labels.replaceChildren(...(panes.length < 2 ? [] : panes.flatMap(({ mode, rect, count }, i) => {
      const [x, y, w, h] = rect.map((v) => v / ratio);
      const label = document.createElement('div');
      label.className = 'label';
      label.append(Object.assign(document.createElement('b'), { textContent: MODES[mode] }), `${whole(count)} leaves`);
      const isStacked = w > h;
      Object.assign(label.style, { left: `${isStacked ? 14 : x + w / 2}px`, top: `${height - y - 38}px`, transform: isStacked ? 'none' : 'translateX(-50%)' });
      const edge = document.createElement('div');
      edge.className = 'edge';
      Object.assign(edge.style, x > 0 ? { left: `${x - 1}px`, top: 0, width: '2px', height: '100%' } : { left: 0, top: `${height - y - h}px`, width: '100%', height: i ? '2px' : 0 });
      return [edge, label];
    })));
  }
}

function say(text) {
  $('message').textContent = text;
  $('message').hidden = !text;
}

/** For tests and the console: resolves to the page once the tree is drawn. */
globalThis.foliagePage = (async () => {
  try {
    const file = load(await embedded());
    const bitmaps = await Promise.all(file.images.map((image) => image && createImageBitmap(
      new Blob([image.bytes], { type: image.mimeType }), { premultiplyAlpha: 'none', colorSpaceConversion: 'none' },
    )));
    const page = new Page(placed(file), bitmaps);
    say('');
    return page;
  } catch (error) {
    say(error.message);
    throw error;
  }
})();
