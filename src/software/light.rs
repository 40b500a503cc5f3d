//! Lighting of surfaces, and the plain backdrop: twin of `light.wgsl`.

use crate::{
    bounds::Aabb,
    crown::{inverse_half_size, openness, smoothstep},
    draw::light::{FLOOR, HORIZON, HORIZON_HEIGHT, LEAN, Lighting, THROUGH, THROUGH_TINT, WRAP, ZENITH},
};
use glam::{DAffine3, DVec3, Vec3};

/// Lighting of one plant, in the plant's space.
pub(super) struct Light {
    pub(super) crown_center_from_eye: Vec3,
    /// One over half the crown's extent along each axis.
    pub(super) inverse_half_size: Vec3,
    /// Unit vector, like `upwards`; zero if the light has no direction.
    towards_sun: Vec3,
    upwards: Vec3,
    lighting: Lighting,
}

impl Light {
    /// Creates the lighting of an unrotated plant. `crown`, the bounding box of all leaves, and
    /// `eye` are in the plant's space.
    pub(super) fn new(crown: &Aabb, eye: DVec3, lighting: &Lighting) -> Self {
        Self {
            crown_center_from_eye: (crown.center() - eye).as_vec3(),
            inverse_half_size: inverse_half_size(crown),
            towards_sun: lighting.towards_sun.normalize_or_zero(),
            upwards: Vec3::Y,
            lighting: *lighting,
        }
    }

    /// Transforms the directions of the lighting from world space to the plant's space.
    pub(super) fn turned(self, plant_from_world: &DAffine3) -> Self {
        let turned =
            |direction: Vec3| plant_from_world.transform_vector3(direction.as_dvec3()).normalize_or_zero().as_vec3();
        Self { towards_sun: turned(self.towards_sun), upwards: turned(self.upwards), ..self }
    }

    /// Linear light that reaches the eye from a surface of colour `albedo` at `from_eye`, its
    /// position relative to the eye: reflected, and transmitted if it is a leaf.
    pub(super) fn reflected(&self, albedo: Vec3, normal: Vec3, from_eye: Vec3, is_leaf: bool, two_sided: bool) -> Vec3 {
        let flip = if two_sided && normal.dot(from_eye) > 0.0 { -1.0 } else { 1.0 };
        let normal = (normal * flip).normalize_or_zero();
        // Its length is 0 at the crown's centre and 1 on the ellipsoid inscribed in its box.
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

    /// Linear light that reaches the eye from many surfaces of colour `albedo` at `from_eye`.
    /// `normal` is the mean of their normals, turned towards the eye: the shorter it is, the more
    /// they differ. Twin of `reflected_by_many` in `impostor_pass.wgsl`.
    pub(super) fn reflected_by_many(&self, albedo: Vec3, normal: Vec3, from_eye: Vec3, is_leaf: bool) -> Vec3 {
        let in_crown = (from_eye - self.crown_center_from_eye) * self.inverse_half_size;
        let open = openness(in_crown.length());
        let sun = self.lighting.sun;
        // Variance of the normals along a direction, were they spread as those of a hemisphere
        // around the direction to the eye: along it a quarter of that across it.
        let towards_eye = from_eye.normalize_or_zero();
        let spread = (1.0 - normal.length_squared()).max(0.0) / 9.0;
        let variance_along = |axis: Vec3| {
            let along = towards_eye.dot(axis);
            spread * (4.0 - 3.0 * along * along)
        };
        let variance = variance_along(self.towards_sun);
        let cosine = normal.dot(self.towards_sun);
        if !is_leaf {
            return albedo * (sun * spread_light(cosine, variance) + self.sky(normal)) * open;
        }
        let outwards = (in_crown * self.inverse_half_size).normalize_or_zero();
        let (own, lean) = match self.lighting.crown_blend {
            None => (1.0, LEAN),
            Some(blend) => (1.0 - blend, blend),
        };
        // Mean of the unit vectors along `own` of a normal and `lean` of the outward direction,
        // from the mean of their squared lengths and its second-order correction.
        let squared = own * own + lean * lean * outwards.length_squared() + 2.0 * own * lean * normal.dot(outwards);
        let (squared, bent) = (squared.max(0.05), own * lean * variance_along(outwards));
        let factor = (1.0 + 1.5 * own * lean * bent / (squared * squared)) / squared.sqrt();
        let leaning = (normal * own + outwards * lean) * factor - outwards * (own * bent / (squared * squared.sqrt()));
        let facing = spread_light(leaning.dot(self.towards_sun) + WRAP, variance * (own * factor) * (own * factor));
        let facing = facing / (1.0 + WRAP);
        let through = spread_light(-cosine, variance) * self.through(from_eye);
        albedo * (sun * (Vec3::splat(facing) + THROUGH_TINT * through) + self.sky(leaning)) * open
    }

    /// Fraction of the sunlight that passes through a leaf towards the eye.
    fn through(&self, from_eye: Vec3) -> f32 {
        let Some(through) = self.lighting.translucency else { return THROUGH };
        let against = from_eye.normalize_or_zero().dot(self.towards_sun).max(0.0);
        through.strength * (1.0 + through.glow * against.powf(through.sharpness))
    }

    fn sky(&self, normal: Vec3) -> Vec3 {
        self.lighting.ground.lerp(self.lighting.sky, normal.dot(self.upwards) * 0.5 + 0.5)
    }
}

/// Mean of max(x, 0) over numbers spread evenly around `mean`, as cosines of the normals of a
/// hemisphere are, with a variance.
fn spread_light(mean: f32, variance: f32) -> f32 {
    let reach = (3.0 * variance).sqrt();
    if mean.abs() >= reach { mean.max(0.0) } else { (mean + reach) * (mean + reach) / (4.0 * reach) }
}

/// Linear colour of the backdrop at a height of 0 (bottom of the picture) to 1 (top).
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
