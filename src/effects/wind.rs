//! Wind: the trunk bends, branches sway, leaves flutter, all from one field of gusts.
//!
//! The motion is a function of time and place alone: nothing is integrated, so nothing drifts, and a frame can be asked for
//! at any time. Every frequency is a whole number of cycles in [`PERIOD`] seconds, and phases are reduced in `f64`: the
//! motion at 10^7 s is that of the first minutes to the last digit that matters.
//!
//! Trunk and branches are moved by one smooth field over the plant's space, which moves a leaf's pivot with the wood beneath
//! it: leaves stay on their twigs. What a leaf does beyond that depends on its number in the model and on time alone, never
//! on how many leaves are drawn.
//!
//! Limits: the plant's own +Y axis is its trunk. Branches are not told apart: those near each other sway alike. Enlarged
//! leaves turn as whole ones.

use crate::{Result, bounds::Aabb, error::check_range};
use glam::{DAffine3, DVec3, Quat, Vec3};
use serde::Deserialize;
use std::f32::consts::TAU;

/// Seconds after which everything repeats.
pub const PERIOD: f64 = 120.0;
/// Cycles in a period: of the gusts' three waves, the trunk, two waves of branches, two of leaves.
const GUSTS: [f64; 3] = [11.0, 23.0, 41.0];
const TRUNK: f64 = 43.0;
const BRANCHES: [f64; 2] = [67.0, 97.0];
const LEAVES: [f64; 2] = [251.0, 397.0];
/// Share of each of the gusts' waves; together 1.
const GUST_SHARES: [f64; 3] = [0.5, 0.3, 0.2];
/// How far the trunk swings about its bend.
const TRUNK_SWING: f64 = 0.35;
/// Waves of branch sway across the crown, in cycles over the plant's height.
pub(crate) const BRANCH_WAVES: [Vec3; 2] = [Vec3::new(0.45, 0.25, 0.35), Vec3::new(-0.3, 0.4, 0.55)];
/// Up and down sway over that along the wind.
pub(crate) const BRANCH_LIFT: f32 = 0.6;

/// The parameters of wind.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wind {
    /// Where it blows to, in degrees from +X towards +Z.
    pub direction: f32,
    /// How far the top of a plant is bent at mean wind, over its height: 0 to 0.1.
    pub strength: f32,
    /// How much gusts add to and take from the mean: 0 to 1.
    pub gustiness: f32,
    /// Sway of the outermost branches over the plant's height: 0 to 0.02.
    pub branches: f32,
    /// How far leaves turn, in degrees: 0 to 90.
    pub flutter: f32,
    /// Length of a gust, in world units: from one crest to the next, above 0.
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

    /// The wind at `seconds`, which may be any finite number.
    pub fn at(self, seconds: f64) -> Moment {
        let cycles = |count: f64| phase(count * (seconds.rem_euclid(PERIOD) / PERIOD));
        Moment {
            wind: self,
            gusts: GUSTS.map(cycles),
            trunk: cycles(TRUNK),
            phases: [BRANCHES[0], BRANCHES[1], LEAVES[0], LEAVES[1]].map(cycles),
        }
    }

    /// Farthest that a point of a plant is moved, in the plant's units; `leaf_reach` is the farthest that a leaf reaches
    /// from its pivot.
    pub fn reach(&self, shape: &Shape, leaf_reach: f32) -> f32 {
        let gust = 1.0 + self.gustiness;
        let bend = self.strength * gust * (1.0 + TRUNK_SWING as f32);
        // Sideways, and down by what the bend takes off the height.
        let trunk = shape.height * bend.hypot(2.0 / 3.0 * bend * bend);
        let branches = shape.height * self.branches * gust * 1.0_f32.hypot(BRANCH_LIFT);
        let turn = (self.flutter.to_radians() * gust).min(std::f32::consts::PI);
        trunk + branches + 2.0 * (0.5 * turn).sin() * leaf_reach
    }
}

/// A phase in cycles, 0 up to 1; 0 for what is not finite.
fn phase(cycles: f64) -> f64 {
    let phase = cycles.rem_euclid(1.0);
    if phase < 1.0 { phase } else { 0.0 }
}

/// The wind at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    wind: Wind,
    gusts: [f64; 3],
    trunk: f64,
    /// Of the two waves of branches and the two of leaves.
    phases: [f64; 4],
}

