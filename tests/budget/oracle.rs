//! Slow ways to split a budget, which share no code with the fast one.

use foliage_lod::{model::ErrorCurve, scene::budget::Item};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    pub fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }
}

/// Error of one plant on screen.
fn error_of(curves: &[ErrorCurve], item: &Item, count: f64) -> f64 {
    let curve = &curves[item.curve as usize];
    let size = f64::from(item.diameter_px) / f64::from(curve.size_px);
    f64::from(item.weight) * size.powf(f64::from(curve.size_power)) * curve.error_px(count)
}

/// Sum of the errors.
pub fn error_px(curves: &[ErrorCurve], items: &[Item], counts: &[f32]) -> f64 {
    items.iter().zip(counts).map(|(item, &count)| error_of(curves, item, f64::from(count))).sum()
}

/// The sum of powers of the errors, and its root; the largest error for infinity.
pub fn norm(curves: &[ErrorCurve], items: &[Item], counts: &[f32], exponent: f32) -> f64 {
    let errors = items.iter().zip(counts).map(|(item, &count)| error_of(curves, item, f64::from(count)));
    if exponent.is_infinite() {
        return errors.fold(0.0, f64::max);
    }
    errors.map(|error| error.powf(f64::from(exponent))).sum::<f64>().powf(1.0 / f64::from(exponent))
}

/// Fewest and most leaves.
fn range(curves: &[ErrorCurve], item: &Item) -> [usize; 2] {
    let most = item.ceiling.min(curves[item.curve as usize].leaves() as f32);
    [item.floor.min(most) as usize, most as usize]
}

/// The least sum of errors of all ways to split a budget of leaves into whole counts: plant by
/// plant, for each number of leaves spent so far.
pub fn least_error(curves: &[ErrorCurve], items: &[Item], budget: usize) -> f64 {
    let mut best = vec![0.0; budget + 1];
    for item in items {
        let [least, most] = range(curves, item);
        let with = |spent: usize| {
            let ways =
                (least..=most.min(spent)).map(|count| best[spent - count] + error_of(curves, item, count as f64));
            ways.fold(f64::INFINITY, f64::min)
        };
        best = (0..=budget).map(with).collect();
    }
    best.into_iter().fold(f64::INFINITY, f64::min)
}

/// The least norm of all ways to split a budget among three plants in quarters of leaves.
pub fn least_norm(curves: &[ErrorCurve], items: &[Item], budget: f64, exponent: f32) -> f64 {
    let quarters = (4.0 * budget) as u32;
    let most = |item: &Item| 4 * curves[item.curve as usize].leaves();
    let mut least = f64::INFINITY;
    for a in 0..=quarters.min(most(&items[0])) {
        for b in 0..=(quarters - a).min(most(&items[1])) {
            let c = (quarters - a - b).min(most(&items[2]));
            least = least.min(norm(curves, items, &[a, b, c].map(|count| count as f32 / 4.0), exponent));
        }
    }
    least
}

/// The least sum of errors: all segments of all curves, those that take off most for their cost
/// first, until the budget is spent. Without floors and ceilings.
pub fn greedy(curves: &[ErrorCurve], items: &[Item], budget: f64) -> f64 {
    let mut segments = Vec::new();
    let mut error = 0.0;
    for item in items {
        error += error_of(curves, item, 0.0);
        for pair in curves[item.curve as usize].corners.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|corner| error_of(curves, item, f64::from(corner.leaves)));
            let cost = f64::from(pair[1].leaves - pair[0].leaves) * f64::from(item.unit_cost);
            segments.push(((from - to) / cost, cost));
        }
    }
    segments.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left = budget;
    for (worth, cost) in segments {
        let spent = cost.min(left);
        error -= worth * spent;
        left -= spent;
    }
    error
}
