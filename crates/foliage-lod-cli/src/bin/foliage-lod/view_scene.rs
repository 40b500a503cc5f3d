//! `foliage-lod view SCENE`: shows a scene in a window, with a switch for each effect.

use crate::{args, budget_panel::BudgetPanel, failure::Failure, orbit, output::Steps, scene::Opened, staging::Shown};
use foliage_lod::{
    FoliageRenderer, Frame, Instance, Look, LookAt, Result,
    draw::{Coloring, FarCounts, ModelId, Prepared},
    effects::Effects,
    extract::Far,
    gpu::{GpuDevice, TargetFormat},
    software::LiveImpostors,
};
use foliage_lod_cli::window::{self, FrameTimes, Stage, egui};
use glam::DVec3;
use indicatif::HumanCount;
use std::time::Instant;

/// Weight of the latest measurement in a displayed time; the rest is the previous value.
const SMOOTHING: f64 = 0.1;

/// Runs the subcommand for a scene.
pub fn run(args: &args::View) -> std::result::Result<(), Failure> {
    let mut steps = Steps::new(false);
    let mut opened = Opened::open(&args.model, None, &mut steps)?;
    if opened.file.budget.is_some() {
        opened.measure(&mut steps)?;
    }
    opened.file.tone &= args.tone == args::Switch::On;
    opened.file.lod.wood_error = args.wood_error.or(opened.file.lod.wood_error);
    opened.look().check()?;
    let title = format!("{} - foliage-lod", args.model.display());
    window::open(&title, Box::new(move |gpu, target| Viewer::new(gpu, target, opened)))?;
    Ok(())
}

struct Viewer {
    opened: Opened,
    target: TargetFormat,
    foliage: FoliageRenderer,
    ids: Vec<ModelId>,
    /// Whether each effect is on.
    is_on: [bool; EFFECTS.len()],
    /// Effects and hand-over that the renderer was created with.
    made_for: (Effects, Option<Far>),
    /// When trees are handed over to impostors, if the scene says so.
    far: Option<Far>,
    /// Whether trees are coloured by what they are drawn with, and whether the renderer does so.
    shows_parts: [bool; 2],
    draws_all: bool,
    is_playing: bool,
    seconds: f64,
    last_frame: Instant,
    /// Eye relative to the target, and the target, once the user has moved the camera.
    moved: Option<(DVec3, DVec3)>,
    prepared: Prepared,
    seen: usize,
    budget: BudgetPanel,
    frame_ms: f64,
    gpu_ms: Option<f64>,
}

/// Enables an effect in the first argument, with the settings of the second if it has any.
type Switch = fn(&mut Effects, &Effects);

/// Name and switch of each effect.
const EFFECTS: [(&str, Switch); 7] = [
    ("fade", |to, from| to.fade = from.fade.or(Some(Default::default()))),
    ("contrast", |to, from| to.contrast = from.contrast.or(Some(Default::default()))),
    ("crown normals", |to, from| to.crown_normals = from.crown_normals.or(Some(Default::default()))),
    ("wind", |to, from| to.wind = from.wind.or(Some(Default::default()))),
    ("translucency", |to, from| to.translucency = from.translucency.or(Some(Default::default()))),
    ("shadow", |to, from| to.shadow = from.shadow.or(Some(Default::default()))),
    ("sky", |to, from| to.sky = from.sky.or(Some(Default::default()))),
];

impl Viewer {
    fn new(gpu: &GpuDevice, target: TargetFormat, opened: Opened) -> Result<Self> {
        let of_file = opened.file.effects;
        let is_on = [
            of_file.fade.is_some(),
            of_file.contrast.is_some(),
            of_file.crown_normals.is_some(),
            of_file.wind.is_some(),
            of_file.translucency.is_some(),
            of_file.shadow.is_some(),
            of_file.sky.is_some(),
        ];
        let opened_far = opened.file.far;
        let (foliage, ids) = renderer(gpu, target, &opened, opened.look())?;
        let budget = BudgetPanel::new(opened.file.budget);
        Ok(Self {
            opened,
            target,
            foliage,
            ids,
            is_on,
            made_for: (of_file, opened_far),
            far: opened_far,
            shows_parts: [false; 2],
            draws_all: false,
            is_playing: true,
            seconds: 0.0,
            last_frame: Instant::now(),
            moved: None,
            prepared: Prepared::default(),
            seen: 0,
            budget,
            frame_ms: 0.0,
            gpu_ms: None,
        })
    }

    /// The enabled effects, with the settings of the scene file if it has any.
    fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        for (_, (_, switch)) in self.is_on.iter().zip(EFFECTS).filter(|(is_on, _)| **is_on) {
            switch(&mut effects, &self.opened.file.effects);
        }
        effects
    }

    fn camera(&self, size: [u32; 2]) -> LookAt {
        let camera = self.opened.camera(self.seconds, f64::from(size[0]) / f64::from(size[1]));
        match self.moved {
            None => camera,
            Some((from_target, target)) => {
                LookAt { eye: self.opened.above_ground(target + from_target), target, ..camera }
            }
        }
    }

    /// Moves the eye by `change`, relative to the target; from now on the scene no longer moves the
    /// camera.
    fn by_hand(&mut self, change: impl Fn(DVec3) -> DVec3) {
        let camera = self.camera([1, 1]);
        self.moved = Some((change(camera.eye - camera.target), camera.target));
    }
}

