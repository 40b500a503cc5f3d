//! The simplification as a recipe, from plant to model.

use super::{
    appearance::Appearance,
    areas::Areas,
    capture::{Captured, capture, capture_at, cover_views},
    criterion::{Criterion, ImageLoss, VisibleArea},
    enlarge::Enlarger,
    fragments::FragmentSource,
    layers::Layers,
    masks::Masks,
    memory,
    options::{self, Compensate, SimplifyOptions},
    price::Price,
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
/// [`Error::NoLeaves`] for a plant without leaves, [`Error::InvalidPlant`], [`Error::InvalidOption`], [`Error::TooLarge`]
/// above [`SimplifyOptions::max_memory_mb`], the errors of `source`, and [`Error::Interrupted`] when the observer says stop.
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
) -> Result<(Vec<Prune>, u64, Seconds)> {
    memory::check(plant, options)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build();
    let pool = pool.map_err(|error| {
        Error::invalid("threads", options.threads, format!("a number of threads that the system grants ({error})"))
    })?;
    pool.install(|| run(plant, options, source, observer))
}

/// Shares of the leaves from which on a cascade halves its resolution. At 30 and 8 % it is a fifth faster, and the oak's RMSE
/// with 15 % of its leaves is 14.1 instead of 11.9.
const CASCADE: [f64; 2] = [0.15, 0.04];

/// Resolution of each part of the work, and how many leaves it leaves over.
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
) -> Result<(Vec<Prune>, u64, Seconds)> {
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(plant)?;
    let shapes = Shapes::new(plant, &views, &masks, options.max_scale);
    source.prepare(&masks.masks)?;
    let appearances = appearances(plant, options, &views)?;
    let mut work = Work { plant, options, shapes: &shapes, masks: &masks, appearances };
    let mut done = Done { enlarger: None, prunes: Vec::new(), fragments: 0, seconds: Seconds::default() };
    for (resolution, left) in parts(options, plant.leaves.len()) {
        let views = ViewSet::new(plant.sphere(), resolution, options.views)?;
        work.part(&views, left, &mut done, source, observer)?;
    }
    Ok((done.prunes, done.fragments, done.seconds))
}

/// What all parts of the work share.
struct Work<'a> {
    plant: &'a Plant,
    options: &'a SimplifyOptions,
    shapes: &'a Shapes,
    masks: &'a Masks,
    /// What the criterion compares views by, and what growths are judged by.
    appearances: [Option<Arc<Appearance>>; 2],
}

/// What parts of the work have done.
struct Done {
    enlarger: Option<Enlarger>,
    prunes: Vec<Prune>,
    fragments: u64,
    seconds: Seconds,
}

impl Work<'_> {
    /// Prunes in `views` until `left` leaves are left.
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
        let full = capture(self.shapes, views, source, |done| observer.advance(done))?;
        done.fragments += full.fragments;
        let pixels = views.pixels() as u64 * views.views.len() as u64;
        let background = self.plant.leaves.len() as u32;
        let fronts = full.layers.iter().flat_map(Layers::fronts);
        let price = Price::new(pixels, fronts.filter(|front| front[0] == background).count() as u64);
        let references: Vec<Vec<u32>> = match self.appearances {
            [None, None] => Vec::new(),
            _ => full.layers.iter().map(Layers::front_rows).collect(),
        };
        let (enlarger, mut layers) = self.shown(done.enlarger.take(), full, views, source)?;
        layers.iter_mut().zip(references).for_each(|(layers, reference)| layers.keep_reference(reference));
        done.seconds.fragments += started.elapsed().as_secs_f64();

        let started = Instant::now();
        observer.phase("prune", self.plant.leaves.len() as u64 - 1);
        let areas = count_areas(&layers.iter().collect::<Vec<_>>(), self.plant.leaves.len());
        let mut criterion = self.criterion(&areas, price, &layers, pixels);
        let dead = enlarger.dead.iter().zip(0..).filter(|(dead, _)| **dead);
        dead.for_each(|(_, leaf)| criterion.retire(leaf));
        let judging = self.appearances[1].as_deref();
        let scene = Scene { shapes: self.shapes, views, masks: &self.masks.masks, appearance: judging };
        let first = done.prunes.len();
        let pruner = Pruner::new(scene, layers, areas, price, criterion, enlarger);
        done.enlarger = Some(pruner.run(left, &mut done.prunes, |done| observer.advance(done))?);
        self.in_pixels_of_the_first_part(views, &mut done.prunes[first..]);
        done.seconds.prune += started.elapsed().as_secs_f64();
        Ok(())
    }

    /// The leaves that are left, in `views`; at first all of them, as `full` shows.
    fn shown(
        &self,
        enlarger: Option<Enlarger>,
        full: Captured,
        views: &ViewSet,
        source: &mut dyn FragmentSource,
    ) -> Result<(Enlarger, Vec<Layers>)> {
        let Some(mut enlarger) = enlarger else {
            let SimplifyOptions { compensate, max_scale, .. } = *self.options;
            return Ok((Enlarger::new(self.plant, full.covered, compensate, max_scale), full.layers));
        };
        drop(full);
        let scale = |leaf: usize| (!enlarger.dead[leaf]).then_some(enlarger.scales[leaf]);
        let Captured { layers, covered, .. } = capture_at(self.shapes, views, scale, source, |_| true)?;
        enlarger.covered = covered;
        Ok((enlarger, layers))
    }

    /// Errors that count pixels count those of the first resolution, whatever the part's.
    fn in_pixels_of_the_first_part(&self, views: &ViewSet, prunes: &mut [Prune]) {
        let ratio = f64::from(self.options.resolution) / f64::from(views.resolution);
        if self.options.criterion != options::Criterion::Vmi {
            prunes.iter_mut().for_each(|prune| prune.error = (f64::from(prune.error) * ratio * ratio) as f32);
        }
    }

    fn criterion(&self, areas: &Areas, price: Price, layers: &[Layers], pixels: u64) -> Box<dyn Criterion> {
        match (self.options.criterion, &self.appearances[0]) {
            (_, Some(appearance)) => Box::new(ImageLoss::new(appearance.clone(), price, areas, layers)),
            (options::Criterion::Vmi, None) => {
                let fronts = layers.iter().enumerate();
                let fronts = fronts.flat_map(|(view, layers)| layers.fronts().map(move |pair| (view, pair)));
                Box::new(Vmi::new(areas, pixels, self.options.background, fronts))
            }
            _ => Box::new(VisibleArea::new(areas)),
        }
    }
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
