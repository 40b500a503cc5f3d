// What leaf_pass and wood_pass share: instances, materials, textures, and the colour of a pixel.
//
// Local space is plant space moved to the middle of the plant, so that f32 keeps its digits wherever a file put it.

// One plant on screen.
struct Instance {
    clip_from_local: mat4x4<f32>,
    eye_local: vec3<f32>,
    // Fraction of the active count.
    fraction: f32,
    // Unit vectors towards the sun and upwards, as local space sees them.
    sun_local: vec3<f32>,
    active_count: u32,
    up_local: vec3<f32>,
    // One past the last index of the last leaf drawn.
    index_end: u32,
    // First of this plant's own drawn scales, or NO_SCALES: then they come from the timeline.
    first_scale: u32,
    // The first leaf that may not be wholly there, and one past the last that is there at all.
    first_partial: u32,
    drawn: u32,
    // How many leaves come and go at once.
    window: f32,
    // Factor on every leaf's drawn scale.
    leaf_scale: f32,
    // Number of the instance that tells where the plant was; of motion vectors alone.
    before: u32,
    // How far the picture is shifted, in clip space.
    jitter: vec2<f32>,
}

// The crown: the box around all leaves, drawn or not.
struct Crown {
    center_local: vec3<f32>,
    inverse_half_size: vec3<f32>,
}

struct Material {
    base_color: vec4<f32>,
    // Alpha from which a texel covers; 0 where every one does.
    cutoff: f32,
    layer: u32,
    // Wrap modes along u and v, by number.
    wrap: vec2<u32>,
    is_two_sided: u32,
}

@group(0) @binding(0) var<uniform> crown: Crown;
@group(0) @binding(1) var<storage, read> materials: array<Material>;
@group(0) @binding(2) var textures: texture_2d_array<f32>;
@group(0) @binding(3) var filtering: sampler;
@group(1) @binding(0) var<storage, read> instances: array<Instance>;

// Samples of a pixel; alpha chooses how many of them are covered.
override SAMPLES: u32 = 1u;

// COLORING_PICTURE, or leaves get plain colours that tell something about them.
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

// A corner of a leaf and its normal, wherever the wind has moved them.
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
            // Alpha rises through the cutoff within one pixel.
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

// How much of a leaf is there, by area or by alpha.
fn presence(leaf: u32, instance: Instance) -> f32 {
    let behind = f32(i32(leaf) - i32(instance.active_count));
    let t = clamp((instance.fraction - behind - 0.5) / instance.window + 0.5, 0.0, 1.0);
    return select(t, t * t * (3.0 - 2.0 * t), FADES_SMOOTHLY);
}

// Round(share * SAMPLES) samples. Which ones depends on the leaf: those behind each other add up.
fn covered_samples(share: f32, pattern: u32) -> u32 {
    let count = u32(share * f32(SAMPLES) + 0.5);
    let first = pattern % SAMPLES;
    let run = (1u << count) - 1u;
    return run << first | run >> (SAMPLES - first);
}

// Nothing is there where alpha stays below the cutoff.
fn is_hole(material: Material, uv: vec2<f32>) -> bool {
    return material.cutoff > 0.0 && texel(material, uv).a * material.base_color.a < material.cutoff;
}

fn texel(material: Material, uv: vec2<f32>) -> vec4<f32> {
    let inside = vec2(wrapped(uv.x, material.wrap.x), wrapped(uv.y, material.wrap.y));
    return textureSampleGrad(textures, filtering, inside, material.layer, dpdx(uv), dpdy(uv));
}

// The sampler repeats; the other modes are brought into the texture here.
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
