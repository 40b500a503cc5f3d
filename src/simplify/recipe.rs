//! The simplification as a recipe, from plant to model.

use super::{
    appearance::Appearance,
    areas::Areas,
    capture::{Captured, capture, cover_views},
    criterion::{Criterion, ImageLoss, VisibleArea},
    enlarge::Enlarger,
    fragments::FragmentSource,
    layers::Layers,
    masks::Masks,
    options::{self, Compensate, SimplifyOptions},
    prune::{Pruner, Scene, count_areas},
    shapes::Shapes,
    views::ViewSet,
    vmi::Vmi,
};
use crate::{
    Error, Plant, Result,
    model::{FoliageModel, Prune, Recipe},
};
use std::{sync::Arc, time::Instant};

/// Is told how a simplification goes on, and may stop it.
pub trait Observer: Send {
    /// A phase of `total` units begins: `"fragments"` (views) or `"prune"` (leaves).
    fn phase(&mut self, name: &str, total: u64);

    /// `done` units of the phase are done; false stops with [`Error::Interrupted`].
    fn advance(&mut self, done: u64) -> bool;
}

/// An observer that says nothing and never stops.
pub struct Quiet;

impl Observer for Quiet {
    fn phase(&mut self, _: &str, _: u64) {}

    fn advance(&mut self, _: u64) -> bool {
        true
    }
}

/// Wall-clock seconds of the phases.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seconds {
    /// Rasterising all views and sorting their fragments.
    pub fragments: f64,
    /// Finding the order.
    pub prune: f64,
}

/// What a simplification gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The model.
    pub model: FoliageModel,
    /// Fragments of all views, each pixel of each triangle counted.
    pub fragments: u64,
    /// How long the phases took.
    pub seconds: Seconds,
}

/// Makes the model of `plant`.
///
/// The same plant and options give the same model, for any number of threads, and with the CPU rasteriser on any machine.
///
/// # Errors
/// [`Error::NoLeaves`] for a plant without leaves, [`Error::InvalidPlant`], [`Error::InvalidOption`], the errors of
/// `source`, and [`Error::Interrupted`] when the observer says stop.
pub fn simplify(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Simplified> {
    let plant = &checked(plant, options)?;
    let (prunes, fragments, seconds) = in_pool(plant, options, source, observer)?;
    let adapter = source.adapter();
    let recipe = Recipe {
        preset: options.preset.clone(),
        criterion: options.criterion.name().into(),
        compensate: options.compensate.name().into(),
        resolution: options.resolution,
        views: options.views,
        background: options.background,
        raster: if adapter.is_some() { "gpu" } else { "cpu" }.into(),
        adapter,
    };
    Ok(Simplified { model: FoliageModel::assemble(plant, &prunes, recipe)?, fragments, seconds })
}

/// The prunings alone, first pruned first: one fewer than there are leaves. Also the fragments and the phases' times.
///
/// # Errors
/// As [`simplify`].
pub fn order(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(Vec<Prune>, u64, Seconds)> {
    in_pool(&checked(plant, options)?, options, source, observer)
}

/// The plant in canonical form, so that the order in which a file lists a leaf's triangles has no influence.
fn checked(plant: &Plant, options: &SimplifyOptions) -> Result<Plant> {
    options.validate()?;
    plant.validate()?;
    if plant.leaves.is_empty() {
        return Err(Error::NoLeaves {
            name: plant.name.clone(),
            reason: "the plant is all wood".into(),
            fix: "name the foliage's material or node with --leaves".into(),
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
) -> Result<(Vec<Prune>, u64, Seconds)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|error| Error::InvalidOption {
        option: "--threads",
        value: options.threads.to_string(),
        allowed: format!("a number of threads that the system grants ({error})"),
    })?;
    pool.install(|| run(plant, options, source, observer))
}

fn run(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<(Vec<Prune>, u64, Seconds)> {
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    let shapes = Shapes::new(plant, &views, &masks, options.max_scale);
    source.prepare(&masks.masks)?;
    let started = Instant::now();
    observer.phase("fragments", u64::from(options.views));
    let Captured { mut layers, covered, fragments } = capture(&shapes, &views, source, |done| observer.advance(done))?;
    let fragments_seconds = started.elapsed().as_secs_f64();
    let started = Instant::now();
    observer.phase("prune", plant.leaves.len() as u64 - 1);
    let areas = count_areas(&layers.iter().collect::<Vec<_>>(), plant.leaves.len());
    let [scoring, judging] = appearances(plant, options, &views)?;
    if scoring.is_some() || judging.is_some() {
        layers.iter_mut().for_each(Layers::keep_reference);
    }
    let criterion = criterion(options, &areas, &layers, &views, scoring);
    let enlarger = Enlarger::new(plant, covered, options.compensate, options.max_scale);
    let scene = Scene { shapes: &shapes, views: &views, masks: &masks.masks, appearance: judging.as_deref() };
    let prunes = Pruner::new(scene, layers, areas, criterion, enlarger).run(|done| observer.advance(done))?;
    let seconds = Seconds { fragments: fragments_seconds, prune: started.elapsed().as_secs_f64() };
    Ok((prunes, fragments, seconds))
}

/// Rasterises every view once and throws the pixels away: the number of fragments. The measure that benches hold the rest
/// against.
///
/// # Errors
/// As [`simplify`].
pub fn rasterise_all(plant: &Plant, options: &SimplifyOptions, source: &mut dyn FragmentSource) -> Result<u64> {
    let plant = &checked(plant, options)?;
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    source.prepare(&masks.masks)?;
    cover_views(&Shapes::new(plant, &views, &masks, options.max_scale), &views, source)
}

/// What the criterion compares views by, and what growths are judged by, where they are.
fn appearances(plant: &Plant, options: &SimplifyOptions, views: &ViewSet) -> Result<[Option<Arc<Appearance>>; 2]> {
    let by_image = options.criterion == options::Criterion::Image;
    let image = match by_image || options.compensate == Compensate::Image {
        true => Some(Arc::new(Appearance::image(plant, views)?)),
        false => None,
    };
    let silhouette = || Arc::new(Appearance::silhouette(plant.leaves.len(), views.views.len()));
    let judging = match options.compensate {
        Compensate::Image => image.clone(),
        Compensate::Silhouette => Some(silhouette()),
        Compensate::Nearest | Compensate::None => None,
    };
    Ok([image.filter(|_| by_image), judging])
}

fn criterion(
    options: &SimplifyOptions,
    areas: &Areas,
    layers: &[Layers],
    views: &ViewSet,
    appearance: Option<Arc<Appearance>>,
) -> Box<dyn Criterion> {
    match (options.criterion, appearance) {
        (_, Some(appearance)) => Box::new(ImageLoss::new(appearance, areas, layers)),
        (options::Criterion::Vmi, None) => {
            let pixels = views.pixels() as u64 * views.views.len() as u64;
            let fronts = layers.iter().enumerate();
            let fronts = fronts.flat_map(|(view, layers)| layers.fronts().map(move |pair| (view, pair)));
            Box::new(Vmi::new(areas, pixels, options.background, fronts))
        }
        _ => Box::new(VisibleArea::new(areas)),
    }
}
