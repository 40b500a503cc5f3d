//! Parts of the work of a simplification: views are captured, then leaves are pruned in them.

use super::{
    appearance::Appearance,
    areas::Areas,
    capture::{Captured, Shown, capture, capture_leaves, capture_shown},
    criterion::{Criterion, ImageLoss, VisibleArea},
    enlarge::Enlarger,
    fragments::FragmentSource,
    intrinsic::Intrinsic,
    layers::Layers,
    masks::Masks,
    options::{self, Compensate, GrowBy, SimplifyOptions},
    outline,
    price::Price,
    progress::{Observer, Seconds},
    prune::{Pruner, count_areas},
    scene::Scene,
    shapes::Shapes,
    views::ViewSet,
    vmi::Vmi,
};
use crate::{Plant, Result, model::Prune};
use rayon::prelude::*;
use std::{sync::Arc, time::Instant};

/// The frontmost polygon of each pixel of each view.
pub type Fronts = Vec<Vec<u32>>;

/// Leaf fractions at which a cascade halves its resolution. Thresholds of 30 and 8 % would be 20 %
/// faster but raise the RMSE of the oak with 15 % of its leaves from 11.9 to 14.1.
const CASCADE: [f64; 2] = [0.15, 0.04];

/// Resolution of each part of the work and the number of leaves that remain after it.
pub fn parts(options: &SimplifyOptions, leaves: usize) -> Vec<(u32, usize)> {
    if !options.cascade {
        return vec![(options.resolution, 1)];
    }
    let lefts = CASCADE.iter().map(|share| ((leaves as f64 * share) as usize).max(1)).chain([1]);
    lefts.enumerate().map(|(halvings, left)| ((options.resolution >> halvings).max(1), left)).collect()
}

/// Data that all parts of the work share.
#[derive(Clone)]
pub struct Work<'a> {
    /// The plant, in canonical form.
    pub plant: &'a Plant,
    /// Options of these parts.
    pub options: &'a SimplifyOptions,
    /// The plant's triangles.
    pub shapes: &'a Shapes,
    /// Its alpha masks.
    pub masks: &'a Masks,
    /// Looks for the criterion, for judging growths, and for a trial of them.
    pub appearances: [Option<Arc<Appearance>>; 3],
}

/// Results of the parts done so far.
#[derive(Default)]
pub struct Done {
    /// The remaining leaves with their scales; `None` before the first part.
    pub enlarger: Option<Enlarger>,
    /// Prunings, in order.
    pub prunes: Vec<Prune>,
    /// Number of fragments of the full plant in all views.
    pub fragments: u64,
    /// Mean number of leaves behind each other where one shows, in the first part's views.
    pub leaf_layers: f64,
    /// Whether leaves that can grow by tiling do; given.
    pub tiles: bool,
    /// Time taken.
    pub seconds: Seconds,
}

impl<'a> Work<'a> {
    /// Finds the looks that `options` need. Parts may use the first of `views` at any resolution.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded.
    pub fn new(
        plant: &'a Plant,
        options: &'a SimplifyOptions,
        shapes: &'a Shapes,
        masks: &'a Masks,
        views: &ViewSet,
    ) -> Result<Self> {
        Ok(Self { plant, options, shapes, masks, appearances: appearances(plant, options, views)? })
    }

    /// Prunes in `views` until `left` leaves remain.
    ///
    /// # Errors
    /// The errors of `source`; [`Interrupted`](crate::Error::Interrupted) if the observer returns
    /// false.
    pub fn part(
        &self,
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
        }
        let open = fronts.iter().flatten().filter(|&&front| front == background).count();
        let price = Price::new(pixels, open as u64);
        let references = match self.appearances {
            [None, None, _] => Vec::new(),
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
        let Shown { fronts, wood_depths, fragments } =
            capture_shown(self.shapes, views, |_| Some(1.0), false, source, advance)?;
        let scale = |leaf: usize| enlarger.scale(leaf);
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

/// Returns the looks for the criterion, for judging growths, and for a trial of them; each is
/// `None` if unused.
fn appearances(plant: &Plant, options: &SimplifyOptions, views: &ViewSet) -> Result<[Option<Arc<Appearance>>; 3]> {
    let by_image = options.criterion == options::Criterion::Image;
    let is_tried = matches!(options.grow_by, GrowBy::Auto | GrowBy::Picture);
    let image = match by_image || is_tried || options.compensate == Compensate::Image {
        true => Some(Arc::new(Appearance::image(plant, views)?)),
        false => None,
    };
    let silhouette = || Arc::new(Appearance::silhouette(plant.leaves.len(), views.views.len()));
    let judging = match options.compensate {
        Compensate::Image => image.clone(),
        Compensate::Silhouette => Some(silhouette()),
        Compensate::Nearest | Compensate::None => None,
    };
    Ok([image.clone().filter(|_| by_image), judging, image.filter(|_| is_tried)])
}
