//! Everything that stays constant while leaves are pruned.

use super::{
    appearance::Appearance,
    fragments::AlphaMask,
    shapes::{Shape, Shapes},
    views::ViewSet,
};
use crate::plant::Tiling;

/// Read-only input of the pruning steps.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Triangles of the plant.
    pub shapes: &'a Shapes,
    /// The cameras.
    pub views: &'a ViewSet,
    /// Alpha masks of the materials.
    pub masks: &'a [AlphaMask],
    /// Looks for judging growths; required if the compensation rule judges growths.
    pub appearance: Option<&'a Appearance>,
    /// Whether leaves that can grow by tiling do.
    pub tiles: bool,
}

impl Scene<'_> {
    /// Tiling of a leaf at a scale.
    pub fn tiling(&self, shape: &Shape, scale: f32) -> Option<Tiling> {
        self.tiles.then(|| shape.tiling(scale)).flatten()
    }
}
