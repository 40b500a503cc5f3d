// Appends every pixel that every triangle covers to one buffer, without depth test or culling.
// Driven by gpu/capture.
//
// Texel indices are computed in f32, and an adapter may fuse a product and a sum or divide
// inexactly. If such an error could select another texel, the fragment is marked UNCERTAIN, and the
// CPU repeats its alpha test exactly.

struct Params {
    resolution: u32,
    // Number of entries that fit; the count may exceed it.
    capacity: u32,
}

struct AlphaTest {
    u: array<f32, 3>,
    v: array<f32, 3>,
    q: array<f32, 3>,
    anchor: array<f32, 2>,
    mask: u32,
}

struct MaskHeader {
    first_word: u32,
    width: u32,
    height: u32,
    wrap: array<u32, 2>,
}

struct Coverage {
    pixel: u32,
    triangle: u32,
}

struct Fragments {
    count: atomic<u32>,
    entries: array<Coverage>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> alpha_tests: array<AlphaTest>;
@group(0) @binding(2) var<storage, read> masks: array<MaskHeader>;
@group(0) @binding(3) var<storage, read> mask_words: array<u32>;
@group(0) @binding(4) var<storage, read_write> fragments: Fragments;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    // Index of the triangle within its view.
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn corner(@location(0) clip_xy: vec2<f32>, @location(1) triangle: u32) -> Corner {
    return Corner(vec4(clip_xy, 0.5, 1.0), triangle);
}

@fragment
fn append_plain(input: Corner) {
    append(vec2<u32>(input.clip.xy), input.triangle);
}

fn append(pixel: vec2<u32>, triangle: u32) {
    let slot = atomicAdd(&fragments.count, 1u);
    if slot < params.capacity {
        fragments.entries[slot] = Coverage(pixel.y * params.resolution + pixel.x, triangle);
    }
}

// Everything that the alpha test needs, fetched per vertex: per-pixel fetches are slow on software
// adapters.
struct MaskedCorner {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) u: vec3<f32>,
    @location(2) @interpolate(flat) v: vec3<f32>,
    @location(3) @interpolate(flat) q: vec3<f32>,
    @location(4) @interpolate(flat) anchor: vec2<f32>,
    @location(5) @interpolate(flat) size: vec2<u32>,
    @location(6) @interpolate(flat) wrap: vec2<u32>,
    @location(7) @interpolate(flat) first_word: u32,
}

// The masked triangles come first in the vertex buffer, in the order of their alpha tests.
@vertex
fn masked_corner(
    @builtin(vertex_index) index: u32,
    @location(0) clip_xy: vec2<f32>,
    @location(1) triangle: u32,
) -> MaskedCorner {
    let test = alpha_tests[index / 3u];
    let mask = masks[test.mask];
    return MaskedCorner(
        vec4(clip_xy, 0.5, 1.0),
        triangle,
        vec3(test.u[0], test.u[1], test.u[2]),
        vec3(test.v[0], test.v[1], test.v[2]),
        vec3(test.q[0], test.q[1], test.q[2]),
        vec2(test.anchor[0], test.anchor[1]),
        vec2(mask.width, mask.height),
        vec2(mask.wrap[0], mask.wrap[1]),
        mask.first_word,
    );
}

@fragment
fn append_masked(input: MaskedCorner) {
    let pixel = vec2<u32>(input.clip.xy);
    let p = vec2<f32>(pixel) - input.anchor;
    let q = plane(input.q, p);
    let column = texel(quotient(plane(input.u, p), q), input.size.x, input.wrap.x);
    let row = texel(quotient(plane(input.v, p), q), input.size.y, input.wrap.y);
    let bit = row.index * input.size.x + column.index;
    let covers = ((mask_words[input.first_word + bit / 32u] >> (bit % 32u)) & 1u) == 1u;
    let is_certain = column.is_certain && row.is_certain;
    if covers || !is_certain {
        append(pixel, input.triangle | select(UNCERTAIN, 0u, is_certain));
    }
}

// A value, and a bound on its difference from the value that the CPU computes.
struct Estimate {
    value: f32,
    error: f32,
}

fn plane(c: vec3<f32>, p: vec2<f32>) -> Estimate {
    let x = c.x * p.x;
    let y = c.y * p.y;
    return Estimate(x + y + c.z, (abs(x) + abs(y) + abs(c.z)) * ROUNDING);
}

fn quotient(a: Estimate, b: Estimate) -> Estimate {
    let value = a.value / b.value;
    return Estimate(value, (a.error + abs(value) * b.error) / abs(b.value) + abs(value) * ROUNDING);
}

struct Texel {
    index: u32,
    is_certain: bool,
}

fn texel(coordinate: Estimate, size: u32, wrap: u32) -> Texel {
    let at = coordinate.value * f32(size);
    let error = coordinate.error * f32(size) + abs(at) * ROUNDING;
    let cell = floor(at);
    // Beyond LARGEST_CELL the error exceeds one texel.
    let is_certain = floor(at - error) == cell && floor(at + error) == cell && abs(at) < LARGEST_CELL;
    let inside = wrapped(clamp(cell, -LARGEST_CELL, LARGEST_CELL), f32(size), wrap);
    return Texel(u32(clamp(inside, 0.0, f32(size - 1u))), is_certain);
}

fn wrapped(cell: f32, size: f32, wrap: u32) -> f32 {
    let is_mirror = wrap == WRAP_MIRROR;
    let period = select(size, 2.0 * size, is_mirror);
    let phase = modulo(cell, period);
    let repeated = select(phase, min(phase, period - 1.0 - phase), is_mirror);
    return select(repeated, cell, wrap == WRAP_CLAMP);
}

// Remainder of a / b, from 0 up to b (exclusive). Exact for whole numbers below 2^24, even if the
// quotient is off by a rounding error.
fn modulo(a: f32, b: f32) -> f32 {
    let rest = a - floor(a / b) * b;
    return rest + select(0.0, b, rest < 0.0) - select(0.0, b, rest >= b);
}
