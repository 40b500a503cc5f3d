//! What plants look like, and which shaders that takes.
//!
//! Shaders are put together from parts. An effect that is called for adds its part; in place of one that is not stands a
//! function that does nothing, so that neither its arithmetic nor its bindings are in the shader. Within a scene each draw
//! takes the [`Variant`] with what its plants need in this frame and no more.

use super::{
    landscape_pass::{Ground, Landscape},
    light::{self, Lighting},
    shader::{ShaderSource, wrap_number},
    surface::{Coloring, NO_SCALES, RUN_INDICES},
};
use crate::{
    effects::{Effects, FadeBy, wind},
    material::Wrap,
};

/// What a renderer's plants look like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// What leaves are coloured by.
    pub coloring: Coloring,
    /// What is simulated and shaded beyond the plain prefix.
    pub effects: Effects,
    /// Sun and sky.
    pub lighting: Lighting,
    /// The ground that plants stand on, if it is drawn.
    pub ground: Option<Ground>,
    /// Thickness in pixels below which a stem is not drawn; 0 draws all wood.
    pub thinnest_px: f32,
}

impl Default for Look {
    /// Plain plants; stems are drawn down to half a pixel.
    fn default() -> Self {
        Self {
            coloring: Coloring::default(),
            effects: Effects::default(),
            lighting: Lighting::default(),
            ground: None,
            thinnest_px: 0.5,
        }
    }
}

impl Look {
    /// Leaves that fade do so by alpha.
    pub(super) fn fades_by_alpha(&self) -> bool {
        self.effects.fade.is_some_and(|fade| fade.by == FadeBy::Alpha)
    }

    /// Sun and sky with the effects on them.
    pub fn lighting(&self) -> Lighting {
        self.lighting.with_effects(&self.effects)
    }

    /// What lies behind the plants, where it is more than a plain backdrop.
    pub fn landscape(&self) -> Option<Landscape> {
        let daylight = self.effects.sky.map(|sky| sky.under(self.lighting.towards_sun));
        let lighting = self.lighting();
        (daylight.is_some() || self.ground.is_some()).then_some(Landscape { daylight, ground: self.ground, lighting })
    }
}

/// What the plants of one draw need in this frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Variant {
    /// They move in the wind.
    pub wind: bool,
    /// Their shaded colours are drawn to the mean.
    pub contrast: bool,
    /// Some leaves of the draw are there in part, by alpha.
    pub alpha: bool,
}

impl Variant {
    /// Every combination.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..8).map(|bits| Self { wind: bits & 1 != 0, contrast: bits & 2 != 0, alpha: bits & 4 != 0 })
    }

    /// Its shader reads buffers of effects.
    fn has_bindings(self) -> bool {
        self.wind || self.contrast
    }
}

/// Of a renderer's bind group layouts those that a variant binds.
pub(super) fn bound<'a>(
    layouts: &'a [wgpu::BindGroupLayout],
    look: &Look,
    variant: Variant,
) -> Vec<Option<&'a wgpu::BindGroupLayout>> {
    let count = if variant.has_bindings() || look.effects.shadow.is_some() { layouts.len() } else { 2 };
    layouts[..count].iter().map(Some).collect()
}

/// What `shadow.wgsl` is told.
pub(super) fn shadow_constants(source: ShaderSource, look: &Look) -> ShaderSource {
    let Some(shadow) = look.effects.shadow else { return source };
    let texel = 1.0 / shadow.resolution as f32;
    // So many pixels of the map along the light, of its depth.
    let bias = (1.5 + 1.5 * shadow.softness) * texel * 2.0 / 4.0;
    source.constant_f32("SHADOW_STEP", shadow.softness * texel).constant_f32("SHADOW_BIAS", bias)
}

/// The shader `body` of a pass that draws plants, with everything that it shares with others in front.
pub(super) fn wgsl(body: &str, look: &Look, variant: Variant) -> String {
    let part = |is_on: bool, on: &'static str, off: &'static str| if is_on { on } else { off };
    let has_shadow = look.effects.shadow.is_some();
    shadow_constants(light::constants(ShaderSource::new(), &look.lighting()), look)
        .constant_u32("WRAP_MIRROR", wrap_number(Wrap::Mirror))
        .constant_u32("WRAP_CLAMP", wrap_number(Wrap::Clamp))
        .constant_u32("NO_SCALES", NO_SCALES)
        .constant_u32("COLORING_PICTURE", Coloring::Picture.number())
        .constant_u32("COLORING_FLAT", Coloring::Flat.number())
        .constant_u32("COLORING_ORDER", Coloring::PruneOrder.number())
        .constant_u32("RUN_INDICES", RUN_INDICES)
        .constant_bool("FADES_BY_ALPHA", look.fades_by_alpha())
        .constant_bool("FADES_SMOOTHLY", look.effects.fade.is_some_and(|fade| fade.smooth))
        .constant_vec3("BRANCH_WAVE_ALONG", wind::BRANCH_WAVES[0])
        .constant_vec3("BRANCH_WAVE_UP", wind::BRANCH_WAVES[1])
        .constant_f32("BRANCH_LIFT", wind::BRANCH_LIFT)
        .with_part(include_str!("../../shaders/light.wgsl"))
        .with_part(include_str!("../../shaders/surface.wgsl"))
        .with_part(part(variant.alpha, include_str!("../../shaders/fade.wgsl"), NO_FADE))
        .with_part(part(variant.contrast, include_str!("../../shaders/contrast.wgsl"), NO_CONTRAST))
        .with_part(part(variant.wind, include_str!("../../shaders/wind.wgsl"), NO_WIND))
        .with_part(part(has_shadow, include_str!("../../shaders/shadow.wgsl"), ""))
        .with_part(part(has_shadow, include_str!("../../shaders/shadowed.wgsl"), NO_SHADOW))
        .with_body(body)
}

const NO_SHADOW: &str = "fn sunlit(position_local: vec3<f32>, instance: u32) -> f32 { return 1.0; }\n";
const NO_FADE: &str = "fn fade_share(leaf: u32, instance: Instance) -> f32 { return 1.0; }\n";
const NO_CONTRAST: &str = "fn toned(color: vec3<f32>, instance: u32) -> vec3<f32> { return color; }\n";
const NO_WIND: &str = "\
fn moved_wood(rest: vec3<f32>, instance: u32) -> vec3<f32> { return rest; }
fn moved_leaf(pivot: vec3<f32>, offset: vec3<f32>, normal: vec3<f32>, leaf: u32, instance: u32) -> Moved {
    return Moved(pivot + offset, normal);
}
";
