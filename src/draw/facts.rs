//! Per-model facts from which frame lists are built.

use super::{
    cards::CardRanges,
    instance::{Instance, ModelId},
    live::LiveFrames,
    stems::Levels,
    upload::Upload,
};
use crate::{
    bounds::{Aabb, largest_scale},
    effects::{Limbs, wind::Shape},
    model::{FoliageModel, Framing, Leaf},
};
use glam::{DVec3, Vec3};
use slotmap::SlotMap;

/// Facts of all models of a renderer.
pub type Facts = SlotMap<ModelId, ModelFacts>;

/// Facts about a model that a frame list needs.
#[derive(Debug, Clone)]
pub struct ModelFacts {
    /// Origin of local space, in plant space.
    pub(crate) center: DVec3,
    pub(crate) leaves: u32,
    /// Entry n: number of quads of the first n leaves.
    quad_ends: Vec<u32>,
    pub(crate) stems: Levels,
    /// Pixels per unit of length from which on leaves are drawn within their outlines.
    pub(super) trimmed_from: f32,
    /// Greatest distance from the centre at which anything is drawn, without wind.
    pub(crate) reach: f32,
    /// Entry n: greatest distance of a drawn vertex from its leaf's pivot, at an active count of n
    /// or more.
    pub(crate) leaf_reaches: Vec<f32>,
    /// Shape of the plant for the wind, in local space.
    pub(crate) shape: Shape,
    /// Mean shaded colour of the leaves, linear, if contrast is enabled.
    pub(crate) mean: [f32; 3],
    /// Whether enlarged leaves have a tone.
    pub(super) has_tone: bool,
    /// Whether enlarged leaves repeat their pictures.
    pub(super) has_tiles: bool,
    /// Which cards of clusters show.
    pub(super) cards: CardRanges,
    /// Centre, in plant space, and radius of what the model's impostor shows; `None` if it has
    /// none.
    pub(super) impostor: Option<(DVec3, f64)>,
    /// Frames of that impostor, if they are made while plants are drawn.
    pub(crate) live: Option<LiveFrames>,
}

impl ModelFacts {
    /// Collects the facts of a valid model, whose records are `upload`. `mean` is the mean shaded
    /// colour of its leaves, linear, if contrast is enabled. O(vertices).
    pub fn new(model: &FoliageModel, upload: &Upload, mean: [f32; 3]) -> Self {
        let (center, reach) = reach(model);
        let wood = model.wood.vertices.iter();
        let corners = || model.vertices.iter().chain(wood.clone()).map(|vertex| vertex.position);
        let local = |position: [f32; 3]| (Vec3::from(position).as_dvec3() - center).as_vec3().to_array();
        let extents: Vec<f32> = model.leaves.iter().map(|leaf| extent(model, leaf)).collect();
        let mut most = extents.iter().copied().fold(0.0, f32::max);
        let mut leaf_reaches = vec![most; model.leaves.len() + 1];
        for (n, leaf) in model.leaves.iter().enumerate().rev() {
            most = leaf.target().map_or(most, |target| most.max(extents[target] * leaf.scale));
            leaf_reaches[n] = most;
        }
        let quads = upload.quads();
        Self {
            center,
            leaves: model.leaves.len() as u32,
            trimmed_from: upload.trimmed(&quads).least_pixels_per_unit,
            quad_ends: quads.ends,
            stems: upload.stems().clone(),
            reach,
            leaf_reaches,
            shape: Shape::new(&Aabb::of_points(corners().map(local))),
            mean,
            has_tone: model.growth.tone > 0.0,
            has_tiles: model.growth.tiles,
            cards: CardRanges::new(model),
            impostor: model.impostor.as_ref().map(|impostor| shown_by(&impostor.framing())),
            live: None,
        }
    }
}

/// Origin of a model's local space, and the greatest distance from there at which anything is
/// drawn, without wind.
pub(crate) fn reach(model: &FoliageModel) -> (DVec3, f32) {
    let (center, reach) = (model.sphere().center(), model.enlarged_sphere());
    (center, (reach.radius + reach.center().distance(center)) as f32)
}

/// Centre and radius of what an impostor shows.
fn shown_by(framing: &Framing) -> (DVec3, f64) {
    (Vec3::from(framing.center).as_dvec3(), f64::from(framing.radius()))
}

impl ModelFacts {
    /// The facts of a model whose limbs, if it has any, move in the wind.
    pub fn with_limbs(self, limbs: Option<&Limbs>) -> Self {
        Self { shape: Shape { limbs: limbs.map(Limbs::reach), ..self.shape }, ..self }
    }

    /// The facts of a model whose impostor is made while its plants are drawn.
    #[cfg(feature = "render")]
    pub(crate) fn with_live(self, framing: &Framing) -> Self {
        Self { impostor: Some(shown_by(framing)), live: Some(LiveFrames::new(framing.lattice)), ..self }
    }

    /// Number of quads of the first `n` leaves.
    pub(super) fn quad_end(&self, n: u32) -> u32 {
        self.quad_ends[n as usize]
    }

    /// Centre and radius of a sphere around everything that is drawn of a plant, in world space.
    pub fn placed(&self, plant: &Instance) -> (DVec3, f64) {
        let to_world = plant.world_from_plant;
        let reach = f64::from(self.reach) * largest_scale(&to_world) * f64::from(plant.leaf_scale.max(1.0));
        (to_world.transform_point3(self.center), reach)
    }
}

/// Greatest distance of a vertex of the unscaled leaf from its pivot.
fn extent(model: &FoliageModel, leaf: &Leaf) -> f32 {
    let pivot = Vec3::from(leaf.pivot);
    let corners = model.vertices[leaf.geometry().vertex_range()].iter();
    corners.map(|corner| pivot.distance(corner.position.into())).fold(0.0, f32::max)
}
