//! What a picture shows: models, plants of them, a camera and a look.

use crate::planting::Planting;
use foliage_lod::{
    model::FoliageModel,
    render::{camera::Camera, look::Look},
};
use glam::DAffine3;

/// What a picture shows.
pub struct Staging<'a> {
    /// The models.
    pub models: &'a [FoliageModel],
    /// Plants of them.
    pub plants: Vec<Shown>,
    /// Plants that cast shadows, where there are any.
    pub casters: Vec<Shown>,
    /// Who looks.
    pub camera: Camera,
    /// What plants look like.
    pub look: Look,
    /// Time of what moves.
    pub seconds: f64,
}

/// One plant.
#[derive(Clone, Copy)]
pub struct Shown {
    /// Index into the models.
    pub model: usize,
    /// Where it stands.
    pub world_from_plant: DAffine3,
    /// Active count with its fraction.
    pub active: f32,
    /// Factor on every leaf's scale.
    pub leaf_scale: f32,
}

impl<'a> Staging<'a> {
    /// Plants of one model, `drawn(distance)` giving active count and factor of each from its distance in radii.
    pub fn of_planting(
        model: &'a FoliageModel,
        planting: &Planting,
        look: Look,
        seconds: f64,
        drawn: impl Fn(f32) -> (f32, f32),
    ) -> Self {
        let plants = planting.plants.iter().map(|plant| {
            let (active, leaf_scale) = drawn(plant.distance);
            Shown { model: 0, world_from_plant: plant.world_from_plant, active, leaf_scale }
        });
        let models = std::slice::from_ref(model);
        Self { models, plants: plants.collect(), casters: Vec::new(), camera: planting.camera, look, seconds }
    }
}
