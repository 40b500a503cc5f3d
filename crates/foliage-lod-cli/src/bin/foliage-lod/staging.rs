//! Contents of a picture: models, their plants, a camera and a look.

use crate::planting::Planting;
use foliage_lod::{
    Camera, FoliageModel, Look,
    scene::{budget::Spent, visibility::Estimate},
    terrain::Terrain,
};
use glam::{DAffine3, Vec3};
use std::sync::Arc;

/// Contents of a picture.
pub struct Staging<'a> {
    /// The models.
    pub models: &'a [FoliageModel],
    /// The plants in view.
    pub plants: Vec<Shown>,
    /// Plants that cast shadows; empty if the effect `shadow` is off.
    pub casters: Vec<Shown>,
    /// The camera.
    pub camera: Camera,
    /// Effects, lighting and ground.
    pub look: Look,
    /// Ground with heights or colours.
    pub terrain: Option<Arc<Terrain>>,
    /// What was spent of the scene's budget, if it has one, and what it counts.
    pub budget: Option<(Spent, &'static str)>,
    /// What shows of the plants, if its budget goes by that.
    pub visibility: Option<Estimate>,
    /// Time of the animation in seconds.
    pub seconds: f64,
}

/// One plant.
#[derive(Clone, Copy)]
pub struct Shown {
    /// Index into the models.
    pub model: usize,
    /// Transform from the plant to the world.
    pub world_from_plant: DAffine3,
    /// Active count, with its fraction.
    pub active: f32,
    /// Factor applied to every leaf's scale.
    pub leaf_scale: f32,
    /// Least share of the plant that its impostor takes; `None` for leaves at any size.
    pub far: Option<f32>,
    /// Tells plants apart.
    pub seed: u32,
    /// Factor of its lit colour.
    pub tint: Vec3,
}

impl<'a> Staging<'a> {
    /// Plants of one model. `drawn(distance)` returns the active count and leaf scale of a plant at
    /// a distance in radii.
    pub fn of_planting(
        model: &'a FoliageModel,
        planting: &Planting,
        height_px: u32,
        look: Look,
        seconds: f64,
        drawn: impl Fn(f32) -> (f32, f32),
    ) -> Self {
        let plants = (0..).zip(&planting.plants).map(|(seed, plant)| {
            let (active, leaf_scale) = drawn(plant.distance);
            let (world_from_plant, far, tint) = (plant.world_from_plant, Some(0.0), Vec3::ONE);
            Shown { model: 0, world_from_plant, active, leaf_scale, far, seed, tint }
        });
        let models = std::slice::from_ref(model);
        let camera = planting.camera.camera(height_px);
        Self {
            models,
            plants: plants.collect(),
            casters: Vec::new(),
            camera,
            look,
            terrain: None,
            budget: None,
            visibility: None,
            seconds,
        }
    }
}
