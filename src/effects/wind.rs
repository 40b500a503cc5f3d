//! Wind: the trunk bends, branches sway and leaves flutter, all driven by one field of gusts.
//!
//! The motion is a function of time and position alone: nothing is integrated, so nothing drifts,
//! and any frame can be evaluated directly. Every frequency is a whole number of cycles in
//! [`PERIOD`] seconds, and phases are reduced in `f64`, so the motion at 10^7 s matches that of the
//! first minutes to every digit that matters.
//!
//! The trunk bends by a smooth displacement field over height, which all of the plant follows. Two
//! levels of branches turn about their feet on top of it ([`Limbs`](super::Limbs)), if the model
//! tells its stems. Other models have a second displacement field in their place, by which
//! neighbouring branches sway alike. Leaves ride on their branches; the rotation of a leaf about
//! its pivot depends only on its index in the model and on the plant's sway, never on the number of
//! drawn leaves.
//!
//! Limits: the trunk is the plant's own +Y axis. An enlarged leaf turns as one piece.

use crate::{Result, bounds::Aabb, error::check_range, hash::HASH_MULTIPLIER};
use glam::{DAffine3, DVec3, Quat, Vec3};
use serde::Deserialize;
use std::f32::consts::TAU;

/// Seconds after which the motion repeats.
pub const PERIOD: f64 = 120.0;
// All counts of cycles are different primes: no two waves repeat together before the period ends.

/// Cycles per period of the three gust waves: one in 10.9, 5.2 and 2.9 s.
const GUSTS: [f64; 3] = [11.0, 23.0, 41.0];
/// Cycles per period of the trunk: one in 2.8 s.
const TRUNK: f64 = 43.0;
/// Cycles per period of the two branch waves: one in 1.8 and 1.2 s, faster than the trunk.
const BRANCHES: [f64; 2] = [67.0, 97.0];
/// Cycles per period of the two leaf waves: one in 0.5 and 0.3 s, faster than the branches.
const LEAVES: [f64; 2] = [251.0, 397.0];
/// Weights of the gust waves, the slowest the largest. They add up to 1, so that `gustiness` bounds
/// the gusts.
const GUST_SHARES: [f64; 3] = [0.5, 0.3, 0.2];
/// Waves per gust length of each gust wave: faster waves are shorter.
const GUST_WAVES: [f64; 3] = [1.0, 2.0, 3.0];
/// Phase shift of a gust across the wind, relative to that along it: crests run obliquely, so that
/// plants in a row across the wind do not sway in unison.
const CREST_SKEW: f64 = 0.3;
/// Cycles of a plant's own phase per gust length: plants much closer than a gust length differ.
const PLANT_PHASE_RATE: f64 = 7.0;
/// A plant's own phase at the world's origin, in cycles: about the fraction of the golden ratio, so
/// that the trunk there does not start in phase with the gusts.
const PLANT_PHASE_START: f64 = 0.618;
/// Amplitude of the trunk's swing as a share of its bend: below 1, so that it never swings upwind.
const TRUNK_SWING: f64 = 0.35;
/// Descent of the top over its squared sideways displacement, both over the plant's height. A trunk
/// bent as a parabola is shortened by half the integral of its squared slope, which is 2/3.
pub(crate) const BEND_DESCENT: f32 = 2.0 / 3.0;
/// Wave vectors of branch sway along the wind and upwards, in cycles over the plant's height: less
/// than one in any direction, so that neighbouring branches move together.
pub(crate) const BRANCH_WAVES: [Vec3; 2] = [Vec3::new(0.45, 0.25, 0.35), Vec3::new(-0.3, 0.4, 0.55)];
/// Amplitude of vertical branch sway as a share of the sway along the wind, which dominates.
pub(crate) const BRANCH_LIFT: f32 = 0.6;
/// Mean of a limb's swing along the wind, as a share of its amplitude: limbs lean downwind.
pub(crate) const LIMB_LEAN: f32 = 0.3;
/// Motion in pixels up to which a level of limbs is not simulated, and that from which on it moves
/// in full: between them its motion fades.
const LIMB_PX: [f64; 2] = [0.5, 1.0];
/// Weights of the two leaf waves. They add up to 1, so that `flutter` is the largest turn.
pub(crate) const FLUTTER_SHARES: [f32; 2] = [0.6, 0.4];
/// Vertical part of a leaf's turning axis, where the horizontal part is 1: leaves mostly nod.
pub(crate) const FLUTTER_TILT: f32 = 0.5;
/// Steps of a leaf's random phases: ten bits each, so that three fit into one 32-bit hash.
pub(crate) const PHASE_STEPS: u32 = 1024;

