//! How a surface is lit: one sun, a sky, and a crown that shades its own inside.
//!
//! Meant to make crowns readable, not to be measured: leaves take light on both sides and let some through, and light
//! fades towards the crown's middle in place of shadows. The crown is the box around *all* leaves, so that a model looks
//! the same lit at any number of active leaves.
//!
//! Limits: no cast shadows, no specular reflection.

use crate::{
    bounds::Aabb,
    crown::{openness, smoothstep},
    effects::{Effects, Translucency},
};
use glam::{DAffine3, DVec3, Vec3};

/// Light of the sun, of the sky straight above and of the ground below, linear.
const SUN: Vec3 = Vec3::new(1.75, 1.65, 1.4);
const SKY: Vec3 = Vec3::new(0.42, 0.50, 0.62);
const GROUND: Vec3 = Vec3::new(0.16, 0.16, 0.12);
/// Where the sun stands: high, ahead of +Z and to the right, so that pictures from +Z are lit from the front.
pub(super) const TOWARDS_SUN: Vec3 = Vec3::new(0.48, 0.72, 0.50);
/// How far light reaches around a leaf's edge-on position.
const WRAP: f32 = 0.25;
/// Share of the sun's light that shines through a leaf, and its tint.
const THROUGH: f32 = 0.45;
const THROUGH_TINT: Vec3 = Vec3::new(1.0, 1.05, 0.55);
/// How much a leaf's normal leans outwards from the crown: softens the noise of thousands of cards.
const LEAN: f32 = 0.45;
/// The backdrop's colours, linear, and at which part of its height the horizon lies.
pub(super) const HORIZON: Vec3 = Vec3::new(0.80, 0.86, 0.90);
pub(super) const ZENITH: Vec3 = Vec3::new(0.36, 0.55, 0.80);
pub(super) const FLOOR: Vec3 = Vec3::new(0.62, 0.62, 0.56);
const HORIZON_HEIGHT: f32 = 0.22;

/// Sun and sky of a scene, and how leaves take their light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// Towards the sun, in the world; any length but 0.
    pub towards_sun: Vec3,
    /// Light of the sun, linear.
    pub sun: Vec3,
    /// Light of the sky straight above, linear.
    pub sky: Vec3,
    /// Light that the ground sends up, linear.
    pub ground: Vec3,
    /// Blend of leaves' normals with the crown's, where that is called for.
    pub crown_blend: Option<f32>,
    /// Light through leaves, where more than a little is called for.
    pub translucency: Option<Translucency>,
}

impl Default for Lighting {
    /// High sun from the front and the right, clear sky, no effects.
    fn default() -> Self {
        Self { towards_sun: TOWARDS_SUN, sun: SUN, sky: SKY, ground: GROUND, crown_blend: None, translucency: None }
    }
}

impl Lighting {
    /// The same sun and sky with the effects on light that are on.
    pub fn with_effects(self, effects: &Effects) -> Self {
        let crown_blend = effects.crown_normals.map(|normals| normals.blend);
        let shaded = Self { crown_blend, translucency: effects.translucency, ..self };
        let Some(sky) = effects.sky else { return shaded };
        let daylight = sky.under(self.towards_sun);
        let sun = self.sun * daylight.sun;
        let skylight = daylight.skylight() * luminance(self.sky);
        // The ground sends back what it gets.
        let height = |lighting: &Self| lighting.towards_sun.normalize_or_zero().y.max(0.0);
        let usual = luminance(SUN * height(&Self::default()) + SKY);
        let ground = self.ground * (luminance(sun * height(&self) + skylight) / usual);
        Self { sun, sky: skylight, ground, ..shaded }
    }
}

