//! Plants, and whatever else takes part in a budget.

use super::octaves::Octaves;
use crate::{extract::Sight, model::ErrorCurve};

/// Largest diameter that counts, in pixels: that of a plant with the camera in it.
pub const MOST_DIAMETER_PX: f32 = 16384.0;
/// Size, in heights of the picture, that a plant with the camera in it counts as.
const MOST_HEIGHTS: f32 = 2.0;
/// Largest cost that counts.
const MOST_COST: f32 = 1e9;

/// Something that takes a share of a budget: a plant in view, or one of its parts with a curve of
/// its own, such as its wood.
///
/// Numbers out of their ranges are clamped to them; what counts for NaN is told below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Item {
    /// Index of its error curve. One that does not exist is that of a plant without leaves.
    pub curve: u32,
    /// Diameter of the plant's bounding sphere on screen, in pixels: 0 to [`MOST_DIAMETER_PX`],
    /// which also counts for NaN, as from within the plant.
    pub diameter_px: f32,
    /// Factor of its error, such as the part of it that is visible; at least 0. With 0, or NaN, it
    /// has no more leaves than its floor.
    pub weight: f32,
    /// Fewest leaves, which it has unless the floors of all exceed the budget. NaN counts as 0.
    pub floor: f32,
    /// Most leaves; goes before the floor. NaN counts as all leaves.
    pub ceiling: f32,
    /// Cost of a leaf: 1 for a budget of leaves, its triangles or pixels for one of these. 0 to
    /// 1e9; NaN counts as 0.
    pub unit_cost: f32,
    /// Cost whatever the number of leaves, such as the triangles of the wood or the pixels of the
    /// impostor. 0 to 1e9; NaN counts as 0.
    pub fixed_cost: f32,
    /// Distance to the camera, in the unit of [`Rule::Gomez`](super::Rule); nothing else reads it.
    pub distance: f32,
}

impl Item {
    /// A plant of the curve with this index, in a budget of leaves, without a floor.
    pub fn new(curve: u32, diameter_px: f32) -> Self {
        Self {
            curve,
            diameter_px,
            weight: 1.0,
            floor: 0.0,
            ceiling: f32::INFINITY,
            unit_cost: 1.0,
            fixed_cost: 0.0,
            distance: 0.0,
        }
    }

    /// A plant as it is seen: with its size and distance, and from within its crown with at least
    /// the leaves that keep it from being hollow.
    ///
    /// Of a plant that is larger than the picture only a part shows, so the size approaches twice
    /// the height of the picture, without a jump where the camera enters the plant.
    pub fn seen(curve: u32, shape: &ErrorCurve, sight: &Sight) -> Self {
        let floor = sight.least_lod() * shape.leaves() as f32;
        let (outline, most) = (2.0 * sight.radius_px(), MOST_HEIGHTS * sight.height_px);
        let diameter = 1.0 / (outline.powi(-2) + most.powi(-2)).sqrt();
        Self { floor, distance: sight.distance, ..Self::new(curve, diameter) }
    }

    /// Octaves of the weighted error against that at the size of a curve. Minus infinity if the
    /// item cannot have an error.
    pub(super) fn weight_octaves(&self, octaves: &Octaves, size_octaves: f32, power: f32) -> f32 {
        let diameter = if self.diameter_px.is_nan() { MOST_DIAMETER_PX } else { self.diameter_px };
        let diameter = octaves.of(diameter.clamp(0.0, MOST_DIAMETER_PX));
        let weight = if self.weight == 1.0 { 0.0 } else { octaves.of(self.weight) };
        // Not 0 times infinity.
        let size = if power > 0.0 { power * (diameter - size_octaves) } else { 0.0 };
        size + weight
    }

    /// Fewest and most leaves of all of them.
    pub(super) fn bounds(&self, leaves: f32) -> [f32; 2] {
        // `min` and `max` pass over NaN.
        let most = self.ceiling.min(leaves).max(0.0);
        [self.floor.max(0.0).min(most), most]
    }

    pub(super) fn unit_cost(&self) -> f32 {
        in_range(self.unit_cost)
    }

    pub(super) fn fixed_cost(&self) -> f32 {
        in_range(self.fixed_cost)
    }
}

/// A cost within its range.
fn in_range(cost: f32) -> f32 {
    if cost > 0.0 { cost.min(MOST_COST) } else { 0.0 }
}