/// Parameters of the wind.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wind {
    /// Direction the wind blows towards, in degrees from +X towards +Z: -360 to 360.
    pub direction: f32,
    /// Sideways displacement of a plant's top at mean wind, over its height: 0 to 0.1.
    pub strength: f32,
    /// Amplitude of the gusts, as a share of the mean wind: 0 to 1.
    pub gustiness: f32,
    /// Sway of the outermost branches at mean wind, both levels together, over the plant's height:
    /// 0 to 0.02.
    pub branches: f32,
    /// Largest turn of a leaf at mean wind, in degrees: 0 to 90.
    pub flutter: f32,
    /// Distance from one gust crest to the next, in world units: above 0.
    pub gust_length: f32,
}

impl Default for Wind {
    /// A breeze.
    fn default() -> Self {
        Self { direction: 20.0, strength: 0.02, gustiness: 0.6, branches: 0.008, flutter: 14.0, gust_length: 40.0 }
    }
}

impl Wind {
    pub(super) fn check(&self) -> Result<()> {
        check_range("effects.wind.direction", self.direction, -360.0..=360.0)?;
        check_range("effects.wind.strength", self.strength, 0.0..=0.1)?;
        check_range("effects.wind.gustiness", self.gustiness, 0.0..=1.0)?;
        check_range("effects.wind.branches", self.branches, 0.0..=0.02)?;
        check_range("effects.wind.flutter", self.flutter, 0.0..=90.0)?;
        check_range("effects.wind.gust_length", self.gust_length, 1e-6..=1e9)
    }

    /// State of the wind at `seconds`, which may be any finite number.
    pub fn at(self, seconds: f64) -> Moment {
        let clock = seconds.rem_euclid(PERIOD) / PERIOD;
        let cycles = |count: f64| phase(count * clock);
        Moment {
            wind: self,
            clock: phase(clock),
            gusts: GUSTS.map(cycles),
            trunk: cycles(TRUNK),
            phases: [BRANCHES[0], BRANCHES[1], LEAVES[0], LEAVES[1]].map(cycles),
        }
    }

    /// Upper bound on the displacement of any point of a plant, in the plant's units; `leaf_reach`
    /// is the largest distance of a leaf's vertex from its pivot.
    pub fn reach(&self, shape: &Shape, leaf_reach: f32) -> f32 {
        let gust = 1.0 + self.gustiness;
        let bend = self.strength * gust * (1.0 + TRUNK_SWING as f32);
        // Sideways, and down by the height lost to the bend.
        let trunk = shape.height * bend.hypot(BEND_DESCENT * bend * bend);
        let branches = self.largest_sway(shape);
        let flutter = (self.flutter.to_radians() * gust).min(std::f32::consts::PI);
        let chord = 2.0 * (0.5 * flutter).sin() * leaf_reach;
        let Some(limbs) = shape.limbs else { return trunk + branches + chord };
        // The second level is turned with the slope of the trunk too, and rides on the first.
        let slope = 2.0 * bend;
        let turns = limbs.turns.map(|turn| branches * turn);
        let second = trunk * limbs.lean + branches * limbs.sways[1];
        let carried = branches * limbs.sways[0] + second * (1.0 + turns[0]);
        carried + chord + (turns[0] + turns[1] + slope) * leaf_reach
    }

    /// Largest displacement of the outermost branches, in plant units.
    fn largest_sway(&self, shape: &Shape) -> f32 {
        shape.height * self.branches * (1.0 + self.gustiness) * 1.0_f32.hypot(BRANCH_LIFT)
    }

