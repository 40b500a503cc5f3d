//! The model: leaves in drawing order, each with its swap record, and everything needed to draw them.

use crate::{
    leaf::Vertex,
    material::{Material, Texture},
    plant::Wood,
};
use serde::{Deserialize, Serialize};

/// `leaf_to_split` and `leaf_to_collapse` of leaf 0, which has no target.
pub const NO_LEAF: u32 = u32::MAX;

/// One leaf of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// First and one-past-last vertex.
    pub vertices: [u32; 2],
    /// First and one-past-last index; three per triangle, each an absolute vertex number.
    pub indices: [u32; 2],
    /// The fixed point when the leaf is scaled.
    pub pivot: [f32; 3],
    /// Index into the model's materials.
    pub material: u32,
    /// The leaf whose scale is swapped when this leaf is added; [`NO_LEAF`] for leaf 0.
    pub leaf_to_split: u32,
    /// The leaf whose scale is swapped when this leaf is removed; always equal to `leaf_to_split`.
    pub leaf_to_collapse: u32,
    /// Swap slot: the linear scale that the target gets when this leaf is removed. 1 for leaf 0.
    pub scale: f32,
    /// Error at which this leaf was pruned: the criterion's own unit (VMI: bits, summed over the views). 0 for leaf 0.
    pub error: f32,
}

/// How a model was made: enough to make it again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Recipe {
    /// Preset name the options started from.
    pub preset: String,
    /// Criterion name.
    pub criterion: String,
    /// Name of the rule that enlarges targets.
    pub compensate: String,
    /// Pixels on a side of each view.
    pub resolution: u32,
    /// Number of views.
    pub views: u32,
    /// The background took part as one more polygon.
    pub background: bool,
    /// `cpu` or `gpu`: which rasteriser captured the fragments.
    pub raster: String,
    /// The adapter's name where the GPU path was used.
    pub adapter: Option<String>,
}

/// A plant with its leaves in the order in which they may be lost (last first): the content of a `.vds` file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FoliageModel {
    /// Name of the plant.
    pub name: String,
    /// How it was made.
    pub recipe: Recipe,
    /// Largest linear scale that any leaf is ever drawn with.
    pub max_scale: f32,
    /// Leaf vertices, leaf after leaf in drawing order.
    pub vertices: Vec<Vertex>,
    /// Leaf indices, leaf after leaf in drawing order, absolute.
    pub indices: Vec<u32>,
    /// The leaves in drawing order.
    pub leaves: Vec<Leaf>,
    /// Trunk and branches.
    pub wood: Wood,
    /// Materials of leaves and wood.
    pub materials: Vec<Material>,
    /// Textures of the materials.
    pub textures: Vec<Texture>,
}

/// One step of a simplification: which leaf was pruned and what its target became.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prune {
    /// Index of the pruned leaf in the plant.
    pub leaf: u32,
    /// Index of its target in the plant.
    pub target: u32,
    /// The target's linear scale from now on (equal to the one before where nothing was added).
    pub target_scale: f32,
    /// Error at which the leaf was pruned.
    pub error: f32,
}
