//! The greedy loop: always the leaf of least error, until one is left.
//!
//! Exact: the same sequence as rendering and counting everything again for every candidate of every step. Each step looks
//! only at the pixels of the pruned leaf and at those in which its target's footprint changes.
//!
//! Limits: time grows with the number of leaves times the pixels each covers, so with the plant's coverage times the
//! logarithm of the number of leaves; a pixel under thousands of leaves makes its own updates linear in that.

use super::{
    areas::Areas,
    criterion::Criterion,
    enlarge::{Enlarger, Growth},
    footprint::Footprint,
    fragments::AlphaMask,
    layers::{Change, Layers},
    shapes::Shapes,
    views::ViewSet,
};
use crate::{Error, Result, model::Prune};
use rayon::prelude::*;

/// Steps whose leaf and target covered fewer pixels in the last step's views than this run on one thread: waking another
/// takes longer.
const PARALLEL_PIXELS: usize = 4096;
/// Steps between two calls of the observer.
const ADVANCE_STEPS: usize = 256;

/// Everything that stays as it is while leaves are pruned.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The plant's triangles.
    pub shapes: &'a Shapes,
    /// The cameras.
    pub views: &'a ViewSet,
    /// Alpha masks.
    pub masks: &'a [AlphaMask],
}

/// Neighbouring views with the memory to update them.
struct Group {
    first_view: usize,
    layers: Vec<Layers>,
    old: Footprint,
    new: Footprint,
    touched: usize,
}

/// The state of all views, in as many groups as there are threads.
struct Canvas {
    groups: Vec<Group>,
    dead: Vec<bool>,
}

impl Canvas {
    fn new(layers: Vec<Layers>, leaves: usize, pixels: usize) -> Self {
        let size = layers.len().div_ceil(rayon::current_num_threads().max(1)).max(1);
        let mut groups: Vec<Group> = Vec::new();
        for (view, layers) in layers.into_iter().enumerate() {
            if view % size == 0 {
                let footprint = Footprint::new(pixels);
                let (old, new) = (footprint.clone(), footprint);
                groups.push(Group { first_view: view, layers: Vec::new(), old, new, touched: 0 });
            }
            groups[view / size].layers.push(layers);
        }
        Self { groups, dead: vec![false; leaves] }
    }

    /// Removes `leaf` (drawn at `scale`) and grows its target.
    fn step(&mut self, scene: Scene<'_>, leaf: u32, scale: f32, growth: Option<Growth>) {
        self.dead[leaf as usize] = true;
        let dead = &self.dead;
        let work = |group: &mut Group| group.step(scene, leaf, scale, growth, dead);
        let touched: usize = self.groups.iter().map(|group| group.touched).sum();
        if touched >= PARALLEL_PIXELS {
            self.groups.par_iter_mut().for_each(work);
        } else {
            self.groups.iter_mut().for_each(work);
        }
    }

    fn changes(&self) -> Vec<&[Change]> {
        self.groups.iter().flat_map(|group| &group.layers).map(|layers| &layers.changes[..]).collect()
    }
}

impl Group {
    fn step(&mut self, scene: Scene<'_>, leaf: u32, scale: f32, growth: Option<Growth>, dead: &[bool]) {
        let Scene { shapes, views, masks } = scene;
        self.touched = 0;
        for (i, layers) in self.layers.iter_mut().enumerate() {
            let view = self.first_view + i;
            layers.changes.clear();
            self.old.rasterise(shapes, views, masks, view, leaf, scale);
            layers.remove(leaf, &self.old, dead);
            self.touched += self.old.fragments.len();
            if let Some(Growth { target, from, to }) = growth.filter(|growth| growth.from != growth.to) {
                self.old.rasterise(shapes, views, masks, view, target, from);
                self.new.rasterise(shapes, views, masks, view, target, to);
                layers.regrow(target, &self.old, &self.new, dead);
                self.touched += self.new.fragments.len();
            }
        }
    }
}

/// Counts the visible areas of freshly captured layers.
pub fn count_areas(layers: &[Layers], leaves: usize) -> Areas {
    let mut areas = Areas::new(leaves, layers.len());
    for (view, layers) in layers.iter().enumerate() {
        layers.fronts().for_each(|pair| areas.count(view, pair));
    }
    areas
}

/// Prunes all leaves but one, in order. `advance` is told how many are gone and answers whether to go on.
///
/// # Errors
/// [`Error::Interrupted`] when `advance` says no.
pub fn prune(
    scene: Scene<'_>,
    layers: Vec<Layers>,
    mut areas: Areas,
    criterion: &mut dyn Criterion,
    enlarger: &mut Enlarger,
    mut advance: impl FnMut(u64) -> bool,
) -> Result<Vec<Prune>> {
    let leaves = areas.leaves;
    let mut canvas = Canvas::new(layers, leaves, scene.views.pixels());
    let mut prunes = Vec::with_capacity(leaves.saturating_sub(1));
    while prunes.len() + 1 < leaves {
        let Some(choice) = criterion.choose(&areas) else { break };
        let leaf = choice.leaf;
        let scale = enlarger.scales[leaf as usize];
        let Some(growth) = enlarger.prune(leaf, areas.total(leaf as usize) > 0) else { break };
        canvas.step(scene, leaf, scale, Some(growth));
        criterion.absorb(&mut areas, &canvas.changes(), leaf);
        let Growth { target, to, .. } = growth;
        prunes.push(Prune { leaf, target, target_scale: to, error: choice.error as f32 });
        if prunes.len() % ADVANCE_STEPS == 0 && !advance(prunes.len() as u64) {
            return Err(Error::Interrupted);
        }
    }
    Ok(prunes)
}
