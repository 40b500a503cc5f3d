//! Level of detail: how much of a plant to draw, given how it is seen.
//!
//! A [`LodPolicy`] turns a [`Sight`] into a LOD between 0 and 1, [`leaf_count`] turns that into the
//! active count, and [`Hysteresis`] keeps the count steady while the camera trembles. Four
//! policies:
//!
//! - [`Blend`]: C. Gasch et al., *Multiresolution Foliage Rendering*, Equation 1, corrected: LOD =
//!   a·nearness + b·projected area. The printed equation uses the distance itself, which would give
//!   distant plants more leaves, and it reaches full detail only for a plant that fills the screen.
//!   Here the area is therefore relative to the area at `near`.
//! - [`CookLambda`]: R. Cook, J. Halstead, M. Planck, D. Ryu, *Stochastic Simplification of
//!   Aggregate Detail* (2007), Equation 2: lambda = b^(ln(1/2)/ln h), where b is the plant's screen
//!   area relative to its area at full detail.
//! - [`Sizes`] (ours): fractions of the leaves that were measured to be enough at given sizes on
//!   screen.
//! - [`PixelError`] (ours): the fewest leaves that keep the recorded prune errors, projected to the
//!   screen, within a bound.
//!
//! From inside the crown every policy draws at least half of the leaves ([`Sight::least_lod`]).
//!
//! Distances are in radii of the plant's bounding sphere, so one setting works for trees of any
//! size. For any input (far = near, NaN, a camera inside the crown), the LOD is between 0 and 1.
//!
//! Limits: no policy considers lighting, motion or occlusion.

use super::sight::{REFERENCE_FOV_Y, Sight, outline, unit};
use crate::model::FoliageModel;
use std::sync::Arc;

/// A rule for how much of a plant to draw. Applications may implement their own.
pub trait LodPolicy {
    /// The rule itself: the level of detail of a plant seen from outside, from 0 (the least
    /// possible) to 1 (everything). Must be defined for any sight.
    fn lod_outside(&self, sight: &Sight) -> f32;

    /// The least level of detail at which leaves stand for the plant: towards it, the plant is
    /// handed over to its impostor, if it has one.
    fn floor(&self) -> f32 {
        FLOOR_SHARE
    }

    /// Share of the plant that its impostor takes at the level of detail `lod`, whatever its size:
    /// all of it from [`floor`](Self::floor) down, none from 1.5 times as much up.
    fn far(&self, lod: f32) -> f32 {
        let floor = self.floor();
        unit((1.5 * floor - lod) / (0.5 * floor))
    }

    /// Returns the level of detail to draw, from 0 (the least possible) to 1 (everything): the
    /// rule's, but at least [`Sight::least_lod`].
    fn lod(&self, sight: &Sight) -> f32 {
        self.lod_outside(sight).max(sight.least_lod())
    }
}

/// Returns the active count for `lod` in a model of `leaves` leaves: `lod * leaves` rounded to the
/// nearest whole number, at least `min_leaves` and at most `leaves`. A NaN LOD counts as 0.
pub fn leaf_count(lod: f32, leaves: u32, min_leaves: u32) -> u32 {
    let wanted = (f64::from(lod) * f64::from(leaves)).round() as u32;
    wanted.max(min_leaves).min(leaves)
}

/// Returns the active count of `model` for `lod`: [`leaf_count`] without a minimum, except that a
/// plant without wood keeps [`fewest_visible`] at any LOD above 0.
pub fn active_count(model: &FoliageModel, lod: f32) -> u32 {
    let least = if lod > 0.0 { fewest_visible(model) } else { 0 };
    leaf_count(lod, model.leaves.len() as u32, least)
}

/// Returns the fewest leaves with which something of `model` can be seen: none if it has wood, one
/// if it has not.
pub fn fewest_visible(model: &FoliageModel) -> u32 {
    u32::from(model.wood.indices.is_empty()).min(model.leaves.len() as u32)
}

/// Minimum fraction of the leaves of a plant that is still drawn: with fewer, each remaining leaf
/// is a large part of the silhouette, and the wood looks bare.
const FLOOR_SHARE: f32 = 0.02;

