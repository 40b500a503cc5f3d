//! Demand: how many leaves of a plant are worth more than a bound.
//!
//! For a sum of errors a leaf is worth what it takes off the error: the slope of the curve. For a
//! sum of their powers q it takes off q E^(q-1) times as much. The worth here is the q-th root of
//! that, in octaves, so that it is the slope for q = 1 and becomes the error itself for the worst
//! plant.

use crate::model::{CurveCorner, ErrorCurve};

/// Octaves by which a leaf that takes off nothing is worth less than the one before it.
const NOTHING: f64 = 24.0;
/// Most by which the slopes at the ends of a curve differ from those of their segments.
const MOST_TURN: f64 = 16.0;
/// Knots in an octave of the worth, and most halvings of a segment for them.
const STEPS: f64 = 8.0;
const MOST_HALVINGS: u32 = 12;
/// Octaves to where the error, which falls to nothing on the last segment, counts as nothing.
const VANISHED: f64 = 12.0;
/// Octaves of a proportional demand, and its steps in an octave.
const PROPORTIONAL: [u32; 2] = [24, 32];

/// What a budget minimises: the sum of the plants' errors, each to the power of an exponent.
///
/// From 1, the sum of the errors, which a lone plant adds little to, to infinity, where the worst
/// plant alone counts and all have the same error. Other numbers count as the nearest of these, NaN
/// as the default, 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponent(f64);

impl Exponent {
    /// The sum of the errors.
    pub const SUM: Self = Self(1.0);
    /// The largest error.
    pub const WORST: Self = Self(f64::INFINITY);

    /// An exponent of 1 or more.
    pub fn new(exponent: f32) -> Self {
        if exponent.is_nan() { Self::default() } else { Self(f64::from(exponent).max(1.0)) }
    }

    /// Part of the octaves of a cost by which it lowers the worth.
    pub(super) fn of_cost(self) -> f64 {
        1.0 / self.0
    }

    /// Power of the share of a plant that shows by which its error counts: a share of its pixels
    /// adds that share of the power of its error. From the default on half of the octaves count, as
    /// the worst error would know no shares.
    pub(in crate::scene) fn of_share(self) -> f32 {
        1.0 / self.0.min(2.0) as f32
    }

    /// Octaves of the worth where the error and the slope have so many.
    fn worth(self, error: f64, slope: f64) -> f64 {
        let q = self.0;
        if q.is_infinite() { error } else { (libm::log2(q) + (q - 1.0) * error + slope) / q }
    }
}

impl Default for Exponent {
    /// Squares.
    fn default() -> Self {
        Self(2.0)
    }
}

/// Whether counts jump over the straight segments of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corners {
    /// The curve is taken as it is: leaves of one segment are all worth the same, and a plant takes
    /// them at once as the bound falls below that. Exactly the least error.
    Sharp,
    /// The slope changes gradually, so that the count follows the bound without jumps; the curve
    /// still passes through all corners.
    Round,
}

/// Number of leaves by the worth that they exceed.
#[derive(Debug, Clone)]
pub struct Demand {
    /// Octaves of the diameter of the curve, and the power of the diameter.
    pub size: f32,
    pub power: f32,
    /// All leaves.
    pub leaves: f32,
    /// Worth of a leaf, decreasing or as before, and the number of leaves that are worth more,
    /// increasing or as before.
    knots: Vec<Knot>,
    /// For each step of an octave below the first knot, the number of leaves that are worth more.
    /// Empty if numbers jump.
    table: Vec<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    worth: f64,
    count: f64,
}

/// Numbers in an octave of the table.
const PLACES: f64 = 16.0;

impl Demand {
    /// Demand by an error curve.
    pub fn new(curve: &ErrorCurve, exponent: Exponent, corners: Corners) -> Self {
        let curve = sound(curve);
        let segments: Vec<Segment> = segments(&curve, corners);
        let mut knots = Vec::new();
        segments.iter().for_each(|segment| segment.knots(exponent, &mut knots));
        let octaves = libm::log2(f64::from(curve.size_px));
        Self::of_knots(curve.leaves() as f32, [octaves as f32, curve.size_power], knots, corners)
    }

