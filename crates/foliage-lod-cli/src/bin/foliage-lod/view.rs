//! `foliage-lod view MODEL`: shows a model in a window.

use crate::{args, failure::Failure, models, orbit, scene, view_scene};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Result, Swap,
    bounds::Sphere,
    draw::{Coloring, ModelId, Prepared},
    extract::{Blend, LodPolicy, REFERENCE_FOV_Y, Sight, fewest_leaves, fewest_visible},
    gpu::GpuDevice,
    model::Transition,
};
use foliage_lod_cli::window::{self, FrameTimes, Stage, egui};
use glam::{DAffine3, DVec3};
use indicatif::HumanCount;
use std::time::Instant;

/// Range of the distance in radii.
const DISTANCES: std::ops::RangeInclusive<f32> = 1.1..=120.0;
/// Colourings of the leaves and their labels in the panel.
const COLORINGS: [(Coloring, &str); 4] = [
    (Coloring::Picture, "shaded leaves"),
    (Coloring::Flat, "one colour per leaf"),
    (Coloring::PruneOrder, "prune order: orange first, blue last"),
    (Coloring::Wire, "wireframe"),
];
/// Weight of the latest measurement in a displayed time; the rest is the previous value.
const SMOOTHING: f64 = 0.1;

/// Runs the subcommand.
pub fn run(args: &args::View) -> std::result::Result<(), Failure> {
    if scene::is_toml(&args.model) {
        return view_scene::run(args);
    }
    let model = models::read(&args.model)?;
    let title = format!("{} - foliage-lod", args.model.display());
    let wood_error_px = args.wood_error.unwrap_or(Look::default().wood_error_px);
    let look = Look { tone: args.tone == args::Switch::On, wood_error_px, ..Look::default() };
    look.check()?;
    window::open(
        &title,
        Box::new(move |gpu, target| Viewer::new(gpu, FoliageRenderer::new(gpu.device(), target, look)?, model)),
    )?;
    Ok(())
}

/// How the active count is chosen.
#[derive(Clone, Copy, PartialEq)]
enum Detail {
    /// From the distance, by the default policy, [`Blend`].
    Automatic,
    /// By the slider.
    Manual,
    /// All leaves.
    Full,
}

struct Viewer {
    foliage: FoliageRenderer,
    id: ModelId,
    name: String,
    leaves: u32,
    /// Fewest leaves with manual detail above 0.
    fewest_visible: u32,
    sphere: Sphere,
    swap: Swap,
    /// Direction from the plant's centre to the eye.
    towards_eye: DVec3,
    distance_radii: f32,
    detail: Detail,
    /// Fraction of the leaves set by the slider.
    lod: f32,
    is_smooth: bool,
    /// Selected colouring, and the one that the renderer is set to.
    coloring: [Coloring; 2],
    prepared: Prepared,
    prepare_us: f64,
    extraction_us: f64,
    frame_ms: f64,
}

impl Viewer {
    fn new(gpu: &GpuDevice, mut foliage: FoliageRenderer, model: FoliageModel) -> Result<Self> {
        Ok(Self {
            id: foliage.add_model(gpu.device(), gpu.queue(), &model)?,
            foliage,
            name: model.name.clone(),
            leaves: model.leaves.len() as u32,
            fewest_visible: fewest_visible(&model),
            sphere: model.sphere(),
            swap: Swap::new(&model),
            towards_eye: DVec3::new(0.42, 0.24, 0.89),
            distance_radii: 2.6,
            detail: Detail::Automatic,
            lod: 1.0,
            is_smooth: true,
            coloring: [Coloring::Picture; 2],
            prepared: Prepared::default(),
            prepare_us: 0.0,
            extraction_us: 0.0,
            frame_ms: 0.0,
        })
    }

    fn share(&self, height_px: u32) -> f32 {
        match self.detail {
            Detail::Full => 1.0,
            Detail::Manual => self.lod,
            Detail::Automatic => Blend::default().lod(&Sight {
                distance: self.distance_radii,
                radius: 1.0,
                fov_y: REFERENCE_FOV_Y,
                height_px: height_px as f32,
            }),
        }
    }

