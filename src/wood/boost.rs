//! Factors of the width that stems are drawn with, by the error.

use super::order::{BOOSTS, Boosts, NO_SWELL, SWELL_STEPS};
use crate::plant::Wood;
use glam::Vec3;
use std::f32::consts::SQRT_2;

/// Least error, over the size of the wood: half a pixel of wood of 2048 pixels.
const LEAST_ERROR: f32 = 1.0 / 4096.0;

/// Middle of the wood, and the diagonal of its box.
pub(super) fn extent(wood: &Wood) -> (Vec3, f32) {
    let positions = || wood.vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let low = positions().reduce(Vec3::min).unwrap_or_default();
    let high = positions().reduce(Vec3::max).unwrap_or_default();
    (low.midpoint(high), (high - low).length())
}

/// Factors at some errors: the random choice among few stems is uneven, and wide ones hide more or
/// less of each other.
#[derive(Debug, Clone)]
pub(super) struct Factors {
    pub(super) errors: [f32; BOOSTS],
    pub(super) factors: [f32; BOOSTS],
}

impl Factors {
    /// Factors of 1 for wood of this size.
    pub(super) fn new(size: f32) -> Self {
        let mut error = size * LEAST_ERROR / SQRT_2;
        let errors = std::array::from_fn(|_| {
            error *= SQRT_2;
            error
        });
        Self { errors, factors: [1.0; BOOSTS] }
    }

    /// The factors that boosts stand for.
    pub(super) fn of(size: f32, boosts: &Boosts) -> Self {
        let factor = |boost: u8| 1.0 + (f32::from(boost) - f32::from(NO_SWELL)) / SWELL_STEPS;
        Self { factors: boosts.map(factor), ..Self::new(size) }
    }

    /// The nearest boosts.
    #[cfg(feature = "simplify")]
    pub(super) fn boosts(&self) -> Boosts {
        self.factors.map(nearest_boost)
    }

    /// The factor at an error, between those that are given.
    pub(super) fn at(&self, error: f32) -> f32 {
        let above = self.errors.partition_point(|&at| at < error);
        let [low, high] = [above.saturating_sub(1), above.min(BOOSTS - 1)];
        let share = (error - self.errors[low]) / (self.errors[high] - self.errors[low]);
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        self.factors[low] + (self.factors[high] - self.factors[low]) * share
    }
}

/// The nearest step of a factor.
pub(super) fn nearest_boost(factor: f32) -> u8 {
    let steps = ((factor - 1.0) * SWELL_STEPS).round() + f32::from(NO_SWELL);
    if steps.is_finite() { steps.clamp(0.0, 255.0) as u8 } else { NO_SWELL }
}
