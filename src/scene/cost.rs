//! What plants cost in triangles.

use crate::{
    model::FoliageModel,
    wood::{DrawnWood, WoodLevels},
};

/// Triangles of an impostor.
pub const IMPOSTOR: f32 = 2.0;

/// Triangles of the plants of one model.
pub struct Triangles {
    /// Of a leaf, on average.
    pub leaf: f32,
    /// Of all wood, where there is no order.
    wood: f32,
    drawn: Option<DrawnWood>,
    /// Radius of the model's bounding sphere.
    radius: f64,
}

impl Triangles {
    /// Counts the triangles of a valid model. O(n log n).
    pub fn new(model: &FoliageModel) -> Self {
        let of_order = |order| WoodLevels::with_ribbons(&model.wood, order).drawn;
        Self {
            leaf: (model.indices.len() / 3) as f32 / model.leaves.len().max(1) as f32,
            wood: model.wood.triangles() as f32,
            drawn: model.wood_order.as_ref().map(of_order),
            radius: model.sphere().radius,
        }
    }

    /// Triangles of the wood at an error, given as a part of the plant's radius.
    pub fn wood(&self, error: f64) -> f32 {
        let error = (error * self.radius) as f32;
        self.drawn.as_ref().map_or(self.wood, |drawn| drawn.at(error).len() as f32)
    }
}
