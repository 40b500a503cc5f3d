//! A plant: foliage cut into leaves, wood, materials and textures. The output of import and growth,
//! and the input of simplification.

use crate::{
    Error, Result,
    bounds::{Aabb, Sphere},
    leaf::{LeafGeometry, Vertex},
    material::{Material, Texture},
};
use serde::{Deserialize, Serialize};

mod canonical;
mod cards;
mod convex;
mod outline;
mod tiles;
#[cfg(feature = "simplify")]
mod trim;
#[cfg(feature = "simplify")]
pub(crate) use canonical::canonical;
pub(crate) use cards::{Card, cards, rect};
pub(crate) use convex::{Point, clipped, crossing, cut, is_convex, turn};
pub use outline::{MAX_OUTLINES, OUTLINE_CORNERS, Outline};
pub(crate) use outline::{Outlines, at_level, moved};
#[cfg(feature = "simplify")]
pub(crate) use tiles::Cell;
pub use tiles::Tiles;
#[cfg(feature = "software")]
pub use tiles::Tiling;
#[cfg(feature = "simplify")]
pub use trim::TRIM_CORNERS;

/// Maximum number of leaves in a plant: an index and a generation always fit into 32 bits.
pub const MAX_LEAVES: usize = 1 << 22;
/// Maximum number of vertices, and of indices, in foliage or in wood.
pub const MAX_ELEMENTS: usize = 1 << 27;

/// A part of the wood that uses one material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WoodPart {
    /// First and one-past-last position in [`Wood::indices`].
    pub indices: [u32; 2],
    /// Index into the owner's materials.
    pub material: u32,
}

/// Everything in a plant that is not a leaf: drawn but never pruned.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Wood {
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Vertex indices, three per triangle.
    pub indices: Vec<u32>,
    /// Parts by material, in index order and without gaps.
    pub parts: Vec<WoodPart>,
}

impl Wood {
    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }
}

/// One tree or bush: foliage and wood.
///
/// Invariants, checked by [`Plant::validate`]:
/// 1. Leaves are contiguous: leaf 0 starts at vertex 0 and index 0, each leaf starts where the
///    previous one ends, and the last leaf ends at the end of the arrays.
/// 2. Every leaf has at least one triangle, its index count is a multiple of 3, and its indices
///    refer to its own vertices.
/// 3. Every position, normal, uv, colour, pivot and material factor is finite.
/// 4. Every material index of leaves and wood, and every texture index of materials, is valid.
/// 5. Wood parts are contiguous and cover all wood indices, each part's index count is a multiple
///    of 3, and the indices refer to the wood's vertices.
/// 6. Counts do not exceed [`MAX_LEAVES`] and [`MAX_ELEMENTS`].
///
/// Invariant 13, numbered after those of a model: there are at most [`MAX_OUTLINES`] outlines, each
/// a convex polygon of 4 to 8 finite corners within a rectangle of a material that exists.
///
/// A plant without leaves is valid, but simplification rejects it.
pub type Plant = PlantOf<LeafGeometry>;

/// Foliage and wood, each leaf a record `L`: [`LeafGeometry`] in a [`Plant`], a leaf with its swap
/// record in a [`FoliageModel`](crate::FoliageModel).
#[derive(Debug, Clone, PartialEq)]
pub struct PlantOf<L> {
    /// Name, for messages and metadata.
    pub name: String,
    /// Leaf vertices, leaf after leaf.
    pub vertices: Vec<Vertex>,
    /// Leaf indices, leaf after leaf, as absolute vertex indices.
    pub indices: Vec<u32>,
    /// The leaves: of a plant in source order, of a model in drawing order.
    pub leaves: Vec<L>,
    /// Trunk and branches.
    pub wood: Wood,
    /// Materials of leaves and wood.
    pub materials: Vec<Material>,
    /// Textures of the materials.
    pub textures: Vec<Texture>,
    /// What is drawn of cards with the same picture; empty if cards are drawn whole.
    pub outlines: Vec<Outline>,
}

