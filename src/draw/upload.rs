//! A model as records for upload to any engine: vertices, leaves, timeline events, wood.
//!
//! Positions are relative to the centre of the plant's bounding sphere (*local space*), so that the
//! precision of `f32` does not depend on where a file places the plant.

use super::{
    quads::Quads,
    records::{CrownRecord, Event, LeafRecord, LeafVertex, StemRecord, WoodSlide, WoodVertex},
    seed::seeds,
    stems::{DrawnStems, Levels, Stems},
    trimmed::Trimmed,
    wood::order_of,
};
use crate::{
    bounds::Aabb,
    crown::inverse_half_size,
    leaf::Vertex,
    model::{FoliageModel, Leaf, Timeline},
    plant::{Outline, rect},
    wood::WoodLevels,
};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Least width of a stem that slides.
const LEAST_WIDTH: f32 = 1e-30;

/// The records of one model. Draw the first [`index_end`](Self::index_end) of `leaf_indices`, or of
/// each material's own indices ([`by_material`](Self::by_material)), and the first
/// [`drawn_wood`](Self::drawn_wood) of `wood_indices`.
#[derive(Debug, Clone, PartialEq)]
pub struct Upload {
    /// Origin of local space, in plant space.
    pub center: [f64; 3],
    /// Vertices of all leaves, in drawing order; each stores its leaf.
    pub leaf_vertices: Vec<LeafVertex>,
    /// Three indices per leaf triangle, in drawing order.
    pub leaf_indices: Vec<u32>,
    /// One record per leaf.
    pub leaves: Vec<LeafRecord>,
    /// Events of the timeline, leaf by leaf; [`LeafRecord::first_event`] and `end_event` delimit
    /// one leaf's events.
    pub events: Vec<Event>,
    /// The box around all leaves.
    pub crown: CrownRecord,
    /// Vertices of the wood: one for each pair of a vertex and a material.
    pub wood_vertices: Vec<WoodVertex>,
    /// Parallel to `wood_vertices`, how they slide; empty unless the wood does.
    pub wood_slides: Vec<WoodSlide>,
    /// Stems of `wood_slides`.
    pub wood_stems: Vec<StemRecord>,
    /// Three indices per wood triangle, in the order in which stems or, if the wood slides,
    /// triangles may be left out.
    pub wood_indices: Vec<u32>,
    /// Entry n: one past the last index of the first n leaves.
    ends: Vec<u32>,
    stems: Levels,
    outlines: Vec<Outline>,
}

/// The leaves of one material, in drawing order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaterialLeaves {
    /// Index into the model's materials.
    pub material: u32,
    /// Three indices per triangle, into [`Upload::leaf_vertices`].
    pub indices: Vec<u32>,
    /// For each of its leaves, in ascending order: the number of the leaf, and one past its last
    /// index.
    ends: Vec<(u32, u32)>,
}

impl MaterialLeaves {
    /// Number of indices that the first `n` leaves of the model have in this material.
    pub fn index_end(&self, n: u32) -> u32 {
        let drawn = self.ends.partition_point(|&(leaf, _)| leaf < n);
        drawn.checked_sub(1).map_or(0, |last| self.ends[last].1)
    }
}

impl Upload {
    /// Builds the records of a valid model. Its wood is drawn by stems, whether it has an
    /// [order](FoliageModel::wood_order) or not. O(vertices + indices).
    pub fn new(model: &FoliageModel) -> Self {
        let Stems { corners, widths, levels } = Stems::new(model);
        Self::with_wood(model, &model.wood.vertices, &corners, &widths, levels, |_| Default::default())
    }

    /// Builds the records of a valid model whose wood slides, if it has an
    /// [order](FoliageModel::wood_order) of at most 65,536 stems and 5 million vertices: draw the
    /// triangles that are [drawn](Self::drawn_wood) at an error, with each vertex on its way to its
    /// parent, and those of ribbons turned towards the eye (see [`WoodSlide::half`]). Other models
    /// are as from [`new`](Self::new). O(n log n).
    pub fn sliding(model: &FoliageModel) -> Self {
        let Some(order) = order_of(model) else { return Self::new(model) };
        let levels = WoodLevels::with_ribbons(&model.wood, order);
        let widths: Vec<f32> = levels.vertex_stems.iter().map(|&stem| levels.widths[stem as usize]).collect();
        let ends = Levels::sliding(levels.drawn.clone());
        Self::with_wood(model, &levels.vertices, &levels.corners, &widths, ends, |copies| copies.sliding(&levels))
    }

