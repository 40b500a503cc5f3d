//! Draw lists of the software renderer: parts of leaves and wood, and their placement.

use super::{light::Light, riders::Riders, samples::SAMPLES, toning::Toning};
use crate::{
    Plant,
    bounds::Aabb,
    draw::{light::Lighting, seed::seeds, tint::Tint},
    effects::{FadeBy, Limbs, wind::Sway},
    leaf::{LeafGeometry, Vertex},
    model::{Clusters, FoliageModel, Leaf, ShownCluster, Timeline, Transition},
    plant::{Outline, Outlines, Tiles, Wood, WoodPart},
};
use glam::{DAffine3, DVec3, Vec3};

/// Triangles of one material, scaled about a pivot.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// Vertices that `indices` refer to.
    pub vertices: &'a [Vertex],
    /// Three indices per triangle.
    pub indices: &'a [u32],
    /// Index of the material.
    pub material: u32,
    /// Fixed point of the scaling.
    pub pivot: [f32; 3],
    /// Linear scale; 1 leaves the part unchanged.
    pub scale: f32,
    /// Index of the leaf, which is lit on both sides and transmits light; `None` for wood.
    pub leaf: Option<u32>,
    /// Seed by which partial coverage is spread over samples, as a fraction of 2^32: evenly
    /// distributed among neighbouring leaves. Has no effect on wood.
    pub seed: u32,
    /// Fraction of a pixel's samples that the part may cover: below 1 only for a leaf that fades by
    /// alpha.
    pub share: f32,
    /// Outlines around all that is opaque of the part's texture, if there are any.
    pub outlines: &'a [Outline],
    /// What the part repeats if it is enlarged; `None` to show one larger picture.
    pub tiles: Option<Tiles>,
    /// How far each vertex is widened: depth is that of the vertex without it. Empty if none is.
    pub widened: &'a [Vec3],
    /// Of each vertex of a ribbon, [`Slid::across`](crate::wood::Slid::across); 0 for others. Empty
    /// if there are no ribbons.
    pub across: &'a [Vec3],
    /// What the part shows in place of its material, if it is the card of a cluster.
    pub picture: Option<Picture<'a>>,
}

/// The picture of a cluster of leaves, at some active count.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// The model's cards.
    pub clusters: &'a Clusters,
    /// Number of the card.
    pub card: usize,
    /// What shows of it.
    pub shown: ShownCluster,
}

impl Picture<'_> {
    pub(super) fn covers(&self, uv: [f32; 2]) -> bool {
        self.clusters.covers(self.card, &self.shown, uv)
    }

    /// Share of its shaded colour's distance from the plant's mean that it keeps with tone.
    pub(super) fn kept(&self) -> f32 {
        self.clusters.cards()[self.card].kept
    }
}

impl<'a> Part<'a> {
    /// A part of wood.
    pub(super) fn of_wood(vertices: &'a [Vertex], indices: &'a [u32], material: u32) -> Self {
        let (pivot, outlines): (_, &[Outline]) = ([0.0; 3], &[]);
        Self {
            vertices,
            indices,
            material,
            pivot,
            scale: 1.0,
            leaf: None,
            seed: 0,
            share: 1.0,
            outlines,
            tiles: None,
            widened: &[],
            across: &[],
            picture: None,
        }
    }

    /// Mask of the samples that the part may cover, one bit per sample. The first one depends on
    /// the leaf, so that fading leaves in front of each other cover different samples and add up.
    pub(super) fn samples(&self) -> u32 {
        let all = SAMPLES as u32;
        let count = (self.share.clamp(0.0, 1.0) * all as f32 + 0.5) as u32;
        let first = self.leaf.unwrap_or(0) % all;
        let run = (1_u32 << count) - 1;
        (run << first | run >> (all - first)) & ((1 << all) - 1)
    }
}

/// Leaves of a model to draw, and how they fade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Active count, and the leaves in transition.
    pub transition: Transition,
    /// Property of the leaves in transition that changes.
    pub by: FadeBy,
    /// Factor applied to every leaf's drawn scale.
    pub leaf_scale: f32,
}

/// Parts of one plant to draw, in the plant's space.
#[derive(Debug, Clone)]
pub struct DrawList<'a> {
    /// Leaves and wood, in any order.
    pub parts: Vec<Part<'a>>,
    /// Bounding box of all leaves of the plant, drawn or not; light fades towards its centre.
    pub crown: Aabb,
}

