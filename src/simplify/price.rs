//! What covering a pixel is worth: more than its picture tells while the crown is thinner than at full detail.
//!
//! The best guess for a pixel that half of the fine structure covers is to leave it open, and so a crown that is judged
//! pixel by pixel thins out as its leaves become fewer. A price on coverage counters that: it rises with what all views
//! together lack of the covered pixels of the full plant, and is negative while they have too many.

use super::areas::Areas;

/// Steps of the price that make up the difference between a polygon and the background.
pub const STEPS: i64 = 8;
/// Part of the full plant's covered pixels that, when they lack, makes the price that difference.
const FULL_PRICE_SHARE: f64 = 0.05;

/// The price, from how many pixels are covered.
#[derive(Debug, Clone, Copy)]
pub struct Price {
    /// Pixels of all views that the full plant leaves open.
    open: i64,
    /// Pixels by which coverage changes for one step of the price.
    pixels_per_step: i64,
}

impl Price {
    /// For views of `pixels` pixels in all, of which the full plant leaves `open` uncovered.
    pub fn new(pixels: u64, open: u64) -> Self {
        let covered = pixels - open.min(pixels);
        let pixels_per_step = (covered as f64 * FULL_PRICE_SHARE / STEPS as f64) as i64;
        Self { open: open as i64, pixels_per_step: pixels_per_step.max(1) }
    }

    /// The price now: from `-STEPS` to `STEPS`.
    pub fn steps(&self, areas: &Areas) -> i64 {
        let lacking = i64::from(areas.total(areas.background())) - self.open;
        (lacking / self.pixels_per_step).clamp(-STEPS, STEPS)
    }
}

/// What a change of a leaf's footprint would do for views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gain {
    /// By how much they would differ less from their references.
    pub closer: i64,
    /// How many more pixels would be covered.
    pub covered: i64,
}

impl Gain {
    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        Self { closer: self.closer + other.closer, covered: self.covered + other.covered }
    }

    /// Both in one number, `price` being that of a pixel in parts of [`STEPS`].
    pub fn score(self, price: i64) -> i64 {
        self.closer * STEPS + self.covered * price
    }

    /// As often.
    pub fn times(self, count: i64) -> Self {
        Self { closer: self.closer * count, covered: self.covered * count }
    }
}
