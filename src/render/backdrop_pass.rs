//! Draws a soft gradient from ground to sky over the whole target, behind everything.

use super::{
    light::{self, Lighting},
    shader::ShaderSource,
    surface::{PassDescription, TargetFormat},
};

/// The pass's shader with its constants.
pub fn wgsl() -> String {
    light::constants(ShaderSource::new(), &Lighting::default())
        .with_part(include_str!("../../shaders/light.wgsl"))
        .with_body(include_str!("../../shaders/backdrop_pass.wgsl"))
}

/// The backdrop: draw it first.
pub struct Backdrop {
    pipeline: wgpu::RenderPipeline,
}

impl Backdrop {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device, target: TargetFormat) -> Self {
        let pipeline = PassDescription {
            name: "backdrop_pass",
            wgsl: wgsl(),
            entry_points: ["backdrop_corner", "backdrop"],
            layouts: Vec::new(),
            vertex_buffers: &[],
            surface: None,
        };
        Self { pipeline: pipeline.pipeline(device, target) }
    }

    /// Covers the whole target.
    pub fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.draw(0..3, 0..1);
    }
}