impl Moment {
    /// What the wind does to a plant that stands somewhere.
    pub fn sway(&self, shape: &Shape, world_from_plant: &DAffine3) -> Sway {
        let angle = f64::from(self.wind.direction).to_radians();
        let along = DVec3::new(angle.cos(), 0.0, angle.sin());
        // Crests travel along the wind; neighbours across it are a little ahead or behind.
        let place = world_from_plant.translation;
        let across = DVec3::new(-along.z, 0.0, along.x);
        let crest = phase((place.dot(along) + 0.3 * place.dot(across)) / f64::from(self.wind.gust_length));
        let own = phase(crest * 7.0 + 0.618);
        let wave = |cycles: f64| (cycles * std::f64::consts::TAU).sin();
        let swell: f64 = (0..3).map(|i| GUST_SHARES[i] * wave(self.gusts[i] - crest * [1.0, 2.0, 3.0][i])).sum();
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
            padding: [0.0; 3],
        }
    }
}

/// What wind needs to know of a plant, in the space that its points are given in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Height of the ground the plant stands on.
    pub base: f32,
    /// From there to the top.
    pub height: f32,
    /// Where the trunk stands: x and z.
    pub axis: [f32; 2],
    /// From the trunk to the outermost branches.
    pub radius: f32,
}

impl Shape {
    /// The shape of a plant whose box this is. Its trunk stands in the middle.
    pub fn new(bounds: &Aabb) -> Self {
        let (center, size) = (bounds.center().as_vec3(), bounds.size());
        Self {
            base: if bounds.is_empty() { 0.0 } else { bounds.min[1] },
            height: size.y.max(f32::MIN_POSITIVE),
            axis: [center.x, center.z],
            radius: (0.5 * size.x.max(size.z)).max(f32::MIN_POSITIVE),
        }
    }
}

/// What the wind does to one plant at one time: what `wind.wgsl` reads.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Sway {
    /// How far the top is moved.
    pub bend: [f32; 3],
    /// See [`Shape`].
    pub height: f32,
    /// Unit vector along the wind, in the plant's space.
    pub along: [f32; 3],
    /// See [`Shape`].
    pub base: f32,
    /// See [`Shape`].
    pub axis: [f32; 2],
    /// See [`Shape`].
    pub radius: f32,
    /// Sway of the outermost branches, in plant units.
    pub branches: f32,
    /// Phases of the two waves of branches and the two of leaves, in cycles, 0 up to 1.
    pub phases: [f32; 4],
    /// How far leaves turn, in radians.
    pub flutter: f32,
    /// Up to a multiple of 16 bytes.
    pub padding: [f32; 3],
}

impl Sway {
    /// How far a point of trunk or branches, or the pivot of a leaf, is moved.
    pub fn offset(&self, point: Vec3) -> Vec3 {
        let height = ((point.y - self.base) / self.height).clamp(0.0, 1.0);
        let bend = Vec3::from(self.bend);
        // A bent trunk is as long as a straight one: what goes sideways is missing above.
        let lowered = 2.0 / 3.0 * bend.length_squared() / self.height * height.powi(3);
        let out = Vec3::new(point.x - self.axis[0], 0.0, point.z - self.axis[1]) / self.radius;
        let reach = self.branches * out.length().min(1.0) * height;
        let place = (point - Vec3::new(self.axis[0], self.base, self.axis[1])) / self.height;
        let wave = |i: usize| ((self.phases[i] - place.dot(BRANCH_WAVES[i])) * TAU).sin();
        bend * (height * height) - Vec3::Y * lowered
            + Vec3::from(self.along) * (reach * wave(0))
            + Vec3::Y * (reach * BRANCH_LIFT * wave(1))
    }

    /// How a leaf is turned about its pivot, by its number in the model.
    pub fn turn(&self, leaf: u32) -> Quat {
        let own = leaf_phases(leaf);
        let wave = |i: usize| ((self.phases[2 + i] + own[i]) * TAU).sin();
        let angle = self.flutter * (0.6 * wave(0) + 0.4 * wave(1));
        let around = own[2] * TAU;
        // Mostly about a level axis: leaves nod.
        let axis = Vec3::new(around.cos(), 0.5, around.sin()).normalize();
        Quat::from_axis_angle(axis, angle)
    }
}

/// Three numbers from 0 to 1 that depend on the leaf's number alone (Knuth's multiplicative hash).
fn leaf_phases(leaf: u32) -> [f32; 3] {
    let mixed = leaf.wrapping_mul(2_654_435_761);
    [mixed >> 22, mixed >> 12 & 1023, mixed >> 2 & 1023].map(|bits| bits as f32 / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { base: -4.0, height: 10.0, axis: [0.5, -0.25], radius: 3.0 };

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
