//! Draws a model on the GPU into a picture, without a window: the work that an engine does per
//! frame.
//!
//! `cargo run --example render_to_png -- oak.vds oak.png`; without a model, it grows a small birch.

use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    gpu::{GpuDevice, GpuOptions, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    model::Transition,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use glam::{DAffine3, DVec3};

fn main() -> foliage_lod::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let model = arguments.next().map_or_else(small_birch, FoliageModel::read)?;
    let path = arguments.next().unwrap_or_else(|| "render_to_png.png".into());

    // Once: create the device and the renderer, and upload the model.
    let gpu = GpuDevice::new(&GpuOptions::from_env())?;
    let (device, queue) = (gpu.device(), gpu.queue());
    let mut foliage = FoliageRenderer::new(device, TARGET, Look::default())?;
    let birch = foliage.add_model(device, queue, &model)?;

    // Each frame: draw three trees side by side, with 100, 30 and 10 % of their leaves.
    let sphere = model.sphere();
    let instances = [(-2.0, 1.0), (0.0, 0.3), (2.0, 0.1)].map(|(sideways, share): (f64, f32)| {
        let place = DAffine3::from_translation(DVec3::X * sideways * sphere.radius);
        let active = share * model.leaves.len() as f32;
        Instance { window: Transition::SMOOTH_WINDOW, ..Instance::new(birch, place, active) }
    });
    let camera = LookAt::framing(&sphere, DVec3::new(0.0, 0.2, 1.0), 0.8, 1.4).with_aspect(2.0);
    let prepared = foliage.prepare(device, queue, camera.camera(512), &instances)?;

    // An engine calls `foliage.render(&mut pass)` in its own render pass instead.
    Offscreen::new(&gpu, [1024, 512])?.picture(&foliage)?.write_png(&path)?;
    println!("{path}: {} leaves of {} trees in {} draws", prepared.leaves, prepared.instances, prepared.draws);
    Ok(())
}

fn small_birch() -> foliage_lod::Result<FoliageModel> {
    let options = GrowOptions { leaves: Some(3000), ..GrowOptions::default() };
    let birch = grow(&Species::embedded("betula-populifolia")?, &options)?;
    let options = SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() };
    Ok(simplify(&birch, &options, &mut CpuFragments::new(), &mut Quiet)?.model)
}