/// Returns the fewest leaves to draw for a plant of `leaves` leaves: one in fifty, at least one.
pub fn fewest_leaves(leaves: u32) -> u32 {
    leaf_count(FLOOR_SHARE, leaves, 1)
}

/// A weighted blend of nearness and projected area: Equation 1, corrected.
///
/// LOD = clamp(`nearness_weight` * nearness + `area_weight` * area, 0, 1). Nearness falls linearly
/// from 1 at `near` to 0 at `far`. Area is the screen area of the bounding sphere relative to its
/// area at `near` under [`REFERENCE_FOV_Y`], at most 1, so zooming in raises it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blend {
    /// Distance in radii up to which nearness is 1. Should be above 1; at 1 or less, the area term
    /// is 0 outside the bounding sphere.
    pub near: f32,
    /// Distance in radii from which nearness is 0. If `far` is not above `near`, nearness is a step
    /// at `near`.
    pub far: f32,
    /// Weight a of nearness.
    pub nearness_weight: f32,
    /// Weight b of area.
    pub area_weight: f32,
}

impl Default for Blend {
    /// The paper's weights, 0.8 and 0.2, between 3 radii, where the plant fills most of an image
    /// with a 60 degree field of view, and 60 radii, where it is a twentieth of that size.
    fn default() -> Self {
        Self { near: 3.0, far: 60.0, nearness_weight: 0.8, area_weight: 0.2 }
    }
}

impl LodPolicy for Blend {
    fn lod_outside(&self, sight: &Sight) -> f32 {
        let distance = sight.distance_in_radii();
        let nearness = if self.far > self.near {
            1.0 - unit((distance - self.near) / (self.far - self.near))
        } else {
            f32::from(u8::from(distance <= self.near))
        };
        let is_inside = distance <= 1.0;
        let area = if is_inside { 1.0 } else { unit((sight.outline() / outline(self.near, REFERENCE_FOV_Y)).powi(2)) };
        unit(self.nearness_weight * nearness + self.area_weight * area)
    }
}

/// Cook's lambda: the fraction of leaves kept is a power of the plant's screen area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookLambda {
    /// Distance in radii, under [`REFERENCE_FOV_Y`], within which everything is drawn.
    pub start: f32,
    /// Screen area, relative to that at `start`, at which half of the leaves are drawn. Between 0
    /// and 1; the paper keeps it at or below 1/2 and gives 0.4.
    pub half_area: f32,
}

/// Upper bound for `half_area`; at 1 the exponent would be infinite.
const LARGEST_HALF_AREA: f32 = 0.999;

impl Default for CookLambda {
    /// The paper's h = 0.4, starting at 3 radii.
    fn default() -> Self {
        Self { start: 3.0, half_area: 0.4 }
    }
}

impl LodPolicy for CookLambda {
    fn lod_outside(&self, sight: &Sight) -> f32 {
        let magnification = (0.5 * REFERENCE_FOV_Y).tan() / (0.5 * sight.fov_y).tan();
        let area = (self.start / sight.distance_in_radii() * magnification).powi(2);
        if area.is_nan() || area >= 1.0 {
            return 1.0;
        }
        let half_area = self.half_area.clamp(0.0, LARGEST_HALF_AREA);
        unit(area.powf(0.5_f32.ln() / half_area.ln()))
    }

    /// The least lambda of Gomez.
    fn floor(&self) -> f32 {
        crate::stochastic::lambda::FLOOR as f32
    }
}

/// The fewest leaves for which the sum of the recorded errors of all pruned leaves, projected to
/// the screen, stays within a bound.
///
/// Each recorded error is converted to a fraction of the views. For criteria that count pixels,
/// that is the error in pixels divided by the pixels of all views; for VMI, the error in bits
/// divided by the number of views. Multiplied by the area in pixels of the square around the plant
/// on screen, it gives the error in pixels (for VMI, pixels weighted by the bits of information
/// each carries). The sum is an upper bound on the change from pruning all of these leaves, so the
/// actual error stays below the bound rather than reaching it.
#[derive(Debug, Clone)]
pub struct PixelError {
    /// Maximum number of wrong pixels; at least 0.
    pub bound_px: f32,
    /// Entry n is the fraction of the views that is wrong at active count n. Descending to 0 at the
    /// end.
    share: Arc<[f64]>,
}

