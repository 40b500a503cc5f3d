//! The bound on the worth of leaves that spends a budget: bisection over whole numbers of steps.

/// Steps in an octave.
const STEPS: f64 = (1_u64 << 32) as f64;

/// Two bounds close together, between which the budget is spent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Octaves of the bound that keeps within the budget.
    pub within: f64,
    /// Octaves of the lower bound, which exceeds it.
    pub beyond: f64,
    /// Part of the way from the counts at the first to those at the second that spends the budget:
    /// plants whose counts jump between the two share what is left.
    pub part: f64,
}

impl Bounds {
    /// Two bounds, the costs at which are known.
    pub fn between([within, beyond]: [f64; 2], [least, most]: [u64; 2], budget: u64) -> Self {
        let part = if most > least { budget.saturating_sub(least) as f64 / (most - least) as f64 } else { 0.0 };
        Self { within, beyond, part: part.clamp(0.0, 1.0) }
    }

    /// The bound between them, for counts that do not jump.
    pub fn middle(&self) -> f64 {
        0.5 * (self.within + self.beyond)
    }

    /// A bound that is not between two.
    pub fn at(octaves: f64) -> Self {
        Self { within: octaves, beyond: octaves, part: 0.0 }
    }
}

/// Finds the bounds between which `total`, which falls as the bound rises, passes `budget`. It
/// exceeds it at `low` and does not at `high`, in octaves.
pub fn bisect([low, high]: [f64; 2], budget: u64, mut total: impl FnMut(f64) -> u64) -> Bounds {
    let octaves = |step: i64| step as f64 / STEPS;
    let (mut beyond, mut within) = ((low * STEPS).floor() as i64 - 1, (high * STEPS).ceil() as i64 + 1);
    let mut totals = [total(octaves(beyond)), total(octaves(within))];
    while within - beyond > 1 {
        let middle = beyond + (within - beyond) / 2;
        let at = total(octaves(middle));
        if at > budget {
            (beyond, totals[0]) = (middle, at);
        } else {
            (within, totals[1]) = (middle, at);
        }
    }
    let [most, least] = totals;
    Bounds::between([octaves(within), octaves(beyond)], [least, most], budget)
}