impl Plant {
    /// Appends a leaf. `indices` are relative to `vertices`.
    pub fn push_leaf(&mut self, vertices: &[Vertex], indices: &[u32], pivot: [f32; 3], material: u32) {
        let first_vertex = self.vertices.len() as u32;
        let first_index = self.indices.len() as u32;
        self.vertices.extend_from_slice(vertices);
        self.indices.extend(indices.iter().map(|index| index + first_vertex));
        self.leaves.push(LeafGeometry {
            vertices: [first_vertex, self.vertices.len() as u32],
            indices: [first_index, self.indices.len() as u32],
            pivot,
            material,
        });
    }

    /// Checks every numbered invariant of the type.
    ///
    /// # Errors
    /// [`Error::InvalidPlant`] with the number of the first violated invariant.
    pub fn validate(&self) -> Result<()> {
        self.parts()
            .validate(self.leaves.iter().cloned())
            .map_err(|Broken { invariant, what }| Error::InvalidPlant { invariant, what })
    }
}

impl<L> Default for PlantOf<L> {
    fn default() -> Self {
        Self {
            name: String::new(),
            vertices: Vec::new(),
            indices: Vec::new(),
            leaves: Vec::new(),
            wood: Wood::default(),
            materials: Vec::new(),
            textures: Vec::new(),
            outlines: Vec::new(),
        }
    }
}

impl<L> PlantOf<L> {
    /// Number of triangles in all leaves.
    pub fn leaf_triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// Bounding box of foliage and wood.
    pub fn aabb(&self) -> Aabb {
        Aabb::of_points(self.positions())
    }

    /// Bounding sphere of foliage and wood.
    pub fn sphere(&self) -> Sphere {
        Sphere::of_points(self.positions())
    }

    fn positions(&self) -> impl Iterator<Item = [f32; 3]> + Clone {
        self.vertices.iter().chain(&self.wood.vertices).map(|vertex| vertex.position)
    }

    pub(crate) fn parts(&self) -> Parts<'_> {
        Parts {
            vertices: &self.vertices,
            indices: &self.indices,
            wood: &self.wood,
            materials: &self.materials,
            textures: &self.textures,
            outlines: &self.outlines,
        }
    }
}

/// Number of a violated invariant, and a description of the violation.
pub(crate) struct Broken {
    pub(crate) invariant: u8,
    pub(crate) what: String,
}

pub(crate) type Checked = std::result::Result<(), Broken>;

/// Returns [`Broken`] unless the invariant holds.
pub(crate) fn check(invariant: u8, holds: bool, what: impl FnOnce() -> String) -> Checked {
    if holds { Ok(()) } else { Err(Broken { invariant, what: what() }) }
}

/// The arrays that plants and models have in common, for checking [`Plant`]'s invariants on either.
pub(crate) struct Parts<'a> {
    pub(crate) vertices: &'a [Vertex],
    pub(crate) indices: &'a [u32],
    pub(crate) wood: &'a Wood,
    pub(crate) materials: &'a [Material],
    pub(crate) textures: &'a [Texture],
    pub(crate) outlines: &'a [Outline],
}

