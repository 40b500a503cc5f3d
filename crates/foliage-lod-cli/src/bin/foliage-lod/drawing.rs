//! Renders a picture on the GPU, or on the CPU if there is none.

use crate::{
    args::Raster,
    failure::complain,
    raster::{open, tell_fallback},
    staging::{Shown, Staging},
};
use foliage_lod::{
    FoliageRenderer, Frame, Instance, Result,
    draw::{ModelId, Prepared},
    gpu::{GpuDevice, Offscreen, TARGET, guarded},
    software::{Drawing as Software, Image, LiveImpostors, SoftwareRenderer},
};

/// A picture with its statistics.
pub struct Drawing {
    /// The picture.
    pub image: Image,
    /// Draw statistics.
    pub prepared: Prepared,
    /// Number of frames of impostors that were made for the picture.
    pub frames_made: u32,
    /// Name of the GPU adapter; `None` on the CPU.
    pub adapter: Option<String>,
}

/// Impostors of models without one: only the frames that the picture shows.
const LIVE: LiveImpostors = LiveImpostors { ahead: false, ..LiveImpostors::DEFAULT };

impl Drawing {
    /// Name of the processor, for step lines.
    pub fn place(&self) -> &str {
        self.adapter.as_deref().unwrap_or("the CPU")
    }
}

/// Renders the picture.
///
/// # Errors
/// GPU errors with [`Raster::Gpu`]; otherwise the errors of the software renderer.
pub fn draw(raster: Raster, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    match raster {
        Raster::Cpu => on_cpu(staging, size),
        Raster::Gpu => on_gpu(open()?, staging, size),
        Raster::Auto => match open() {
            Err(_) => on_cpu(staging, size),
            Ok(gpu) => on_gpu(gpu, staging, size).or_else(|error| {
                tell_fallback(&error);
                on_cpu(staging, size)
            }),
        },
    }
}

fn on_gpu(gpu: GpuDevice, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    guarded(|| draw_on_gpu(gpu, staging, size))
}

fn draw_on_gpu(gpu: GpuDevice, staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    let target = Offscreen::new(&gpu, size)?;
    let (device, queue) = (gpu.device(), gpu.queue());
    let mut foliage = FoliageRenderer::new(device, TARGET, staging.look)?.with_live_impostors(LIVE)?;
    foliage.set_terrain(device, queue, staging.terrain.clone())?;
    let added = staging.models.iter().map(|model| foliage.add_model(device, queue, model));
    let ids = added.collect::<Result<Vec<_>>>()?;
    let [seen, casters] = [&staging.plants, &staging.casters].map(|plants| instances(&ids, plants));
    let frames_made = foliage.warm(device, queue, frame(staging), &seen, &casters)?;
    let prepared = foliage.prepare_with_casters(device, queue, frame(staging), &seen, &casters)?;
    let image = target.picture(&foliage)?;
    Ok(Drawing { image, prepared, frames_made, adapter: Some(gpu.adapter_name()) })
}

fn on_cpu(staging: &Staging<'_>, size: [u32; 2]) -> Result<Drawing> {
    let mut foliage = SoftwareRenderer::new(staging.look)?.with_live_impostors(LIVE)?;
    foliage.set_terrain(staging.terrain.clone())?;
    let added = staging.models.iter().map(|model| foliage.add_model(model));
    let ids = added.collect::<Result<Vec<_>>>()?;
    let Software { image, prepared } = foliage.draw(frame(staging), &instances(&ids, &staging.plants), size)?;
    if staging.look.effects.shadow.is_some() {
        complain("warning: the picture has no shadows: the CPU does not draw them; use --raster gpu");
    }
    Ok(Drawing { image, frames_made: prepared.live.made, prepared, adapter: None })
}

fn frame(staging: &Staging<'_>) -> Frame {
    Frame::new(&staging.camera).at(staging.seconds)
}

fn instances(ids: &[ModelId], plants: &[Shown]) -> Vec<Instance> {
    let instance = |plant: &Shown| Instance {
        leaf_scale: plant.leaf_scale,
        far: plant.far,
        seed: plant.seed,
        tint: plant.tint.to_array(),
        ..Instance::new(ids[plant.model], plant.world_from_plant, plant.active)
    };
    plants.iter().map(instance).collect()
}
