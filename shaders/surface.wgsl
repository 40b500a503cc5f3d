// Shared by leaf_pass and wood_pass: instances, materials, textures, and the colour of a pixel.
//
// Local space is plant space with its origin at the plant's centre, so that the precision of f32
// does not depend on where a file places the plant.

// What all plants of the frame share. Anchor space is world space with its origin at the frame's
// anchor, a point in view.
struct Frame {
    clip_from_anchor: mat4x4<f32>,
    // In the previous frame, from that frame's anchor space; only used for motion vectors.
    clip_from_anchor_before: mat4x4<f32>,
    light_from_anchor: mat4x4<f32>,
    // Position of the eye in anchor space.
    eye: vec3<f32>,
    // Number of plants; the records of the previous frame follow theirs.
    plants: u32,
    // Jitter of the picture, in clip space.
    jitter: vec2<f32>,
    // Half of the picture's width and height.
    half_size_px: vec2<f32>,
}

// One plant to draw.
struct Instance {
    // Rows of the transform from local space to anchor space.
    anchor_from_local: array<vec4<f32>, 3>,
    active_count: u32,
    // Fractional part of the active count.
    fraction: f32,
    // Number of leaves that are in transition at once.
    window: f32,
    // Factor applied to every leaf's drawn scale.
    leaf_scale: f32,
    // Index of the first of this plant's own drawn scales, or NO_SCALES if they come from the
    // timeline.
    first_scale: u32,
    // The first leaf that may be only partly present; of a plant that is its impostor alone, its
    // seed.
    first_partial: u32,
    // Number of leaves to draw; within the hand-over LEAF_BITS of it, and above them the share of
    // the impostor.
    drawn: u32,
    // Error that the wood is drawn at if its vertices slide; otherwise the least width of a drawn
    // stem. In local space.
    wood_error: f32,
}

// The crown: the box around all leaves, drawn or not.
struct Crown {
    center_local: vec3<f32>,
    inverse_half_size: vec3<f32>,
    // Exponent of the tone of enlarged leaves.
    tone: f32,
    // Mean shaded colour of the leaves, linear.
    mean: vec3<f32>,
}