    fn fewest(&self) -> u32 {
        match self.detail {
            Detail::Manual if self.lod > 0.0 => self.fewest_visible,
            Detail::Manual => 0,
            Detail::Full | Detail::Automatic => fewest_leaves(self.leaves),
        }
    }

    fn camera(&self, size: [u32; 2]) -> LookAt {
        let fov_y = f64::from(REFERENCE_FOV_Y);
        let factor = f64::from(self.distance_radii) * (0.5 * fov_y).sin();
        let camera = LookAt::framing(&self.sphere, self.towards_eye, fov_y, factor);
        camera.with_aspect(f64::from(size[0]) / f64::from(size[1]))
    }
}

impl Stage for Viewer {
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.heading(&self.name);
        ui.label(format!("{} leaves", HumanCount(self.leaves.into())));
        ui.separator();
        ui.add(egui::Slider::new(&mut self.distance_radii, DISTANCES).logarithmic(true).text("distance (radii)"));
        ui.separator();
        ui.radio_value(&mut self.detail, Detail::Automatic, "detail from distance");
        ui.radio_value(&mut self.detail, Detail::Manual, "manual detail");
        ui.radio_value(&mut self.detail, Detail::Full, "all leaves");
        ui.add_enabled(self.detail == Detail::Manual, egui::Slider::new(&mut self.lod, 0.0..=1.0).text("LOD"));
        ui.checkbox(&mut self.is_smooth, "smooth transitions");
        ui.separator();
        for (coloring, name) in COLORINGS {
            ui.radio_value(&mut self.coloring[0], coloring, name);
        }
        ui.separator();
        let Prepared { leaves, draws, .. } = self.prepared;
        let percent = 100.0 * leaves as f64 / f64::from(self.leaves.max(1));
        ui.label(format!("{} leaves drawn ({percent:.1} %)", HumanCount(leaves)));
        ui.label(format!("{draws} draw calls"));
        ui.label(format!("extraction {:.1} us", self.extraction_us));
        ui.label(format!("prepare {:.1} us", self.prepare_us));
        ui.label(format!("frame {:.1} ms", self.frame_ms));
        ui.separator();
        ui.small("Drag to orbit, scroll to zoom.");
    }

    fn dragged(&mut self, by_px: [f32; 2]) {
        self.towards_eye = orbit::dragged(self.towards_eye, by_px);
    }

    fn scrolled(&mut self, lines: f32) {
        let distance = self.distance_radii * orbit::zoom(lines) as f32;
        self.distance_radii = distance.clamp(*DISTANCES.start(), *DISTANCES.end());
    }

    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()> {
        if self.coloring[0] != self.coloring[1] {
            self.coloring[1] = self.coloring[0];
            self.foliage.set_coloring(self.coloring[0]);
        }
        let active = (self.share(size[1]) * self.leaves as f32).max(self.fewest() as f32);
        let started = Instant::now();
        self.swap.set_active(active as u32);
        self.extraction_us = started.elapsed().as_secs_f64() * 1e6;
        let (active, window) = if self.is_smooth { (active, Transition::SMOOTH_WINDOW) } else { (active.round(), 1.0) };
        let instance = Instance { window, ..Instance::new(self.id, DAffine3::IDENTITY, active) };
        let started = Instant::now();
        self.prepared =
            self.foliage.prepare(gpu.device(), gpu.queue(), self.camera(size).camera(size[1]), &[instance])?;
        smooth(&mut self.prepare_us, started.elapsed().as_secs_f64() * 1e6);
        Ok(())
    }

    fn foliage(&self) -> &FoliageRenderer {
        &self.foliage
    }

    fn drawn(&mut self, times: FrameTimes) {
        smooth(&mut self.frame_ms, times.whole.as_secs_f64() * 1e3);
    }
}

fn smooth(shown: &mut f64, measured: f64) {
    *shown += (measured - *shown) * if *shown == 0.0 { 1.0 } else { SMOOTHING };
}
