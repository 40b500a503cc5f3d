//! Effect buffers: only the buffers that the look's effects need.

use super::{
    bindings::map_layout,
    buffers::{buffer, grow},
    shadow_map::ShadowMap,
};
use crate::{
    draw::{
        frame_list::FrameList,
        look::Look,
        records::{
            Tone,
            bindings::{SWAYS, TINTS, TONES},
        },
        tint::Tint,
    },
    effects::wind::Sway,
};

/// Buffers and bind group of the enabled effects.
pub(super) struct EffectBuffers {
    tones: Option<wgpu::Buffer>,
    sways: Option<wgpu::Buffer>,
    tints: Option<wgpu::Buffer>,
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
        look: &Look,
        map: Option<&ShadowMap>,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let storage = Usage::STORAGE | Usage::COPY_DST;
        let effects = &look.effects;
        let tints = look.has_tints().then(|| buffer(device, "foliage tints", storage, size_of::<Tint>() as u64));
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
        let buffers = [tones.as_ref(), sways.as_ref(), tints.as_ref()];
        let bindings = bind(device, layout, buffers, shadow.as_ref());
        Self { tones, sways, tints, shadow, bindings }
    }

    /// Labels of the effect buffers and textures.
    pub(super) fn labels(&self) -> Vec<&'static str> {
        let tones = self.tones.iter().map(|_| "tones");
        let sways = self.sways.iter().map(|_| "sways");
        let tints = self.tints.iter().map(|_| "tints");
        tones.chain(sways).chain(tints).chain(self.shadow.iter().map(|_| "shadow map")).collect()
    }

    /// Total size in bytes of all effect buffers and textures.
    pub(super) fn bytes(&self) -> u64 {
        let buffers = self.tones.iter().chain(&self.sways).chain(&self.tints);
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
        if let Some(tints) = &mut self.tints {
            is_rebound |= fill(device, queue, tints, &list.tints);
        }
        if is_rebound {
            let buffers = [self.tones.as_ref(), self.sways.as_ref(), self.tints.as_ref()];
            self.bindings = bind(device, layout, buffers, self.shadow.as_ref());
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
    buffers: [Option<&wgpu::Buffer>; 3],
    shadow: Option<&Shadow>,
) -> wgpu::BindGroup {
    let buffers = [TONES, SWAYS, TINTS].into_iter().zip(buffers);
    let buffers = buffers.filter_map(|(binding, buffer)| Some((binding, buffer?)));
    let mut entries: Vec<_> = buffers
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    entries.extend(shadow.into_iter().flat_map(|shadow| shadow.map.entries()));
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("foliage effects"), layout, entries: &entries })
}
