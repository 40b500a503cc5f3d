//! Depth texture and comparison sampler of the shadow map.

use crate::draw::records::bindings::{SHADOW_MAP, SHADOW_SAMPLER};

/// Depth texture of the shadow map, and its comparison sampler.
#[derive(Clone)]
pub(super) struct ShadowMap {
    view: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl ShadowMap {
    /// Format of the map. Depth is linear along the light, from 0 (towards the sun) to 1.
    pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// Creates a square map with a side of `side` texels.
    pub(super) fn new(device: &wgpu::Device, side: u32) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: Self::FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow map"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        Self { view: texture.create_view(&Default::default()), sampler }
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    pub(super) fn bytes(&self) -> u64 {
        let texture = self.view.texture();
        u64::from(texture.width()) * u64::from(texture.height()) * size_of::<f32>() as u64
    }

    pub(super) fn entries(&self) -> [wgpu::BindGroupEntry<'_>; 2] {
        [
            wgpu::BindGroupEntry { binding: SHADOW_MAP, resource: wgpu::BindingResource::TextureView(&self.view) },
            wgpu::BindGroupEntry { binding: SHADOW_SAMPLER, resource: wgpu::BindingResource::Sampler(&self.sampler) },
        ]
    }
}