impl PixelError {
    /// Creates the policy for one model. O(leaves).
    pub fn new(model: &FoliageModel, bound_px: f32) -> Self {
        let views = f64::from(model.recipe.views.max(1));
        let resolution = f64::from(model.recipe.resolution.max(1));
        let whole = if model.recipe.criterion == "vmi" { views } else { views * resolution * resolution };
        let mut share = vec![0.0; model.leaves.len() + 1];
        for (i, leaf) in model.leaves.iter().enumerate().rev() {
            share[i] = share[i + 1] + f64::from(leaf.error) / whole;
        }
        Self { bound_px, share: share.into() }
    }

    /// Returns the fewest leaves whose error on screen stays within the bound.
    pub fn fewest_leaves(&self, sight: &Sight) -> u32 {
        let square_px = (2.0 * f64::from(sight.radius_px())).powi(2);
        let too_few = self.share.partition_point(|share| share * square_px > f64::from(self.bound_px));
        too_few.min(self.share.len() - 1) as u32
    }
}

impl LodPolicy for PixelError {
    fn lod_outside(&self, sight: &Sight) -> f32 {
        let leaves = self.share.len() - 1;
        unit((f64::from(self.fewest_leaves(sight)) / leaves as f64) as f32)
    }
}

/// Fractions of the leaves that were found to be enough at given sizes on screen, such as the
/// smallest that meet a quality target.
///
/// Between two sizes the fraction is a power of the size. Beyond the last size it stays at the last
/// fraction, and before the first size at the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Diameter of the bounding sphere's outline in pixels, ascending, and the fraction of the
    /// leaves.
    shares: Arc<[(f32, f32)]>,
}

impl Sizes {
    /// Creates the policy from pairs of a diameter in pixels and a fraction of the leaves. Returns
    /// `None` unless there is at least one pair, the diameters are finite, above 0 and strictly
    /// ascending, and the fractions are above 0 and at most 1.
    pub fn new(shares: &[(f32, f32)]) -> Option<Self> {
        let in_range = |&(px, share): &(f32, f32)| px > 0.0 && px.is_finite() && share > 0.0 && share <= 1.0;
        let rise = shares.windows(2).all(|pair| pair[0].0 < pair[1].0);
        (!shares.is_empty() && rise && shares.iter().all(in_range)).then(|| Self { shares: shares.into() })
    }
}

impl LodPolicy for Sizes {
    fn lod_outside(&self, sight: &Sight) -> f32 {
        let px = 2.0 * sight.radius_px();
        let next = self.shares.partition_point(|&(size, _)| size < px);
        let [from, to] = [next.saturating_sub(1), next.min(self.shares.len() - 1)].map(|i| self.shares[i]);
        if next == 0 || from == to {
            return to.1;
        }
        let t = (px / from.0).ln() / (to.0 / from.0).ln();
        unit(from.1 * (to.1 / from.1).powf(t))
    }
}

/// A dead band around the active count: a still or trembling camera changes nothing.
///
/// The count follows the wanted count as if pulled by a slack rope, so a slow dolly changes it by a
/// leaf or two at a time and never by the whole width of the band. Full detail and `min_leaves` are
/// always reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// Half the width of the band, relative to the wanted count. At 0 the count follows
    /// immediately.
    pub dead_band: f32,
    current: Option<f64>,
}

impl Default for Hysteresis {
    /// 2 % of the wanted count: a camera that trembles by 1 % of its distance changes a count
    /// proportional to the area by this much.
    fn default() -> Self {
        Self::new(0.02)
    }
}

impl Hysteresis {
    /// Creates a dead band of `dead_band` times the wanted count on either side.
    pub fn new(dead_band: f32) -> Self {
        Self { dead_band, current: None }
    }