    /// Share, from 0 to 1, of its motion that each level of limbs is simulated with on a plant of
    /// which a unit covers so many pixels: 0 up to half a pixel of motion at the strongest gust, 1
    /// from one pixel on. 0 for a plant without limbs.
    pub fn limb_shares(&self, shape: &Shape, pixels_per_unit: f64) -> [f32; 2] {
        let Some(limbs) = shape.limbs else { return [0.0; 2] };
        let [least, full] = LIMB_PX;
        limbs.sways.map(|sway| {
            let motion_px = f64::from(self.largest_sway(shape) * sway) * pixels_per_unit;
            ((motion_px - least) / (full - least)).clamp(0.0, 1.0) as f32
        })
    }
}

/// Reduces a phase in cycles to the range from 0 up to 1 (exclusive); 0 if it is not finite.
fn phase(cycles: f64) -> f64 {
    let phase = cycles.rem_euclid(1.0);
    if phase < 1.0 { phase } else { 0.0 }
}

/// State of the wind at one time: phases in cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    wind: Wind,
    /// Part of the period that has passed.
    clock: f64,
    gusts: [f64; 3],
    trunk: f64,
    /// Phases of the two branch waves and the two leaf waves.
    phases: [f64; 4],
}

impl Moment {
    /// Motion of a plant at the position and orientation of `world_from_plant`, all levels of limbs
    /// in full.
    pub fn sway(&self, shape: &Shape, world_from_plant: &DAffine3) -> Sway {
        let angle = f64::from(self.wind.direction).to_radians();
        let along = DVec3::new(angle.cos(), 0.0, angle.sin());
        // Crests travel along the wind; neighbours across it are slightly ahead or behind.
        let place = world_from_plant.translation;
        let across = DVec3::new(-along.z, 0.0, along.x);
        let crest = phase((place.dot(along) + CREST_SKEW * place.dot(across)) / f64::from(self.wind.gust_length));
        let own = phase(crest * PLANT_PHASE_RATE + PLANT_PHASE_START);
        let wave = |cycles: f64| (cycles * std::f64::consts::TAU).sin();
        let swell: f64 = (0..3).map(|i| GUST_SHARES[i] * wave(self.gusts[i] - crest * GUST_WAVES[i])).sum();
        let gust = 1.0 + f64::from(self.wind.gustiness) * swell;
        let bend = f64::from(self.wind.strength) * gust * (1.0 + TRUNK_SWING * wave(self.trunk + own));
        let local = world_from_plant.inverse().transform_vector3(along);
        let local = DVec3::new(local.x, 0.0, local.z).normalize_or_zero().as_vec3();
        Sway {
            bend: (local * (bend as f32 * shape.height)).to_array(),
            height: shape.height,
            along: local.to_array(),
            base: shape.base,
            axis: shape.axis,
            radius: shape.radius,
            branches: self.wind.branches * gust as f32 * shape.height,
            phases: self.phases.map(|cycles| phase(cycles + own) as f32),
            flutter: self.wind.flutter.to_radians() * gust as f32,
            clock: shape.limbs.map_or(NO_LIMBS, |_| phase(self.clock + own) as f32),
            limbs: shape.limbs.map_or([0.0; 2], |_| [1.0; 2]),
        }
    }
}

/// Dimensions of a plant that the wind depends on, in the space of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// The y coordinate of the ground below the plant.
    pub base: f32,
    /// Height from the base to the top.
    pub height: f32,
    /// Position of the trunk: x and z.
    pub axis: [f32; 2],
    /// Distance from the trunk to the outermost branches.
    pub radius: f32,
    /// How far limbs move; `None` for a plant whose branches follow a displacement field.
    pub limbs: Option<LimbReach>,
}

/// How far the limbs of a plant move, for a [sway of the outermost branches](Wind::branches) of 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LimbReach {
    /// Largest displacement at each level, relative to what it grows on.
    pub sways: [f32; 2],
    /// Largest turn at each level, in radians per unit of length.
    pub turns: [f32; 2],
    /// Largest displacement by the bend of the trunk, over that of the plant's top: what is on a
    /// limb of level 2 is turned with the slope at its foot.
    pub lean: f32,
}

impl Shape {
    /// Shape of a plant with the bounding box `bounds`, without limbs. The trunk is assumed to be
    /// at its centre.
    pub fn new(bounds: &Aabb) -> Self {
        let (center, size) = (bounds.center().as_vec3(), bounds.size());
        Self {
            base: if bounds.is_empty() { 0.0 } else { bounds.min[1] },
            height: size.y.max(f32::MIN_POSITIVE),
            axis: [center.x, center.z],
            radius: (0.5 * size.x.max(size.z)).max(f32::MIN_POSITIVE),
            limbs: None,
        }
    }
}