/// The constants for `light.wgsl`, which does the same on the GPU.
#[cfg(feature = "render")]
pub(super) fn constants(source: super::shader::ShaderSource, lighting: &Lighting) -> super::shader::ShaderSource {
    use crate::crown::{INNERMOST, INNERMOST_RADIUS};
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

/// The light on one plant of a picture. Everything is in the plant's space.
pub(super) struct Light {
    pub(super) crown_center_from_eye: Vec3,
    /// One over half the crown's extent along each axis.
    pub(super) inverse_half_size: Vec3,
    /// Unit vectors.
    towards_sun: Vec3,
    upwards: Vec3,
    lighting: Lighting,
}

impl Light {
    /// `crown` is the box around all leaves, in the plant's space.
    pub(super) fn new(crown: &Aabb, eye: DVec3, lighting: &Lighting) -> Self {
        let half_size = (crown.size() * 0.5).max(Vec3::splat(f32::MIN_POSITIVE));
        let inverse = half_size.recip();
        Self {
            crown_center_from_eye: (crown.center() - eye).as_vec3(),
            inverse_half_size: if inverse.is_finite() && !crown.is_empty() { inverse } else { Vec3::ZERO },
            towards_sun: lighting.towards_sun.normalize_or_zero(),
            upwards: Vec3::Y,
            lighting: *lighting,
        }
    }

    /// The same light for a plant that stands turned.
    pub(super) fn turned(self, plant_from_world: &DAffine3) -> Self {
        let turned =
            |direction: Vec3| plant_from_world.transform_vector3(direction.as_dvec3()).normalize_or_zero().as_vec3();
        Self { towards_sun: turned(self.towards_sun), upwards: turned(self.upwards), ..self }
    }

    /// Light that a surface of colour `albedo` at `from_eye` sends back to the eye, linear.
    pub(super) fn reflected(&self, albedo: Vec3, normal: Vec3, from_eye: Vec3, is_leaf: bool, two_sided: bool) -> Vec3 {
        let flip = if two_sided && normal.dot(from_eye) > 0.0 { -1.0 } else { 1.0 };
        let normal = (normal * flip).normalize_or_zero();
        // 0 in the crown's middle, 1 on the ellipsoid that its box encloses.
        let in_crown = (from_eye - self.crown_center_from_eye) * self.inverse_half_size;
        let open = openness(in_crown.length());
        let sun = self.lighting.sun;
        let lit = if is_leaf {
            let outwards = (in_crown * self.inverse_half_size).normalize_or_zero();
            let leaning = match self.lighting.crown_blend {
                None => normal + outwards * LEAN,
                Some(blend) => normal.lerp(outwards, blend),
            };
            let leaning = leaning.normalize_or_zero();
            let facing = ((leaning.dot(self.towards_sun) + WRAP) / (1.0 + WRAP)).max(0.0);
            let through = (-normal.dot(self.towards_sun)).max(0.0) * self.through(from_eye);
            sun * (Vec3::splat(facing) + THROUGH_TINT * through) + self.sky(leaning)
        } else {
            sun * normal.dot(self.towards_sun).max(0.0) + self.sky(normal)
        };
        albedo * lit * open
    }

    /// Share of the sun's light that comes through a leaf to the eye.
    fn through(&self, from_eye: Vec3) -> f32 {
        let Some(through) = self.lighting.translucency else { return THROUGH };
        let against = from_eye.normalize_or_zero().dot(self.towards_sun).max(0.0);
        through.strength * (1.0 + through.glow * against.powf(through.sharpness))
    }

    fn sky(&self, normal: Vec3) -> Vec3 {
        self.lighting.ground.lerp(self.lighting.sky, normal.dot(self.upwards) * 0.5 + 0.5)
    }
}

fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The backdrop, linear, at a height of 0 (bottom of the picture) to 1 (top).
pub(super) fn backdrop(height: f32) -> Vec3 {
    if height < HORIZON_HEIGHT {
        FLOOR.lerp(HORIZON, smoothstep(0.0, 1.0, height / HORIZON_HEIGHT))
    } else {
        HORIZON.lerp(ZENITH, (height - HORIZON_HEIGHT) / (1.0 - HORIZON_HEIGHT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_is_never_black_and_a_flat_or_missing_crown_stays_finite() {
        let flat = Aabb { min: [0.0; 3], max: [1.0, 0.0, 1.0] };
        for crown in [Aabb::EMPTY, flat, Aabb { min: [-1.0; 3], max: [1.0; 3] }] {
            let light = Light::new(&crown, DVec3::Z * 3.0, &Lighting::default());
            for normal in [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::ZERO] {
                let color = light.reflected(Vec3::ONE, normal, Vec3::new(0.0, 0.0, -3.0), true, true);
                assert!(color.is_finite() && color.min_element() > 0.05, "{crown:?} {normal} {color}");
            }
        }
    }
}