    /// Demand of the same share of all leaves at the same worth: 2^-worth of them.
    pub fn proportional(leaves: u32) -> Self {
        let [octaves, steps] = PROPORTIONAL;
        let knot = |step: u32| {
            let worth = f64::from(step) / f64::from(steps);
            Knot { worth, count: f64::from(leaves) * libm::exp2(-worth) }
        };
        let none = Knot { worth: f64::from(octaves) + NOTHING, count: 0.0 };
        let knots = std::iter::once(none).chain((0..=octaves * steps).rev().map(knot)).collect();
        Self::of_knots(leaves as f32, [0.0; 2], knots, Corners::Round)
    }

    fn of_knots(leaves: f32, [size, power]: [f32; 2], mut knots: Vec<Knot>, corners: Corners) -> Self {
        // Rounding may make them rise.
        let mut least = f64::INFINITY;
        for knot in &mut knots {
            least = least.min(knot.worth);
            knot.worth = least;
        }
        knots.dedup();
        let mut demand = Self { size, power, leaves, knots, table: Vec::new() };
        if let (Some([first, last]), Corners::Round) = (demand.range(), corners) {
            let places = ((first - last) * PLACES).ceil() as u32;
            demand.table = (0..=places).map(|place| demand.exact(first - f64::from(place) / PLACES) as f32).collect();
            demand.table.push(leaves);
        }
        demand
    }

    /// Largest and smallest worth of a leaf.
    pub fn range(&self) -> Option<[f64; 2]> {
        Some([self.knots.first()?.worth, self.knots.last()?.worth])
    }

    /// Whether numbers jump as the bound falls.
    pub fn jumps(&self) -> bool {
        self.table.is_empty()
    }

    /// Number of leaves that are worth more than `bound`; none for NaN.
    #[inline]
    pub fn count(&self, bound: f64) -> f64 {
        let (Some(first), [.., _, _]) = (self.knots.first(), &self.table[..]) else { return self.exact(bound) };
        let last = self.table.len() - 2;
        let place = ((first.worth - bound) * PLACES).max(0.0).min((last + 1) as f64);
        // At most the last.
        let number = (place as usize).min(last);
        let [from, to] = [self.table[number], self.table[number + 1]].map(f64::from);
        from + (to - from) * (place - number as f64)
    }

    /// As [`count`](Self::count), from the knots.
    fn exact(&self, bound: f64) -> f64 {
        let next = self.knots.partition_point(|knot| knot.worth > bound);
        match (next.checked_sub(1), self.knots.get(next)) {
            (None, _) => 0.0,
            (Some(before), None) => self.knots[before].count,
            (Some(before), Some(to)) => {
                let from = self.knots[before];
                from.count + (to.count - from.count) * ((from.worth - bound) / (from.worth - to.worth))
            }
        }
    }
}

/// A curve with what `ErrorCurve` promises, whatever its numbers.
fn sound(curve: &ErrorCurve) -> ErrorCurve {
    let error = |error: f32| if error.is_nan() { 0.0 } else { error.clamp(0.0, f32::MAX / 4.0) };
    let mut corners: Vec<(u32, f32)> = Vec::new();
    for corner in &curve.corners {
        if corners.is_empty() && corner.leaves > 0 {
            corners.push((0, error(corner.error_px)));
        }
        if corners.last().is_none_or(|&(leaves, _)| corner.leaves > leaves) {
            corners.push((corner.leaves, error(corner.error_px)));
        }
    }
    let size = if curve.size_px > 0.0 && curve.size_px.is_finite() { curve.size_px } else { 1.0 };
    let power = if curve.size_power.is_nan() { 2.0 } else { curve.size_power.clamp(0.0, 4.0) };
    ErrorCurve::hull(size, power, corners)
}

