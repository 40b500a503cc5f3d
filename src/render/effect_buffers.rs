//! Buffers of effects: those that a look calls for, and no others.

use super::{
    buffers::{buffer, grow},
    frame_list::{FrameList, Tone},
    surface::{LIGHTS, SHADOW_MAP, SHADOW_SAMPLER, SWAYS, TONES, map_layout},
};
use crate::effects::{Effects, wind::Sway};

/// What the sun's light meets first, and how it is looked up.
#[derive(Clone)]
pub(super) struct ShadowMap {
    view: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl ShadowMap {
    /// Depths are linear from 0, next to the sun, to 1.
    pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// A map of so many pixels on a side, or as many as the device allows.
    pub(super) fn new(device: &wgpu::Device, resolution: u32) -> Self {
        let side = resolution.min(device.limits().max_texture_dimension_2d);
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

    fn bytes(&self) -> u64 {
        let texture = self.view.texture();
        u64::from(texture.width()) * u64::from(texture.height()) * size_of::<f32>() as u64
    }

    fn entries(&self) -> [wgpu::BindGroupEntry<'_>; 2] {
        [
            wgpu::BindGroupEntry { binding: SHADOW_MAP, resource: wgpu::BindingResource::TextureView(&self.view) },
            wgpu::BindGroupEntry { binding: SHADOW_SAMPLER, resource: wgpu::BindingResource::Sampler(&self.sampler) },
        ]
    }
}

/// Buffers and bindings of the effects that have any.
pub(super) struct EffectBuffers {
    tones: Option<wgpu::Buffer>,
    sways: Option<wgpu::Buffer>,
    shadow: Option<Shadow>,
    bindings: wgpu::BindGroup,
}

struct Shadow {
    lights: wgpu::Buffer,
    map: ShadowMap,
    /// The map alone.
    bindings: wgpu::BindGroup,
}

impl EffectBuffers {
    pub(super) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        effects: &Effects,
        map: Option<&ShadowMap>,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let storage = Usage::STORAGE | Usage::COPY_DST;
        let tones = effects.contrast.map(|_| buffer(device, "foliage tones", storage, size_of::<Tone>() as u64));
        let sways = effects.wind.map(|_| buffer(device, "foliage sways", storage, size_of::<Sway>() as u64));
        let shadow = map.map(|map| Shadow {
            lights: buffer(device, "foliage lights", storage, size_of::<[[f32; 4]; 4]>() as u64),
            bindings: device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("shadow map"),
                layout: &map_layout(device),
                entries: &map.entries(),
            }),
            map: map.clone(),
        });
        let bindings = bind(device, layout, tones.as_ref(), sways.as_ref(), shadow.as_ref());
        Self { tones, sways, shadow, bindings }
    }

    /// What each is for.
    pub(super) fn labels(&self) -> Vec<&'static str> {
        let tones = self.tones.iter().map(|_| "tones");
        let sways = self.sways.iter().map(|_| "sways");
        tones.chain(sways).chain(self.shadow.iter().flat_map(|_| ["lights", "shadow map"])).collect()
    }

    /// Of all of them.
    pub(super) fn bytes(&self) -> u64 {
        let buffers = self.tones.iter().chain(&self.sways);
        let buffers = buffers.chain(self.shadow.iter().map(|shadow| &shadow.lights));
        let map = self.shadow.as_ref().map_or(0, |shadow| shadow.map.bytes());
        buffers.map(wgpu::Buffer::size).sum::<u64>() + map
    }

    pub(super) fn bindings(&self) -> &wgpu::BindGroup {
        &self.bindings
    }

    /// Those of the shadow map alone; of all effects where there is none.
    pub(super) fn map_bindings(&self) -> &wgpu::BindGroup {
        self.shadow.as_ref().map_or(&self.bindings, |shadow| &shadow.bindings)
    }

    pub(super) fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        list: &FrameList,
    ) {
        let mut is_rebound = false;
        if let Some(tones) = &mut self.tones {
            is_rebound |= fill(device, queue, tones, &list.tones);
        }
        if let Some(sways) = &mut self.sways {
            is_rebound |= fill(device, queue, sways, &list.sways);
        }
        if let Some(shadow) = &mut self.shadow {
            is_rebound |= fill(device, queue, &mut shadow.lights, &list.lights);
        }
        if is_rebound {
            self.bindings = bind(device, layout, self.tones.as_ref(), self.sways.as_ref(), self.shadow.as_ref());
        }
    }
}

/// Uploads, and tells whether the buffer is another one now.
fn fill<T: bytemuck::Pod>(device: &wgpu::Device, queue: &wgpu::Queue, to: &mut wgpu::Buffer, list: &[T]) -> bool {
    let is_new = grow(device, to, size_of_val(list) as u64);
    queue.write_buffer(to, 0, bytemuck::cast_slice(list));
    is_new
}

fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    tones: Option<&wgpu::Buffer>,
    sways: Option<&wgpu::Buffer>,
    shadow: Option<&Shadow>,
) -> wgpu::BindGroup {
    let sways = sways.map(|sways| (SWAYS, sways));
    let lights = shadow.map(|shadow| (LIGHTS, &shadow.lights));
    let buffers = tones.map(|tones| (TONES, tones)).into_iter().chain(sways).chain(lights);
    let mut entries: Vec<_> = buffers
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    entries.extend(shadow.into_iter().flat_map(|shadow| shadow.map.entries()));
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("foliage effects"), layout, entries: &entries })
}