/// [`Sway::clock`] of a plant without limbs.
const NO_LIMBS: f32 = -1.0;

/// Motion of one plant at one time, as read by `wind.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Sway {
    /// Sideways displacement of the top, in plant units.
    pub bend: [f32; 3],
    /// See [`Shape`].
    pub height: f32,
    /// Horizontal unit vector along the wind, in the plant's space.
    pub along: [f32; 3],
    /// See [`Shape`].
    pub base: f32,
    /// See [`Shape`].
    pub axis: [f32; 2],
    /// See [`Shape`].
    pub radius: f32,
    /// Sway of the outermost branches, in plant units.
    pub branches: f32,
    /// Phases of the two branch waves and the two leaf waves, in cycles from 0 up to 1.
    pub phases: [f32; 4],
    /// Largest turn of a leaf, in radians.
    pub flutter: f32,
    /// Part of the wind's period that has passed for the plant's limbs, from 0 up to 1; below 0 for
    /// a plant without limbs.
    pub clock: f32,
    /// Share, from 0 to 1, of its motion that each level of limbs is simulated with; see
    /// [`Wind::limb_shares`].
    pub limbs: [f32; 2],
}

impl Sway {
    /// Whether branches are limbs.
    pub(super) fn has_limbs(&self) -> bool {
        self.clock >= 0.0
    }

    /// The motion with a share of that of each level of limbs.
    pub fn with_limbs(self, shares: [f32; 2]) -> Self {
        Self { limbs: if self.has_limbs() { shares } else { [0.0; 2] }, ..self }
    }

    /// Height over the ground, as a part of the plant's.
    pub(super) fn height_of(&self, y: f32) -> f32 {
        ((y - self.base) / self.height).clamp(0.0, 1.0)
    }

    /// Displacement by the bend of the trunk at a y coordinate.
    pub(super) fn bent(&self, y: f32) -> Vec3 {
        let height = self.height_of(y);
        let bend = Vec3::from(self.bend);
        // Bending preserves the trunk's length, so sideways displacement lowers the top.
        let lowered = BEND_DESCENT * bend.length_squared() / self.height * height.powi(3);
        bend * (height * height) - Vec3::Y * lowered
    }

    /// Displacement of a point of the trunk and, without limbs, of a branch or a leaf's pivot.
    pub fn offset(&self, point: Vec3) -> Vec3 {
        if self.has_limbs() {
            return self.bent(point.y);
        }
        let out = Vec3::new(point.x - self.axis[0], 0.0, point.z - self.axis[1]) / self.radius;
        let reach = self.branches * out.length().min(1.0) * self.height_of(point.y);
        let place = (point - Vec3::new(self.axis[0], self.base, self.axis[1])) / self.height;
        let wave = |i: usize| ((self.phases[i] - place.dot(BRANCH_WAVES[i])) * TAU).sin();
        self.bent(point.y) + Vec3::from(self.along) * (reach * wave(0)) + Vec3::Y * (reach * BRANCH_LIFT * wave(1))
    }

    /// Upper bound on the length of [`offset`](Self::offset).
    pub fn reach(&self) -> f32 {
        let bend = Vec3::from(self.bend).length();
        let lowered = BEND_DESCENT * bend * bend / self.height;
        let branches = if self.has_limbs() { 0.0 } else { self.branches.abs() * 1.0_f32.hypot(BRANCH_LIFT) };
        bend.hypot(lowered) + branches
    }

    /// Rotation of a leaf about its pivot; `leaf` is its index in the model.
    pub fn turn(&self, leaf: u32) -> Quat {
        let own = leaf_phases(leaf);
        let wave = |i: usize| ((self.phases[2 + i] + own[i]) * TAU).sin();
        let angle = self.flutter * (FLUTTER_SHARES[0] * wave(0) + FLUTTER_SHARES[1] * wave(1));
        let around = own[2] * TAU;
        let axis = Vec3::new(around.cos(), FLUTTER_TILT, around.sin()).normalize();
        Quat::from_axis_angle(axis, angle)
    }
}

