//! The model: leaves in drawing order, each with its swap record, and everything needed to draw
//! them.
//!
//! A model is immutable: any number of plants on screen share one model, each with its own active
//! count. [`assemble`](FoliageModel::assemble) builds a model from the steps of a simplification,
//! [`to_bytes`](FoliageModel::to_bytes) writes its file, and [`Timeline`] looks up the drawn scale
//! of any leaf at any active count without keeping state.

mod assemble;
mod clusters;
mod copies;
mod curve;
pub(crate) mod format;
mod grid;
mod growth;
mod impostor;
pub(crate) mod octahedral;
mod precision;
mod quantize;
mod shapes;
mod timeline;
mod validate;

pub use assemble::Prune;
pub use clusters::{ClusterCard, Clusters, EMPTY, PICTURE_SIDES, ShownCluster};
pub use copies::{LeafCopy, Turn};
pub use curve::{CurveCorner, ErrorCurve};
pub use format::{MAGIC, MAX_FILE_BYTES, ModelFile, Part, VERSION};
pub use growth::Growth;
pub(crate) use impostor::Framing;
pub use impostor::{FRAME_SIDES, FRAMES_ACROSS, Impostor, Lattice};
pub use precision::Precision;
pub use timeline::{Timeline, Transition};

use crate::{
    Plant,
    bounds::{Aabb, Sphere},
    leaf::LeafGeometry,
    plant::{PlantOf, Tiles},
    wood::WoodOrder,
};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// Value of `leaf_to_split` and `leaf_to_collapse` for leaf 0, which has no target.
pub const NO_LEAF: u32 = u32::MAX;

/// One leaf of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// Indices of the first and one-past-last vertex.
    pub vertices: [u32; 2],
    /// Positions of the first and one-past-last index; three per triangle, each an absolute vertex
    /// number.
    pub indices: [u32; 2],
    /// Point that stays fixed when the leaf is scaled.
    pub pivot: [f32; 3],
    /// Index into the model's materials.
    pub material: u32,
    /// The leaf whose scale is swapped when this leaf is added; [`NO_LEAF`] for leaf 0.
    pub leaf_to_split: u32,
    /// The leaf whose scale is swapped when this leaf is removed; always equal to `leaf_to_split`.
    pub leaf_to_collapse: u32,
    /// Swap slot: the target's linear scale once this leaf is removed. 1 for leaf 0.
    pub scale: f32,
    /// Error at which this leaf was pruned, in the unit of the criterion (VMI: bits, summed over
    /// the views). 0 for leaf 0.
    pub error: f32,
}

impl Leaf {
    /// The leaf that is enlarged when this one is removed; `None` for leaf 0.
    pub fn target(&self) -> Option<usize> {
        (self.leaf_to_collapse != NO_LEAF).then_some(self.leaf_to_collapse as usize)
    }

    /// The fields that this leaf shares with a leaf of a plant.
    pub fn geometry(&self) -> LeafGeometry {
        LeafGeometry { vertices: self.vertices, indices: self.indices, pivot: self.pivot, material: self.material }
    }
}

/// How a model was made, in enough detail to make it again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Recipe {
    /// Name of the preset that the options started from.
    pub preset: String,
    /// Name of the criterion.
    pub criterion: String,
    /// Name of the rule that enlarges targets.
    pub compensate: String,
    /// Width and height of each view in pixels.
    pub resolution: u32,
    /// Number of views.
    pub views: u32,
    /// Whether the background took part as an extra polygon.
    pub background: bool,
    /// Cost of leaves that no view sees, 0 to 1: the intrinsic cost of the image criterion.
    #[serde(skip)]
    pub intrinsic: f32,
    /// Rasteriser that captured the fragments: `cpu` or `gpu`.
    pub raster: String,
    /// Name of the GPU adapter, if the GPU was used.
    pub adapter: Option<String>,
}

/// A plant whose leaves are sorted so that the last one can be dropped first: the content of a
/// `.vds` file.
///
/// At active count `n` the prefix `0..n` is drawn. Every drawn scale is 1 at `n = N`. When `n`
/// falls to `i`, the drawn scale of leaf `i`'s target becomes leaf `i`'s `scale`; when `n` rises
/// again, the previous scale is restored.
///
/// Invariants, checked by [`FoliageModel::validate`]:
///
/// 1. to 6. as for [`Plant`]: leaves are contiguous, here in drawing order; each has triangles that
///    stay within its vertices; numbers are finite; materials and textures exist; wood parts cover
///    the wood; counts stay within their limits.
/// 7. There is at least one leaf.
/// 8. `leaf_to_split == leaf_to_collapse` for every leaf. Leaf 0 has [`NO_LEAF`], scale 1 and
///    error 0.
/// 9. The target of every other leaf precedes it in drawing order, so the target is still drawn
///    when the leaf is removed.
/// 10. Every scale is above 0, and the largest of them (leaf 0's 1 included) equals `max_scale`.
/// 11. Every error is finite and at least 0.
/// 12. The bounding box of the wood and of every leaf at each scale from 1 to its largest is
///     finite.
/// 13. as for [`Plant`]: outlines are sound.
/// 14. Tone is from 0 to [`Growth::MAX_TONE`].
/// 15. The impostor's sizes are within their limits, and its pages are as long as they say.
/// 16. The order of the wood is [valid](WoodOrder::validate) for it.
/// 17. The error curve is sound: see [`ErrorCurve`].
/// 18. Cards of clusters are in order, each begins with the removal of a leaf that its own stands
///     for, and has fewer than 255 events; their numbers are in range, and there are as many texels
///     as they say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FoliageModel {
    /// The plant, its leaves in drawing order, each with its swap record. Its fields and methods
    /// are reached through the model itself too.
    pub plant: PlantOf<Leaf>,
    /// How the model was made.
    pub recipe: Recipe,
    /// Largest linear scale at which any leaf is drawn; at least 1.
    pub max_scale: f32,
    /// How far the numbers may be from those of the plant that was simplified.
    pub precision: Precision,
    /// How enlarged leaves are drawn.
    pub growth: Growth,
    /// Leaves that the file stores as copies of others, in drawing order; found by
    /// [`quantize`](FoliageModel::quantize). They change the size of the file alone: those that do
    /// not give the vertices of their leaf bit for bit are ignored.
    pub copies: Vec<LeafCopy>,
    /// What is drawn in the plant's place far away, if it was [baked](crate::software::bake).
    pub impostor: Option<Impostor>,
    /// The order in which the wood loses detail where it is small; `None` draws stems whole or not
    /// at all.
    pub wood_order: Option<WoodOrder>,
    /// How wrong the plant looks with fewer leaves, if it was
    /// [measured](crate::simplify::error_curve).
    pub curve: Option<ErrorCurve>,
    /// Cards with pictures of the leaves that one stands for; drawers that do not know them enlarge
    /// the leaf instead.
    pub clusters: Clusters,
}

