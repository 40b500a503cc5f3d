//! GPU resources of a model's impostor: its record, and both pages with all mip levels.

use super::buffers::filled;
use crate::{
    Error, Result,
    draw::{
        pages::{PageLevel, Pages},
        records::{CrownRecord, ImpostorRecord, bindings::*},
    },
    model::Impostor,
};
use glam::{DVec3, Vec3};

/// Bind group of an impostor, which keeps its buffers and textures alive.
pub(super) struct ImpostorBuffers {
    pub(super) bindings: wgpu::BindGroup,
    /// Size of both pages in bytes.
    pub(super) bytes: u64,
}

impl ImpostorBuffers {
    /// Uploads an impostor. `center` is the origin of local space, in the plant's.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if the device allows fewer texture layers than it has frames.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        impostor: &Impostor,
        crown: &CrownRecord,
        center: DVec3,
    ) -> Result<Self> {
        let (value, limit) = (u64::from(impostor.lattice.frames()), device.limits().max_texture_array_layers.into());
        if value > limit {
            let (what, fix) = ("number of frames of the impostor".into(), "bake it with fewer frames".into());
            return Err(Error::TooLarge { what, value, limit, fix });
        }
        let record = ImpostorRecord {
            center: (Vec3::from(impostor.center).as_dvec3() - center).as_vec3().to_array(),
            half_side: impostor.half_side,
            radius: impostor.radius(),
            texels: (impostor.frame_px - 2) as f32,
            across: impostor.lattice.across,
            is_whole_sphere: impostor.lattice.is_whole_sphere.into(),
        };
        let uniform = |label, bytes: &[u8]| filled(device, label, wgpu::BufferUsages::UNIFORM, bytes);
        let buffers = [
            (CROWN, uniform("crown", bytemuck::bytes_of(crown))),
            (IMPOSTOR, uniform("impostor", bytemuck::bytes_of(&record))),
        ];
        let pages = Pages::new(impostor);
        let upload = |format, page: fn(&PageLevel) -> &Vec<u8>| upload(device, queue, &pages, format, page);
        let textures = [
            (COLORS, upload(wgpu::TextureFormat::Rgba8UnormSrgb, |level| &level.color)),
            (SURFACES, upload(wgpu::TextureFormat::Rgba8Unorm, |level| &level.surface)),
        ];
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("foliage impostor"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        let buffers = buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
        let textures = textures.iter().map(|(binding, view)| (*binding, wgpu::BindingResource::TextureView(view)));
        let entries: Vec<_> = buffers
            .chain(textures)
            .chain([(CLAMPING, wgpu::BindingResource::Sampler(&sampler))])
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("foliage impostor"),
            layout,
            entries: &entries,
        });
        Ok(Self { bindings, bytes: impostor.gpu_bytes() })
    }
}

/// Uploads one page, a layer for each frame.
fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    pages: &Pages,
    format: wgpu::TextureFormat,
    page: fn(&PageLevel) -> &Vec<u8>,
) -> wgpu::TextureView {
    let side = pages.levels[0].side;
    let layers = (pages.levels[0].color.len() / 4) as u32 / (side * side);
    let size = |side| wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("foliage impostor"),
        size: size(side),
        mip_level_count: pages.levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (mip_level, level) in (0..).zip(&pages.levels) {
        let destination = wgpu::TexelCopyTextureInfo {
            texture: &texture,
            mip_level,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        };
        let rows = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * level.side),
            rows_per_image: Some(level.side),
        };
        queue.write_texture(destination, page(level), rows, size(level.side));
    }
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
}
