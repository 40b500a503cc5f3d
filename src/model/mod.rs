//! The model: leaves in drawing order, each with its swap record, and everything needed to draw them.
//!
//! A model never changes once it is made: any number of plants on screen read one model, each at its own active count.
//! [`assemble`](FoliageModel::assemble) makes it from the steps of a simplification, [`mod@format`] is its file, and
//! [`timeline`] tells the drawn scale of any leaf at any active count without state.

mod assemble;
pub mod format;
pub mod timeline;
mod validate;

pub use assemble::Prune;
pub use timeline::{Timeline, Transition};

use crate::{
    Plant,
    bounds::{Aabb, Sphere},
    leaf::{LeafGeometry, Vertex},
    material::{Material, Texture},
    plant::Wood,
};
use glam::Vec3;
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

impl Leaf {
    /// The leaf enlarged when this one is removed; `None` for leaf 0.
    pub fn target(&self) -> Option<usize> {
        (self.leaf_to_collapse != NO_LEAF).then_some(self.leaf_to_collapse as usize)
    }

    /// The part that a leaf of a plant has too.
    pub fn geometry(&self) -> LeafGeometry {
        LeafGeometry { vertices: self.vertices, indices: self.indices, pivot: self.pivot, material: self.material }
    }
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
///
/// At active count `n` the prefix `0..n` is drawn. Every drawn scale is 1 at `n = N`; when `n` falls to `i`, the drawn
/// scale of leaf `i`'s target becomes leaf `i`'s `scale`, and when `n` rises again it becomes what it was.
///
/// Invariants, checked by [`FoliageModel::validate`]:
///
/// 1. to 6. as for [`Plant`]: leaves lie one after another, here in drawing order; each has triangles that
///    stay within its vertices; numbers are finite; materials and textures exist; wood parts cover the wood; counts
///    stay within their limits.
/// 7. There is at least one leaf.
/// 8. `leaf_to_split == leaf_to_collapse` for every leaf. Leaf 0 has [`NO_LEAF`], scale 1 and error 0.
/// 9. The target of every other leaf comes before it in drawing order, so it is still drawn when the leaf goes.
/// 10. Every scale is above 0, and the largest of them all (leaf 0's 1 included) is `max_scale`.
/// 11. Every error is finite and at least 0.
/// 12. The box around every leaf at every scale that it is drawn with, and around the wood, is finite.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FoliageModel {
    /// Name of the plant.
    pub name: String,
    /// How it was made.
    pub recipe: Recipe,
    /// Largest linear scale that any leaf is ever drawn with; at least 1.
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

impl FoliageModel {
    /// Triangles of all leaves.
    pub fn leaf_triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// The plant that the model was made of, its leaves in drawing order.
    pub fn plant(&self) -> Plant {
        Plant {
            name: self.name.clone(),
            vertices: self.vertices.clone(),
            indices: self.indices.clone(),
            leaves: self.leaves.iter().map(Leaf::geometry).collect(),
            wood: self.wood.clone(),
            materials: self.materials.clone(),
            textures: self.textures.clone(),
        }
    }

    /// Box around foliage and wood at full detail: the plant's own. O(vertices).
    pub fn aabb(&self) -> Aabb {
        Aabb::of_points(self.positions())
    }

    /// Sphere around foliage and wood at full detail: the plant's own, to which distances refer. O(vertices).
    pub fn sphere(&self) -> Sphere {
        Sphere::of_points(self.positions())
    }

    /// Box around the wood and every leaf at every scale that it is drawn with: what culling needs, whatever the active
    /// count. O(vertices).
    pub fn enlarged_aabb(&self) -> Aabb {
        Aabb::of_points(self.reach())
    }

    /// Sphere around the wood and every leaf at every scale that it is drawn with. O(vertices).
    pub fn enlarged_sphere(&self) -> Sphere {
        Sphere::of_points(self.reach())
    }

    fn positions(&self) -> impl Iterator<Item = [f32; 3]> + Clone {
        self.vertices.iter().chain(&self.wood.vertices).map(|vertex| vertex.position)
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

    /// Every vertex where it is and, for an enlarged leaf, where it gets at the leaf's largest scale. What lies between
    /// the two is inside any convex shape around both.
    fn reach(&self) -> impl Iterator<Item = [f32; 3]> + Clone {
        let scales = std::sync::Arc::new(self.largest_scales());
        let leaves = (0..self.leaves.len()).flat_map(move |i| {
            let (leaf, scale) = (&self.leaves[i], scales[i]);
            let vertices = self.vertices.get(leaf.geometry().vertex_range()).unwrap_or_default();
            vertices.iter().flat_map(move |v| [v.position, scaled(v.position, leaf.pivot, scale)])
        });
        leaves.chain(self.wood.vertices.iter().map(|vertex| vertex.position))
    }
}

/// `position` moved away from `pivot` by the linear factor `scale`; the same bits at scale 1.
pub fn scaled(position: [f32; 3], pivot: [f32; 3], scale: f32) -> [f32; 3] {
    if scale == 1.0 {
        return position;
    }
    let pivot = Vec3::from(pivot);
    (pivot + (Vec3::from(position) - pivot) * scale).to_array()
}
