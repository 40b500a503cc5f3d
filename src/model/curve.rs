//! Error curve: how wrong a plant looks with fewer leaves.

use super::FoliageModel;
use crate::plant::{Broken, Checked};
use serde::{Deserialize, Serialize};

/// Most corners of a curve.
const MAX_CORNERS: usize = 1 << 16;
/// Ranges of the size and of its power.
const SIZES: std::ops::RangeInclusive<f32> = 1.0..=16384.0;
const POWERS: std::ops::RangeInclusive<f32> = 0.0..=4.0;

/// Error of a plant's picture by the number of leaves that are drawn: corners of its lower convex
/// hull, so that each leaf more is worth at most as much as the one before it.
///
/// The error is in wrong pixels, on average over the views: the squared difference of the picture
/// to that of all leaves, where a pixel that only one of them covers counts as 1. Squares add up
/// over plants, as those in the root mean square of a picture of all of them do.
///
/// At a diameter of D pixels the error is that at `size_px` times (D / `size_px`)^`size_power`.
///
/// Invariant 17 of [`FoliageModel`]:
///
/// - `size_px` is from 1 to 16384 and `size_power` from 0 to 4;
/// - the first of 2 to 65,536 corners is at no leaf and the last at all leaves, without an error;
/// - leaves increase from corner to corner;
/// - errors are finite and at least 0, and no corner is above the line through its neighbours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorCurve {
    /// Diameter in pixels, in the pictures, of the plant's bounding sphere.
    pub size_px: f32,
    /// Power of the diameter that the error grows with: 2 if it grows as the area, less if the
    /// pixels of small pictures even it out.
    pub size_power: f32,
    /// Corners of the hull, by increasing numbers of leaves.
    pub corners: Vec<CurveCorner>,
}

/// Corner of an error curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurveCorner {
    /// Number of leaves.
    pub leaves: u32,
    /// Error in pixels.
    pub error_px: f32,
}

impl ErrorCurve {
    /// The lower convex hull of measured errors: pairs of an increasing number of leaves, from 0 to
    /// all, and an error that is finite and at least 0; the last error counts as 0. O(points).
    pub fn hull(size_px: f32, size_power: f32, points: impl IntoIterator<Item = (u32, f32)>) -> Self {
        let mut corners: Vec<CurveCorner> = Vec::new();
        let mut points = points.into_iter().peekable();
        while let Some((leaves, error_px)) = points.next() {
            let error_px = if points.peek().is_some() { error_px } else { 0.0 };
            let corner = CurveCorner { leaves, error_px };
            while corners.len() > 1 && !is_below(corners[corners.len() - 2], corners[corners.len() - 1], corner) {
                corners.pop();
            }
            corners.push(corner);
        }
        Self { size_px, size_power, corners }
    }

    /// The curve that the errors recorded in the leaves of `model` sum up to: for models without a
    /// measured one. Its size is that of the simplification's views. Criteria that count pixels
    /// give an upper bound; the unit of the criterion `vmi` is pixels weighted by their bits.
    /// O(leaves).
    pub fn recorded(model: &FoliageModel) -> Self {
        let recipe = &model.recipe;
        let size_px = recipe.resolution.clamp(*SIZES.start() as u32, *SIZES.end() as u32) as f32;
        let square = size_px * size_px;
        let of_bits = if recipe.criterion == "vmi" { square } else { 1.0 };
        let per_view = f64::from(of_bits) / f64::from(recipe.views.max(1));
        // The last leaf has no record; its loss counts as that of the one before it.
        let first = model.leaves.get(1).map_or(square, |leaf| (f64::from(leaf.error) * per_view) as f32);
        let recorded = model.leaves.iter().skip(1).map(|leaf| f64::from(leaf.error) * per_view);
        let mut errors: Vec<f64> = std::iter::once(f64::from(first)).chain(recorded).collect();
        let mut sum = 0.0;
        for error in errors.iter_mut().rev() {
            sum += std::mem::replace(error, sum);
        }
        let most = f64::from(f32::MAX) / 1e6;
        let errors = std::iter::once(sum).chain(errors);
        Self::hull(size_px, 2.0, (0..).zip(errors.map(|error| error.min(most) as f32)))
    }

