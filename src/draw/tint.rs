//! What a plant's own tint and the haze before it make of its lit colour.

use super::{instance::Instance, landscape::Landscape, look::Look};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use std::f32::consts::TAU;

/// Directions in which the colour of the haze is computed; between them it is linear.
const DIRECTIONS: usize = 64;

/// Change of a plant's lit colour, linear: it is multiplied by `factor`, then `added` is added.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Tint {
    /// Factors of red, green and blue, at least 0.
    pub factor: [f32; 3],
    /// Light of the haze before the plant.
    pub added: [f32; 3],
}

impl Tint {
    /// Changes nothing.
    pub const NONE: Self = Self { factor: [1.0; 3], added: [0.0; 3] };

    /// The changed colour.
    #[cfg(feature = "software")]
    pub(crate) fn of(&self, color: Vec3) -> Vec3 {
        color * Vec3::from(self.factor) + Vec3::from(self.added)
    }
}

/// Tints of the plants of one frame.
#[derive(Debug, Clone)]
pub(crate) struct Tints {
    has_own: bool,
    haze: Option<Haze>,
}

/// Haze over the ground, as seen by one eye.
#[derive(Debug, Clone)]
struct Haze {
    eye: DVec3,
    /// Distance at which it leaves 1/e of a plant's own light.
    distance: f32,
    /// Its colour in directions all around, from +X towards +Z; the last is the first again.
    colors: [Vec3; DIRECTIONS + 1],
}

impl Tints {
    /// Those of a look, for an eye.
    pub(crate) fn new(look: &Look, eye: DVec3) -> Self {
        let haze = |landscape: Landscape| Haze::new(&landscape, eye);
        Self { has_own: look.tints, haze: look.ground.and_then(|_| look.landscape()).and_then(haze) }
    }

    /// The tint of a plant whose middle is at `at`.
    pub(crate) fn of(&self, plant: &Instance, at: DVec3) -> Tint {
        let own = if self.has_own { Vec3::from(plant.tint) } else { Vec3::ONE };
        let Some(haze) = &self.haze else { return Tint { factor: own.into(), ..Tint::NONE } };
        let (share, color) = haze.towards(at);
        Tint { factor: (own * (1.0 - share)).into(), added: (color * share).into() }
    }
}

impl Haze {
    fn new(landscape: &Landscape, eye: DVec3) -> Option<Self> {
        let color = |direction: usize| {
            let (z, x) = (direction as f32 / DIRECTIONS as f32 * TAU).sin_cos();
            landscape.sky(Vec3::new(x, 0.0, z))
        };
        let distance = landscape.ground?.haze as f32;
        Some(Self { eye, distance, colors: std::array::from_fn(|direction| color(direction % DIRECTIONS)) })
    }

    /// Share of the light from `at` that is the haze's, and the haze's colour there.
    fn towards(&self, at: DVec3) -> (f32, Vec3) {
        let away = (at - self.eye).as_vec3();
        let share = 1.0 - (-away.length() / self.distance).exp();
        let turn = (away.z.atan2(away.x) / TAU).rem_euclid(1.0) * DIRECTIONS as f32;
        let first = (turn as usize).min(DIRECTIONS - 1);
        let color = self.colors[first].lerp(self.colors[first + 1], turn - first as f32);
        if share.is_finite() && color.is_finite() { (share, color) } else { (0.0, Vec3::ZERO) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        draw::Ground,
        effects::{Effects, Sky},
    };

    #[test]
    fn haze_grows_with_the_distance_and_has_the_colour_of_the_sky_behind() {
        let effects = Effects { sky: Some(Sky::default()), ..Effects::default() };
        let ground = Some(Ground { color: [0.1; 3], height: 0.0, haze: 100.0 });
        let look = Look { ground, effects, ..Look::default() };
        let (eye, landscape) = (DVec3::new(1e6, 2.0, 3.0), look.landscape().unwrap());
        let tints = Tints::new(&look, eye);
        let plant = Instance::new(Default::default(), Default::default(), 1.0);
        for turn in 0..360 {
            let direction = DVec3::new(f64::from(turn).to_radians().cos(), 0.0, f64::from(turn).to_radians().sin());
            let tint = tints.of(&plant, eye + direction * 100.0);
            let expected = landscape.sky(direction.as_vec3()) * (1.0 - (-1.0_f32).exp());
            assert!((Vec3::from(tint.added) - expected).length() < 0.004, "{turn}: {tint:?} {expected}");
            assert!((tint.factor[0] - (-1.0_f32).exp()).abs() < 1e-3);
        }
        assert_eq!(tints.of(&plant, eye), Tint::NONE);
        assert_eq!(tints.of(&plant, DVec3::NAN), Tint::NONE);
        let clear = Tints::new(&Look { ground: None, ..look }, eye);
        assert_eq!(clear.of(&plant, eye + 5e3), Tint::NONE);
    }
}
