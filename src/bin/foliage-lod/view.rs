//! `foliage-lod view MODEL`: a model in a window.

use crate::{args, failure::Failure, output::grouped, scene, view_scene};
use foliage_lod::{
    Result,
    bounds::Sphere,
    extract::{
        LodPolicy, Sight, Swap,
        lod::{Blend, REFERENCE_FOV_Y, fewest_leaves},
    },
    model::{FoliageModel, Transition},
    render::{
        camera::Camera,
        device::GpuDevice,
        foliage::{FoliageRenderer, Instance, ModelId, Prepared},
        surface::Coloring,
        window::{self, Stage, egui},
    },
};
use glam::{DAffine3, DVec3};
use std::time::{Duration, Instant};

/// Radians of orbit for a pixel of drag.
const ORBIT_PER_PX: f32 = 0.006;
/// Steepest look from above and below, in radians.
const STEEPEST: f32 = 1.5;
/// What one line of scrolling multiplies the distance by.
const SCROLL_FACTOR: f32 = 0.88;
/// Nearest and farthest distance, in radii.
const DISTANCES: std::ops::RangeInclusive<f32> = 1.1..=120.0;
/// The looks of leaves, as the panel names them.
const COLORINGS: [(Coloring, &str); 4] = [
    (Coloring::Picture, "leaves as they are"),
    (Coloring::Flat, "each leaf in its colour"),
    (Coloring::PruneOrder, "by order: blue stays, orange goes"),
    (Coloring::Wire, "edges"),
];
/// How much of a shown time is its last measurement: the rest is what was shown before.
const SMOOTHING: f64 = 0.1;

/// Runs the subcommand.
pub fn run(args: &args::View) -> std::result::Result<(), Failure> {
    if scene::is_toml(&args.model) {
        return view_scene::run(args);
    }
    let model = FoliageModel::read(&args.model)?;
    let title = format!("{} - foliage-lod", args.model.display());
    window::open(
        &title,
        Box::new(move |gpu, target| Viewer::new(gpu, FoliageRenderer::new(gpu.device(), target), model)),
    )?;
    Ok(())
}

/// How the active count is found.
#[derive(Clone, Copy, PartialEq)]
enum Detail {
    /// By Equation 1, from the distance.
    Automatic,
    /// By hand.
    Manual,
    /// All leaves.
    Full,
}

struct Viewer {
    foliage: FoliageRenderer,
    id: ModelId,
    name: String,
    leaves: u32,
    sphere: Sphere,
    swap: Swap,
    /// Radians about the vertical and above the horizon.
    orbit: [f32; 2],
    distance_radii: f32,
    detail: Detail,
    /// Share of the leaves, by hand.
    lod: f32,
    is_smooth: bool,
    /// Chosen, and compiled for.
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
            sphere: model.sphere(),
            swap: Swap::new(&model),
            orbit: [0.42, 0.22],
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

    fn camera(&self, size: [u32; 2]) -> Camera {
        let [around, above] = self.orbit.map(f64::from);
        let towards_eye = DVec3::new(around.sin() * above.cos(), above.sin(), around.cos() * above.cos());
        let fov_y = f64::from(REFERENCE_FOV_Y);
        let factor = f64::from(self.distance_radii) * (0.5 * fov_y).sin();
        let camera = Camera::framing(&self.sphere, towards_eye, fov_y, factor);
        camera.with_aspect(f64::from(size[0]) / f64::from(size[1]))
    }
}

impl Stage for Viewer {
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.heading(&self.name);
        ui.label(format!("{} leaves", grouped(self.leaves)));
        ui.separator();
        ui.add(egui::Slider::new(&mut self.distance_radii, DISTANCES).logarithmic(true).text("distance (radii)"));
        ui.separator();
        ui.radio_value(&mut self.detail, Detail::Automatic, "detail by distance");
        ui.radio_value(&mut self.detail, Detail::Manual, "detail by hand");
        ui.radio_value(&mut self.detail, Detail::Full, "all leaves");
        ui.add_enabled(self.detail == Detail::Manual, egui::Slider::new(&mut self.lod, 0.0..=1.0).text("LOD"));
        ui.checkbox(&mut self.is_smooth, "leaves come and go smoothly");
        ui.separator();
        for (coloring, name) in COLORINGS {
            ui.radio_value(&mut self.coloring[0], coloring, name);
        }
        ui.separator();
        let Prepared { leaves, draws, .. } = self.prepared;
        let percent = 100.0 * leaves as f64 / f64::from(self.leaves.max(1));
        ui.label(format!("{} leaves drawn ({percent:.1} %)", grouped(leaves)));
        ui.label(format!("{draws} draws"));
        ui.label(format!("extraction {:.1} us", self.extraction_us));
        ui.label(format!("prepare {:.1} us", self.prepare_us));
        ui.label(format!("frame {:.1} ms", self.frame_ms));
        ui.separator();
        ui.small("Drag to turn, scroll to come nearer.");
    }

    fn dragged(&mut self, [x, y]: [f32; 2]) {
        self.orbit[0] -= x * ORBIT_PER_PX;
        self.orbit[1] = (self.orbit[1] + y * ORBIT_PER_PX).clamp(-STEEPEST, STEEPEST);
    }

    fn scrolled(&mut self, lines: f32) {
        let distance = self.distance_radii * SCROLL_FACTOR.powf(lines);
        self.distance_radii = distance.clamp(*DISTANCES.start(), *DISTANCES.end());
    }

    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()> {
        if self.coloring[0] != self.coloring[1] {
            self.coloring[1] = self.coloring[0];
            self.foliage.set_coloring(self.coloring[0]);
        }
        let active = self.share(size[1]) * self.leaves as f32;
        let active = if self.detail == Detail::Manual { active } else { active.max(fewest_leaves(self.leaves) as f32) };
        let started = Instant::now();
        self.swap.set_active(active as u32);
        self.extraction_us = started.elapsed().as_secs_f64() * 1e6;
        let (active, window) = if self.is_smooth { (active, Transition::SMOOTH_WINDOW) } else { (active.round(), 1.0) };
        let instance = Instance { window, ..Instance::new(self.id, DAffine3::IDENTITY, active) };
        let started = Instant::now();
        self.prepared = self.foliage.prepare(gpu.device(), gpu.queue(), &self.camera(size), &[instance])?;
        smooth(&mut self.prepare_us, started.elapsed().as_secs_f64() * 1e6);
        Ok(())
    }

    fn foliage(&self) -> &FoliageRenderer {
        &self.foliage
    }

    fn drawn(&mut self, frame: Duration) {
        smooth(&mut self.frame_ms, frame.as_secs_f64() * 1e3);
    }
}

fn smooth(shown: &mut f64, measured: f64) {
    *shown += (measured - *shown) * if *shown == 0.0 { 1.0 } else { SMOOTHING };
}
