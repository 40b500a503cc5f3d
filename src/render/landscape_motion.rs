//! Motion vectors of sky and ground, for renderers that draw both.

use super::{
    foliage::Frame,
    landscape_pass::{Landscape, Rays},
    shader::ShaderSource,
    surface::{PassDescription, Target, TargetFormat, uniform},
};
use glam::DMat4;

/// What `landscape_motion.wgsl` reads.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MotionRays {
    /// See `Rays`.
    pub right: [f32; 3],
    /// Of the eye over the ground.
    pub eye_height: f32,
    /// See `Rays`; filled up to 16 bytes.
    pub up: [f32; 4],
    /// See `Rays`; filled up.
    pub forward: [f32; 4],
    /// From the eye to the clip space of the frame before.
    pub before_from_eye: [[f32; 4]; 4],
}

/// The pass's shader.
pub fn wgsl(has_ground: bool) -> String {
    let source = ShaderSource::new().constant_bool("HAS_GROUND", has_ground);
    source.with_body(include_str!("../../shaders/landscape_motion.wgsl"))
}

/// The pipeline and what it reads.
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
            wgsl: wgsl(landscape.ground.is_some()),
            entry_points: ["landscape_corner", "landscape_motion"],
            layouts: vec![Some(&own)],
            vertex_buffers: &[],
            surface: None,
        };
        Self { pipeline: pass.pipeline(device, Target::Motion(target)), rays, bindings }
    }

    pub(super) fn upload(&self, queue: &wgpu::Queue, landscape: &Landscape, frame: &Frame) {
        let rays = Rays::new(&frame.camera);
        let eye = frame.camera.eye;
        let (before, _) = frame.before.unwrap_or((frame.camera, frame.seconds));
        let before_from_eye = before.clip_from_world() * DMat4::from_translation(eye);
        let record = MotionRays {
            right: rays.right.to_array(),
            eye_height: landscape.ground.map_or(0.0, |ground| (eye.y - ground.height) as f32),
            up: rays.up.extend(0.0).to_array(),
            forward: rays.forward.extend(0.0).to_array(),
            before_from_eye: before_from_eye.as_mat4().to_cols_array_2d(),
        };
        queue.write_buffer(&self.rays, 0, bytemuck::bytes_of(&record));
    }

    /// Covers the whole target.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}
