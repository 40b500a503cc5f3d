//! `foliage-lod view SCENE`: a scene in a window, its effects switched on and off.

use crate::{
    args,
    failure::Failure,
    output::{Steps, grouped},
    scene::Opened,
    staging::Shown,
};
use foliage_lod::{
    Result,
    effects::Effects,
    render::{
        camera::Camera,
        device::GpuDevice,
        foliage::{FoliageRenderer, Frame, Instance, ModelId, Prepared},
        look::Look,
        surface::TargetFormat,
        window::{self, Stage, egui},
    },
};
use glam::DVec3;
use std::time::{Duration, Instant};

/// Radians of orbit for a pixel of drag.
const ORBIT_PER_PX: f64 = 0.004;
/// What one line of scrolling multiplies the distance by.
const SCROLL_FACTOR: f64 = 0.9;
/// Steepest look from above and below, in radians.
const STEEPEST: f64 = 1.5;
/// How much of a shown time is its last measurement.
const SMOOTHING: f64 = 0.1;

/// Runs the subcommand for a scene.
pub fn run(args: &args::View) -> std::result::Result<(), Failure> {
    let opened = Opened::open(&args.model, &mut Steps::new(false))?;
    let title = format!("{} - foliage-lod", args.model.display());
    window::open(&title, Box::new(move |gpu, target| Viewer::new(gpu, target, opened)))?;
    Ok(())
}

struct Viewer {
    opened: Opened,
    target: TargetFormat,
    foliage: FoliageRenderer,
    ids: Vec<ModelId>,
    /// Which effects are on, and what the renderer was made for.
    is_on: [bool; EFFECTS.len()],
    made_for: Effects,
    draws_all: bool,
    is_playing: bool,
    seconds: f64,
    last_frame: Instant,
    /// Eye from target, once the camera was moved by hand.
    moved: Option<(DVec3, DVec3)>,
    prepared: Prepared,
    seen: usize,
    frame_ms: f64,
}

/// Switches an effect on, with the numbers of other effects where they have any.
type Switch = fn(&mut Effects, &Effects);

/// Names of the effects, and how each is switched.
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
        let (foliage, ids) = renderer(gpu, target, &opened, opened.look())?;
        Ok(Self {
            opened,
            target,
            foliage,
            ids,
            is_on,
            made_for: of_file,
            draws_all: false,
            is_playing: true,
            seconds: 0.0,
            last_frame: Instant::now(),
            moved: None,
            prepared: Prepared::default(),
            seen: 0,
            frame_ms: 0.0,
        })
    }

    /// The effects that are switched on, with the numbers of the scene file where it has them.
    fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        for (_, (_, switch)) in self.is_on.iter().zip(EFFECTS).filter(|(is_on, _)| **is_on) {
            switch(&mut effects, &self.opened.file.effects);
        }
        effects
    }

    fn camera(&self, size: [u32; 2]) -> Camera {
        let camera = self.opened.camera(self.seconds, f64::from(size[0]) / f64::from(size[1]));
        match self.moved {
            None => camera,
            Some((from_target, target)) => Camera { eye: target + from_target, target, ..camera },
        }
    }

    /// Where the eye stands from what it looks at, moved by hand from now on.
    fn by_hand(&mut self, change: impl Fn(DVec3) -> DVec3) {
        let camera = self.camera([1, 1]);
        self.moved = Some((change(camera.eye - camera.target), camera.target));
    }
}

/// A renderer with all models of the scene.
fn renderer(
    gpu: &GpuDevice,
    target: TargetFormat,
    opened: &Opened,
    look: Look,
) -> Result<(FoliageRenderer, Vec<ModelId>)> {
    let mut foliage = FoliageRenderer::with_look(gpu.device(), target, look);
    let added = opened.models.iter().map(|model| foliage.add_model(gpu.device(), gpu.queue(), model));
    let ids = added.collect::<Result<_>>()?;
    Ok((foliage, ids))
}

impl Stage for Viewer {
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.heading("scene");
        ui.label(format!("{} plants, {} in view", grouped(self.opened.plants() as u64), grouped(self.seen as u64)));
        ui.separator();
        ui.radio_value(&mut self.draws_all, false, "level of detail");
        ui.radio_value(&mut self.draws_all, true, "all leaves");
        ui.separator();
        for ((name, _), is_on) in EFFECTS.iter().zip(&mut self.is_on) {
            ui.checkbox(is_on, *name);
        }
        ui.separator();
        ui.checkbox(&mut self.is_playing, "time runs");
        ui.add(egui::Slider::new(&mut self.seconds, 0.0..=120.0).text("seconds"));
        if self.moved.is_some() && ui.button("camera of the scene").clicked() {
            self.moved = None;
        }
        ui.separator();
        let Prepared { leaves, wood_triangles, draws, effects, .. } = self.prepared;
        ui.label(format!("{} leaves drawn", grouped(leaves)));
        ui.label(format!("{} triangles of wood", grouped(wood_triangles)));
        ui.label(format!("{draws} draws"));
        for (name, count) in effects.named() {
            ui.label(format!("{name}: {} simulated, {} skipped", grouped(count.simulated), grouped(count.skipped)));
        }
        ui.label(format!("frame {:.1} ms", self.frame_ms));
        ui.separator();
        ui.small("Drag to turn, scroll to come nearer.");
        if self.is_playing {
            ui.ctx().request_repaint();
        }
    }

    fn dragged(&mut self, [x, y]: [f32; 2]) {
        self.by_hand(|from_target| {
            let distance = from_target.length();
            let around = from_target.x.atan2(from_target.z) - f64::from(x) * ORBIT_PER_PX;
            let above = (from_target.y / distance).asin() + f64::from(y) * ORBIT_PER_PX;
            let above = above.clamp(-STEEPEST, STEEPEST);
            DVec3::new(around.sin() * above.cos(), above.sin(), around.cos() * above.cos()) * distance
        });
    }

    fn scrolled(&mut self, lines: f32) {
        self.by_hand(|from_target| from_target * SCROLL_FACTOR.powf(f64::from(lines)));
    }

    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()> {
        let effects = self.effects();
        if effects != self.made_for {
            let look = Look { effects, ..self.opened.look() };
            (self.foliage, self.ids) = renderer(gpu, self.target, &self.opened, look)?;
            self.made_for = effects;
        }
        if self.is_playing {
            self.seconds = (self.seconds + self.last_frame.elapsed().as_secs_f64()) % 120.0;
        }
        self.last_frame = Instant::now();
        let camera = self.camera(size);
        let viewer = camera.viewer(size[1] as f32);
        let instance = |shown: &Shown| Instance::new(self.ids[shown.model], shown.world_from_plant, shown.active);
        let seen: Vec<Instance> = self.opened.shown(&viewer, self.draws_all).iter().map(instance).collect();
        let casters: Vec<Instance> = match effects.shadow {
            Some(_) => self.opened.shown(&viewer.all_around(), self.draws_all).iter().map(instance).collect(),
            None => Vec::new(),
        };
        self.seen = seen.len();
        let frame = Frame::new(&camera, size[1]).at(self.seconds);
        let (device, queue) = (gpu.device(), gpu.queue());
        self.prepared = self.foliage.prepare_with_casters(device, queue, frame, &seen, &casters)?;
        Ok(())
    }

    fn foliage(&self) -> &FoliageRenderer {
        &self.foliage
    }

    fn drawn(&mut self, frame: Duration) {
        let measured = frame.as_secs_f64() * 1e3;
        self.frame_ms += (measured - self.frame_ms) * if self.frame_ms == 0.0 { 1.0 } else { SMOOTHING };
    }
}
