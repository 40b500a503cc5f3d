//! GPU resources of a model's impostor: its record, and both pages with all mip levels.

use super::buffers::filled;
use crate::{
    Error, Result,
    draw::{
        pages::Pages,
        records::{CrownRecord, ImpostorRecord, bindings::*},
    },
    model::Framing,
};
use glam::DVec3;

/// Bind group of an impostor, and the textures of its pages.
pub(super) struct ImpostorBuffers {
    pub(super) bindings: wgpu::BindGroup,
    /// Size of both pages in bytes.
    pub(super) bytes: u64,
    colors: wgpu::Texture,
    surfaces: wgpu::Texture,
}

/// Checks that a texture can have a layer for each frame.
///
/// # Errors
/// [`Error::TooLarge`] if the device allows fewer texture layers than there are frames.
pub(super) fn check_layers(device: &wgpu::Device, framing: &Framing) -> Result<()> {
    let (value, limit) = (u64::from(framing.lattice.frames()), device.limits().max_texture_array_layers.into());
    if value > limit {
        let (what, fix) = ("number of frames of the impostor".into(), "bake it with fewer frames".into());
        return Err(Error::TooLarge { what, value, limit, fix });
    }
    Ok(())
}

impl ImpostorBuffers {
    /// Creates clear pages. `center` is the origin of local space, in the plant's. Call
    /// [`check_layers`] before.
    pub(super) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        framing: &Framing,
        crown: &CrownRecord,
        center: DVec3,
    ) -> Self {
        let record = ImpostorRecord::of(framing, center);
        let uniform = |label, bytes: &[u8]| filled(device, label, wgpu::BufferUsages::UNIFORM, bytes);
        let buffers = [
            (CROWN, uniform("crown", bytemuck::bytes_of(crown))),
            (IMPOSTOR, uniform("impostor", bytemuck::bytes_of(&record))),
        ];
        let colors = page(device, framing, wgpu::TextureFormat::Rgba8UnormSrgb);
        let surfaces = page(device, framing, wgpu::TextureFormat::Rgba8Unorm);
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let view =
            |of: &wgpu::Texture| of.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
        let views = [(COLORS, view(&colors)), (SURFACES, view(&surfaces))];
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("foliage impostor"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        let buffers = buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
        let views = views.iter().map(|(binding, view)| (*binding, wgpu::BindingResource::TextureView(view)));
        let entries: Vec<_> = buffers
            .chain(views)
            .chain([(CLAMPING, wgpu::BindingResource::Sampler(&sampler))])
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("foliage impostor"),
            layout,
            entries: &entries,
        });
        Self { bindings, bytes: framing.gpu_bytes(), colors, surfaces }
    }

    /// Uploads some frames, from `first` on.
    pub(super) fn write(&self, queue: &wgpu::Queue, first: u32, pages: &Pages) {
        for (mip_level, level) in (0..).zip(&pages.levels) {
            let side = level.side;
            let size = wgpu::Extent3d {
                width: side,
                height: side,
                depth_or_array_layers: (level.color.len() / 4) as u32 / (side * side),
            };
            let rows =
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * side), rows_per_image: Some(side) };
            for (texture, texels) in [(&self.colors, &level.color), (&self.surfaces, &level.surface)] {
                let origin = wgpu::Origin3d { x: 0, y: 0, z: first };
                let aspect = wgpu::TextureAspect::All;
                let destination = wgpu::TexelCopyTextureInfo { texture, mip_level, origin, aspect };
                queue.write_texture(destination, texels, rows, size);
            }
        }
    }
}

/// Creates one page, a layer for each frame.
fn page(device: &wgpu::Device, framing: &Framing, format: wgpu::TextureFormat) -> wgpu::Texture {
    let (side, layers) = (framing.frame_px, framing.lattice.frames());
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("foliage impostor"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
        mip_level_count: side.ilog2() + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}
