//! Lighting of surfaces: one sun, a sky, and a crown that shades its own interior.
//!
//! Meant to make crowns readable, not to be physically accurate: leaves are lit on both sides and
//! let some light through, and light fades towards the centre of the crown in place of shadows. The
//! crown is the box around *all* leaves, so that a model is lit the same at any active count.
//!
//! Limits: no cast shadows (the effect `shadow` adds them), no specular reflection.

use crate::effects::{Effects, Translucency, sky::LUMINANCE};
use glam::Vec3;

/// Light of the sun, of the sky straight above and of the ground below, linear.
const SUN: Vec3 = Vec3::new(1.75, 1.65, 1.4);
const SKY: Vec3 = Vec3::new(0.42, 0.50, 0.62);
const GROUND: Vec3 = Vec3::new(0.16, 0.16, 0.12);
/// Direction towards the sun: high, in front (+Z) and to the right, so that pictures taken from +Z
/// are lit from the front.
pub(crate) const TOWARDS_SUN: Vec3 = Vec3::new(0.48, 0.72, 0.50);
/// Wrap lighting: how far beyond edge-on, as a cosine, a leaf still receives direct light.
pub(crate) const WRAP: f32 = 0.25;
/// Fraction of sunlight that passes through a leaf, and its tint.
pub(crate) const THROUGH: f32 = 0.45;
pub(crate) const THROUGH_TINT: Vec3 = Vec3::new(1.0, 1.05, 0.55);
/// Weight of the crown's outward direction that is added to a leaf's normal; it softens the noise
/// of thousands of cards.
pub(crate) const LEAN: f32 = 0.45;
/// Colours of the backdrop, linear, and the height of its horizon as a fraction of the picture's.
pub(crate) const HORIZON: Vec3 = Vec3::new(0.80, 0.86, 0.90);
pub(crate) const ZENITH: Vec3 = Vec3::new(0.36, 0.55, 0.80);
pub(crate) const FLOOR: Vec3 = Vec3::new(0.62, 0.62, 0.56);
pub(crate) const HORIZON_HEIGHT: f32 = 0.22;

/// Sun and sky of a scene, and how they light leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// Direction towards the sun, in world space; of any length but 0.
    pub towards_sun: Vec3,
    /// Light of the sun, linear.
    pub sun: Vec3,
    /// Light of the sky straight above, linear.
    pub sky: Vec3,
    /// Light reflected upwards by the ground, linear.
    pub ground: Vec3,
    /// Blend of leaf normals with the crown's; `None` if the effect `crown_normals` is off.
    pub crown_blend: Option<f32>,
    /// Light that passes through leaves; `None` for the small default, if the effect `translucency`
    /// is off.
    pub translucency: Option<Translucency>,
}

impl Default for Lighting {
    /// High sun from the front and the right, clear sky, no effects.
    fn default() -> Self {
        Self { towards_sun: TOWARDS_SUN, sun: SUN, sky: SKY, ground: GROUND, crown_blend: None, translucency: None }
    }
}

impl Lighting {
    /// Applies the enabled lighting effects.
    pub fn with_effects(self, effects: &Effects) -> Self {
        let crown_blend = effects.crown_normals.map(|normals| normals.blend);
        let shaded = Self { crown_blend, translucency: effects.translucency, ..self };
        let Some(sky) = effects.sky else { return shaded };
        let daylight = sky.under(self.towards_sun);
        let sun = self.sun * daylight.sun;
        let skylight = daylight.skylight() * luminance(self.sky);
        // The ground reflects light in proportion to the light that it receives.
        let height = |lighting: &Self| lighting.towards_sun.normalize_or_zero().y.max(0.0);
        let usual = luminance(SUN * height(&Self::default()) + SKY);
        let ground = self.ground * (luminance(sun * height(&self) + skylight) / usual);
        Self { sun, sky: skylight, ground, ..shaded }
    }

    /// Light that ground of some linear colour, with a normal of unit length, reflects where the
    /// sun shines on it.
    pub fn on_ground(&self, albedo: Vec3, normal: Vec3) -> Vec3 {
        let cosine = normal.dot(self.towards_sun.normalize_or_zero()).max(0.0);
        albedo * (self.sun * cosine + self.ground.lerp(self.sky, normal.y * 0.5 + 0.5))
    }
}

/// Luminance of a linear colour.
pub(crate) fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::from(LUMINANCE))
}
