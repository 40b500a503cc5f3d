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
    change::{Change, Gain},
    criterion::Criterion,
    enlarge::{Enlarger, Growth, Plan},
    footprint::Footprint,
    layers::Layers,
    price::{Price, Prices},
    scene::Scene,
};
use crate::{Error, Result, model::Prune};
use std::{
    sync::Arc,
    sync::mpsc::{Receiver, Sender, TryRecvError, channel},
    time::{Duration, Instant},
};

/// After a task that touched fewer pixels than this, the next removal or growth runs on one thread,
/// since handing it over would take longer. Judging always uses all threads.
const PARALLEL_PIXELS: usize = 256;
/// How long a thread polls for its next message before it sleeps. This is longer than a step takes,
/// so that no thread has to be woken on an idle machine; every poll yields, so that little time is
/// wasted on a busy one.
const BUSY_WAIT: Duration = Duration::from_micros(500);
/// Number of steps between two calls of the observer.
const ADVANCE_STEPS: usize = 256;

/// A leaf to be removed.
#[derive(Clone, Copy)]
struct Gone {
    leaf: u32,
    /// Current scale of the leaf.
    scale: f32,
}

/// Task for every group of views.
#[derive(Clone)]
enum Task {
    /// Remove a leaf and grow another.
    Step(Gone, Growth),
    /// Remove a leaf, if there is one, and judge the growths that could replace it.
    Judge(Option<Gone>, Arc<[Growth]>),
    /// Grow a leaf that was judged before.
    Grow(Growth),
}

/// Consecutive views and the working memory to update them.
struct Group {
    first_view: usize,
    layers: Vec<Layers>,
    dead: Vec<bool>,
    old: Footprint,
    new: Footprint,
    /// Number of pixels that the last task touched.
    touched: usize,
    /// Number of pixels that the target covers after the last task; 0 if it grew nothing.
    grown: u32,
    /// Gain of each growth judged last.
    gains: Vec<Gain>,
}

impl Group {
    fn run(&mut self, scene: Scene<'_>, task: &Task) {
        self.touched = 0;
        self.grown = 0;
        match task {
            Task::Step(gone, growth) => {
                self.remove(scene, *gone);
                self.grow(scene, *growth);
            }
            Task::Judge(gone, growths) => {
                if let Some(gone) = gone {
                    self.remove(scene, *gone);
                }
                self.judge(scene, growths);
            }
            Task::Grow(growth) => self.grow(scene, *growth),
        }
    }

    fn remove(&mut self, Scene { shapes, views, .. }: Scene<'_>, Gone { leaf, scale }: Gone) {
        self.dead[leaf as usize] = true;
        for (layers, view) in self.layers.iter_mut().zip(self.first_view..) {
            layers.changes.clear();
            self.old.outline(shapes, views, view, leaf, scale);
            layers.remove(leaf, &self.old, &self.dead);
            self.touched += self.old.fragments.len();
        }
    }

    fn grow(&mut self, scene: Scene<'_>, Growth { target, from, to }: Growth) {
        if from == to {
            return;
        }
        for (layers, view) in self.layers.iter_mut().zip(self.first_view..) {
            self.old.rasterise(scene, view, target, from);
            self.new.rasterise(scene, view, target, to);
            layers.regrow(target, &self.old, &self.new, &self.dead);
            self.touched += self.new.fragments.len();
            self.grown += self.new.fragments.len() as u32;
        }
    }

    /// Fills `gains` with the gain of each growth, summed over the group's views.
    fn judge(&mut self, scene: Scene<'_>, growths: &[Growth]) {
        self.gains.clear();
        self.gains.resize(growths.len(), Gain::default());
        let Some(appearance) = scene.appearance else { return };
        for (layers, view) in self.layers.iter_mut().zip(self.first_view..) {
            layers.refresh();
            let (layers, look) = (&*layers, appearance.view(view));
            let mut drawn = None;
            for (&growth, gain) in growths.iter().zip(&mut self.gains) {
                let Growth { target, from, to } = growth;
                if from == to || !may_show(&mut self.new, scene, view, growth, layers) {
                    continue;
                }
                if drawn.replace(target) != Some(target) {
                    self.old.rasterise_where(scene, view, target, from, |pixel, _| layers.shows(pixel, target));
                }
                let wanted = |pixel, depth| layers.would_show(pixel, depth, target);
                self.new.rasterise_where(scene, view, target, to, wanted);
                *gain = gain.plus(layers.gain(target, &self.old, &self.new, look));
            }
        }
    }
}

/// Whether a leaf could be frontmost anywhere in a view before or after a growth. Conservative: may
/// return true for a hidden leaf.
fn may_show(footprint: &mut Footprint, scene: Scene<'_>, view: usize, growth: Growth, layers: &Layers) -> bool {
    [growth.from, growth.to]
        .into_iter()
        .any(|scale| footprint.extent(scene, view, growth.target, scale).is_none_or(|extent| !layers.hides(&extent)))
}

