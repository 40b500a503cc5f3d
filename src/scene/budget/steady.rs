//! The bound on the worth of leaves from frame to frame: it is smoothed, and nothing else is.

/// Seconds in which the bound goes 63 % of the way to where it should be.
const SMOOTHING_SECONDS: f64 = 0.25;
/// Part of the budget by which a smoothed bound may exceed it, falling to nothing within so many
/// seconds.
const EXCESS: f64 = 0.05;
const EXCESS_SECONDS: f64 = 0.5;

/// The bound that was used last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steady {
    octaves: Option<f64>,
    /// Seconds since the budget was kept last.
    over_seconds: f64,
}

impl Steady {
    /// Bound of a frame, `seconds` after the last one, in which `octaves` would be right. `None` in
    /// the first frame: the right one itself.
    pub fn followed(&self, octaves: f64, seconds: f64) -> Option<f64> {
        let last = self.octaves?;
        let way = 1.0 - libm::exp(-passed(seconds) / SMOOTHING_SECONDS);
        Some(last + (octaves - last) * way)
    }

    /// Most that a frame may spend, `seconds` after the last one, of a budget.
    pub fn most(&self, budget: f64, seconds: f64) -> f64 {
        let left = 1.0 - (self.over_seconds + passed(seconds)) / EXCESS_SECONDS;
        budget * (1.0 + EXCESS * left.max(0.0))
    }

    /// Keeps the bound of a frame and whether it exceeded the budget.
    pub fn keep(&mut self, octaves: f64, is_over: bool, seconds: f64) {
        self.over_seconds = if is_over { self.over_seconds + passed(seconds) } else { 0.0 };
        self.octaves = Some(octaves);
    }
}

/// Seconds of a frame, at least 0; an endless one has none.
fn passed(seconds: f64) -> f64 {
    if seconds.is_finite() { seconds.max(0.0) } else { 0.0 }
}