impl<'a> DrawList<'a> {
    /// A plant's wood and all of its leaves.
    pub fn of_plant(plant: &'a Plant) -> Self {
        let mut list = Self::of_wood(&plant.wood, &plant.vertices);
        let seeds = seeds(&plant.vertices, &plant.indices, plant.leaves.iter().map(|leaf| leaf.indices));
        let outlines = Outlines::new(&plant.outlines);
        for ((number, leaf), seed) in (0..).zip(&plant.leaves).zip(seeds) {
            let part = Part {
                vertices: &plant.vertices,
                indices: &plant.indices[leaf.index_range()],
                material: leaf.material,
                pivot: leaf.pivot,
                scale: 1.0,
                leaf: Some(number),
                seed,
                share: 1.0,
                outlines: &[],
                tiles: None,
                widened: &[],
                across: &[],
                picture: None,
            };
            list.add_leaf(part, leaf, &outlines);
        }
        list
    }

    /// A model's wood and its first `active_count` leaves, each at its drawn scale for that count.
    pub fn of_model(model: &'a FoliageModel, active_count: usize) -> Self {
        if model.clusters.cards().is_empty() {
            return Self::of_scaled(model, drawn_scales(model, active_count));
        }
        let transition = Transition::new(active_count as f64, 1.0, model.leaves.len() as u32);
        Self::between(model, &Timeline::with_cards(model), &transition)
    }

    /// Same as [`of_model`](Self::of_model) for a fractional active count: the leaves in transition
    /// change in size. `timeline` must be built from `model`.
    pub fn between(model: &'a FoliageModel, timeline: &Timeline, transition: &Transition) -> Self {
        Self::of_drawn(model, timeline, &Drawn { transition: *transition, by: FadeBy::Size, leaf_scale: 1.0 })
    }

    /// A model's wood and the leaves that `drawn` selects, with the cards of clusters if the
    /// timeline [has them](Timeline::has_cards). `timeline` must be built from `model`.
    pub fn of_drawn(model: &'a FoliageModel, timeline: &Timeline, drawn: &Drawn) -> Self {
        let mut list = Self::of_wood(&model.wood, &model.vertices);
        let leaves = drawn.transition.drawn().min(timeline.leaves());
        let outlines = Outlines::new(&model.outlines);
        for ((number, leaf), seed) in (0..leaves).zip(&model.leaves).zip(leaf_seeds(model)) {
            let (scale, share) = match drawn.by {
                FadeBy::Size => (timeline.scale_at(number, &drawn.transition), 1.0),
                FadeBy::Alpha => (timeline.full_scale_at(number, &drawn.transition), drawn.transition.presence(number)),
            };
            if scale == 0.0 {
                continue;
            }
            let part = part_of_leaf(model, number, leaf, scale * drawn.leaf_scale);
            list.add_leaf(Part { share, seed, ..part }, &leaf.geometry(), &outlines);
        }
        if timeline.has_cards() {
            list.add_cards(model, timeline, drawn);
        }
        list
    }

    /// Adds the cards of clusters that show.
    fn add_cards(&mut self, model: &'a FoliageModel, timeline: &Timeline, drawn: &Drawn) {
        let clusters = &model.clusters;
        for (number, card) in clusters.cards().iter().enumerate() {
            let Some(shown) = clusters.shown(number, timeline, &drawn.transition) else { continue };
            let picture = Picture { clusters, card: number, shown };
            // Of no material.
            let of_card = Part::of_wood(clusters.corners(number), &[0, 1, 2, 0, 2, 3], u32::MAX);
            self.parts.push(Part {
                pivot: card.center,
                scale: drawn.leaf_scale,
                leaf: Some(card.leaf),
                picture: Some(picture),
                ..of_card
            });
        }
    }

    fn of_scaled(model: &'a FoliageModel, scales: impl IntoIterator<Item = f32>) -> Self {
        let mut list = Self::of_wood(&model.wood, &model.vertices);
        let leaves = (0..).zip(&model.leaves).zip(scales).zip(leaf_seeds(model));
        let outlines = Outlines::new(&model.outlines);
        for (((number, leaf), scale), seed) in leaves {
            let part = part_of_leaf(model, number, leaf, scale);
            list.add_leaf(Part { seed, ..part }, &leaf.geometry(), &outlines);
        }
        list
    }

