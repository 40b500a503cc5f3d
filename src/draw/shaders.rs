//! WGSL of every pass, assembled from the files in `shaders` and the constants that they share with
//! Rust.
//!
//! An enabled effect adds its part. A disabled one is replaced by a function that does nothing, so
//! that neither its arithmetic nor its bindings are in the shader.

use super::{
    cards::{HAS_NEXT, TEXELS_PER_WORD},
    handover::WHOLE_SHARE,
    landscape::{FADES_OVER, FLOOR_FROM, ZENITH_FROM},
    light::{FLOOR, HORIZON, HORIZON_HEIGHT, LEAN, Lighting, THROUGH, THROUGH_TINT, WRAP, ZENITH},
    look::{Coloring, Look, Variant},
    records::{
        HALF_STEPS, LEAF_BITS, LEAST_HALF, LEAST_WIDTH, LEVELS_ACROSS, NO_EXTRA, NO_NORMAL, NO_SCALES, RUN_QUADS,
        TRIMMED_CORNERS, WIDTH_STEPS,
    },
    shader::{ShaderSource, wrap_number},
    sprite::{DEEP_FROM_PX, DEPTH_STEPS, LEAST_APPROACH, LEAST_PX, MOST_PULL, SHARPER_LEVELS},
    sun::DEPTH_RADII,
};
use crate::{
    crown::{INNERMOST, INNERMOST_RADIUS},
    effects::{
        sky::{LOWEST, LOWEST_CHROMATICITY_Y, RGB_FROM_XYZ},
        wind,
    },
    hash::HASH_MULTIPLIER,
    material::Wrap,
    model::EMPTY,
    wood::{LEAST_SWELL, MAX_SLIDES, NO_SWELL, RIBBON, SLIDE, SWELL_STEPS, SWELLS},
};

/// Mip levels by which textures are sampled finer than a texel per pixel. Cards of one cluster are
/// all dense in the middle; with texels of a quarter of a pixel, they are not blurred into each
/// other: a crown of 322 cards at 96 radii covers 6 to 8 % too much, with whole pixels 14 %.
const FINER_LEVELS: f32 = 2.0;

/// Texels in a row of the texture of limbs.
pub(super) const LIMB_COLUMNS: u32 = 256;

/// Vertices of the passes that cover the whole picture.
const COVER: &str = include_str!("../../shaders/cover.wgsl");

/// What every pass knows of a leaf, without bindings.
const LEAF: &str = include_str!("../../shaders/leaf.wgsl");
/// Timeline look-up over `events`.
const TIMELINE: &str = include_str!("../../shaders/timeline.wgsl");
/// Growth by tiling, without bindings.
const TILES: &str = include_str!("../../shaders/tiles.wgsl");
/// The wind over `sways` and `limbs`.
const WIND: &str = include_str!("../../shaders/wind.wgsl");
/// What a ray sees in the pictures of an impostor, over `impostor`, `colors` and `surfaces`.
const FRAMES: &str = include_str!("../../shaders/impostor_frames.wgsl");
/// Bindings of `sways` and `limbs`.
const WIND_BINDINGS: &str = include_str!("../../shaders/wind_bindings.wgsl");

/// Constants and functions for the shaders of an engine that draws an [`Upload`](super::Upload)
/// itself, without bindings: `scale_in`, the drawn scale of a leaf during a transition; `tiled`,
/// the texture coordinates of a leaf that repeats its picture; `cutout_coverage` and
/// `cutout_dither`, the alpha test of minified cut-outs; `leaf_turn`, `moved_leaf` and
/// `stem_carry`, the wind.
///
/// Declare beside them, at bindings of your own:
/// ```wgsl
/// var<storage, read> events: array<Event>; // `Upload::events`
/// var<storage, read> sways: array<Sway>;   // a `Sway` for each instance
/// var limbs: texture_2d<u32>;              // `limb_texels`, as Rgba32Uint
/// ```
pub fn engine_parts() -> String {
    leaf_constants(ShaderSource::new()).with_part(LEAF).with_part(TILES).with_part(TIMELINE).with_body(WIND)
}