    /// The curve of `model`: measured, or else [recorded](Self::recorded).
    pub fn of(model: &FoliageModel) -> Self {
        model.curve.clone().unwrap_or_else(|| Self::recorded(model))
    }

    /// Number of all leaves.
    pub fn leaves(&self) -> u32 {
        self.corners.last().map_or(0, |corner| corner.leaves)
    }

    /// Error in pixels of `size_px`, on the hull, with a fractional number of leaves. That of no
    /// leaf for NaN. O(log corners).
    pub fn error_px(&self, leaves: f64) -> f64 {
        let at = |corner: CurveCorner| (f64::from(corner.leaves), f64::from(corner.error_px));
        let next = self.corners.partition_point(|corner| f64::from(corner.leaves) < leaves);
        let (Some(&to), Some(&from)) = (self.corners.get(next), self.corners.get(next.saturating_sub(1))) else {
            return 0.0;
        };
        let [(n, error), (from_n, from_error)] = [at(to), at(from)];
        if n == from_n { error } else { from_error + (error - from_error) * (leaves - from_n) / (n - from_n) }
    }

    /// Checks invariant 17 for a model of so many leaves.
    pub(super) fn check(&self, leaves: usize) -> Checked {
        let Self { size_px, size_power, corners } = self;
        let broken = |what: String| Err(Broken { invariant: 17, what: format!("the error curve {what}") });
        if !SIZES.contains(size_px) || !POWERS.contains(size_power) {
            return broken(format!("is of {size_px} pixels and grows with their power {size_power}"));
        }
        let ([first, .., last], 2..=MAX_CORNERS) = (&corners[..], corners.len()) else {
            return broken(format!("has {} corners", corners.len()));
        };
        if first.leaves != 0 || last.leaves as usize != leaves || last.error_px != 0.0 {
            return broken(format!("is from {first:?} to {last:?}"));
        }
        if let Some(corner) = corners.iter().find(|corner| !(corner.error_px >= 0.0 && corner.error_px.is_finite())) {
            return broken(format!("has {corner:?}"));
        }
        if let Some(pair) = corners.windows(2).find(|pair| pair[0].leaves >= pair[1].leaves) {
            return broken(format!("goes from {:?} to {:?}", pair[0], pair[1]));
        }
        match corners.windows(3).find(|three| !is_below(three[0], three[1], three[2])) {
            Some(three) => broken(format!("is not convex at {:?}", three[1])),
            None => Ok(()),
        }
    }
}

/// Whether the middle one of three corners is below the line through the others.
fn is_below(before: CurveCorner, middle: CurveCorner, after: CurveCorner) -> bool {
    let rise = |a: CurveCorner, b: CurveCorner| f64::from(b.error_px) - f64::from(a.error_px);
    let run = |a: CurveCorner, b: CurveCorner| f64::from(b.leaves) - f64::from(a.leaves);
    rise(before, middle) * run(middle, after) < rise(middle, after) * run(before, middle)
}

#[cfg(test)]
mod tests {
    use super::{super::validate::samples, *};
    use crate::Error;
    use proptest::prelude::*;

    fn curve(points: &[(u32, f32)]) -> ErrorCurve {
        ErrorCurve::hull(64.0, 2.0, points.iter().copied())
    }

