//! The views while leaves are pruned: the tasks of a step, done view by view by any thread, and the
//! criterion that their changes go to, part by part.

use super::{
    areas::Areas,
    change::{Change, Gain},
    crew::{Crew, Dismissal, Lead, read, written},
    criterion::Criterion,
    enlarge::Growth,
    footprint::Footprints,
    judge::{Judge, ViewOf},
    layers::Layers,
    scene::Scene,
};
use std::{
    sync::{
        Arc, RwLock, RwLockReadGuard,
        atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed},
    },
    thread,
};

/// After a task that touched fewer pixels than this, the next removal or growth runs on one thread,
/// since handing it over would take longer. Judging always uses all threads.
const PARALLEL_PIXELS: usize = 256;

/// A leaf to be removed.
#[derive(Debug, Clone, Copy)]
pub struct Gone {
    /// The leaf.
    pub leaf: u32,
    /// Its current scale.
    pub scale: f32,
}

/// Task for every view.
#[derive(Debug, Clone)]
pub enum Task {
    /// Remove a leaf and grow another.
    Step(Gone, Growth),
    /// Remove a leaf, if there is one, and judge the growths that could replace it.
    Judge(Option<Gone>, Arc<[Growth]>),
    /// Grow a leaf that was judged before.
    Grow(Growth),
}

/// Job for the threads.
#[derive(Debug, Clone)]
enum Job {
    /// A task; its parts are the views.
    Views(Task),
    /// The criterion absorbs the changes of a step in which this leaf was pruned.
    Absorb(u32),
}

/// One view and what the last task found in it.
#[derive(Debug)]
pub struct CanvasView {
    /// Its fragments.
    pub layers: Layers,
    /// Gain of each growth judged last.
    gains: Vec<Gain>,
}

/// Working memory of one thread.
struct Memory {
    footprints: Footprints,
    judge: Judge,
}

/// Everything that the threads share.
pub struct Canvas<C: Criterion + ?Sized> {
    views: Vec<RwLock<CanvasView>>,
    areas: RwLock<Areas>,
    /// Scores of the leaves.
    pub criterion: Box<C>,
    /// Whether each leaf is pruned.
    dead: Vec<AtomicBool>,
    /// Number of pixels that the last task touched.
    touched: AtomicUsize,
    /// Number of pixels that the target covers after the last task; 0 if it grew nothing.
    grown: AtomicUsize,
    crew: Crew<Job>,
}

impl<C: Criterion + ?Sized> Canvas<C> {
    /// Creates a canvas of captured views. `areas` and `criterion` must be computed from them;
    /// `dead` tells which leaves they lack.
    pub fn new(layers: Vec<Layers>, areas: Areas, criterion: Box<C>, dead: &[bool]) -> Self {
        let view = |layers| RwLock::new(CanvasView { layers, gains: Vec::new() });
        Self {
            views: layers.into_iter().map(view).collect(),
            areas: RwLock::new(areas),
            criterion,
            dead: dead.iter().copied().map(AtomicBool::new).collect(),
            touched: AtomicUsize::new(0),
            grown: AtomicUsize::new(0),
            crew: Crew::new(Job::Absorb(0)),
        }
    }

    /// Visible areas. Not to be held while a job runs.
    pub fn areas(&self) -> RwLockReadGuard<'_, Areas> {
        read(&self.areas)
    }

    /// Number of pixels, over all views, that the target covers after the last task; 0 if it grew
    /// nothing.
    pub fn grown(&self) -> u32 {
        self.grown.load(Relaxed) as u32
    }

    /// Gain of each growth judged last, summed over all views.
    pub fn gains(&self, growths: usize) -> Vec<Gain> {
        let mut sums = vec![Gain::default(); growths];
        for view in self.views() {
            sums.iter_mut().zip(&view.gains).for_each(|(sum, gain)| *sum = sum.plus(*gain));
        }
        sums
    }

    /// All views. Not to be held while a task runs.
    pub fn views(&self) -> Vec<RwLockReadGuard<'_, CanvasView>> {
        self.views.iter().map(read).collect()
    }

    /// Calls `work` while the other threads of the pool help with its tasks.
    pub fn with_helpers<T>(&self, scene: Scene<'_>, work: impl FnOnce() -> T) -> T {
        let helpers = threads().min(self.views.len()) - 1;
        thread::scope(|scope| {
            let _dismissal = Dismissal(&self.crew);
            for _ in 0..helpers {
                scope.spawn(|| {
                    let mut memory = Memory::new(scene);
                    self.crew.help(|job, part| self.run(scene, job, part, &mut memory));
                });
            }
            work()
        })
    }

    fn run(&self, scene: Scene<'_>, job: &Job, part: usize, memory: &mut Memory) {
        match job {
            Job::Views(task) => self.run_view(scene, task, part, memory),
            Job::Absorb(pruned) => {
                let views = self.views();
                let changes: Vec<&[Change]> = views.iter().map(|view| &view.layers.changes[..]).collect();
                self.criterion.absorb(part, &self.areas(), &changes, *pruned);
            }
        }
    }

    fn run_view(&self, scene: Scene<'_>, task: &Task, view: usize, memory: &mut Memory) {
        let mut on = OnView { scene, view, dead: &self.dead, state: &mut written(&self.views[view]), memory };
        match task {
            Task::Step(gone, growth) => {
                let removed = on.remove(*gone);
                let grown = on.grow(*growth);
                self.count(removed, grown);
            }
            Task::Judge(gone, growths) => {
                let removed = gone.map_or(0, |gone| on.remove(gone));
                on.judge(growths);
                self.count(removed, 0);
            }
            Task::Grow(growth) => self.count(0, on.grow(*growth)),
        }
    }

    fn count(&self, removed: usize, grown: usize) {
        self.touched.fetch_add(removed + grown, Relaxed);
        self.grown.fetch_add(grown, Relaxed);
    }
}