/// Constants and functions for the shaders of an engine that draws impostors itself, without
/// bindings: `around`, the pictures around a direction; `add_picture`, what a ray sees in one;
/// `moved_wood` and `sway_reach`, the wind, by which the pictures bend with the trunk.
///
/// Declare beside them, at bindings of your own:
/// ```wgsl
/// var<uniform> impostor: Impostor;     // an `ImpostorRecord`
/// var colors: texture_2d_array<f32>;   // `PageLevel::color`, as Rgba8UnormSrgb
/// var surfaces: texture_2d_array<f32>; // `PageLevel::surface`, as Rgba8Unorm
/// var clamping: sampler;
/// var<storage, read> sways: array<Sway>; // a `Sway` for each instance
/// var limbs: texture_2d<u32>;            // need not be bound: limbs move leaves and wood alone
/// ```
pub fn impostor_parts() -> String {
    sprite_constants(leaf_constants(ShaderSource::new())).with_part(LEAF).with_part(FRAMES).with_body(WIND)
}

/// WGSL of the leaf pass.
pub fn leaf_pass(look: &Look, variant: Variant) -> String {
    let parts = [TIMELINE, include_str!("../../shaders/trimmed.wgsl"), include_str!("../../shaders/leaf_pass.wgsl")];
    plant(&parts.concat(), look, variant)
}

/// WGSL of the leaf pass into the shadow map.
pub fn leaf_shadow(look: &Look, variant: Variant) -> String {
    leaf_pass(look, variant) + include_str!("../../shaders/shadow_pass.wgsl")
}

/// WGSL of the leaf pass for motion vectors.
pub fn leaf_motion(look: &Look, variant: Variant) -> String {
    leaf_pass(look, variant)
        + include_str!("../../shaders/motion_pass.wgsl")
        + include_str!("../../shaders/leaf_motion.wgsl")
}

/// WGSL of the cards of clusters.
pub fn card_pass(look: &Look, variant: Variant) -> String {
    plant(&[TIMELINE, include_str!("../../shaders/card_pass.wgsl")].concat(), look, variant)
}

/// WGSL of the cards of clusters into the shadow map.
pub fn card_shadow(look: &Look, variant: Variant) -> String {
    card_pass(look, variant) + include_str!("../../shaders/card_shadow.wgsl")
}

/// WGSL of the cards of clusters for motion vectors.
pub fn card_motion(look: &Look, variant: Variant) -> String {
    card_pass(look, variant)
        + include_str!("../../shaders/motion_pass.wgsl")
        + include_str!("../../shaders/card_motion.wgsl")
}

/// WGSL of the wood pass, of wood whose vertices slide or of other wood.
pub fn wood_pass(look: &Look, variant: Variant, slides: bool) -> String {
    let vertices = match slides {
        true => include_str!("../../shaders/wood_slides.wgsl"),
        false => include_str!("../../shaders/wood_stems.wgsl"),
    };
    plant(&[vertices, include_str!("../../shaders/wood_pass.wgsl")].concat(), look, variant)
}

/// WGSL of the wood pass into the shadow map.
pub fn wood_shadow(look: &Look, variant: Variant, slides: bool) -> String {
    wood_pass(look, variant, slides) + include_str!("../../shaders/shadow_pass.wgsl")
}

/// WGSL of the wood pass for motion vectors.
pub fn wood_motion(look: &Look, variant: Variant, slides: bool) -> String {
    wood_pass(look, variant, slides)
        + include_str!("../../shaders/motion_pass.wgsl")
        + include_str!("../../shaders/wood_motion.wgsl")
}

/// WGSL of the impostors. Only the wind and the hand-over of `variant` count.
pub fn impostor_pass(look: &Look, variant: Variant) -> String {
    plant(&[FRAMES, include_str!("../../shaders/impostor_pass.wgsl")].concat(), look, variant)
}

/// WGSL of the impostors into the shadow map.
pub fn impostor_shadow(look: &Look, variant: Variant) -> String {
    impostor_pass(look, variant) + include_str!("../../shaders/impostor_shadow.wgsl")
}

/// WGSL of the impostors for motion vectors.
pub fn impostor_motion(look: &Look, variant: Variant) -> String {
    impostor_pass(look, variant) + include_str!("../../shaders/impostor_motion.wgsl")
}

/// WGSL of the plain backdrop.
pub fn backdrop_pass() -> String {
    light_constants(ShaderSource::new(), &Lighting::default())
        .with_part(include_str!("../../shaders/light.wgsl"))
        .with_part(COVER)
        .with_body(include_str!("../../shaders/backdrop_pass.wgsl"))
}

