// How a model is packed; twin of draw/packed.rs.

// What several leaves or vertices of the wood have in common.
struct Look {
    // Origin of positions, in local space.
    origin: vec3<f32>,
    material: u32,
    // Linear colour factor.
    color: vec3<f32>,
    // Unit of offsets from a leaf's pivot; for wood, the width of the stem if widths are in looks.
    size: f32,
    uv_low: vec2<f32>,
    uv_size: vec2<f32>,
    // Width and height of the part of the texture that a leaf shows.
    shown: vec2<f32>,
    // Lowest texture coordinates of that part.
    shown_low: vec2<f32>,
    // Point of that part that stays in place where an enlarged leaf repeats it, as a fraction;
    // below 0 if it does not.
    anchor: vec2<f32>,
    // Extra after the first outline's for the leaf's first quad, or NO_EXTRA.
    outline: u32,
    // Levels by which outlines must reach farther than the mip levels call for.
    farther: f32,
}

struct Packing {
    // Steps of pivots and of the wood's positions, in local space.
    grid_step: f32,
    wood_step: f32,
    // 0 if leaves differ; the first extras are then the leaves of all quads, and which quad of its
    // leaf each is.
    quads_per_leaf: u32,
    // Extra with the colour of the first corner, or NO_EXTRA.
    first_color: u32,
    // Extra with the look of the first leaf, or NO_EXTRA.
    first_look: u32,
    // 1 if the widths of stems are in looks.
    widths_in_looks: u32,
    // First extra of the outlines.
    first_outline: u32,
}

@group(0) @binding(5) var<uniform> packing: Packing;
@group(0) @binding(8) var<storage, read> looks: array<Look>;

// Point on a grid: x and y in `xy`, z in the lower half of `z`.
fn grid_point(xy: u32, z: u32, step: f32, look: Look) -> vec3<f32> {
    return look.origin + vec3(f32(xy & 0xffffu), f32(xy >> 16u), f32(z & 0xffffu)) * step;
}

fn uv_of(bits: u32, look: Look) -> vec2<f32> {
    return look.uv_low + unpack2x16unorm(bits) * look.uv_size;
}

// Unit vector from the upper half of `bits`, where it is folded onto an octahedron.
fn normal_of(bits: u32) -> vec3<f32> {
    let at = unpack4x8snorm(bits).zw;
    let z = 1.0 - abs(at.x) - abs(at.y);
    let folded = at - select(vec2(1.0), vec2(-1.0), at < vec2(0.0)) * max(-z, 0.0);
    return select(normalize(vec3(folded, z)), vec3(0.0), bits >> 16u == NO_NORMAL);
}
