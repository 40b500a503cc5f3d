//! Resources: what applies to all plants, and what was drawn.

use bevy::ecs::resource::Resource;
use foliage_lod::{
    LodPolicy,
    effects::Wind,
    extract::{CookLambda, Far},
    model::Transition,
    scene::budget::Rule,
};
use std::{fmt, sync::Arc};

/// What applies to all plants.
#[derive(Resource, Clone)]
pub struct FoliageSettings {
    /// How many leaves a plant has that is seen from so far away: Cook's lambda by default.
    pub policy: Arc<dyn LodPolicy + Send + Sync>,
    /// Number of leaves that grow or shrink at once where the count changes; at least 1. The more,
    /// the less is seen of it.
    pub window: f32,
    /// Pixels that wood may be off: 0.5 by default, 0 for all wood.
    pub wood_error_px: f32,
    /// Sizes at which plants are handed over to the impostor of their model, if it has one: 64
    /// pixels by default. `None` draws leaves at any size.
    pub far: Option<Far>,
    /// Half of the width of the band, relative to the wanted count, in which the count stays: 0.02
    /// by default.
    pub dead_band: f32,
}

impl Default for FoliageSettings {
    fn default() -> Self {
        let policy = Arc::new(CookLambda::default());
        Self {
            policy,
            window: Transition::SMOOTH_WINDOW,
            wood_error_px: 0.5,
            far: Some(Far::default()),
            dead_band: 0.02,
        }
    }
}

impl fmt::Debug for FoliageSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { policy: _, window, wood_error_px, far, dead_band } = self;
        let mut debug = f.debug_struct("FoliageSettings");
        debug.field("window", window).field("wood_error_px", wood_error_px);
        debug.field("far", far).field("dead_band", dead_band);
        debug.finish_non_exhaustive()
    }
}

/// A number of leaves that all plants in view share, split so that the summed visible error is
/// least. While the resource is there, it goes before policies.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct FoliageBudget {
    /// Number of leaves; NaN and negative numbers count as 0. Plants with a
    /// [share](crate::FoliageLod::Share) take theirs first.
    pub leaves: f64,
    /// What is least.
    pub rule: Rule,
}

impl FoliageBudget {
    /// So many leaves, with the least sum of visible errors.
    pub fn new(leaves: f64) -> Self {
        Self { leaves, rule: Rule::default() }
    }
}

/// The wind that moves all plants, by [`Time`](bevy::time::Time). Without the resource, the air is
/// still.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default)]
pub struct FoliageWind(pub Wind);

/// What is drawn of plants that are not hidden.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default)]
pub struct FoliageStats {
    /// Plants whose model is loaded.
    pub plants: u32,
    /// Plants in view of a camera; what follows is theirs.
    pub in_view: u32,
    /// Plants of these that are drawn as their impostor alone.
    pub impostors: u32,
    /// Leaves.
    pub leaves: f64,
    /// Leaves whose vertices are processed in each pass.
    pub leaves_processed: u64,
    /// Triangles of wood.
    pub wood_triangles: u64,
}