    fn with_wood(
        model: &FoliageModel,
        wood: &[Vertex],
        corners: &[(u32, u32)],
        widths: &[f32],
        stems: Levels,
        slides: impl FnOnce(&mut WoodCopies<'_>) -> (Vec<WoodSlide>, Vec<StemRecord>),
    ) -> Self {
        let center = model.sphere().center();
        let (leaves, events) = leaf_records(model, center);
        let mut copies =
            WoodCopies { wood, center, widths, of: Vec::new(), vertices: Vec::new(), numbers: HashMap::new() };
        let wood_indices = corners.iter().map(|&(index, material)| copies.number(index, material)).collect();
        let (wood_slides, wood_stems) = slides(&mut copies);
        Self {
            center: center.to_array(),
            leaf_vertices: leaf_vertices(model, center),
            leaf_indices: model.indices.clone(),
            leaves,
            events,
            crown: crown_record(model, center),
            wood_vertices: copies.vertices,
            wood_slides,
            wood_stems,
            wood_indices,
            ends: std::iter::once(0).chain(model.leaves.iter().map(|leaf| leaf.indices[1])).collect(),
            stems,
            outlines: model.outlines.clone(),
        }
    }

    /// Hides leaves behind the cards of clusters: the events of each, from the one on with which
    /// its first card appears, leave it nothing. For drawers that draw the cards.
    #[cfg(feature = "render")]
    pub(crate) fn hide_behind_cards(&mut self, model: &FoliageModel) {
        let timeline = Timeline::with_cards(model);
        self.events.iter_mut().zip(timeline.scales()).for_each(|(event, scale)| event.scale = *scale);
    }

    /// Number of indices of the first `n` leaves, or of all leaves if the model has fewer.
    pub fn index_end(&self, n: u32) -> u32 {
        self.ends[(n as usize).min(self.ends.len() - 1)]
    }

    /// Wood indices to draw so that all stems at least `width` wide, in plant units, are drawn, and
    /// the width to which drawn stems that are thinner must be widened. If the wood slides, `width`
    /// is its error, and the width that is returned the one to draw it at.
    pub fn drawn_wood(&self, width: f32) -> DrawnStems {
        self.stems.drawn(width)
    }

    /// The leaves cut into quads. O(indices).
    pub(super) fn quads(&self) -> Quads {
        Quads::new(&self.leaf_vertices, &self.leaf_indices, self.ends.windows(2).map(|ends| [ends[0], ends[1]]))
    }

    /// The leaves whose quads are drawn within an outline. O(indices).
    pub(super) fn trimmed(&self, quads: &Quads) -> Trimmed {
        Trimmed::new(&self.outlines, &self.leaves, &self.leaf_vertices, quads)
    }

    pub(super) fn stems(&self) -> &Levels {
        &self.stems
    }

    /// Leaves grouped by material, without empty groups, for engines that draw one mesh per
    /// material. O(indices).
    pub fn by_material(&self) -> Vec<MaterialLeaves> {
        let mut groups: Vec<MaterialLeaves> = Vec::new();
        for (number, leaf) in (0..).zip(&self.leaves) {
            let place = groups.iter().position(|group| group.material == leaf.material).unwrap_or_else(|| {
                groups.push(MaterialLeaves { material: leaf.material, indices: Vec::new(), ends: Vec::new() });
                groups.len() - 1
            });
            let [start, end] = [number, number + 1].map(|n| self.index_end(n) as usize);
            let group = &mut groups[place];
            group.indices.extend_from_slice(&self.leaf_indices[start..end]);
            group.ends.push((number, group.indices.len() as u32));
        }
        groups
    }
}

fn local(position: [f32; 3], center: DVec3) -> [f32; 3] {
    (Vec3::from(position).as_dvec3() - center).as_vec3().to_array()
}

fn rgb([r, g, b, _]: [f32; 4]) -> [f32; 3] {
    [r, g, b]
}

fn leaf_vertices(model: &FoliageModel, center: DVec3) -> Vec<LeafVertex> {
    let vertices = |(number, leaf): (u32, &crate::model::Leaf)| {
        let vertices = model.vertices[leaf.geometry().vertex_range()].iter();
        vertices.map(move |&Vertex { position, normal, uv, color }| LeafVertex {
            position: local(position, center),
            normal,
            uv,
            color: rgb(color),
            leaf: number,
        })
    };
    (0..).zip(&model.leaves).flat_map(vertices).collect()
}

fn leaf_records(model: &FoliageModel, center: DVec3) -> (Vec<LeafRecord>, Vec<Event>) {
    let timeline = Timeline::new(model);
    let seeds = seeds(&model.vertices, &model.indices, model.leaves.iter().map(|leaf| leaf.indices));
    let leaves = model.leaves.iter().zip(timeline.starts().windows(2)).zip(seeds);
    let leaves = leaves.map(|((leaf, events), seed)| {
        let [uv_low, uv_size] = uv_range(model, leaf);
        LeafRecord {
            pivot: local(leaf.pivot, center),
            material: leaf.material,
            first_event: events[0],
            end_event: events[1],
            uv_low,
            uv_size,
            anchor: model.tiles(leaf).map_or([-1.0; 2], |tiles| tiles.anchor),
            seed,
        }
    });
    let events = timeline.events().iter().zip(timeline.scales()).map(|(&leaf, &scale)| Event { leaf, scale });
    (leaves.collect(), events.collect())
}

/// Lowest texture coordinates, width and height of the part of a texture that the vertices span.
fn uv_range(model: &FoliageModel, leaf: &Leaf) -> [[f32; 2]; 2] {
    let vertices = &model.vertices[leaf.geometry().vertex_range()];
    let [low, high] = rect(vertices.iter().map(|vertex| vertex.uv));
    if vertices.is_empty() {
        return [[0.0; 2]; 2];
    }
    [low, [0, 1].map(|axis| high[axis] - low[axis])]
}

fn crown_record(model: &FoliageModel, center: DVec3) -> CrownRecord {
    let crown = Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position));
    CrownRecord {
        center_local: (crown.center() - center).as_vec3().to_array(),
        padding: 0.0,
        inverse_half_size: inverse_half_size(&crown).to_array(),
        tone: model.growth.tone,
        mean: [0.0; 3],
        end: 0.0,
    }
}