/// Creates a renderer with all models of the scene.
fn renderer(
    gpu: &GpuDevice,
    target: TargetFormat,
    opened: &Opened,
    look: Look,
) -> Result<(FoliageRenderer, Vec<ModelId>)> {
    let foliage = FoliageRenderer::new(gpu.device(), target, look)?;
    let mut foliage = foliage.with_live_impostors(LiveImpostors::default())?;
    foliage.set_terrain(gpu.device(), gpu.queue(), opened.terrain.clone())?;
    let added = opened.models.iter().map(|model| foliage.add_model(gpu.device(), gpu.queue(), model));
    let ids = added.collect::<Result<_>>()?;
    Ok((foliage, ids))
}

impl Stage for Viewer {
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.heading("scene");
        ui.label(format!(
            "{} plants, {} in view",
            HumanCount(self.opened.plants() as u64),
            HumanCount(self.seen as u64)
        ));
        ui.separator();
        ui.radio_value(&mut self.draws_all, false, "level of detail");
        ui.radio_value(&mut self.draws_all, true, "all leaves");
        ui.separator();
        self.budget.show(ui, &self.opened);
        ui.separator();
        for ((name, _), is_on) in EFFECTS.iter().zip(&mut self.is_on) {
            ui.checkbox(is_on, *name);
        }
        if let Some(far) = &mut self.far {
            ui.separator();
            ui.add(egui::Slider::new(&mut far.at_px, 0.0..=256.0).text("impostors below (pixels)"));
            ui.checkbox(&mut self.shows_parts[0], "colour leaves green, impostors orange");
        }
        ui.separator();
        ui.checkbox(&mut self.is_playing, "animate");
        ui.add(egui::Slider::new(&mut self.seconds, 0.0..=120.0).text("seconds"));
        if self.moved.is_some() && ui.button("reset camera").clicked() {
            self.moved = None;
            self.budget.cut(&mut self.opened);
        }
        ui.separator();
        let Prepared { leaves, wood_triangles, draws, effects, far, live, .. } = self.prepared;
        ui.label(format!("{} leaves drawn", HumanCount(leaves)));
        ui.label(format!("{} wood triangles", HumanCount(wood_triangles)));
        ui.label(format!("{draws} draw calls"));
        if self.far.is_some() {
            let FarCounts { leaves, both, impostors, faded } = far;
            ui.label(format!("trees by leaves {leaves}, by both {both}, by impostors {impostors}, faded {faded}"));
            ui.label(format!("frames of impostors: {} made now, {} waited for", live.made, live.pending));
        }
        for (name, count) in effects.named() {
            ui.label(format!(
                "{name}: {} simulated, {} skipped",
                HumanCount(count.simulated),
                HumanCount(count.skipped)
            ));
        }
        let gpu = self.gpu_ms.map_or(String::new(), |ms| format!(", scene on the GPU {ms:.1} ms"));
        ui.label(format!("frame {:.1} ms{gpu}", self.frame_ms));
        ui.separator();
        ui.small("Drag to orbit, scroll to zoom.");
        if self.is_playing || self.budget.moves() || live.pending + live.appearing > 0 {
            ui.ctx().request_repaint();
        }
    }

    fn dragged(&mut self, by_px: [f32; 2]) {
        self.by_hand(|from_target| orbit::dragged(from_target, by_px));
    }

    fn scrolled(&mut self, lines: f32) {
        self.by_hand(|from_target| from_target * orbit::zoom(lines));
    }

    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()> {
        let effects = self.effects();
        if (effects, self.far) != self.made_for {
            let look = Look { effects, far: self.far, ..self.opened.look() };
            (self.foliage, self.ids) = renderer(gpu, self.target, &self.opened, look)?;
            self.made_for = (effects, self.far);
            self.shows_parts[1] = false;
        }
        if self.shows_parts[0] != self.shows_parts[1] {
            self.shows_parts[1] = self.shows_parts[0];
            self.foliage.set_coloring(if self.shows_parts[0] { Coloring::Parts } else { Coloring::Picture });
        }
        if self.is_playing {
            self.seconds = (self.seconds + self.last_frame.elapsed().as_secs_f64()) % 120.0;
        }
        let seconds = self.last_frame.elapsed().as_secs_f64();
        self.last_frame = Instant::now();
        let camera = self.camera(size).camera(size[1]);
        self.budget.apply(&mut self.opened)?;
        let instance = |shown: &Shown| Instance {
            far: shown.far,
            seed: shown.seed,
            tint: shown.tint.to_array(),
            ..Instance::new(self.ids[shown.model], shown.world_from_plant, shown.active)
        };
        self.opened.follow(camera.eye, false)?;
        let shown = self.opened.shown(&camera, self.draws_all, Some(seconds));
        let seen: Vec<Instance> = shown.iter().map(instance).collect();
        let casters = self.opened.casters(&camera, self.draws_all, &effects);
        let casters: Vec<Instance> = casters.iter().map(instance).collect();
        self.seen = seen.len();
        let frame = Frame::new(&camera).at(self.seconds);
        let (device, queue) = (gpu.device(), gpu.queue());
        self.prepared = self.foliage.prepare_with_casters(device, queue, frame, &seen, &casters)?;
        self.budget.prepared(&mut self.opened, &shown, self.prepared.wood_triangles);
        Ok(())
    }

    fn foliage(&self) -> &FoliageRenderer {
        &self.foliage
    }

    fn drawn(&mut self, times: FrameTimes) {
        self.budget.took(&times);
        self.gpu_ms = times.gpu_ms;
        let measured = times.whole.as_secs_f64() * 1e3;
        self.frame_ms += (measured - self.frame_ms) * if self.frame_ms == 0.0 { 1.0 } else { SMOOTHING };
    }
}
