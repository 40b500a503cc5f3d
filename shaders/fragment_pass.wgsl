// Every pixel that every triangle covers, appended to one buffer: no depth test, no culling, nothing hidden.
//
// Texels are looked up in f32, and an adapter may contract a product and a sum or divide a little inexactly. Where such an
// error could reach another texel the fragment is marked UNCERTAIN, and the CPU repeats its test exactly.

struct Params {
    resolution: u32,
    // Number of the first triangle of this draw within its view.
    first_triangle: u32,
    // Entries that fit; the count goes on beyond it.
    capacity: u32,
    padding: u32,
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
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn corner(@builtin(vertex_index) index: u32, @location(0) clip_xy: vec2<f32>) -> Corner {
    return Corner(vec4(clip_xy, 0.5, 1.0), index / 3u);
}

@fragment
fn append(input: Corner) {
    let pixel = vec2<u32>(input.clip.xy);
    let verdict = test(input.triangle, vec2<f32>(pixel));
    if !verdict.covers && !verdict.uncertain {
        return;
    }
    let slot = atomicAdd(&fragments.count, 1u);
    if slot < params.capacity {
        let mark = select(0u, UNCERTAIN, verdict.uncertain);
        let triangle = (params.first_triangle + input.triangle) | mark;
        fragments.entries[slot] = Coverage(pixel.y * params.resolution + pixel.x, triangle);
    }
}

struct Verdict {
    covers: bool,
    uncertain: bool,
}

fn test(triangle: u32, pixel: vec2<f32>) -> Verdict {
    let mask_index = alpha_tests[triangle].mask;
    if mask_index == NO_MASK {
        return Verdict(true, false);
    }
    let planes = alpha_tests[triangle];
    let p = pixel - vec2(planes.anchor[0], planes.anchor[1]);
    let q = Estimate(plane(planes.q, p), plane_error(planes.q, p));
    let u = quotient(Estimate(plane(planes.u, p), plane_error(planes.u, p)), q);
    let v = quotient(Estimate(plane(planes.v, p), plane_error(planes.v, p)), q);
    let mask = masks[mask_index];
    let column = texel(u, mask.width, mask.wrap[0]);
    let row = texel(v, mask.height, mask.wrap[1]);
    let bit = row.index * mask.width + column.index;
    let word = mask_words[mask.first_word + bit / 32u];
    return Verdict(((word >> (bit % 32u)) & 1u) == 1u, column.uncertain || row.uncertain);
}

// A value and how far it may be from the one computed elsewhere.
struct Estimate {
    value: f32,
    error: f32,
}

fn plane(c: array<f32, 3>, p: vec2<f32>) -> f32 {
    return c[0] * p.x + c[1] * p.y + c[2];
}

fn plane_error(c: array<f32, 3>, p: vec2<f32>) -> f32 {
    return (abs(c[0] * p.x) + abs(c[1] * p.y) + abs(c[2])) * ROUNDING;
}

fn quotient(a: Estimate, b: Estimate) -> Estimate {
    let value = a.value / b.value;
    return Estimate(value, (a.error + abs(value) * b.error) / abs(b.value) + abs(value) * ROUNDING);
}

struct Texel {
    index: u32,
    uncertain: bool,
}

fn texel(coordinate: Estimate, size: u32, wrap: u32) -> Texel {
    let at = coordinate.value * f32(size);
    let error = coordinate.error * f32(size) + abs(at) * ROUNDING;
    let cell = floor(at);
    // Beyond LARGEST_CELL the error is over a texel, and the integers below would overflow.
    let is_certain = floor(at - error) == cell && floor(at + error) == cell && abs(at) < LARGEST_CELL;
    return Texel(wrapped(i32(clamp(cell, -LARGEST_CELL, LARGEST_CELL)), i32(size), wrap), !is_certain);
}

fn wrapped(cell: i32, size: i32, wrap: u32) -> u32 {
    var inside = clamp(cell, 0, size - 1);
    if wrap == WRAP_REPEAT {
        inside = modulo(cell, size);
    } else if wrap == WRAP_MIRROR {
        let phase = modulo(cell, 2 * size);
        inside = min(phase, 2 * size - 1 - phase);
    }
    return u32(inside);
}

fn modulo(a: i32, b: i32) -> i32 {
    return ((a % b) + b) % b;
}