impl Parts<'_> {
    /// Checks invariants 1 to 6 and 13 of [`Plant`] for these arrays and their `leaves`.
    pub(crate) fn validate(&self, leaves: impl ExactSizeIterator<Item = LeafGeometry> + Clone) -> Checked {
        self.validate_counts(leaves.len())?;
        self.validate_leaves(leaves.clone())?;
        self.validate_numbers(leaves.clone())?;
        self.validate_materials(leaves)?;
        self.validate_wood()?;
        outline::check_all(self.outlines, self.materials.len())
    }

    fn validate_counts(&self, leaves: usize) -> Checked {
        let counts = [self.vertices.len(), self.indices.len(), self.wood.vertices.len(), self.wood.indices.len()];
        check(6, leaves <= MAX_LEAVES, || format!("{leaves} leaves"))?;
        check(6, counts.iter().all(|&count| count <= MAX_ELEMENTS), || format!("{counts:?} vertices and indices"))
    }

    fn validate_leaves(&self, leaves: impl Iterator<Item = LeafGeometry>) -> Checked {
        let (mut vertex, mut index) = (0, 0);
        for (i, leaf) in leaves.enumerate() {
            let starts_where_the_last_ended = leaf.vertices[0] == vertex && leaf.indices[0] == index;
            let ends_within = leaf.vertices[1] as usize <= self.vertices.len()
                && leaf.indices[1] as usize <= self.indices.len()
                && leaf.vertices[1] >= vertex
                && leaf.indices[1] >= index;
            check(1, starts_where_the_last_ended && ends_within, || format!("leaf {i} is {leaf:?}"))?;
            let indices = &self.indices[leaf.index_range()];
            let stay_within = indices.iter().all(|i| (leaf.vertices[0]..leaf.vertices[1]).contains(i));
            check(2, !indices.is_empty() && indices.len().is_multiple_of(3) && stay_within, || {
                format!("leaf {i}: its {} indices do not form triangles of its own vertices", indices.len())
            })?;
            [vertex, index] = [leaf.vertices[1], leaf.indices[1]];
        }
        let ends = vertex as usize == self.vertices.len() && index as usize == self.indices.len();
        check(1, ends, || format!("leaves end at vertex {vertex}, index {index}"))
    }

    fn validate_numbers(&self, mut leaves: impl Iterator<Item = LeafGeometry>) -> Checked {
        for (what, vertices) in [("leaf", self.vertices), ("wood", &self.wood.vertices)] {
            let broken =
                vertices.iter().position(|v| bytemuck::cast_ref::<_, [f32; 12]>(v).iter().any(|x| !x.is_finite()));
            check(3, broken.is_none(), || format!("{what} vertex {} is not finite", broken.unwrap_or_default()))?;
        }
        let broken = leaves.position(|leaf| leaf.pivot.iter().any(|x| !x.is_finite()));
        check(3, broken.is_none(), || format!("the pivot of leaf {} is not finite", broken.unwrap_or_default()))?;
        let is_finite = |m: &Material| m.base_color.iter().chain([&m.alpha_cutoff]).all(|x| x.is_finite());
        let broken = self.materials.iter().find(|material| !is_finite(material));
        check(3, broken.is_none(), || format!("a number of material {:?} is not finite", broken.map(|m| &m.name)))
    }

    fn validate_materials(&self, leaves: impl Iterator<Item = LeafGeometry>) -> Checked {
        let mut used = leaves.map(|leaf| leaf.material).chain(self.wood.parts.iter().map(|part| part.material));
        let missing = used.find(|&material| material as usize >= self.materials.len());
        check(4, missing.is_none(), || format!("material {missing:?} of {}", self.materials.len()))?;
        let missing = self.materials.iter().filter_map(|m| m.texture).find(|&t| t as usize >= self.textures.len());
        check(4, missing.is_none(), || format!("texture {missing:?} of {}", self.textures.len()))
    }

    fn validate_wood(&self) -> Checked {
        let mut at = 0;
        for part in &self.wood.parts {
            let [start, end] = part.indices;
            let sound = start == at && end >= start && (end - start).is_multiple_of(3);
            check(5, sound, || {
                format!("wood part {:?} must start at index {at} and hold whole triangles", part.indices)
            })?;
            at = end;
        }
        check(5, at as usize == self.wood.indices.len(), || format!("wood parts end at index {at}"))?;
        let worst = self.wood.indices.iter().max().copied();
        check(5, worst.is_none_or(|i| (i as usize) < self.wood.vertices.len()), || format!("wood index {worst:?}"))
    }
}
