//! Landscape pass: draws sky and ground behind everything, along the ray of each pixel.

use super::{
    bindings::uniform,
    pipeline::{PassDescription, Surface, TargetFormat},
};
use crate::{
    Result,
    draw::{
        instance::Frame,
        landscape::{Landscape, Rays},
        look::Look,
        records::LandscapeRecord,
        shaders,
    },
    effects::sky::SHOWN,
};
use glam::{Mat4, Vec3};

/// Pipeline and uniforms of the landscape pass.
pub(super) struct LandscapePass {
    pipeline: wgpu::RenderPipeline,
    record: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    bindings: wgpu::BindGroup,
}

impl LandscapePass {
    /// Compiles the pass. `shadow` is the layout of the shadow map's bindings, if there is a map.
    pub(super) fn new(
        device: &wgpu::Device,
        target: TargetFormat,
        look: &Look,
        shadow: Option<&wgpu::BindGroupLayout>,
    ) -> Self {
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let (own, record, bindings) = uniform(device, "landscape", stages, size_of::<LandscapeRecord>());
        let pipeline = PassDescription {
            name: "landscape_pass",
            wgsl: shaders::landscape_pass(look),
            entry_points: ["cover_corner", "landscape_color"],
            layouts: match shadow {
                Some(shadow) => vec![Some(&own), None, Some(shadow)],
                None => vec![Some(&own)],
            },
            vertex_buffers: &[],
            surface: Surface::Backdrop,
        };
        Self { pipeline: pipeline.pipeline(device, target), record, layout: own, bindings }
    }

    /// Layout of [`bindings`](Self::bindings).
    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The uniforms.
    pub(super) fn bindings(&self) -> &wgpu::BindGroup {
        &self.bindings
    }

    /// # Errors
    /// Same as [`Rays::new`].
    pub(super) fn upload(
        &self,
        queue: &wgpu::Queue,
        landscape: &Landscape,
        frame: &Frame,
        light_from_eye: Mat4,
    ) -> Result<()> {
        let rays = Rays::new(&frame.camera)?;
        let ground = landscape.ground;
        let dome = landscape.daylight.map(|daylight| daylight.dome);
        let padded = |v: Vec3| v.extend(0.0).to_array();
        let towards_sun = dome.map_or(landscape.lighting.towards_sun.normalize_or_zero(), |dome| dome.towards_sun);
        let record = LandscapeRecord {
            right: rays.right.to_array(),
            eye_height: ground.map_or(0.0, |ground| (frame.camera.eye.y - ground.height) as f32),
            up: rays.up.to_array(),
            haze: ground.map_or(1.0, |ground| ground.haze as f32),
            forward: rays.forward.to_array(),
            scale: landscape.daylight.map_or(0.0, |daylight| daylight.scale * daylight.exposure * SHOWN),
            towards_sun: padded(towards_sun),
            ground: padded(ground.map_or(Vec3::ZERO, |ground| ground.color.into())),
            perez: dome.map_or([[0.0; 4]; 5], |dome| dome.perez.map(padded)),
            zenith: padded(dome.map_or(Vec3::ZERO, |dome| dome.zenith)),
            light_from_eye: light_from_eye.to_cols_array_2d(),
        };
        queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
        Ok(())
    }

    /// Draws over the whole target. The caller sets the bind group of the shadow map, if there is
    /// one.
    pub(super) fn render(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}
