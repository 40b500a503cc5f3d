//! Greedy pruning: repeatedly prunes the leaf with the least error.
//!
//! Exact: the sequence is the same as if everything were rendered and counted again for every
//! candidate at every step. Each step visits only the pixels of the pruned leaf and the pixels in
//! which its target's footprint changes.
//!
//! Limits: time grows with the number of leaves times the pixels each covers, that is, with the
//! plant's coverage times the logarithm of the number of leaves. Updating a pixel under thousands
//! of leaves takes time linear in their number.

use super::{
    appearance::Appearance,
    areas::Areas,
    canvas::{Canvas, Gone, Runner, Task},
    criterion::Criterion,
    enlarge::{Enlarger, Growth, Plan},
    layers::Layers,
    price::{Price, Prices},
    scene::Scene,
};
use crate::{Error, Result, model::Prune};
use std::sync::Arc;

/// Number of steps between two calls of the observer.
const ADVANCE_STEPS: usize = 256;

/// Counts the visible areas in freshly captured layers.
pub fn count_areas(layers: &[&Layers], leaves: usize) -> Areas {
    let mut areas = Areas::new(leaves, layers.len());
    for (view, layers) in layers.iter().enumerate() {
        layers.fronts().for_each(|pair| areas.count(view, pair));
        layers.references().into_iter().flatten().for_each(|(full, [front, _])| areas.count_beyond(full, front, 1));
    }
    areas
}

/// Prunes the leaves of a plant, one per step.
pub struct Pruner<'a, C: Criterion + ?Sized> {
    scene: Scene<'a>,
    runner: Runner<'a, C>,
    enlarger: Enlarger,
    price: Price,
}

impl<'a, C: Criterion + ?Sized> Pruner<'a, C> {
    /// Creates a pruner. `areas` and `criterion` must be computed from `layers`, which must contain
    /// the leaves that are alive in `enlarger`.
    pub fn new(
        scene: Scene<'a>,
        layers: Vec<Layers>,
        areas: Areas,
        price: Price,
        criterion: Box<C>,
        enlarger: Enlarger,
    ) -> Self {
        let canvas = Canvas::new(layers, areas, criterion, &enlarger.dead);
        Self { scene, runner: Runner::new(scene, canvas), enlarger, price }
    }

    /// Prunes one leaf. Returns `None` if it would be the last.
    pub fn step(&mut self) -> Option<Prune> {
        let canvas = self.runner.canvas();
        let (choice, visible) = {
            let areas = canvas.areas();
            let choice = canvas.criterion.choose(&areas)?;
            (choice, areas.total(choice.leaf as usize))
        };
        let leaf = choice.leaf;
        let gone = Gone { leaf, scale: self.enlarger.scales[leaf as usize] };
        let growth = match self.enlarger.prune(leaf, visible)? {
            Plan::Grow(growth) => {
                self.runner.run(Task::Step(gone, growth));
                growth
            }
            Plan::Judge { lost_area, growths } => self.judged(gone, lost_area, growths),
        };
        if growth.from != growth.to {
            let canvas = self.runner.canvas();
            self.enlarger.grow(growth, canvas.grown());
            canvas.criterion.cover(growth.target, canvas.grown());
        }
        self.runner.absorb(leaf);
        Some(Prune { leaf, target: growth.target, target_scale: growth.to, error: choice.error as f32 })
    }

    /// Removes a leaf and applies the growth with the highest score, if that score is positive.
    fn judged(&mut self, gone: Gone, lost_area: f64, growths: Vec<Growth>) -> Growth {
        let prices =
            self.price.steps(&self.runner.canvas().areas()) * self.scene.appearance.map_or(0, Appearance::coverage);
        let (score, best) = self.best(Some(gone), growths, prices);
        let others = self.enlarger.other_growths(best.target, lost_area);
        let (score, best) = if others.is_empty() {
            (score, best)
        } else {
            let (other_score, other) = self.best(None, others, prices);
            if other_score > score { (other_score, other) } else { (score, best) }
        };
        if score <= 0 {
            return Growth { to: best.from, ..best };
        }
        self.runner.run(Task::Grow(best));
        best
    }

