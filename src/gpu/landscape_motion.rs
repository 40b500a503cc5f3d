//! Motion vectors of the sky and the ground, for looks that have either.

use super::{
    bindings::uniform,
    pipeline::{PassDescription, Surface, Target, TargetFormat},
};
use crate::{
    Result,
    draw::{
        instance::Frame,
        landscape::{Landscape, Rays},
        records::MotionRays,
        shaders,
    },
};
use glam::DMat4;

/// Pipeline and uniforms of the pass.
pub(super) struct LandscapeMotion {
    pipeline: wgpu::RenderPipeline,
    rays: wgpu::Buffer,
    bindings: wgpu::BindGroup,
}

impl LandscapeMotion {
    pub(super) fn new(device: &wgpu::Device, target: TargetFormat, landscape: &Landscape) -> Self {
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let (own, rays, bindings) = uniform(device, "landscape motion", fragment, size_of::<MotionRays>());
        let pass = PassDescription {
            name: "landscape_motion",
            wgsl: shaders::landscape_motion(landscape.ground.is_some()),
            entry_points: ["cover_corner", "landscape_motion"],
            layouts: vec![Some(&own)],
            vertex_buffers: &[],
            surface: Surface::Backdrop,
        };
        Self { pipeline: pass.pipeline(device, Target::Motion(target)), rays, bindings }
    }

    /// # Errors
    /// Same as [`Rays::new`].
    pub(super) fn upload(&self, queue: &wgpu::Queue, landscape: &Landscape, frame: &Frame) -> Result<()> {
        let rays = Rays::new(&frame.camera)?;
        let eye = frame.camera.eye;
        let (before, _) = frame.before.unwrap_or((frame.camera, frame.seconds));
        let before_from_eye = before.clip_from_world * DMat4::from_translation(eye);
        let record = MotionRays {
            right: rays.right.to_array(),
            eye_height: landscape.ground.map_or(0.0, |ground| (eye.y - ground.height) as f32),
            up: rays.up.extend(0.0).to_array(),
            forward: rays.forward.extend(0.0).to_array(),
            before_from_eye: before_from_eye.as_mat4().to_cols_array_2d(),
        };
        queue.write_buffer(&self.rays, 0, bytemuck::bytes_of(&record));
        Ok(())
    }

    /// Draws over the whole target.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}
