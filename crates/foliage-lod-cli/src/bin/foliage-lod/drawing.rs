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
    gpu::{FrameTimer, GpuDevice, Offscreen, TARGET, guarded},
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
    Drawer::new(gpu, staging, size)?.drawing(staging)
}

/// Draws frames of one scene on the GPU.
pub struct Drawer {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    ids: Vec<ModelId>,
    /// Number of frames of impostors that were made for the first picture.
    frames_made: u32,
}

impl Drawer {
    /// Uploads the models, and makes the impostors that a picture needs.
    ///
    /// # Errors
    /// GPU errors.
    pub fn new(gpu: GpuDevice, staging: &Staging<'_>, size: [u32; 2]) -> Result<Self> {
        let target = Offscreen::new(&gpu, size)?;
        let (device, queue) = (gpu.device(), gpu.queue());
        let mut foliage = FoliageRenderer::new(device, TARGET, staging.look)?.with_live_impostors(LIVE)?;
        foliage.set_terrain(device, queue, staging.terrain.clone())?;
        let added = staging.models.iter().map(|model| foliage.add_model(device, queue, model));
        let ids = added.collect::<Result<Vec<_>>>()?;
        let [seen, casters] = [&staging.plants, &staging.casters].map(|plants| instances(&ids, plants));
        let frames_made = foliage.warm(device, queue, frame(staging), &seen, &casters)?;
        Ok(Self { gpu, target, foliage, ids, frames_made })
    }

    /// Draws a picture, with its statistics.
    ///
    /// # Errors
    /// GPU errors.
    pub fn drawing(&mut self, staging: &Staging<'_>) -> Result<Drawing> {
        let (prepared, image) = (self.prepare(staging)?, self.picture()?);
        Ok(Drawing { image, prepared, frames_made: self.frames_made, adapter: Some(self.gpu.adapter_name()) })
    }

    /// Prepares a picture.
    ///
    /// # Errors
    /// GPU errors.
    pub fn prepare(&mut self, staging: &Staging<'_>) -> Result<Prepared> {
        let [seen, casters] = [&staging.plants, &staging.casters].map(|plants| instances(&self.ids, plants));
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        self.foliage.prepare_with_casters(device, queue, frame(staging), &seen, &casters)
    }

    /// Draws the prepared picture.
    ///
    /// # Errors
    /// GPU errors.
    pub fn picture(&self) -> Result<Image> {
        self.target.picture(&self.foliage)
    }

    /// Draws the prepared picture without reading it back, timed under a number.
    ///
    /// # Errors
    /// GPU errors.
    pub fn draw(&self, timer: Option<&mut FrameTimer>, number: u64) -> Result<()> {
        match timer {
            Some(timer) => self.target.draw_timed(&self.foliage, timer, number),
            None => self.target.draw(&self.foliage),
        }
    }
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