/// A segment of a curve. Its slope, the error that a leaf takes off, falls linearly from that of
/// its first corner to its mean, and from there to that of its last corner; the mean is where the
/// integral is that of the segment.
struct Segment {
    counts: [f64; 2],
    errors: [f64; 2],
    /// At the first corner, the mean, and at the last corner; above 0.
    slopes: [f64; 3],
}

fn segments(curve: &ErrorCurve, corners: Corners) -> Vec<Segment> {
    let mut last = None;
    let straight = |pair: &[CurveCorner]| {
        let counts = [pair[0], pair[1]].map(|corner| f64::from(corner.leaves));
        let errors = [pair[0], pair[1]].map(|corner| f64::from(corner.error_px));
        // Leaves that take off nothing come last.
        let least = last.map_or(f64::from(f32::MIN_POSITIVE), |slope: f64| slope * libm::exp2(-NOTHING));
        let slope = ((errors[0] - errors[1]) / (counts[1] - counts[0])).max(least);
        last = Some(slope);
        Segment { counts, errors, slopes: [slope; 3] }
    };
    let mut segments: Vec<Segment> = curve.corners.windows(2).map(straight).collect();
    if corners == Corners::Round {
        round(&mut segments);
    }
    segments
}

/// Gives each corner the geometric mean of the slopes on both sides, and the ends as much more and
/// less than theirs as the corners next to them.
fn round(segments: &mut [Segment]) {
    let means: Vec<f64> = segments.iter().map(|segment| segment.slopes[1]).collect();
    for i in 1..segments.len() {
        let middle = (means[i - 1] * means[i]).sqrt();
        (segments[i - 1].slopes[2], segments[i].slopes[0]) = (middle, middle);
    }
    let is_alone = segments.len() == 1;
    if let [first, ..] = segments {
        let [_, mean, to] = first.slopes;
        first.slopes[0] = if is_alone { 2.0 * mean } else { mean * (mean / to).min(MOST_TURN) };
    }
    if let [.., last] = segments {
        let [from, mean, _] = last.slopes;
        last.slopes[2] = if is_alone { 0.5 * mean } else { mean * (mean / from).max(1.0 / MOST_TURN) };
    }
}

impl Segment {
    /// Appends knots so close that a straight line between them will do.
    fn knots(&self, exponent: Exponent, knots: &mut Vec<Knot>) {
        let at = |part: f64| self.knot(part, exponent);
        knots.push(at(0.0));
        let mut ends = vec![(1.0, at(1.0), 0)];
        let mut from = (0.0, at(0.0));
        while let Some(&(part, to, depth)) = ends.last() {
            if depth < MOST_HALVINGS && from.1.worth - to.worth > 1.0 / STEPS {
                let middle = 0.5 * (from.0 + part);
                ends.last_mut().expect("just seen").2 += 1;
                ends.push((middle, at(middle), depth + 1));
            } else {
                knots.push(to);
                from = (part, to);
                ends.pop();
            }
        }
    }

    /// Count and worth of its next leaf at a part of the way through.
    fn knot(&self, part: f64, exponent: Exponent) -> Knot {
        let ([from, to], [from_error, to_error], [first, mean, last]) = (self.counts, self.errors, self.slopes);
        let turn = if first > last { (mean - last) / (first - last) } else { 0.5 };
        let count = from + (to - from) * part;
        let (slope, error) = if part <= turn {
            let fallen = (first - mean) * part / turn.max(f64::MIN_POSITIVE);
            (first - fallen, from_error - (to - from) * part * (first - 0.5 * fallen))
        } else {
            let left = 1.0 - part;
            let risen = (mean - last) * left / (1.0 - turn).max(f64::MIN_POSITIVE);
            (last + risen, to_error + (to - from) * left * (last + 0.5 * risen))
        };
        let least = f64::from(f32::MIN_POSITIVE).max(from_error * libm::exp2(-VANISHED));
        Knot { worth: exponent.worth(libm::log2(error.max(least)), libm::log2(slope)), count }
    }
}