/// State of all views, divided into at most as many groups as there are threads.
struct Canvas {
    groups: Vec<Group>,
    /// Threads that process all groups but the first; present only during [`Pruner::run`].
    helpers: Vec<Helper>,
}

/// A thread that updates the groups it is sent and sends them back.
struct Helper {
    to: Sender<(Group, Task)>,
    from: Receiver<Group>,
}

impl Canvas {
    fn new(layers: Vec<Layers>, dead: &[bool], pixels: usize) -> Self {
        let size = layers.len().div_ceil(rayon::current_num_threads().max(1)).max(1);
        let mut groups: Vec<Group> = Vec::new();
        for (view, layers) in layers.into_iter().enumerate() {
            if view % size == 0 {
                let footprint = Footprint::new(pixels);
                let (old, new) = (footprint.clone(), footprint);
                let dead = dead.to_vec();
                let (layers, gains) = (Vec::new(), Vec::new());
                groups.push(Group { first_view: view, layers, dead, old, new, touched: 0, grown: 0, gains });
            }
            groups[view / size].layers.push(layers);
        }
        Self { groups, helpers: Vec::new() }
    }

    fn run(&mut self, scene: Scene<'_>, task: Task) {
        let touched: usize = self.groups.iter().map(|group| group.touched).sum();
        let is_small = touched < PARALLEL_PIXELS && !matches!(task, Task::Judge(..));
        if is_small || self.helpers.is_empty() {
            return self.groups.iter_mut().for_each(|group| group.run(scene, &task));
        }
        for (helper, group) in self.helpers.iter().zip(self.groups.drain(1..)) {
            // A helper lives as long as its channel, and neither end closes while the canvas holds
            // the other.
            let _ = helper.to.send((group, task.clone()));
        }
        self.groups[0].run(scene, &task);
        self.groups.extend(self.helpers.iter().filter_map(|helper| receive(&helper.from)));
    }

    /// Gain of each growth, summed over all views.
    fn gains(&self, growths: usize) -> impl Iterator<Item = Gain> {
        (0..growths).map(|i| self.groups.iter().map(|group| group.gains[i]).fold(Gain::default(), Gain::plus))
    }

    /// Number of pixels, over all views, that the target covers after the last task; 0 if it grew
    /// nothing.
    fn grown(&self) -> u32 {
        self.groups.iter().map(|group| group.grown).sum()
    }

    fn changes(&self) -> Vec<&[Change]> {
        self.groups.iter().flat_map(|group| &group.layers).map(|layers| &layers.changes[..]).collect()
    }
}

