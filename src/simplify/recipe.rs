//! The simplification as a recipe: the steps from plant to model.

use super::{
    appearance::Appearance,
    areas::Areas,
    capture::{Captured, Shown, capture, capture_leaves, capture_shown, cover_views},
    criterion::{Criterion, ImageLoss, VisibleArea},
    enlarge::Enlarger,
    fragments::FragmentSource,
    growth,
    intrinsic::Intrinsic,
    layers::Layers,
    masks::Masks,
    memory,
    options::{self, Compensate, SimplifyOptions},
    outline,
    price::Price,
    prune::{Pruner, count_areas},
    scene::Scene,
    shapes::Shapes,
    views::ViewSet,
    vmi::Vmi,
};
use crate::{
    Error, Plant, Result,
    model::{FoliageModel, Prune, Recipe},
};
use rayon::prelude::*;
use std::{sync::Arc, time::Instant};

/// The frontmost polygon of each pixel of each view.
type Fronts = Vec<Vec<u32>>;

/// Receives the progress of a simplification and may stop it.
pub trait Observer: Send {
    /// Called when a phase of `total` units begins: `"fragments"` (views) or `"prune"` (leaves).
    fn phase(&mut self, name: &str, total: u64);

    /// Called when `done` units of the phase are done. Returning false stops with
    /// [`Error::Interrupted`].
    fn advance(&mut self, done: u64) -> bool;
}

/// An observer that reports nothing and never stops.
pub struct Quiet;

impl Observer for Quiet {
    fn phase(&mut self, _: &str, _: u64) {}

    fn advance(&mut self, _: u64) -> bool {
        true
    }
}

/// Wall-clock seconds of each phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seconds {
    /// Rasterising all views and sorting their fragments.
    pub fragments: f64,
    /// Finding the pruning order.
    pub prune: f64,
}

/// Result of a simplification.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The model.
    pub model: FoliageModel,
    /// Number of fragments of the full plant in all views, counting each pixel of each triangle.
    pub fragments: u64,
    /// Mean number of leaves behind each other where one shows, over the first part's views.
    pub leaf_layers: f64,
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
    let Done { prunes, fragments, seconds, leaf_layers, tiles, .. } = in_pool(&plant, options, source, observer)?;
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
    Ok(Simplified { model, fragments, leaf_layers, seconds })
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
    let done = in_pool(&checked(plant, options)?, options, source, observer)?;
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
) -> Result<Done> {
    memory::check(plant, options)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|error| {
        Error::invalid("threads", options.threads, format!("a number of threads that the system grants ({error})"))
    })?;
    pool.install(|| run(plant, options, source, observer))
}

/// Leaf fractions at which a cascade halves its resolution. Thresholds of 30 and 8 % would be 20 %
/// faster but raise the RMSE of the oak with 15 % of its leaves from 11.9 to 14.1.
const CASCADE: [f64; 2] = [0.15, 0.04];

/// Resolution of each part of the work and the number of leaves that remain after it.
fn parts(options: &SimplifyOptions, leaves: usize) -> Vec<(u32, usize)> {
    if !options.cascade {
        return vec![(options.resolution, 1)];
    }
    let lefts = CASCADE.iter().map(|share| ((leaves as f64 * share) as usize).max(1)).chain([1]);
    lefts.enumerate().map(|(halvings, left)| ((options.resolution >> halvings).max(1), left)).collect()
}

fn run(
    plant: &Plant,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Done> {
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    let shapes = Shapes::new(plant, &views, &masks, options.max_scale);
    source.prepare(&masks.masks)?;
    let appearances = appearances(plant, options, &views)?;
    let mut work = Work { plant, options, shapes: &shapes, masks: &masks, appearances };
    let mut done = Done::default();
    for (resolution, left) in parts(options, plant.leaves.len()) {
        let views = ViewSet::new(plant.sphere(), resolution, options.views)?;
        work.part(&views, left, &mut done, source, observer)?;
    }
    Ok(done)
}

/// Data that all parts of the work share.
struct Work<'a> {
    plant: &'a Plant,
    options: &'a SimplifyOptions,
    shapes: &'a Shapes,
    masks: &'a Masks,
    /// Looks for the criterion, and looks for judging growths.
    appearances: [Option<Arc<Appearance>>; 2],
}

/// Results of the parts done so far.
#[derive(Default)]
struct Done {
    enlarger: Option<Enlarger>,
    prunes: Vec<Prune>,
    fragments: u64,
    leaf_layers: f64,
    tiles: bool,
    seconds: Seconds,
}