    /// Adds a leaf, one part for each run of triangles that show the same picture.
    fn add_leaf(&mut self, part: Part<'a>, leaf: &LeafGeometry, outlines: &Outlines<'a>) {
        let Some(outlines) = outlines.of_leaf(leaf, part.vertices, part.indices) else { return self.parts.push(part) };
        let mut indices = part.indices;
        for run in outlines.chunk_by(|a, b| std::ptr::eq(*a, *b)) {
            let (own, rest) = indices.split_at(3 * run.len());
            self.parts.push(Part { indices: own, outlines: run[0], ..part });
            indices = rest;
        }
    }

    fn of_wood(wood: &'a Wood, leaf_vertices: &[Vertex]) -> Self {
        let part = |part: &WoodPart| {
            let indices = wood.indices.get(part.indices[0] as usize..part.indices[1] as usize);
            Part::of_wood(&wood.vertices, indices.unwrap_or_default(), part.material)
        };
        let crown = Aabb::of_points(leaf_vertices.iter().map(|vertex| vertex.position));
        Self { parts: wood.parts.iter().map(part).collect(), crown }
    }
}

fn part_of_leaf<'a>(model: &'a FoliageModel, number: u32, leaf: &Leaf, scale: f32) -> Part<'a> {
    Part {
        vertices: &model.vertices,
        indices: model.indices.get(leaf.indices[0] as usize..leaf.indices[1] as usize).unwrap_or_default(),
        material: leaf.material,
        pivot: leaf.pivot,
        scale,
        leaf: Some(number),
        seed: 0,
        share: 1.0,
        outlines: &[],
        tiles: model.tiles(leaf),
        widened: &[],
        across: &[],
        picture: None,
    }
}

fn leaf_seeds(model: &FoliageModel) -> Vec<u32> {
    seeds(&model.vertices, &model.indices, model.leaves.iter().map(|leaf| leaf.indices))
}

/// Drawn scales of the first `active_count` leaves, found by pruning the whole model down to that
/// count.
fn drawn_scales(model: &FoliageModel, active_count: usize) -> Vec<f32> {
    let mut drawn = vec![1.0; model.leaves.len()];
    for pruned in model.leaves.iter().skip(active_count).rev() {
        if let Some(target) = drawn.get_mut(pruned.leaf_to_collapse as usize) {
            *target = pruned.scale;
        }
    }
    drawn.truncate(active_count);
    drawn
}

/// A draw list placed in the world.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// The draw list.
    pub list: &'a DrawList<'a>,
    /// Wood that is drawn with the list's own.
    pub wood: &'a [Part<'a>],
    /// Transform to world space. Lighting is slightly inaccurate under non-uniform scaling.
    pub world_from_plant: DAffine3,
    /// Tone of its leaves; `None` for the tone of the picture.
    pub tone: Option<Toning>,
    /// Wind motion in the plant's space; `None` without wind.
    pub sway: Option<Sway>,
    /// Limbs that the wind moves, and what `wood` rides on.
    pub(super) limbs: Option<(&'a Limbs, &'a Riders)>,
    /// Share of a pixel's samples, from 0 to 1, that are left to the plant's impostor.
    pub far: f32,
    /// Change of its lit colour.
    pub tint: Tint,
}

impl<'a> Placed<'a> {
    /// Places a list, with the tone of the picture and without wind or other wood.
    pub fn new(list: &'a DrawList<'a>, world_from_plant: DAffine3) -> Self {
        Self { list, wood: &[], world_from_plant, tone: None, sway: None, limbs: None, far: 0.0, tint: Tint::NONE }
    }

    pub(super) fn is_sound(&self) -> bool {
        is_sound(&self.world_from_plant)
    }

    pub(super) fn light(&self, eye: DVec3, lighting: &Lighting) -> Light {
        let plant_from_world = self.world_from_plant.inverse();
        Light::new(&self.list.crown, plant_from_world.transform_point3(eye), lighting).turned(&plant_from_world)
    }
}

/// Whether a plant can be drawn with a transform.
pub(super) fn is_sound(world_from_plant: &DAffine3) -> bool {
    world_from_plant.is_finite() && world_from_plant.inverse().is_finite()
}