/// Waits for a message: polls for [`BUSY_WAIT`], since the next step is near, then sleeps. Returns
/// `None` once the other end is closed.
fn receive<T>(from: &Receiver<T>) -> Option<T> {
    let started = Instant::now();
    while started.elapsed() < BUSY_WAIT {
        match from.try_recv() {
            Ok(message) => return Some(message),
            Err(TryRecvError::Disconnected) => return None,
            Err(TryRecvError::Empty) => std::thread::yield_now(),
        }
    }
    from.recv().ok()
}

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
    canvas: Canvas,
    areas: Areas,
    criterion: Box<C>,
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
        let canvas = Canvas::new(layers, &enlarger.dead, scene.views.pixels());
        Self { scene, canvas, areas, criterion, enlarger, price }
    }

    /// Prunes one leaf. Returns `None` if it would be the last.
    pub fn step(&mut self) -> Option<Prune> {
        let choice = self.criterion.choose(&self.areas)?;
        let leaf = choice.leaf;
        let gone = Gone { leaf, scale: self.enlarger.scales[leaf as usize] };
        let growth = match self.enlarger.prune(leaf, self.areas.total(leaf as usize))? {
            Plan::Grow(growth) => {
                self.canvas.run(self.scene, Task::Step(gone, growth));
                growth
            }
            Plan::Judge { lost_area, growths } => self.judged(gone, lost_area, growths),
        };
        if growth.from != growth.to {
            self.enlarger.grow(growth, self.canvas.grown());
        }
        self.criterion.absorb(&mut self.areas, &self.canvas.changes(), leaf);
        Some(Prune { leaf, target: growth.target, target_scale: growth.to, error: choice.error as f32 })
    }

    /// Removes a leaf and applies the growth with the highest score, if that score is positive.
    fn judged(&mut self, gone: Gone, lost_area: f64, growths: Vec<Growth>) -> Growth {
        let prices = self.price.steps(&self.areas) * self.scene.appearance.map_or(0, Appearance::coverage);
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
        self.canvas.run(self.scene, Task::Grow(best));
        best
    }

    /// Removes `gone`, if there is one, and returns the growth with the highest score, the first of
    /// equal ones, with its score.
    fn best(&mut self, gone: Option<Gone>, growths: Vec<Growth>, prices: Prices) -> (i64, Growth) {
        let growths: Arc<[Growth]> = growths.into();
        self.canvas.run(self.scene, Task::Judge(gone, growths.clone()));
        let scores = self.canvas.gains(growths.len()).map(|gain| gain.score(prices));
        let best = scores.zip(0..).map(|(score, i)| (score, std::cmp::Reverse(i))).max();
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
        let scene = self.scene;
        std::thread::scope(|scope| {
            for _ in 1..self.canvas.groups.len() {
                let (to, tasks) = channel::<(Group, Task)>();
                let (done, from) = channel();
                scope.spawn(move || {
                    while let Some((mut group, task)) = receive(&tasks) {
                        group.run(scene, &task);
                        let _ = done.send(group);
                    }
                });
                self.canvas.helpers.push(Helper { to, from });
            }
            let done = self.until(left, prunes, &mut advance);
            // Closes the channels, which ends the helpers.
            self.canvas.helpers.clear();
            done.map(|()| self.enlarger)
        })
    }

    fn until(&mut self, left: usize, prunes: &mut Vec<Prune>, advance: &mut impl FnMut(u64) -> bool) -> Result<()> {
        while self.areas.leaves - prunes.len() > left {
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

    fn vmi(areas: &Areas, layers: &[&Layers]) -> Vmi {
        let fronts = layers.iter().enumerate().flat_map(|(view, layers)| layers.fronts().map(move |pair| (view, pair)));
        Vmi::new(areas, u64::from(RESOLUTION).pow(2) * layers.len() as u64, true, fronts)
    }

    /// Front and second polygon of every pixel, drawn from scratch at the current scales.
    fn drawn_again(pruner: &Pruner<'_, Vmi>, view: usize) -> Vec<[u32; 2]> {
        let leaves = pruner.areas.leaves as u32;
        let mut nearest = vec![[(u32::MAX, leaves); 2]; pruner.scene.views.pixels()];
        let mut footprint = Footprint::new(nearest.len());
        for shape in (0..=leaves).filter(|&shape| shape == leaves || !pruner.canvas.groups[0].dead[shape as usize]) {
            let row = if shape == leaves { leaves + 1 } else { shape };
            let scale = pruner.enlarger.scales.get(shape as usize).copied().unwrap_or(1.0);
            footprint.rasterise(pruner.scene, view, shape, scale);
            for &(pixel, depth) in &footprint.fragments {
                let pair = &mut nearest[pixel as usize];
                // Only wood is counted behind wood.
                let sinking =
                    if (depth, row) < pair[0] { std::mem::replace(&mut pair[0], (depth, row)) } else { (depth, row) };
                pair[1] = if pair[0].1 == leaves + 1 { pair[0] } else { pair[1].min(sinking) };
            }
        }
        nearest.into_iter().map(|pair| pair.map(|(_, row)| row)).collect()
    }

    /// Number of pixels, over all views, that a leaf covers at its current scale.
    fn covers(pruner: &Pruner<'_, Vmi>, leaf: usize) -> u32 {
        let views = pruner.scene.views;
        let mut footprint = Footprint::new(views.pixels());
        let count = |view| {
            footprint.rasterise(pruner.scene, view, leaf as u32, pruner.enlarger.scales[leaf]);
            footprint.fragments.len() as u32
        };
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
        let scene = Scene { shapes: &shapes, views: &views, masks: &masks.masks, appearance: None };
        let enlarger = Enlarger::new(&plant, covered, Compensate::Nearest, 4.0);
        let price = Price::new(1, 0);
        let mut pruner = Pruner::new(scene, layers, areas, price, Box::new(criterion), enlarger);
        let mut steps = 0;
        while pruner.step().is_some() {
            steps += 1;
            let layers: Vec<&Layers> = pruner.canvas.groups.iter().flat_map(|group| &group.layers).collect();
            for (view, layers) in layers.iter().enumerate() {
                assert_eq!(
                    layers.fronts().collect::<Vec<_>>(),
                    drawn_again(&pruner, view),
                    "step {steps}, view {view}"
                );
            }
            let areas = count_areas(&layers, plant.leaves.len());
            let scratch = vmi(&areas, &layers);
            assert_eq!(pruner.criterion.f(), scratch.f(), "step {steps}");
            for leaf in (0..plant.leaves.len()).filter(|&leaf| !pruner.canvas.groups[0].dead[leaf]) {
                assert_eq!(pruner.areas.row(leaf), areas.row(leaf), "step {steps}, leaf {leaf}");
                assert_eq!(pruner.areas.seconds(leaf), areas.seconds(leaf), "step {steps}, leaf {leaf}");
                assert_eq!(pruner.enlarger.covered[leaf], covers(&pruner, leaf), "step {steps}, leaf {leaf}");
                assert_eq!(
                    pruner.criterion.error(&areas, leaf as u32),
                    scratch.error(&areas, leaf as u32),
                    "step {steps}, leaf {leaf}"
                );
            }
        }
        assert_eq!(steps, plant.leaves.len() - 1);
    }
}
