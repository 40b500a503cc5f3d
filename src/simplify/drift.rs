//! Bounds on how far the errors of leaves in front of the background (or the wood) can have moved
//! since they were computed.
//!
//! Every pruning that uncovers sky changes the background's row, and thus slightly changes the
//! error of every leaf that would uncover sky, which is thousands of leaves. Instead of recomputing
//! them all, a lower bound is kept. A leaf that would uncover d(v) pixels of a polygon with areas
//! a(v), where D and A are the sums over the views, changes the views' information by
//!
//! ```text
//! g(v) = (a + d)(L(a + d) - L(A + D)) - a (L(a) - L(A))
//! ```
//!
//! When a(v) moves by δ(v) and A by Δ, the changes of |g(v)|, summed over the views, are at most
//!
//! ```text
//! sum |δ(v)| (L(1 + D / a(v)) + L(1 + D / A))  +  2 D L((A_max + D) / (A_min + D))
//! ```
//!
//! where each a and A is the smaller of its values before and after (∂g/∂a and ∂g/∂A integrated,
//! d(v) <= D), plus |δ(v)| (1/ln 2) for each that starts or ends at 0. This bound is kept for each
//! power of two. It is concave in D and not negative, so for any D from 2^k on it is at most
//! D / 2^k times that for 2^k. Bounds only decide which errors are recomputed, never which leaf is
//! chosen.

/// Number of bounds, one for each power of two.
const BUCKETS: usize = 32;
/// Approximate number of steps for which the bounds that leaves are ranked by stay valid. A lower
/// value ranks all leaves more often, a higher one makes the bounds looser.
const EPOCH_STEPS: f64 = 64.0;
/// Factor that covers the rounding of the bound's own arithmetic.
const SAFETY: f64 = 1.001;

/// Accumulated movement of one polygon's row, in bits times pixels.
#[derive(Debug, Clone)]
pub struct Drift {
    /// Movement by bucket since the beginning, for buckets that are in use.
    so_far: [f64; BUCKETS],
    /// Movement that the epoch allows.
    allowed: [f64; BUCKETS],
    epoch_start: [f64; BUCKETS],
    is_used: [bool; BUCKETS],
    steps: f64,
}

impl Drift {
    /// Creates a drift without movement and without allowance.
    pub fn new() -> Self {
        let none = [0.0; BUCKETS];
        Self { so_far: none, allowed: none, epoch_start: none, is_used: [false; BUCKETS], steps: 0.0 }
    }

    /// Keeps bounds for leaves that uncover `uncovered` pixels in total.
    pub fn use_for(&mut self, uncovered: u32) {
        self.is_used[bucket(uncovered)] = true;
    }

    /// Movement so far of the errors of leaves that uncover `uncovered` pixels in total, at least
    /// 1. Only differences between two steps count.
    pub fn so_far(&self, uncovered: u32) -> f64 {
        at(&self.so_far, uncovered)
    }

    /// Largest value that [`so_far`](Self::so_far) may take before the epoch ends.
    pub fn allowed(&self, uncovered: u32) -> f64 {
        at(&self.allowed, uncovered)
    }

    /// Adds one step's movement of the row. Returns false if the epoch is over.
    pub fn advance(&mut self, old: &[u32], new: &[u32]) -> bool {
        self.steps += 1.0;
        let total = |row: &[u32]| row.iter().map(|&area| f64::from(area)).sum::<f64>();
        let (old_total, new_total) = (total(old), total(new));
        let (least, most) = (old_total.min(new_total), old_total.max(new_total));
        let mut holds = true;
        for bucket in (0..BUCKETS).filter(|&bucket| self.is_used[bucket]) {
            let uncovered = (1_u64 << bucket) as f64;
            let mut moved = 2.0 * uncovered * ((most + uncovered) / (least + uncovered)).log2();
            let slope_of_total = slope(uncovered, least);
            for (&old, &new) in old.iter().zip(new).filter(|(old, new)| old != new) {
                let delta = f64::from(old.abs_diff(new));
                moved += delta * (slope(uncovered, f64::from(old.min(new))) + slope_of_total);
            }
            self.so_far[bucket] += moved * SAFETY;
            holds &= self.so_far[bucket] <= self.allowed[bucket];
        }
        holds
    }

    /// Starts an epoch that allows the movement of [`EPOCH_STEPS`] steps at the pace of the last
    /// epoch.
    pub fn start_epoch(&mut self) {
        for bucket in 0..BUCKETS {
            let pace = (self.so_far[bucket] - self.epoch_start[bucket]) / self.steps.max(1.0);
            self.allowed[bucket] = self.so_far[bucket] + EPOCH_STEPS * pace;
            self.epoch_start[bucket] = self.so_far[bucket];
        }
        self.steps = 0.0;
    }
}

fn bucket(uncovered: u32) -> usize {
    uncovered.max(1).ilog2() as usize
}

/// Bound for a leaf by those for powers of two.
fn at(bounds: &[f64; BUCKETS], uncovered: u32) -> f64 {
    let bucket = bucket(uncovered);
    bounds[bucket] * (f64::from(uncovered) / (1_u64 << bucket) as f64)
}

/// L(1 + D / a). It is singular but integrable at 0, where the integral from 0 to 1 adds 1 / ln 2.
fn slope(uncovered: f64, area: f64) -> f64 {
    let at_zero = if area < 1.0 { std::f64::consts::LOG2_E } else { 0.0 };
    (1.0 + uncovered / area.max(1.0)).log2() + at_zero
}