/// Three phases from 0 up to 1, hashed from the leaf's index alone (Knuth's multiplicative hash).
fn leaf_phases(leaf: u32) -> [f32; 3] {
    let mixed = leaf.wrapping_mul(HASH_MULTIPLIER);
    [22, 12, 2].map(|shift| ((mixed >> shift) % PHASE_STEPS) as f32 / PHASE_STEPS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { base: -4.0, height: 10.0, axis: [0.5, -0.25], radius: 3.0, limbs: None };

    fn points() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            let [a, b, c] = leaf_phases(i * 31 + 7);
            Vec3::new(a * 6.0 - 2.5, b * 10.0 - 4.0, c * 6.0 - 3.25)
        })
    }

    fn place(x: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, 0.0, 3.0))
    }

    #[test]
    fn motion_is_bounded_for_a_million_steps_and_never_grows() {
        let wind = Wind { strength: 0.1, gustiness: 1.0, branches: 0.02, flutter: 40.0, ..Wind::default() };
        let reach = wind.reach(&SHAPE, 0.3);
        let mut most = [0.0_f32; 2];
        for step in 0..1_000_000_u32 {
            let moment = wind.at(f64::from(step) / 60.0);
            let sway = moment.sway(&SHAPE, &place(1.0));
            let point = Vec3::new(3.0, 6.0, 1.0);
            let turned = sway.turn(step % 97) * Vec3::X * 0.3 - Vec3::X * 0.3;
            let moved = (sway.offset(point) + turned).length();
            let half = usize::from(step >= 500_000);
            most[half] = most[half].max(moved);
            assert!(moved <= reach * 1.0001, "step {step}: {moved} beyond {reach}");
        }
        assert!((most[0] / most[1] - 1.0).abs() < 0.02, "{most:?}");
        assert!(most[0] > 0.5 * reach, "the bound is not idle: {most:?} of {reach}");
    }

    #[test]
    fn late_times_move_as_early_ones_and_no_wind_gives_the_rest_pose() {
        let wind = Wind::default();
        for early in [0.0, 0.37, 59.9, 119.99] {
            let late = early + PERIOD * 83_333.0;
            let [a, b] = [early, late].map(|seconds| wind.at(seconds).sway(&SHAPE, &place(1.0)));
            for (leaf, point) in (0..).zip(points()) {
                let [x, y] = [a, b].map(|sway| sway.offset(point) + sway.turn(leaf) * Vec3::X * 0.2);
                assert!((x - y).length() < 2e-4, "{early}: {x} {y}");
            }
        }
        let still = Wind { strength: 0.0, branches: 0.0, flutter: 0.0, ..wind };
        let moment = still.at(12.3);
        let sway = moment.sway(&SHAPE, &place(1.0));
        assert!(points().all(|point| point + sway.offset(point) == point));
        assert_eq!(sway.turn(5) * Vec3::X, Vec3::X);
        assert_eq!(still.reach(&SHAPE, 1.0), 0.0);
    }

    #[test]
    fn odd_times_and_places_stay_finite() {
        for seconds in [f64::NAN, f64::INFINITY, -5.0, 1e300] {
            let moment = Wind::default().at(seconds);
            let sway = moment.sway(&SHAPE, &place(1e300));
            assert!(sway.offset(Vec3::ONE).is_finite(), "{seconds}");
        }
        let flat = Shape::new(&Aabb { min: [0.0; 3], max: [1.0, 0.0, 0.0] });
        let moment = Wind::default().at(1.0);
        assert!(moment.sway(&flat, &place(0.0)).offset(Vec3::X).is_finite());
        assert!(Shape::new(&Aabb::EMPTY).height > 0.0);
    }

    #[test]
    fn neighbours_in_a_plant_move_alike_and_plants_apart_do_not() {
        let moment = Wind::default().at(3.0);
        let sway = moment.sway(&SHAPE, &place(1.0));
        for point in points() {
            let near = point + Vec3::splat(1e-3);
            let apart = (sway.offset(point) - sway.offset(near)).length();
            assert!(apart < 2e-4, "{apart}");
        }
        assert_ne!(sway.bend, moment.sway(&SHAPE, &place(9.0)).bend);
    }
}