impl Work<'_> {
    /// Prunes in `views` until `left` leaves remain.
    fn part(
        &mut self,
        views: &ViewSet,
        left: usize,
        done: &mut Done,
        source: &mut dyn FragmentSource,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let started = Instant::now();
        observer.phase("fragments", views.views.len() as u64);
        let pixels = views.pixels() as u64 * views.views.len() as u64;
        let background = self.plant.leaves.len() as u32;
        let is_first = done.enlarger.is_none();
        let (enlarger, mut layers, fronts, fragments) =
            self.shown(done.enlarger.take(), done.tiles, views, source, |done| observer.advance(done))?;
        done.fragments += fragments;
        if is_first {
            let of_leaves = fronts.iter().flatten().filter(|&&front| front < background).count();
            let covered: u64 = enlarger.covered.iter().map(|&pixels| u64::from(pixels)).sum();
            done.leaf_layers = covered as f64 / of_leaves.max(1) as f64;
            done.tiles = growth::tiles(self.options.grow_by, done.leaf_layers, self.shapes.tiled(&self.masks.masks));
        }
        let open = fronts.iter().flatten().filter(|&&front| front == background).count();
        let price = Price::new(pixels, open as u64);
        let references = match self.appearances {
            [None, None] => Vec::new(),
            _ => {
                let side = views.resolution as usize;
                fronts.into_par_iter().map(|fronts| outline::marked(fronts, background, side)).collect()
            }
        };
        let kept = layers.par_iter_mut().zip(references);
        kept.for_each(|(layers, reference)| layers.keep_reference(&reference));
        done.seconds.fragments += started.elapsed().as_secs_f64();

        let started = Instant::now();
        observer.phase("prune", self.plant.leaves.len() as u64 - 1);
        let areas = count_areas(&layers.iter().collect::<Vec<_>>(), self.plant.leaves.len());
        let criterion = self.criterion(&areas, &enlarger.covered, price, &layers, pixels);
        let dead = enlarger.dead.iter().zip(0..).filter(|(dead, _)| **dead);
        dead.for_each(|(_, leaf)| criterion.retire(leaf));
        let judging = self.appearances[1].as_deref();
        let scene =
            Scene { shapes: self.shapes, views, masks: &self.masks.masks, appearance: judging, tiles: done.tiles };
        let first = done.prunes.len();
        let pruner = Pruner::new(scene, layers, areas, price, criterion, enlarger);
        done.enlarger = Some(pruner.run(left, &mut done.prunes, |done| observer.advance(done))?);
        self.in_pixels_of_the_first_part(views, &mut done.prunes[first..]);
        done.seconds.prune += started.elapsed().as_secs_f64();
        Ok(())
    }

    /// Returns the remaining leaves and their layers in `views`, and of the full plant the
    /// frontmost polygons and the number of fragments. In the first part all leaves remain.
    fn shown(
        &self,
        enlarger: Option<Enlarger>,
        tiles: bool,
        views: &ViewSet,
        source: &mut dyn FragmentSource,
        advance: impl FnMut(u64) -> bool,
    ) -> Result<(Enlarger, Vec<Layers>, Fronts, u64)> {
        let Some(mut enlarger) = enlarger else {
            let SimplifyOptions { compensate, max_scale, .. } = *self.options;
            let Captured { layers, covered, fragments } = capture(self.shapes, views, source, advance)?;
            let fronts = layers.iter().map(Layers::front_rows).collect();
            return Ok((Enlarger::new(self.plant, covered, compensate, max_scale), layers, fronts, fragments));
        };
        let Shown { fronts, wood_depths, fragments } = capture_shown(self.shapes, views, source, advance)?;
        let scale = |leaf: usize| (!enlarger.dead[leaf]).then_some(enlarger.scales[leaf]);
        let Captured { layers, covered, .. } = capture_leaves(self.shapes, views, scale, tiles, &wood_depths, source)?;
        enlarger.covered = covered;
        Ok((enlarger, layers, fronts, fragments))
    }

    /// Converts errors in pixels to pixels of the first part's resolution.
    fn in_pixels_of_the_first_part(&self, views: &ViewSet, prunes: &mut [Prune]) {
        let ratio = f64::from(self.options.resolution) / f64::from(views.resolution);
        if self.options.criterion != options::Criterion::Vmi {
            prunes.iter_mut().for_each(|prune| prune.error = (f64::from(prune.error) * ratio * ratio) as f32);
        }
    }

    fn criterion<'l>(
        &self,
        areas: &Areas,
        covered: &[u32],
        price: Price,
        layers: &'l [Layers],
        pixels: u64,
    ) -> Box<dyn Criterion> {
        let cost = self.options.intrinsic;
        let intrinsic = (cost > 0.0).then(|| Intrinsic::new(cost, covered));
        match (self.options.criterion, &self.appearances[0]) {
            (_, Some(appearance)) => Box::new(ImageLoss::new(appearance.clone(), price, intrinsic, areas, layers)),
            (options::Criterion::Vmi, None) => {
                let of_view = |(view, layers): (usize, &'l Layers)| layers.fronts().map(move |pair| (view, pair));
                let fronts = || layers.iter().enumerate().flat_map(of_view);
                Box::new(Vmi::new(areas, pixels, self.options.background, fronts))
            }
            _ => Box::new(VisibleArea::new(areas)),
        }
    }
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

/// Returns the looks for the criterion and the looks for judging growths; each is `None` if unused.
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
