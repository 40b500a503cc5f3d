//! Effect buffers: only the buffers that the look's effects need.

use super::{
    bindings::map_layout,
    buffers::{buffer, grow},
    shadow_map::ShadowMap,
};
use crate::{
    draw::{
        frame_list::FrameList,
        records::{
            Tone,
            bindings::{SWAYS, TONES},
        },
    },
    effects::{Effects, wind::Sway},
};

/// Buffers and bind group of the enabled effects.
pub(super) struct EffectBuffers {
    tones: Option<wgpu::Buffer>,
    sways: Option<wgpu::Buffer>,
    shadow: Option<Shadow>,
    bindings: wgpu::BindGroup,
}

struct Shadow {
    map: ShadowMap,
    /// Bind group of the map alone, for the landscape pass.
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

    /// Labels of the effect buffers and textures.
    pub(super) fn labels(&self) -> Vec<&'static str> {
        let tones = self.tones.iter().map(|_| "tones");
        let sways = self.sways.iter().map(|_| "sways");
        tones.chain(sways).chain(self.shadow.iter().map(|_| "shadow map")).collect()
    }

    /// Total size in bytes of all effect buffers and textures.
    pub(super) fn bytes(&self) -> u64 {
        let buffers = self.tones.iter().chain(&self.sways);
        let map = self.shadow.as_ref().map_or(0, |shadow| shadow.map.bytes());
        buffers.map(wgpu::Buffer::size).sum::<u64>() + map
    }

    pub(super) fn bindings(&self) -> &wgpu::BindGroup {
        &self.bindings
    }

    /// Bind group of the shadow map alone; of all effects if there is no map.
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
        if is_rebound {
            self.bindings = bind(device, layout, self.tones.as_ref(), self.sways.as_ref(), self.shadow.as_ref());
        }
    }
}

/// Uploads `list`; returns whether the buffer was replaced by a larger one.
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
    let buffers = tones.map(|tones| (TONES, tones)).into_iter().chain(sways);
    let mut entries: Vec<_> = buffers
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    entries.extend(shadow.into_iter().flat_map(|shadow| shadow.map.entries()));
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("foliage effects"), layout, entries: &entries })
}