/// WGSL of the motion vectors of sky and ground.
pub fn landscape_motion(has_ground: bool) -> String {
    let source = ShaderSource::new().constant_bool("HAS_GROUND", has_ground);
    source.with_part(COVER).with_body(include_str!("../../shaders/landscape_motion.wgsl"))
}

/// WGSL of the sky and the level ground.
pub fn landscape_pass(look: &Look) -> String {
    landscape(look).with_body(include_str!("../../shaders/landscape_pass.wgsl"))
}

/// WGSL of ground with heights, in the picture, the shadow map and the motion vectors.
pub fn ground_pass(look: &Look) -> String {
    landscape(look)
        .constant_f32("FADES_OVER", FADES_OVER)
        .with_part(include_str!("../../shaders/landscape_pass.wgsl"))
        .with_body(include_str!("../../shaders/ground_pass.wgsl"))
}

/// Constants and parts of what lies behind plants.
fn landscape(look: &Look) -> ShaderSource {
    let shadow: [&str; 2] = match look.effects.shadow {
        Some(_) => [
            include_str!("../../shaders/shadow.wgsl"),
            "fn ground_sunlit(from_eye: vec3<f32>) -> f32 {\n    \
             return shadow_share((landscape.light_from_eye * vec4(from_eye, 1.0)).xyz);\n}\n",
        ],
        None => ["", "fn ground_sunlit(from_eye: vec3<f32>) -> f32 { return 1.0; }\n"],
    };
    let [x, y, z] = [RGB_FROM_XYZ.x_axis, RGB_FROM_XYZ.y_axis, RGB_FROM_XYZ.z_axis]
        .map(|axis| format!("vec3({:?}f, {:?}f, {:?}f)", axis.x, axis.y, axis.z));
    shadow_constants(light_constants(ShaderSource::new(), &look.lighting()), look)
        .constant_bool("HAS_SKY", look.effects.sky.is_some())
        .constant_bool("HAS_GROUND", look.ground.is_some())
        .constant_f32("LOWEST", LOWEST)
        .constant_f32("LOWEST_CHROMATICITY_Y", LOWEST_CHROMATICITY_Y)
        .constant_f32("ZENITH_FROM", ZENITH_FROM)
        .constant_f32("FLOOR_FROM", FLOOR_FROM)
        .with_part(&format!("const RGB_FROM_XYZ: mat3x3<f32> = mat3x3({x}, {y}, {z});\n"))
        .with_part(include_str!("../../shaders/light.wgsl"))
        .with_part(shadow[0])
        .with_part(shadow[1])
        .with_part(COVER)
}

/// Shadow bias along the light, in texels of the shadow map: a surface this far behind the stored
/// depth is still lit. Half the diagonal of the filter's square, of 3 x 3 texels at softness 1, on
/// a surface that slopes at 45 degrees.
const BIAS_TEXELS: f32 = 1.5;

/// Adds the constants of `shadow.wgsl`.
fn shadow_constants(source: ShaderSource, look: &Look) -> ShaderSource {
    let Some(shadow) = look.effects.shadow else { return source };
    let texel = 1.0 / shadow.resolution as f32;
    // The map is two radii wide.
    let radii = BIAS_TEXELS * (1.0 + shadow.softness) * texel * 2.0;
    let bias = radii / DEPTH_RADII as f32;
    source.constant_f32("SHADOW_STEP", shadow.softness * texel).constant_f32("SHADOW_BIAS", bias)
}