    /// Removes `gone`, if there is one, and returns the growth with the highest score, the first of
    /// equal ones, with its score.
    fn best(&mut self, gone: Option<Gone>, growths: Vec<Growth>, prices: Prices) -> (i64, Growth) {
        let growths: Arc<[Growth]> = growths.into();
        self.runner.run(Task::Judge(gone, growths.clone()));
        let gains = self.runner.canvas().gains(growths.len());
        let best =
            gains.iter().map(|gain| gain.score(prices)).zip(0..).map(|(score, i)| (score, std::cmp::Reverse(i))).max();
        let (score, std::cmp::Reverse(i)) = best.unwrap_or_default();
        (score, growths[i])
    }

    /// Prunes leaves until `left` remain, at least one, and appends to `prunes`. `advance` receives
    /// the length of `prunes` and returns whether to continue. Returns the remaining leaves with
    /// their scales.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if `advance` returns false.
    pub fn run(
        mut self,
        left: usize,
        prunes: &mut Vec<Prune>,
        mut advance: impl FnMut(u64) -> bool,
    ) -> Result<Enlarger> {
        let canvas = self.runner.canvas().clone();
        canvas.with_helpers(self.scene, || self.until(left, prunes, &mut advance))?;
        Ok(self.enlarger)
    }

    fn until(&mut self, left: usize, prunes: &mut Vec<Prune>, advance: &mut impl FnMut(u64) -> bool) -> Result<()> {
        while self.enlarger.dead.len() - prunes.len() > left {
            let Some(prune) = self.step() else { break };
            prunes.push(prune);
            if prunes.len().is_multiple_of(ADVANCE_STEPS) && !advance(prunes.len() as u64) {
                return Err(Error::Interrupted);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Plant,
        leaf::Vertex,
        material::Material,
        plant::WoodPart,
        simplify::{
            capture::{Captured, capture},
            footprint::Footprints,
            masks::Masks,
            options::Compensate,
            raster::CpuFragments,
            shapes::Shapes,
            views::ViewSet,
            vmi::Vmi,
        },
    };

    const RESOLUTION: u32 = 24;

    fn vertex(position: [f32; 3]) -> Vertex {
        Vertex { position, normal: [0.0, 1.0, 0.0], uv: [0.0; 2], color: [1.0; 4] }
    }

    /// Bent leaves (two triangles out of plane) on a lattice around a sheet of wood.
    fn plant() -> Plant {
        let mut plant = Plant { materials: vec![Material::default()], ..Plant::default() };
        for i in 0..90_u32 {
            let [x, y, z] = [i % 5, i / 5 % 6, i / 30].map(|place| place as f32);
            let tilt = (i * 37 % 11) as f32 * 0.1;
            let corners = [[x, y, z], [x + 1.1, y + tilt, z], [x + 0.9, y + 1.0, z + tilt], [x, y + 1.2, z + 0.4]];
            plant.push_leaf(&corners.map(vertex), &[0, 1, 2, 0, 2, 3], corners[0], 0);
        }
        plant.wood.vertices = [[-1.0, 2.0, 1.0], [6.0, 2.0, 1.5], [6.0, 3.0, 1.0]].map(vertex).to_vec();
        plant.wood.indices = vec![0, 1, 2];
        plant.wood.parts = vec![WoodPart { indices: [0, 3], material: 0 }];
        plant
    }

    fn vmi<'l>(areas: &Areas, layers: &'l [&'l Layers]) -> Vmi {
        let of_view = |(view, layers): (usize, &'l &Layers)| layers.fronts().map(move |pair| (view, pair));
        let fronts = || layers.iter().enumerate().flat_map(of_view);
        Vmi::new(areas, u64::from(RESOLUTION).pow(2) * layers.len() as u64, true, fronts)
    }

    /// Front and second polygon of every pixel, drawn from scratch at the current scales.
    fn drawn_again(pruner: &Pruner<'_, Vmi>, view: usize) -> Vec<[u32; 2]> {
        let leaves = pruner.enlarger.dead.len() as u32;
        let mut nearest = vec![[(u32::MAX, leaves); 2]; pruner.scene.views.pixels()];
        let mut footprints = Footprints::new(RESOLUTION);
        for shape in (0..=leaves).filter(|&shape| shape == leaves || !pruner.enlarger.dead[shape as usize]) {
            let row = if shape == leaves { leaves + 1 } else { shape };
            let scale = pruner.enlarger.scales.get(shape as usize).copied().unwrap_or(1.0);
            // A leaf without size covers nothing.
            footprints.rasterise(pruner.scene, view, shape, [0.0, scale]);
            footprints.for_each_difference(|pixel, _, depth| {
                let Some(depth) = depth else { return };
                let pair = &mut nearest[pixel as usize];
                // Only wood is counted behind wood.
                let sinking =
                    if (depth, row) < pair[0] { std::mem::replace(&mut pair[0], (depth, row)) } else { (depth, row) };
                pair[1] = if pair[0].1 == leaves + 1 { pair[0] } else { pair[1].min(sinking) };
            });
        }
        nearest.into_iter().map(|pair| pair.map(|(_, row)| row)).collect()
    }

    /// Number of pixels, over all views, that a leaf covers at its current scale.
    fn covers(pruner: &Pruner<'_, Vmi>, leaf: usize) -> u32 {
        let views = pruner.scene.views;
        let mut footprints = Footprints::new(RESOLUTION);
        let count =
            |view| footprints.rasterise(pruner.scene, view, leaf as u32, [1.0, pruner.enlarger.scales[leaf]]) as u32;
        (0..views.views.len()).map(count).sum()
    }

    #[test]
    fn after_every_step_layers_areas_and_sums_equal_those_from_scratch() {
        let plant = plant();
        let views = ViewSet::new(plant.sphere(), RESOLUTION, 20).unwrap();
        let masks = Masks::new(&plant).unwrap();
        let shapes = Shapes::new(&plant, &views, &masks, 4.0);
        let Captured { layers, covered, .. } = capture(&shapes, &views, &mut CpuFragments::new(), |_| true).unwrap();
        let areas = count_areas(&layers.iter().collect::<Vec<_>>(), plant.leaves.len());
        let criterion = vmi(&areas, &layers.iter().collect::<Vec<_>>());
        let scene = Scene { shapes: &shapes, views: &views, masks: &masks.masks, appearance: None, tiles: false };
        let enlarger = Enlarger::new(&plant, covered, Compensate::Nearest, 4.0);
        let price = Price::new(1, 0);
        let mut pruner = Pruner::new(scene, layers, areas, price, Box::new(criterion), enlarger);
        let mut steps = 0;
        while pruner.step().is_some() {
            steps += 1;
            let canvas = pruner.runner.canvas().clone();
            let views = canvas.views();
            let layers: Vec<&Layers> = views.iter().map(|view| &view.layers).collect();
            for (view, layers) in layers.iter().enumerate() {
                assert_eq!(
                    layers.fronts().collect::<Vec<_>>(),
                    drawn_again(&pruner, view),
                    "step {steps}, view {view}"
                );
            }
            let areas = count_areas(&layers, plant.leaves.len());
            let scratch = vmi(&areas, &layers);
            let kept = canvas.areas();
            for leaf in (0..plant.leaves.len()).filter(|&leaf| !pruner.enlarger.dead[leaf]) {
                assert_eq!(kept.row(leaf), areas.row(leaf), "step {steps}, leaf {leaf}");
                assert_eq!(kept.seconds(leaf), areas.seconds(leaf), "step {steps}, leaf {leaf}");
                assert_eq!(pruner.enlarger.covered[leaf], covers(&pruner, leaf), "step {steps}, leaf {leaf}");
                assert_eq!(
                    canvas.criterion.error(&areas, leaf as u32),
                    scratch.error(&areas, leaf as u32),
                    "step {steps}, leaf {leaf}"
                );
            }
        }
        assert_eq!(steps, plant.leaves.len() - 1);
    }
}