    /// Returns the count to draw, within `min_leaves..=leaves`, when `wanted` would be right for
    /// this frame.
    pub fn settle(&mut self, wanted: u32, leaves: u32, min_leaves: u32) -> u32 {
        self.follow(f64::from(wanted), leaves, min_leaves).round() as u32
    }

    /// As [`settle`](Self::settle), for fractional counts, between which nothing pops. NaN counts
    /// as `min_leaves`.
    pub fn follow(&mut self, wanted: f64, leaves: u32, min_leaves: u32) -> f64 {
        let (least, most) = (f64::from(min_leaves.min(leaves)), f64::from(leaves));
        let wanted = wanted.max(least).min(most);
        let slack = f64::from(self.dead_band.max(0.0)) * wanted;
        let settled = match self.current {
            Some(current) if wanted < most && wanted > least => {
                current.max(wanted - slack).min(wanted + slack).max(least).min(most)
            }
            _ => wanted,
        };
        self.current = Some(settled);
        settled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(radii: f32) -> Sight {
        Sight { distance: 2.0 * radii, radius: 2.0, fov_y: REFERENCE_FOV_Y, height_px: 1080.0 }
    }

    fn zoomed(radii: f32, fov_y: f32) -> Sight {
        Sight { fov_y, ..at(radii) }
    }

    fn policies() -> Vec<Box<dyn LodPolicy>> {
        let share = Arc::from([0.4, 0.1, 0.01, 0.0]);
        vec![
            Box::new(Blend::default()),
            Box::new(CookLambda::default()),
            Box::new(PixelError { bound_px: 200.0, share }),
        ]
    }

    #[test]
    fn lod_falls_with_distance_from_1_at_near_and_rises_with_zoom() {
        for (i, policy) in policies().iter().enumerate() {
            let lods: Vec<f32> = (0..400).map(|step| policy.lod(&at(0.25 * step as f32))).collect();
            assert!(lods.windows(2).all(|pair| pair[0] >= pair[1]), "policy {i}: {lods:?}");
            assert_eq!(lods[11], 1.0, "policy {i} at 2.75 radii");
            assert!(lods[399] < 0.5, "policy {i} at 100 radii");
            assert!(policy.lod(&zoomed(30.0, 0.1)) > policy.lod(&at(30.0)), "policy {i}");
        }
    }

    #[test]
    fn blend_is_equation_1_between_near_and_far() {
        let lod = Blend::default().lod(&at(31.5));
        let area = (3.0_f32.powi(2) - 1.0) / (31.5_f32.powi(2) - 1.0);
        assert!((lod - (0.8 * 0.5 + 0.2 * area)).abs() < 1e-6, "{lod}");
    }

    #[test]
    fn cook_keeps_half_of_the_leaves_at_half_area() {
        for half_area in [0.1_f32, 0.4, 0.5, 0.9] {
            let policy = CookLambda { start: 3.0, half_area };
            assert!((policy.lod(&at(3.0 / half_area.sqrt())) - 0.5).abs() < 1e-5);
        }
    }

    #[test]
    fn pixel_error_takes_the_fewest_leaves_within_the_bound() {
        let policy = PixelError { bound_px: 2.0, share: Arc::from([0.4, 0.1, 0.01, 0.0]) };
        for step in 0..4000 {
            let sight = at(1.0 + 0.05 * step as f32);
            let n = policy.fewest_leaves(&sight) as usize;
            let error_px = |n: usize| policy.share[n] * (2.0 * f64::from(sight.radius_px())).powi(2);
            assert!(n == 3 || error_px(n) <= 2.0);
            assert!(n == 0 || error_px(n - 1) > 2.0);
        }
    }

    #[test]
    fn any_numbers_give_a_lod_between_0_and_1() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -1.0, 1.0, 1e-38, 1e38];
        let mut policies = policies();
        for near in odd {
            for far in odd {
                policies.push(Box::new(Blend { near, far, nearness_weight: 0.8, area_weight: 0.2 }));
                policies.push(Box::new(CookLambda { start: near, half_area: far }));
            }
        }
        for policy in policies {
            for distance in odd {
                for radius in odd {
                    for fov_y in [f32::NAN, 0.0, 0.0175, 2.967, 3.2] {
                        let lod = policy.lod(&Sight { distance, radius, fov_y, height_px: 1.0 });
                        assert!((0.0..=1.0).contains(&lod), "{lod} at {distance} {radius} {fov_y}");
                    }
                }
            }
        }
    }

    #[test]
    fn equal_near_and_far_make_a_step_of_the_nearness() {
        let blend = Blend { near: 5.0, far: 5.0, nearness_weight: 1.0, area_weight: 0.0 };
        assert_eq!([blend.lod(&at(4.9)), blend.lod(&at(5.1))], [1.0, 0.0]);
    }

    #[test]
    fn from_inside_the_crown_everything_is_drawn() {
        for radii in [0.0, 0.5, 1.0] {
            assert_eq!(Blend::default().lod(&at(radii)), 1.0);
            assert_eq!(CookLambda::default().lod(&at(radii)), 1.0);
        }
    }

    /// Policies that would draw less from inside, also at the centre.
    fn sparing() -> Vec<Box<dyn LodPolicy>> {
        vec![
            Box::new(Blend { near: 0.1, far: 0.4, nearness_weight: 1.0, area_weight: 0.0 }),
            Box::new(CookLambda { start: 0.01, half_area: 0.4 }),
            Box::new(Sizes::new(&[(10.0, 0.05), (200.0, 0.3)]).unwrap()),
            // Nine leaves in ten are hidden from all views.
            Box::new(PixelError { bound_px: 2.0, share: (0..101).map(|n| f64::from(u8::from(n < 10))).collect() }),
        ]
    }

    #[test]
    fn from_inside_the_crown_at_least_half_is_drawn_by_any_policy() {
        for (i, policy) in sparing().iter().enumerate() {
            for step in 0..=100 {
                let sight = at(0.01 * step as f32);
                let lod = policy.lod(&sight);
                assert_eq!(lod, policy.lod_outside(&sight).max(0.5), "policy {i} at {sight:?}");
            }
            assert!(policy.lod_outside(&at(0.9)) < 0.5 && policy.lod(&at(0.9)) == 0.5, "policy {i}");
            for radii in [1.5, 1.6, 3.0, 40.0] {
                assert_eq!(policy.lod(&at(radii)), policy.lod_outside(&at(radii)), "policy {i} at {radii}");
            }
        }
    }

    #[test]
    fn leaf_count_rounds_and_stays_between_the_least_and_all() {
        let counts = [0.0, 0.049, 0.25, 0.5, 0.999, 1.0, 2.0, -1.0, f32::NAN].map(|lod| leaf_count(lod, 100, 3));
        assert_eq!(counts, [3, 5, 25, 50, 100, 100, 100, 3, 3]);
        assert_eq!(leaf_count(0.5, 2, 10), 2);
        for n in [1, 77_777, 4_194_303_u32] {
            assert_eq!(leaf_count((f64::from(n) / 4_194_304.0) as f32, 4_194_304, 0), n);
        }
    }

    #[test]
    fn a_trembling_count_settles_and_a_slow_one_moves_by_two_at_most() {
        let mut hysteresis = Hysteresis::new(0.02);
        assert_eq!(hysteresis.settle(1000, 2000, 1), 1000);
        for wanted in [1010, 990, 1005, 1015, 985] {
            assert_eq!(hysteresis.settle(wanted, 2000, 1), 1000);
        }
        let mut last = 1000;
        for wanted in (1..1000).rev() {
            let n = hysteresis.settle(wanted, 2000, 1);
            assert!(last - n <= 2, "{last} -> {n}");
            last = n;
        }
        assert_eq!(hysteresis.settle(1, 2000, 1), 1);
        assert_eq!(hysteresis.settle(2000, 2000, 1), 2000);
        assert_eq!(Hysteresis::new(f32::NAN).settle(7, 5, 9), 5);
    }
}
