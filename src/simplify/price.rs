//! Price of coverage: an additional value of covered pixels that keeps the crown from thinning out.
//!
//! For a pixel that is half covered by fine structure, the best guess is to leave it open, so a
//! crown that is judged pixel by pixel thins out as its leaves become fewer. A price on coverage
//! counters that: it rises with the number of covered pixels of the full plant that the views
//! together lack, and is negative while they have too many.

use super::{areas::Areas, change::Gain};

/// Number of price steps that equal the difference between a polygon and the background.
pub const STEPS: i64 = 8;
/// Fraction of the full plant's covered pixels that must be missing for the price to reach
/// [`STEPS`].
const FULL_PRICE_SHARE: f64 = 0.05;

/// Price of a covered pixel as a function of the number of covered pixels.
#[derive(Debug, Clone, Copy)]
pub struct Price {
    /// Number of pixels, over all views, that the full plant leaves uncovered.
    open: i64,
    /// Change in covered pixels per step of the price.
    pixels_per_step: i64,
}

impl Price {
    /// Creates the price for views with `pixels` pixels in total; the full plant leaves `open` of
    /// them uncovered.
    pub fn new(pixels: u64, open: u64) -> Self {
        let covered = pixels - open.min(pixels);
        let pixels_per_step = (covered as f64 * FULL_PRICE_SHARE / STEPS as f64) as i64;
        Self { open: open as i64, pixels_per_step: pixels_per_step.max(1) }
    }

    /// Current price in steps, from `-STEPS` to `STEPS`.
    pub fn steps(&self, areas: &Areas) -> i64 {
        let lacking = i64::from(areas.total(areas.background())) - self.open;
        (lacking / self.pixels_per_step).clamp(-STEPS, STEPS)
    }
}

impl Gain {
    /// Combines both parts into `closer * STEPS + covered * price`, where `price` is the value of a
    /// covered pixel in units of 1 / [`STEPS`].
    pub fn score(self, price: i64) -> i64 {
        self.closer * STEPS + self.covered * price
    }
}
