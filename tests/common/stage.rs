//! One plant on the GPU.

use super::gpu::gpu;
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Instance, Look,
    draw::ModelId,
    gpu::{GpuDevice, Offscreen, TARGET},
    software::Image,
};
use glam::DAffine3;

/// A renderer with a model, and a frame to draw it in.
pub struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    pub foliage: FoliageRenderer,
    id: ModelId,
    frame: Frame,
}

impl Stage {
    /// Returns `None` without an adapter.
    pub fn new(model: &FoliageModel, look: Look, frame: Frame, size: [u32; 2]) -> Option<Self> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, size).unwrap();
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        Some(Self { gpu, target, foliage, id, frame })
    }

    /// Draws the plant, unmoved, with so many leaves.
    pub fn draw(&mut self, active: f32) -> Image {
        let instance = Instance::new(self.id, DAffine3::IDENTITY, active);
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), self.frame, &[instance]).unwrap();
        self.target.picture(&self.foliage).unwrap()
    }
}
