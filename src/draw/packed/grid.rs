//! Positions as steps of a grid.

use crate::bounds::Aabb;
use glam::{DVec3, Vec3};

/// Steps of a grid along each axis that one look covers.
const STEPS: f64 = 65536.0;
/// Largest number of origins along an axis; beyond it the steps grow.
const ORIGINS: f64 = 256.0;
/// Steps of pivots over the reach of the median leaf.
const PIVOT_STEPS: f64 = 64.0;
/// Origins along the longest axis of the wood.
const WOOD_ORIGINS: f64 = 4.0;

/// Points in steps from origins that are [`STEPS`] steps apart.
pub(super) struct Grid {
    low: DVec3,
    pub(super) step: f64,
}

impl Grid {
    /// Grid whose steps are small compared with leaves of these reaches.
    pub(super) fn of_pivots(bounds: Aabb, reaches: &[f32]) -> Self {
        let mut sorted: Vec<f32> = reaches.iter().copied().filter(|&reach| reach > 0.0).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let wanted = sorted.get(sorted.len() / 2).map_or(f64::INFINITY, |&reach| f64::from(reach) / PIVOT_STEPS);
        let across = f64::from(bounds.size().max_element());
        Self::new(bounds, (across / (STEPS - 1.0)).min(wanted).max(across / (STEPS * ORIGINS)))
    }

    pub(super) fn of_wood(bounds: Aabb) -> Self {
        Self::new(bounds, f64::from(bounds.size().max_element()) / (STEPS * WOOD_ORIGINS))
    }

    fn new(bounds: Aabb, step: f64) -> Self {
        // Both sides compute with the same step.
        let step = f64::from((step as f32).max(f32::MIN_POSITIVE));
        Self { low: bounds.center() - 0.5 * bounds.size().as_dvec3(), step }
    }

    /// The origin of the part that a point lies in, and its steps from there.
    pub(super) fn place(&self, point: [f32; 3]) -> (Vec3, [u32; 3]) {
        let steps = ((Vec3::from(point).as_dvec3() - self.low) / self.step).round().max(DVec3::ZERO);
        let part = (steps / STEPS).floor();
        let origin = self.low + part * STEPS * self.step;
        (origin.as_vec3(), (steps - part * STEPS).to_array().map(|steps| steps as u32))
    }
}
