// Shared by leaf_pass and wood_pass: instances, materials, textures, and the colour of a pixel.
//
// Local space is plant space with its origin at the plant's centre, so that the precision of f32
// does not depend on where a file places the plant.

// One plant to draw.
struct Instance {
    clip_from_local: mat4x4<f32>,
    eye_local: vec3<f32>,
    // Fractional part of the active count.
    fraction: f32,
    // Unit vector towards the sun, in local space.
    sun_local: vec3<f32>,
    active_count: u32,
    // Unit vector upwards, in local space.
    up_local: vec3<f32>,
    // One past the last index of the last leaf drawn.
    index_end: u32,
    // Index of the first of this plant's own drawn scales, or NO_SCALES if they come from the
    // timeline.
    first_scale: u32,
    // The first leaf that may be only partly present.
    first_partial: u32,
    // Number of leaves to draw.
    drawn: u32,
    // Number of leaves that are in transition at once.
    window: f32,
    // Factor applied to every leaf's drawn scale.
    leaf_scale: f32,
    // Index of the plant's record for the previous frame; only used for motion vectors.
    before: u32,
    // Jitter of the picture, in clip space.
    jitter: vec2<f32>,
}

// The crown: the box around all leaves, drawn or not.
struct Crown {
    center_local: vec3<f32>,
    inverse_half_size: vec3<f32>,
}

struct Material {
    base_color: vec4<f32>,
    // Alpha at or above which a texel is opaque; 0 if all texels are.
    cutoff: f32,
    layer: u32,
    // Wrap modes along u and v, as numbered by `wrap_number` in draw/shader.rs.
    wrap: vec2<u32>,
    is_two_sided: u32,
}

@group(0) @binding(0) var<uniform> crown: Crown;
@group(0) @binding(1) var<storage, read> materials: array<Material>;
@group(0) @binding(2) var textures: texture_2d_array<f32>;
@group(0) @binding(3) var filtering: sampler;
@group(1) @binding(0) var<storage, read> instances: array<Instance>;

// Samples per pixel; alpha determines how many of them are covered.
override SAMPLES: u32 = 1u;

// COLORING_PICTURE, or a constant that selects unlit diagnostic colours.
override COLORING: u32 = 0u;

struct Surface {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) color: vec3<f32>,
    @location(2) normal: vec3<f32>,
    @location(3) position_local: vec3<f32>,
    @location(4) @interpolate(flat) material: u32,
    @location(5) @interpolate(flat) instance: u32,
    @location(6) @interpolate(flat) leaf: u32,
}

// Position and normal of a leaf's vertex after scaling and wind.
struct Moved {
    position: vec3<f32>,
    normal: vec3<f32>,
}

struct Shaded {
    @location(0) color: vec4<f32>,
    @builtin(sample_mask) samples: u32,
}

fn shaded(surface: Surface, is_leaf: bool, pattern: u32) -> Shaded {
    let material = materials[surface.material];
    let instance = instances[surface.instance];
    let texel = texel(material, surface.uv);
    let alpha = texel.a * material.base_color.a;
    let sharpness = 1.0 / max(fwidth(alpha), 1e-4);
    var share = 1.0;
    if material.cutoff > 0.0 {
        share = select(
            select(0.0, 1.0, alpha >= material.cutoff),
            // Coverage rises from 0 to 1 within one pixel around the cutoff.
            clamp((alpha - material.cutoff) * sharpness + 0.5, 0.0, 1.0),
            SAMPLES > 1u,
        );
    }
    if is_leaf {
        share *= fade_share(surface.leaf, instance);
    }
    if share <= 0.0 {
        discard;
    }
    let lit = Lit(
        surface.normal,
        surface.position_local - instance.eye_local,
        (surface.position_local - crown.center_local) * crown.inverse_half_size,
        crown.inverse_half_size,
        instance.sun_local,
        instance.up_local,
        is_leaf,
        is_leaf || material.is_two_sided == 1u,
        sunlit(surface.position_local, surface.instance),
    );
    let lit_color = texel.rgb * material.base_color.rgb * surface.color * reflected(lit);
    var color = surface.color;
    if COLORING == COLORING_PICTURE {
        color = lit_color;
        if is_leaf {
            color = toned(color, surface.instance);
        }
    }
    return Shaded(vec4(encoded(color), 1.0), covered_samples(share, pattern));
}

// Presence of a leaf from 0 to 1, as a fraction of its area or of its alpha.
fn presence(leaf: u32, instance: Instance) -> f32 {
    let behind = f32(i32(leaf) - i32(instance.active_count));
    let t = clamp((instance.fraction - behind - 0.5) / instance.window + 0.5, 0.0, 1.0);
    return select(t, t * t * (3.0 - 2.0 * t), FADES_SMOOTHLY);
}

// Mask of round(share * SAMPLES) samples. It is rotated by `pattern`, which differs between leaves,
// so that overlapping leaves cover different samples.
fn covered_samples(share: f32, pattern: u32) -> u32 {
    let count = u32(share * f32(SAMPLES) + 0.5);
    let first = pattern % SAMPLES;
    let run = (1u << count) - 1u;
    return (run << first) | (run >> (SAMPLES - first));
}

// Whether the surface is transparent: its alpha is below the cutoff.
fn is_hole(material: Material, uv: vec2<f32>) -> bool {
    return material.cutoff > 0.0 && texel(material, uv).a * material.base_color.a < material.cutoff;
}

fn texel(material: Material, uv: vec2<f32>) -> vec4<f32> {
    let inside = vec2(wrapped(uv.x, material.wrap.x), wrapped(uv.y, material.wrap.y));
    return textureSampleGrad(textures, filtering, inside, material.layer, dpdx(uv), dpdy(uv));
}

// The sampler repeats; the other wrap modes are applied to the coordinate here.
fn wrapped(coordinate: f32, wrap: u32) -> f32 {
    switch wrap {
        case WRAP_CLAMP: {
            return clamp(coordinate, 0.0, 1.0);
        }
        case WRAP_MIRROR: {
            return 1.0 - abs(fract(coordinate * 0.5) * 2.0 - 1.0);
        }
        default: {
            return coordinate;
        }
    }
}