/// Assembles a pass that draws plants: the shared constants and parts, then `body`.
fn plant(body: &str, look: &Look, variant: Variant) -> String {
    let part = |is_on: bool, on: &'static str, off: &'static str| if is_on { on } else { off };
    let has_shadow = look.effects.shadow.is_some();
    let source = shadow_constants(light_constants(ShaderSource::new(), &look.lighting()), look);
    sprite_constants(leaf_constants(source))
        .constant_u32("WRAP_MIRROR", wrap_number(Wrap::Mirror))
        .constant_u32("WRAP_CLAMP", wrap_number(Wrap::Clamp))
        .constant_f32("LEAST_ALPHA", 1.0 / 255.0)
        .constant_u32("NO_SCALES", NO_SCALES)
        .constant_vec3("TOWARDS_SUN", look.lighting().towards_sun.normalize_or_zero())
        .constant_u32("COLORING_PICTURE", Coloring::Picture.number())
        .constant_u32("COLORING_FLAT", Coloring::Flat.number())
        .constant_u32("COLORING_ORDER", Coloring::PruneOrder.number())
        .constant_u32("COLORING_PARTS", Coloring::Parts.number())
        .constant_u32("RUN_QUADS", RUN_QUADS)
        .constant_u32("TRIMMED_CORNERS", TRIMMED_CORNERS)
        .constant_u32("LEAF_BITS", LEAF_BITS)
        .constant_u32("HAS_NEXT", HAS_NEXT)
        .constant_u32("TEXELS_PER_WORD", TEXELS_PER_WORD)
        .constant_u32("EMPTY_TEXEL", EMPTY.into())
        .constant_u32("NO_EXTRA", NO_EXTRA)
        .constant_u32("NO_NORMAL", NO_NORMAL)
        .constant_f32("LEAST_WIDTH", LEAST_WIDTH)
        .constant_f32("WIDTH_STEPS", WIDTH_STEPS)
        .constant_f32("LEAST_HALF", LEAST_HALF)
        .constant_f32("HALF_STEPS", HALF_STEPS)
        .constant_f32("RIBBON", RIBBON)
        .constant_u32("MAX_SLIDES", MAX_SLIDES)
        .constant_f32("SLIDE", SLIDE)
        .constant_u32("SWELLS", SWELLS as u32)
        .constant_f32("LEAST_SWELL", LEAST_SWELL)
        .constant_f32("NO_SWELL", f32::from(NO_SWELL))
        .constant_f32("SWELL_STEPS", SWELL_STEPS)
        .constant_bool("FADES_BY_ALPHA", look.fades_by_alpha())
        .constant_bool("FADES_SMOOTHLY", look.effects.fade.is_some_and(|fade| fade.smooth))
        .constant_f32("WHOLE_SHARE", WHOLE_SHARE as f32)
        .with_part(include_str!("../../shaders/light.wgsl"))
        .with_part(LEAF)
        .with_part(include_str!("../../shaders/surface.wgsl"))
        .with_part(include_str!("../../shaders/packing.wgsl"))
        .with_part(part(variant.alpha, include_str!("../../shaders/fade.wgsl"), NO_FADE))
        .with_part(part(variant.handover, include_str!("../../shaders/handover.wgsl"), NO_HANDOVER))
        .with_part(tone(variant))
        .with_part(part(look.has_tints(), include_str!("../../shaders/tint.wgsl"), NO_TINT))
        .with_part(part(variant.tiles, TILES, NO_TILES))
        .with_part(part(variant.wind, WIND_BINDINGS, ""))
        .with_part(part(variant.wind, WIND, NO_WIND))
        .with_part(part(has_shadow, include_str!("../../shaders/shadow.wgsl"), ""))
        .with_part(part(has_shadow, include_str!("../../shaders/shadowed.wgsl"), NO_SHADOW))
        .with_body(body)
}

const NO_SHADOW: &str = "fn sunlit(position_local: vec3<f32>, instance: u32) -> f32 { return 1.0; }\n";
const NO_TINT: &str = "fn tinted(color: vec3<f32>, instance: u32) -> vec3<f32> { return color; }\n";
const NO_HANDOVER: &str = "\
fn kept_samples(pixel: vec2<f32>, instance: u32) -> u32 { return 0xffffffffu; }
fn leaves_drawn(instance: Instance) -> u32 { return instance.drawn; }
";
const NO_FADE: &str = "fn fade_share(leaf: u32, instance: u32) -> f32 { return 1.0; }\n";
const NO_TILES: &str = "\
fn is_tiled(scale: f32, anchor: vec2<f32>) -> bool { return false; }
fn tiled(uv: vec2<f32>, rect: vec4<f32>, scale: f32, anchor: vec2<f32>) -> Shown { return Shown(uv, vec2(1.0)); }
";
const NO_TONE: &str = "\
fn kept_at(scale: f32) -> f32 { return 1.0; }
fn toned(color: vec3<f32>, surface: Surface) -> vec3<f32> { return color; }
";
const NO_WIND: &str = "\
struct Carry { nothing: u32 }
struct LeafTurn { nothing: u32 }
fn sway_reach(instance: u32) -> f32 { return 0.0; }
fn moved_wood(rest: vec3<f32>, instance: u32) -> vec3<f32> { return rest; }
fn moved_leaf(pivot: vec3<f32>, offset: vec3<f32>, normal: vec3<f32>, turn: LeafTurn) -> Moved {
    return Moved(pivot + offset, normal);
}
fn carried_by(carry: Carry, point: vec3<f32>) -> vec3<f32> { return vec3(0.0); }
fn turned_by(carry: Carry, v: vec3<f32>) -> vec3<f32> { return v; }
fn still_carry(point: vec3<f32>, instance: u32) -> Carry { return Carry(0u); }
fn stem_carry(stem: u32, point: vec3<f32>, instance: u32) -> Carry { return Carry(0u); }
fn leaf_turn(leaf: u32, pivot: vec3<f32>, instance: u32) -> LeafTurn { return LeafTurn(0u); }
";

