//! Backdrop pass: draws a soft gradient from ground to sky over the whole target.

use super::pipeline::{PassDescription, Surface, TargetFormat};
use crate::draw::shaders;

/// Pipeline of the backdrop. Draw it before the plants.
pub struct Backdrop {
    pipeline: wgpu::RenderPipeline,
}

impl Backdrop {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device, target: TargetFormat) -> Self {
        let pipeline = PassDescription {
            name: "backdrop_pass",
            wgsl: shaders::backdrop_pass(),
            entry_points: ["cover_corner", "backdrop"],
            layouts: Vec::new(),
            vertex_buffers: &[],
            surface: Surface::Backdrop,
        };
        Self { pipeline: pipeline.pipeline(device, target) }
    }

    /// Draws over the whole target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.draw(0..3, 0..1);
    }
}