impl Deref for FoliageModel {
    type Target = PlantOf<Leaf>;

    fn deref(&self) -> &Self::Target {
        &self.plant
    }
}

impl DerefMut for FoliageModel {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.plant
    }
}

impl FoliageModel {
    /// Returns the plant that the model was made from, with its leaves in drawing order.
    pub fn to_plant(&self) -> Plant {
        Plant {
            name: self.name.clone(),
            vertices: self.vertices.clone(),
            indices: self.indices.clone(),
            leaves: self.leaves.iter().map(Leaf::geometry).collect(),
            wood: self.wood.clone(),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            outlines: self.outlines.clone(),
        }
    }

    /// Finds the [order](WoodOrder) in which the wood loses detail, if there is any wood. Do so
    /// after [`quantize`](Self::quantize), which moves vertices. O(n log n) for wood of tubes.
    #[cfg(feature = "simplify")]
    pub fn order_wood(&mut self) {
        self.wood_order = (!self.wood.indices.is_empty()).then(|| WoodOrder::new(&self.wood));
    }

    /// Bounding box of the wood and of every leaf at each scale from 0 to its largest: the box to
    /// cull with, at any active count. O(vertices).
    pub fn enlarged_aabb(&self) -> Aabb {
        Aabb::of_points(self.reach())
    }

    /// Bounding sphere of the wood and of every leaf at each scale from 0 to its largest.
    /// O(vertices).
    pub fn enlarged_sphere(&self) -> Sphere {
        Sphere::of_points(self.reach())
    }

    /// Largest scale that each leaf is drawn with at any active count. O(leaves).
    pub fn largest_scales(&self) -> Vec<f32> {
        let mut largest = vec![1.0_f32; self.leaves.len()];
        for leaf in &self.leaves {
            if let Some(scale) = leaf.target().and_then(|target| largest.get_mut(target)) {
                *scale = scale.max(leaf.scale);
            }
        }
        largest
    }

    /// Number of leaves that are enlarged at some active count and then repeat their picture.
    pub fn tiled_leaves(&self) -> usize {
        let leaves = self.leaves.iter().zip(self.largest_scales());
        leaves.filter(|(leaf, scale)| *scale > 1.0 && self.tiles(leaf).is_some()).count()
    }

    /// What an enlarged leaf repeats; `None` if it is drawn larger.
    pub(crate) fn tiles(&self, leaf: &Leaf) -> Option<Tiles> {
        let material = self.materials.get(leaf.material as usize).filter(|_| self.growth.tiles)?;
        Tiles::of_leaf(&leaf.geometry(), material, &self.vertices, &self.indices)
    }

    /// Every vertex of the wood, and for each leaf its pivot and its vertices at scale 1 and at its
    /// largest. Any convex shape around them contains the leaf at all scales.
    fn reach(&self) -> impl Iterator<Item = [f32; 3]> + Clone {
        let scales = std::sync::Arc::new(self.largest_scales());
        let leaves = (0..self.leaves.len()).flat_map(move |i| {
            let (leaf, scale) = (&self.leaves[i], scales[i]);
            let vertices = self.vertices.get(leaf.geometry().vertex_range()).unwrap_or_default();
            let at_scales = vertices.iter().flat_map(move |v| [v.position, scaled(v.position, leaf.pivot, scale)]);
            std::iter::once(leaf.pivot).chain(at_scales)
        });
        let cards = (0..self.clusters.cards().len()).flat_map(|card| self.clusters.corners(card));
        let fixed = cards.chain(&self.wood.vertices).map(|vertex| vertex.position);
        leaves.chain(fixed)
    }
}

/// Scales `position` about `pivot` by the linear factor `scale`; bit-identical at scale 1.
pub fn scaled(position: [f32; 3], pivot: [f32; 3], scale: f32) -> [f32; 3] {
    if scale == 1.0 {
        return position;
    }
    let pivot = Vec3::from(pivot);
    (pivot + (Vec3::from(position) - pivot) * scale).to_array()
}