/// Hands out the jobs, and does its share of them.
pub struct Runner<'a, C: Criterion + ?Sized> {
    scene: Scene<'a>,
    canvas: Arc<Canvas<C>>,
    lead: Lead,
    memory: Memory,
}

impl<'a, C: Criterion + ?Sized> Runner<'a, C> {
    /// Creates a runner that works alone until the canvas [has helpers](Canvas::with_helpers).
    pub fn new(scene: Scene<'a>, canvas: Canvas<C>) -> Self {
        Self { scene, canvas: Arc::new(canvas), lead: Lead::default(), memory: Memory::new(scene) }
    }

    /// What the threads share.
    pub fn canvas(&self) -> &Arc<Canvas<C>> {
        &self.canvas
    }

    /// Does a task in every view.
    pub fn run(&mut self, task: Task) {
        let canvas = &self.canvas;
        if let Task::Step(gone, _) | Task::Judge(Some(gone), _) = &task {
            canvas.dead[gone.leaf as usize].store(true, Relaxed);
        }
        canvas.grown.store(0, Relaxed);
        let is_small = canvas.touched.swap(0, Relaxed) < PARALLEL_PIXELS && !matches!(task, Task::Judge(..));
        let views = canvas.views.len();
        self.share(Job::Views(task), views, is_small);
    }

    /// Ends a step in which `pruned` was pruned: areas and criterion take up its changes.
    pub fn absorb(&mut self, pruned: u32) {
        let canvas = &self.canvas;
        let mut areas = written(&canvas.areas);
        areas.begin_step();
        for (view, state) in canvas.views().iter().enumerate() {
            state.layers.changes.iter().for_each(|change| areas.apply(view, change));
        }
        drop(areas);
        let is_small = canvas.touched.load(Relaxed) < PARALLEL_PIXELS;
        self.share(Job::Absorb(pruned), self.canvas.criterion.parts(), is_small);
    }

    fn share(&mut self, job: Job, parts: usize, is_small: bool) {
        let Self { scene, canvas, lead, memory } = self;
        let mut run = |job: &Job, part| canvas.run(*scene, job, part, memory);
        if is_small || parts == 1 || threads() == 1 {
            return (0..parts).for_each(|part| run(&job, part));
        }
        lead.share(&canvas.crew, job, parts, run);
    }
}

/// Number of threads that work on the views.
fn threads() -> usize {
    rayon::current_num_threads()
}

impl Memory {
    fn new(scene: Scene<'_>) -> Self {
        Self { footprints: Footprints::new(scene.views.resolution), judge: Judge::new(scene.views.pixels()) }
    }
}

/// Everything that a task needs in one view.
struct OnView<'a> {
    scene: Scene<'a>,
    view: usize,
    dead: &'a [AtomicBool],
    state: &'a mut CanvasView,
    memory: &'a mut Memory,
}

impl OnView<'_> {
    /// Removes a leaf and returns the number of pixels looked at.
    fn remove(&mut self, Gone { leaf, scale }: Gone) -> usize {
        let layers = &mut self.state.layers;
        layers.changes.clear();
        if layers.seen(leaf) == [0; 2] {
            return 0;
        }
        let mut count = 0;
        self.memory.footprints.outline(self.scene, self.view, leaf, scale, |index| {
            count += 1;
            layers.remove(leaf, index, self.dead);
        });
        count
    }

    /// Grows a leaf and returns the number of pixels that it covers now, or 0 if nothing changed.
    fn grow(&mut self, Growth { target, from, to }: Growth) -> usize {
        if from == to {
            return 0;
        }
        let footprints = &mut self.memory.footprints;
        let count = footprints.rasterise(self.scene, self.view, target, [from, to]);
        self.state.layers.regrow(target, footprints, self.dead);
        count
    }

    /// Finds the gain of each growth in this view.
    fn judge(&mut self, growths: &[Growth]) {
        let CanvasView { layers, gains } = &mut *self.state;
        gains.clear();
        gains.resize(growths.len(), Gain::default());
        layers.refresh();
        let (scene, view) = (self.scene, self.view);
        if let (Some(appearance), Some(occlusion)) = (scene.appearance, layers.occlusion()) {
            let on = ViewOf { scene, view, layers, occlusion, look: appearance.view(view) };
            self.memory.judge.judge(on, growths, gains);
        }
    }
}