/// What moves shaded colours of leaves towards their mean.
fn tone(variant: Variant) -> &'static str {
    match variant {
        Variant { tone: true, .. } => include_str!("../../shaders/tone.wgsl"),
        Variant { contrast: true, .. } => include_str!("../../shaders/contrast.wgsl"),
        _ => NO_TONE,
    }
}

/// Adds the constants of `leaf.wgsl` and `wind.wgsl`.
fn leaf_constants(source: ShaderSource) -> ShaderSource {
    source
        .constant_f32("FINER_LEVELS", FINER_LEVELS)
        .constant_f32("LEVELS_ACROSS", LEVELS_ACROSS)
        .constant_u32("HASH_MULTIPLIER", HASH_MULTIPLIER)
        .constant_vec3("BRANCH_WAVE_ALONG", wind::BRANCH_WAVES[0])
        .constant_vec3("BRANCH_WAVE_UP", wind::BRANCH_WAVES[1])
        .constant_f32("BRANCH_LIFT", wind::BRANCH_LIFT)
        .constant_f32("BEND_DESCENT", wind::BEND_DESCENT)
        .constant_f32("LIMB_LEAN", wind::LIMB_LEAN)
        .constant_u32("LIMB_COLUMNS", LIMB_COLUMNS)
        .constant_f32("FLUTTER_SHARE_A", wind::FLUTTER_SHARES[0])
        .constant_f32("FLUTTER_SHARE_B", wind::FLUTTER_SHARES[1])
        .constant_f32("FLUTTER_TILT", wind::FLUTTER_TILT)
        .constant_u32("PHASE_STEPS", wind::PHASE_STEPS)
}

/// Adds the constants of impostors.
fn sprite_constants(source: ShaderSource) -> ShaderSource {
    source
        .constant_f32("DEEP_FROM_PX", DEEP_FROM_PX)
        .constant_u32("DEPTH_STEPS", DEPTH_STEPS)
        .constant_f32("LEAST_APPROACH", LEAST_APPROACH)
        .constant_f32("LEAST_PX", LEAST_PX)
        .constant_f32("MOST_PULL", MOST_PULL)
        .constant_f32("SHARPER_LEVELS", SHARPER_LEVELS)
}

/// Adds the constants of `light.wgsl`.
fn light_constants(source: ShaderSource, lighting: &Lighting) -> ShaderSource {
    let through = lighting.translucency;
    source
        .constant_vec3("SUN", lighting.sun)
        .constant_vec3("SKY", lighting.sky)
        .constant_vec3("GROUND", lighting.ground)
        .constant_f32("WRAP_LIGHT", WRAP)
        .constant_vec3("THROUGH", THROUGH_TINT * through.map_or(THROUGH, |through| through.strength))
        .constant_bool("TRANSLUCENCY", through.is_some())
        .constant_f32("GLOW", through.map_or(0.0, |through| through.glow))
        .constant_f32("GLOW_SHARPNESS", through.map_or(1.0, |through| through.sharpness))
        .constant_f32("INNERMOST", INNERMOST)
        .constant_f32("INNERMOST_RADIUS", INNERMOST_RADIUS)
        .constant_f32("LEAN", LEAN)
        .constant_bool("CROWN_NORMALS", lighting.crown_blend.is_some())
        .constant_f32("CROWN_BLEND", lighting.crown_blend.unwrap_or(0.0))
        .constant_vec3("HORIZON", HORIZON)
        .constant_vec3("ZENITH", ZENITH)
        .constant_vec3("FLOOR", FLOOR)
        .constant_f32("HORIZON_HEIGHT", HORIZON_HEIGHT)
}
