//! A forest in a window: a thousand trees, each at its own level of detail, frustum-culled and
//! drawn with a few draw calls.
//!
//! `cargo run --release --features viewer --example forest_window -- birch.vds`; without a model it
//! grows a small birch.

use foliage_lod::{
    FoliageModel, FoliageRenderer, Grove, Instance, Look, LookAt, Result,
    draw::{ModelId, Prepared},
    gpu::GpuDevice,
    grow::{GrowOptions, Species, grow},
    model::Transition,
    scene::{Active, Kind, Placement},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use foliage_lod_cli::window::{self, Stage, egui};
use glam::{DAffine3, DQuat, DVec3};

const TREES: u32 = 1000;

struct Forest {
    foliage: FoliageRenderer,
    model: ModelId,
    grove: Grove,
    placements: Vec<Placement>,
    /// Trees in view. Kept between frames, like `instances`, so that the memory is reused.
    active: Vec<Active>,
    instances: Vec<Instance>,
    prepared: Prepared,
    radius: f64,
    turn: f64,
    distance_radii: f64,
}

fn main() -> Result<()> {
    let model = std::env::args().nth(1).map_or_else(small_birch, FoliageModel::read)?;
    window::open(
        "forest",
        Box::new(move |gpu, target| {
            let mut foliage = FoliageRenderer::new(gpu.device(), target, Look::default())?;
            let radius = model.sphere().radius;
            let placements: Vec<Placement> = (0..TREES).map(|i| placement(i, radius)).collect();
            Ok(Forest {
                model: foliage.add_model(gpu.device(), gpu.queue(), &model)?,
                foliage,
                grove: Grove::new(vec![Kind::new(&model)], &placements)?,
                placements,
                active: Vec::new(),
                instances: Vec::new(),
                prepared: Prepared::default(),
                radius,
                turn: 0.0,
                distance_radii: 20.0,
            })
        }),
    )
}

/// Places the trees like the seeds of a sunflower: evenly spaced, without rows.
fn placement(i: u32, radius: f64) -> Placement {
    let (turn, out) = (f64::from(i) * 2.399_963, f64::from(i).sqrt() * radius * 1.6);
    let place = DVec3::new(turn.cos(), 0.0, turn.sin()) * out;
    let world_from_plant = DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn * 7.0), place);
    Placement { kind: 0, world_from_plant }
}

impl Stage for Forest {
    fn panel(&mut self, ui: &mut egui::Ui) {
        let Prepared { instances, leaves, draws, .. } = self.prepared;
        ui.label(format!("{instances} of {TREES} trees in view\n{leaves} leaves\n{draws} draw calls"));
    }

    fn dragged(&mut self, by_px: [f32; 2]) {
        self.turn -= f64::from(by_px[0]) * 0.005;
    }

    fn scrolled(&mut self, lines: f32) {
        self.distance_radii = (self.distance_radii * 0.9_f64.powf(lines.into())).clamp(1.5, 200.0);
    }

    fn prepare(&mut self, gpu: &GpuDevice, size: [u32; 2]) -> Result<()> {
        let target = DVec3::Y * self.radius;
        let towards_eye = DVec3::new(self.turn.sin(), 0.25, self.turn.cos());
        let camera = LookAt {
            eye: target + towards_eye * self.distance_radii * self.radius,
            target,
            up: DVec3::Y,
            fov_y_radians: 1.0,
            aspect: f64::from(size[0]) / f64::from(size[1]),
            near: 0.01 * self.radius,
        }
        .camera(size[1]);
        // Selects the trees in view and the number of leaves that each of them draws.
        self.grove.select(&camera, &mut self.active);
        self.instances.clear();
        self.instances.extend(self.active.iter().map(|active| {
            let place = self.placements[active.instance as usize].world_from_plant;
            Instance { window: Transition::SMOOTH_WINDOW, ..Instance::new(self.model, place, active.count) }
        }));
        self.prepared = self.foliage.prepare(gpu.device(), gpu.queue(), camera, &self.instances)?;
        Ok(())
    }

    fn foliage(&self) -> &FoliageRenderer {
        &self.foliage
    }
}

fn small_birch() -> Result<FoliageModel> {
    let options = GrowOptions { leaves: Some(3000), ..GrowOptions::default() };
    let birch = grow(&Species::embedded("betula-populifolia")?, &options)?;
    let options = SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() };
    Ok(simplify(&birch, &options, &mut CpuFragments::new(), &mut Quiet)?.model)
}
