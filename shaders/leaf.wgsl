// What every pass, and the shader of any engine, knows of a leaf: how far it is present, how it is
// moved, and what its cut-out covers.

// A fractional active count; twin of model/timeline.rs.
struct Transition {
    count: u32,
    fraction: f32,
    // Number of leaves that are in transition at once.
    window: f32,
    // The first leaf that may be only partly present.
    first_partial: u32,
    // Number of leaves to draw.
    drawn: u32,
    is_smooth: bool,
}

// Presence of a leaf from 0 to 1, as a fraction of its area or of its alpha.
fn presence(leaf: u32, transition: Transition) -> f32 {
    let behind = f32(i32(leaf) - i32(transition.count));
    let t = clamp((transition.fraction - behind - 0.5) / transition.window + 0.5, 0.0, 1.0);
    return select(t, t * t * (3.0 - 2.0 * t), transition.is_smooth);
}

// Position and normal of a leaf's vertex after scaling and wind.
struct Moved {
    position: vec3<f32>,
    normal: vec3<f32>,
}

// Texture coordinates after repetition, and how many times as fast they change.
struct Shown {
    uv: vec2<f32>,
    stretch: vec2<f32>,
}

// Mip level of a surface that shows `shown` texels, if a pixel's step to the right and one down are
// so many texels.
fn mip_level(right: vec2<f32>, down: vec2<f32>, shown: vec2<f32>) -> f32 {
    let footprint = 0.5 * log2(max(max(dot(right, right), dot(down, down)), 1e-12)) - FINER_LEVELS;
    // Texels that are not small compared with the surface would mix in what lies beside it.
    let across = max(shown, vec2(1.0));
    return min(footprint, log2(min(across.x, across.y)) - LEVELS_ACROSS);
}

// Fraction of a pixel that a cut-out covers. full: alpha of the full texture; edge: 0 or 1, whether
// that passes the alpha test, or between them; filtered: alpha at the mip level, which is coverage.
fn cutout_coverage(full: f32, edge: f32, filtered: f32, level: f32) -> f32 {
    // Between the full texture and the first level, `filtered` contains (1 - minified) * full.
    return clamp(filtered + (1.0 - clamp(level, 0.0, 1.0)) * (edge - full), 0.0, 1.0);
}

// Offset of the threshold that coverage is rounded at, from 0 to 1. texel: place on the full
// texture, in texels.
fn cutout_dither(texel: vec2<f32>, level: f32, seed: u32) -> f32 {
    // Cells of about a pixel: smaller ones would flicker when the surface moves.
    let whole = floor(max(level, 0.0)) + FINER_LEVELS;
    let cell = vec3(vec2<i32>(floor(texel * exp2(-whole))), i32(whole));
    return mix(0.5, fract(hash(cell) + f32(seed >> 8u) / 16777216.0), clamp(level, 0.0, 1.0));
}

// Mask of coverage * samples samples, rounded up where the fraction exceeds 1 - dither. It is
// rotated by `seed`, which differs between leaves, so that overlapping leaves cover different
// samples.
fn covered_samples(coverage: f32, dither: f32, seed: u32, samples: u32) -> u32 {
    let count = u32(coverage * f32(samples) + dither);
    let first = (seed >> 16u) % samples;
    let run = (1u << min(count, samples)) - 1u;
    return (run << first) | (run >> (samples - first));
}

// Samples of a pixel that belong to the impostor, of a plant that leaves it this share.
fn far_samples(pixel: vec2<f32>, share: f32, samples: u32) -> u32 {
    let cell = vec2<i32>(floor(pixel));
    let turn = u32(hash(vec3(cell, 1)) * f32(samples)) << 16u;
    return covered_samples(share, hash(vec3(cell, 0)), turn, samples);
}

// Hash of a cell of a surface, from 0 to below 1.
fn hash(cell: vec3<i32>) -> f32 {
    var mixed = 0u;
    for (var axis = 0; axis < 3; axis++) {
        mixed = (mixed ^ (mixed >> 15u) ^ u32(cell[axis])) * HASH_MULTIPLIER;
    }
    return f32((mixed ^ (mixed >> 15u)) >> 8u) / 16777216.0;
}

fn pow2(x: f32) -> f32 {
    return x * x;
}