struct Material {
    base_color: vec4<f32>,
    // Alpha of the full texture at or above which a texel is opaque; 0 if all texels are.
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
@group(1) @binding(2) var<uniform> frame: Frame;

// Samples per pixel; coverage determines how many of them are covered.
override SAMPLES: u32 = 1u;

// COLORING_PICTURE, or a constant that selects unlit diagnostic colours.
override COLORING: u32 = 0u;

struct Surface {
    @builtin(position) clip: vec4<f32>,
    // Interpolated at a covered sample, so that a surface smaller than a pixel is not sampled
    // beside its texture.
    @location(0) @interpolate(perspective, centroid) uv: vec2<f32>,
    @location(1) @interpolate(perspective, centroid) color: vec3<f32>,
    @location(2) @interpolate(perspective, centroid) normal: vec3<f32>,
    @location(3) @interpolate(perspective, centroid) position_local: vec3<f32>,
    @location(4) @interpolate(flat) material: u32,
    @location(5) @interpolate(flat) instance: u32,
    @location(6) @interpolate(flat) leaf: u32,
    // Fraction of the pixel's samples that may be covered.
    @location(7) @interpolate(flat) share: f32,
    // Part of the texture that the surface shows, unscaled: lowest coordinates, width and height.
    @location(8) @interpolate(flat) rect: vec4<f32>,
    // Seed of the surface's partial coverage, like a fraction of 2^32; 0 for wood.
    @location(9) @interpolate(flat) seed: u32,
    // In local space: position of the eye, and unit vectors towards the sun and upwards. They are
    // the same for the whole plant, so vertices compute them.
    @location(10) @interpolate(flat) eye: vec3<f32>,
    @location(11) @interpolate(flat) towards_sun: vec3<f32>,
    @location(12) @interpolate(flat) upwards: vec3<f32>,
    // Fraction of the colour's distance from the plant's mean that is kept, scale, and the point of
    // `rect` that stays in place where an enlarged leaf repeats it, as a fraction; below 0 if it
    // does not.
    @location(13) @interpolate(flat) enlarged: vec4<f32>,
    // In the middle of the pixel, covered or not: uv, and the place on the quad, from 0 to 1 both
    // ways; outside that range for other surfaces. Triangles that meet within a pixel agree there.
    @location(14) @interpolate(perspective, center) middle: vec4<f32>,
}

struct Shaded {
    @location(0) color: vec4<f32>,
    @builtin(sample_mask) samples: u32,
}

fn shaded(surface: Surface, is_leaf: bool) -> Shaded {
    let material = materials[surface.material];
    let on_quad = surface.middle.zw;
    let is_on_quad = all(on_quad >= vec2(0.0)) && all(on_quad <= vec2(1.0));
    let uv = select(surface.uv, surface.middle.xy, is_on_quad);
    let shown = tiled(uv, surface.rect, surface.enlarged.y, surface.enlarged.zw);
    let right = dpdx(surface.middle.xy) * shown.stretch;
    let down = dpdy(surface.middle.xy) * shown.stretch;
    let texel = texel(material, shown.uv, right, down, surface.rect.zw, surface.seed);
    var coverage = texel.coverage * surface.share;
    var dither = texel.dither;
    if surface.share < 1.0 {
        dither = hash(vec3<i32>(floor(surface.position_local / instances[surface.instance].wood_error)));
    }
    if is_leaf {
        coverage *= fade_share(surface.leaf, surface.instance);
    }
    let samples = covered_samples(coverage, dither, surface.seed, SAMPLES) & kept_samples(surface.clip.xy, surface.instance);
    if samples == 0u {
        discard;
    }
    let is_two_sided = is_leaf || material.is_two_sided == 1u;
    let color = surface_color(surface, texel.color * material.base_color.rgb, is_leaf, is_two_sided);
    return Shaded(vec4(encoded(color), 1.0), samples);
}

// Linear colour of a surface whose texture has a colour.
fn surface_color(surface: Surface, texture_color: vec3<f32>, is_leaf: bool, is_two_sided: bool) -> vec3<f32> {
    if COLORING != COLORING_PICTURE {
        return surface.color;
    }
    let lit = Lit(
        surface.normal,
        surface.position_local - surface.eye,
        (surface.position_local - crown.center_local) * crown.inverse_half_size,
        crown.inverse_half_size,
        surface.towards_sun,
        surface.upwards,
        is_leaf,
        is_two_sided,
        sunlit(surface.position_local, surface.instance),
    );
    var color = texture_color * surface.color * reflected(lit);
    if is_leaf {
        color = toned(color, surface);
    }
    return tinted(color, surface.instance);
}

// Colour of a leaf in a diagnostic colouring.
fn diagnostic_color(number: u32, last: u32) -> vec3<f32> {
    switch COLORING {
        case COLORING_FLAT: {
            // Any hash will do; this is Knuth's multiplicative hash.
            let mixed = number * HASH_MULTIPLIER;
            return vec3(f32(mixed >> 24u), f32((mixed >> 16u) & 255u), f32((mixed >> 8u) & 255u)) / 255.0;
        }
        case COLORING_ORDER: {
            // Blue for the leaf that is kept longest, orange for the one that is pruned first.
            return mix(vec3(0.02, 0.1, 0.6), vec3(1.0, 0.5, 0.02), f32(number) / f32(last));
        }
        default: {
            return vec3(0.05, 0.4, 0.05);
        }
    }
}

// Place beside any quad.
const NO_QUAD: vec2<f32> = vec2(-1.0);

fn in_anchor_space(position_local: vec3<f32>, instance: Instance) -> vec3<f32> {
    let rows = instance.anchor_from_local;
    let position = vec4(position_local, 1.0);
    return vec3(dot(rows[0], position), dot(rows[1], position), dot(rows[2], position));
}

// A surface of a plant, with the plant's index, eye and light alone.
fn surface_of(number: u32, instance: Instance) -> Surface {
    var surface: Surface;
    let rows = instance.anchor_from_local;
    // Without the size of the plant, whose powers may leave the range of f32.
    let size = length(rows[0].xyz);
    let x = rows[0].xyz / size;
    let y = rows[1].xyz / size;
    let z = rows[2].xyz / size;
    let adjugate = mat3x3(cross(y, z), cross(z, x), cross(x, y));
    let local_from_world = adjugate * (1.0 / dot(x, adjugate[0]));
    surface.instance = number;
    surface.eye = local_from_world * ((frame.eye - vec3(rows[0].w, rows[1].w, rows[2].w)) / size);
    surface.towards_sun = unit(local_from_world * TOWARDS_SUN);
    surface.upwards = unit(local_from_world[1]);
    return surface;
}

fn transition_of(instance: Instance) -> Transition {
    let drawn = leaves_drawn(instance);
    return Transition(instance.active_count, instance.fraction, instance.window, instance.first_partial, drawn, FADES_SMOOTHLY);
}

// Share of a plant's samples that its impostor takes.
fn far_share(instance: Instance) -> f32 {
    return f32(instance.drawn >> LEAF_BITS) / WHOLE_SHARE;
}

// Whether the surface is transparent here, for passes with one sample per pixel.
fn is_hole(material: Material, uv: vec2<f32>, rect: vec4<f32>, enlarged: vec4<f32>, seed: u32) -> bool {
    let shown = tiled(uv, rect, enlarged.y, enlarged.zw);
    let texel = texel(material, shown.uv, dpdx(uv) * shown.stretch, dpdy(uv) * shown.stretch, rect.zw, seed);
    return texel.coverage + texel.dither < 1.0;
}

// What a cut-out covers of one pixel; see Texel.
struct Cutout {
    coverage: f32,
    dither: f32,
}

// A material's texture at one pixel.
struct Texel {
    color: vec3<f32>,
    // Fraction of the pixel that opaque texels cover.
    coverage: f32,
    // Offset of the threshold that coverage is rounded at: 1/2 where the texture is magnified.
    // Where it is minified, the leaf's seed plus a hash of the texel, so that coverage is right on
    // average and stays in place on the leaf.
    dither: f32,
}

// right, down: change of the texture coordinates from pixel to pixel.
// The full texture's alpha is compared with the cutoff; the alpha of its mip levels is coverage.
fn texel(
    material: Material,
    uv: vec2<f32>,
    right: vec2<f32>,
    down: vec2<f32>,
    uv_size: vec2<f32>,
    seed: u32,
) -> Texel {
    let size = vec2<f32>(textureDimensions(textures));
    let level = mip_level(right * size, down * size, uv_size * size);
    let inside = vec2(wrapped(uv.x, material.wrap.x), wrapped(uv.y, material.wrap.y));
    let full = textureSampleLevel(textures, filtering, inside, material.layer, 0.0).a;
    // Coverage rises from 0 to 1 within one pixel around the cutoff, but is 0 where alpha is 0: the
    // neighbours of a pixel at a card's edge may be sampled beside its picture.
    let widest = 2.0 * min(material.cutoff, 1.0 - material.cutoff);
    let rise = max(min(fwidth(full), widest), 1e-4);
    let smooth_edge = clamp((full - material.cutoff) / rise + 0.5, 0.0, 1.0);
    let edge = select(select(0.0, 1.0, full >= material.cutoff), smooth_edge, SAMPLES > 1u);
    let filtered = textureSampleLevel(textures, filtering, inside, material.layer, max(level, 0.0));
    var coverage = cutout_coverage(full, edge, filtered.a, level);
    // No texel reaches a cutoff above 1.
    if material.cutoff > 1.0 {
        coverage = 0.0;
    }
    let dither = cutout_dither(uv * size, level, seed);
    // Texels are multiplied by alpha.
    let color = filtered.rgb / max(filtered.a, LEAST_ALPHA);
    return Texel(color, select(1.0, coverage, material.cutoff > 0.0), dither);
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