    proptest! {
        #[test]
        fn a_hull_is_the_largest_convex_curve_below_all_points(
            errors in prop::collection::vec(0.0..100.0_f32, 2..40), steps in prop::collection::vec(1..50_u32, 40),
        ) {
            let counts = steps.iter().scan(0, |at, step| Some(std::mem::replace(at, *at + step)));
            let points: Vec<(u32, f32)> = counts.zip(errors).collect();
            let hull = curve(&points);
            prop_assert!(hull.check(hull.leaves() as usize).is_ok(), "{hull:?}");
            let last = points.len() - 1;
            for (i, &(n, error)) in points.iter().enumerate() {
                let error = if i == last { 0.0 } else { f64::from(error) };
                // The lowest line from a point at or before to one at or after.
                let mut lowest = error;
                for &(a, from) in &points[..=i] {
                    for (j, &(b, to)) in points.iter().enumerate().skip(i) {
                        let to = if j == last { 0.0 } else { f64::from(to) };
                        if b > a && !(a == n && b == n) {
                            let from = if a == points[last].0 { 0.0 } else { f64::from(from) };
                            lowest = lowest.min(from + (to - from) * f64::from(n - a) / f64::from(b - a));
                        }
                    }
                }
                prop_assert!((hull.error_px(f64::from(n)) - lowest).abs() < 1e-4 * (1.0 + lowest), "{n}: {lowest}");
            }
        }
    }

    #[test]
    fn recorded_errors_sum_up_from_the_last_leaf() {
        let mut model = samples::model(4);
        (model.recipe.resolution, model.recipe.views) = (10, 2);
        model.recipe.criterion = "image".into();
        for (leaf, error) in model.plant.leaves.iter_mut().zip([0.0, 32.0, 8.0, 2.0]) {
            leaf.error = error;
        }
        let curve = ErrorCurve::recorded(&model);
        let errors: Vec<f64> = (0..=4).map(|n| curve.error_px(f64::from(n))).collect();
        assert_eq!((curve.size_px, errors), (10.0, vec![37.0, 21.0, 5.0, 1.0, 0.0]));
        assert_eq!(curve.corners.len(), 4, "the second corner is on a line");
        model.recipe.criterion = "vmi".into();
        assert_eq!(ErrorCurve::recorded(&model).error_px(3.0), 100.0);
        assert_eq!(ErrorCurve::recorded(&samples::model(1)).corners.len(), 2);
    }

    #[test]
    fn a_curve_that_does_not_belong_to_the_model_or_is_not_convex_breaks_invariant_17() {
        let good = curve(&[(0, 9.0), (1, 4.0), (4, 0.0)]);
        let of = |change: fn(&mut ErrorCurve)| {
            let mut model = samples::model(4);
            let mut curve = good.clone();
            change(&mut curve);
            model.curve = Some(curve);
            match model.validate() {
                Ok(()) => 0,
                Err(Error::InvalidModel { invariant, .. }) => invariant,
                Err(other) => panic!("{other}"),
            }
        };
        assert_eq!(of(|_| {}), 0);
        let changes: [fn(&mut ErrorCurve); 10] = [
            |c| c.size_px = 0.5,
            |c| c.size_power = f32::NAN,
            |c| c.corners.truncate(1),
            |c| c.corners[2].leaves = 5,
            |c| c.corners[0].leaves = 1,
            |c| c.corners[2].error_px = 1e-9,
            |c| c.corners[1].error_px = f32::INFINITY,
            |c| c.corners[0].error_px = f32::NAN,
            |c| c.corners[1].leaves = 4,
            |c| c.corners[1].error_px = 8.0,
        ];
        assert_eq!(changes.map(of), [17; 10]);
    }

    #[test]
    fn errors_between_corners_are_on_lines_and_beyond_them_constant() {
        let curve = curve(&[(0, 9.0), (1, 4.0), (5, 0.0)]);
        let at = [-1.0, 0.0, 0.5, 1.0, 3.0, 5.0, 6.0, f64::INFINITY].map(|n| curve.error_px(n));
        assert_eq!(at, [9.0, 9.0, 6.5, 4.0, 2.0, 0.0, 0.0, 0.0]);
        assert_eq!(curve.error_px(f64::NAN), 9.0);
    }
}
