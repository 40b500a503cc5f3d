//! The simplification as a recipe: the steps from plant to model.

use super::{
    capture::cover_views,
    cards,
    fragments::FragmentSource,
    growth,
    masks::Masks,
    memory,
    options::{GrowBy, SimplifyOptions},
    progress::{Observer, Seconds},
    shapes::Shapes,
    trial::{self, Trial},
    views::ViewSet,
    work::{Done, Work, parts},
};
use crate::{
    Error, Plant, Result,
    model::{FoliageModel, Prune, Recipe},
};
use std::time::Instant;

/// Result of a simplification.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The model.
    pub model: FoliageModel,
    /// Number of fragments of the full plant in all views, counting each pixel of each triangle.
    pub fragments: u64,
    /// Mean number of leaves behind each other where one shows, over the first part's views.
    pub leaf_layers: f64,
    /// The trial that decided whether leaves grow by scale or by tiling; `None` if none was needed.
    pub trial: Option<Trial>,
    /// Duration of each phase.
    pub seconds: Seconds,
}

/// Builds the model of `plant`.
///
/// The same plant and options give the same model for any number of threads and, with the CPU
/// rasteriser, on any machine.
///
/// # Errors
/// [`Error::NoLeaves`] for a plant without leaves, [`Error::InvalidPlant`],
/// [`Error::InvalidOption`], [`Error::TooLarge`] above [`SimplifyOptions::max_memory_mb`], the
/// errors of `source`, and [`Error::Interrupted`] if the observer returns false.
pub fn simplify(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Simplified> {
    let mut plant = checked(plant, options)?;
    let (done, trial) = in_pool(&plant, options, source, observer)?;
    let Done { prunes, fragments, seconds, leaf_layers, tiles, .. } = done;
    // So that models find leaves of the same shape.
    plant.sort_by_uv();
    let adapter = source.adapter();
    let recipe = Recipe {
        preset: options.preset.clone(),
        criterion: options.criterion.name().into(),
        compensate: options.compensate.name().into(),
        resolution: options.resolution,
        views: options.views,
        background: options.background,
        intrinsic: options.intrinsic,
        raster: if adapter.is_some() { "gpu" } else { "cpu" }.into(),
        adapter,
    };
    let mut model = FoliageModel::assemble(&plant, &prunes, recipe)?;
    model.growth.tiles = tiles;
    if options.tone {
        model.growth.tone = growth::tone(leaf_layers);
    }
    let started = Instant::now();
    if options.grow_by == GrowBy::Picture {
        model.clusters = threads(options)?.install(|| cards::chosen(&model, options, source, observer))?;
    }
    let seconds = Seconds { growth: seconds.growth + started.elapsed().as_secs_f64(), ..seconds };
    Ok(Simplified { model, fragments, leaf_layers, trial, seconds })
}

/// Returns only the prunings, in order, one fewer than there are leaves, with the number of
/// fragments and the duration of each phase.
///
/// # Errors
/// Same as [`simplify`].
pub fn order(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(Vec<Prune>, u64, Seconds)> {
    let (done, _) = in_pool(&checked(plant, options)?, options, source, observer)?;
    Ok((done.prunes, done.fragments, done.seconds))
}

/// Checks the input and returns the plant in canonical form, so that the order in which a file
/// lists a leaf's triangles has no effect.
fn checked(plant: &Plant, options: &SimplifyOptions) -> Result<Plant> {
    options.validate()?;
    plant.validate()?;
    if plant.leaves.is_empty() {
        return Err(Error::NoLeaves {
            name: plant.name.clone(),
            reason: "the plant is all wood".into(),
            fix: "name the foliage's material or node with `leaves`".into(),
        });
    }
    let mut plant = plant.clone();
    plant.canonicalize();
    Ok(plant)
}

fn in_pool(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(Done, Option<Trial>)> {
    memory::check(plant, options)?;
    threads(options)?.install(|| run(plant, options, source, observer))
}

fn threads(options: &SimplifyOptions) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    pool.map_err(|error| {
        Error::invalid("threads", options.threads, format!("a number of threads that the system grants ({error})"))
    })
}

fn run(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(Done, Option<Trial>)> {
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    let shapes = Shapes::new(plant, &views, &masks, options.max_scale);
    source.prepare(&masks.masks)?;
    let work = Work::new(plant, options, &shapes, &masks, &views)?;
    let started = Instant::now();
    let tileable = shapes.tileable();
    let trial = match growth::needs_trial(options.grow_by, tileable) {
        true => trial::run(&work, &views, source, observer)?,
        false => None,
    };
    let tiles = growth::tiles(options.grow_by, tileable, trial.as_ref());
    let mut done = Done { tiles, ..Done::default() };
    done.seconds.growth = started.elapsed().as_secs_f64();
    for (resolution, left) in parts(options, plant.leaves.len()) {
        work.part(&views.of_resolution(resolution), left, &mut done, source, observer)?;
    }
    Ok((done, trial))
}

/// Rasterises every view once, discards the pixels and returns the number of fragments: the
/// baseline of the benchmarks.
///
/// # Errors
/// Same as [`simplify`].
pub fn rasterise_all(plant: &Plant, options: &SimplifyOptions, source: &mut dyn FragmentSource) -> Result<u64> {
    let plant = &checked(plant, options)?;
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    source.prepare(&masks.masks)?;
    cover_views(&Shapes::new(plant, &views, &masks, options.max_scale), &views, source)
}