/// Wood with a material at each vertex: a vertex shared by parts of several materials is repeated
/// for each of them.
struct WoodCopies<'a> {
    /// Vertices of the model's wood, and of its ribbons.
    wood: &'a [Vertex],
    center: DVec3,
    /// Width of the stem of each of them.
    widths: &'a [f32],
    /// Vertex of the model's wood and material of each of `vertices`.
    of: Vec<(u32, u32)>,
    vertices: Vec<WoodVertex>,
    numbers: HashMap<(u32, u32), u32>,
}

impl WoodCopies<'_> {
    /// Number of the vertex that stands for one of the model's wood with a material.
    fn number(&mut self, index: u32, material: u32) -> u32 {
        *self.numbers.entry((index, material)).or_insert_with(|| {
            let Vertex { position, normal, uv, color } = self.wood[index as usize];
            let (position, color) = (local(position, self.center), rgb(color));
            let width = self.widths[index as usize];
            self.vertices.push(WoodVertex { position, normal, uv, color, material, width });
            self.of.push((index, material));
            self.vertices.len() as u32 - 1
        })
    }

    /// Tells how all vertices slide, with those that they slide to added, and their stems.
    fn sliding(&mut self, levels: &WoodLevels) -> (Vec<WoodSlide>, Vec<StemRecord>) {
        let mut slides = Vec::new();
        // Vertices are added while this goes on.
        while let Some(&(vertex, material)) = self.of.get(slides.len()) {
            slides.push(WoodSlide {
                parent: self.number(levels.parents[vertex as usize], material),
                threshold: levels.thresholds[vertex as usize],
                stem: levels.vertex_stems[vertex as usize],
                half: levels.half(vertex),
            });
        }
        let stem = |(&swells, &width): (_, &f32)| StemRecord { width: width.max(LEAST_WIDTH), swells };
        (slides, levels.swells.iter().zip(&levels.widths).map(stem).collect())
    }
}
