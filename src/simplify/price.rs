//! Prices of coverage, which keep the crown from thinning out and from growing out of its shape.
//!
//! For a pixel that is half covered by fine structure, the best guess is to leave it open, so a
//! crown that is judged pixel by pixel thins out as its leaves become fewer. A price on coverage
//! within the crown's [outline](super::outline) counters that: it rises with the number of covered
//! pixels of the full plant that the views together lack, and is negative while they have too many.
//!
//! Beyond the outline, a covered pixel has a price of its own, which rises steeply once their
//! number exceeds a small share: otherwise a few large leaves make up for gaps in the crown by
//! growing beyond its edge.

use super::{areas::Areas, change::Gain};
use std::ops::Mul;

/// Number of price steps that equal the difference between a polygon and the background.
pub const STEPS: i64 = 8;
/// Fraction of the full plant's covered pixels that must be missing for the price to reach
/// [`STEPS`].
const FULL_PRICE_SHARE: f64 = 0.05;
/// Fraction of the full plant's covered pixels up to which coverage beyond the outline has no price
/// of its own: leaves at the edge rarely fit it to the pixel.
const FREE_SHARE: f64 = 0.008;
/// Additional fraction per step of the price beyond the outline.
const SHARE_PER_STEP: f64 = 0.0005;
/// Highest price beyond the outline in steps; no gain within it is worth as much.
const MAX_STEPS_BEYOND: i64 = 8 * STEPS;

/// Prices of a covered pixel as functions of the numbers of covered pixels.
#[derive(Debug, Clone, Copy)]
pub struct Price {
    /// Number of pixels, over all views, that the full plant leaves uncovered.
    open: i64,
    /// Change in covered pixels per step of the price within the outline.
    pixels_per_step: i64,
    /// Number of covered pixels beyond the outline that have no price.
    free: i64,
    /// Change in covered pixels per step of the price beyond the outline.
    pixels_per_step_beyond: i64,
}

/// Prices of a covered pixel, in units of 1 / [`STEPS`] of the difference between a polygon and the
/// background.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Prices {
    /// Value within the outline.
    pub within: i64,
    /// Cost beyond the outline.
    pub beyond: i64,
}

impl Price {
    /// Creates the prices for views with `pixels` pixels in total; the full plant leaves `open` of
    /// them uncovered.
    pub fn new(pixels: u64, open: u64) -> Self {
        let share = |share: f64| ((pixels - open.min(pixels)) as f64 * share) as i64;
        Self {
            open: open as i64,
            pixels_per_step: share(FULL_PRICE_SHARE / STEPS as f64).max(1),
            free: share(FREE_SHARE),
            pixels_per_step_beyond: share(SHARE_PER_STEP).max(1),
        }
    }

    /// Current prices: `within` from `-STEPS` to `STEPS`, `beyond` from 0 to [`MAX_STEPS_BEYOND`].
    pub fn steps(&self, areas: &Areas) -> Prices {
        let lacking = i64::from(areas.total(areas.background())) - self.open + areas.beyond();
        let excess = areas.beyond() - self.free;
        Prices {
            within: (lacking / self.pixels_per_step).clamp(-STEPS, STEPS),
            beyond: (excess / self.pixels_per_step_beyond).clamp(0, MAX_STEPS_BEYOND),
        }
    }
}

impl Mul<i64> for Prices {
    type Output = Self;

    fn mul(self, factor: i64) -> Self {
        Self { within: self.within * factor, beyond: self.beyond * factor }
    }
}

impl Gain {
    /// Combines all parts into one number, in units of 1 / [`STEPS`].
    pub fn score(self, prices: Prices) -> i64 {
        self.closer * STEPS + self.within * prices.within - self.beyond * prices.beyond
    }
}
