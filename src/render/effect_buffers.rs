//! Buffers of effects: those that a look calls for, and no others.

use super::{
    buffers::{buffer, grow},
    frame_list::{FrameList, Tone},
    surface::{PHASES, SWAYS, TONES},
};
use crate::effects::{Effects, wind::Sway};

/// Buffers and bindings of the effects that have any.
pub(super) struct EffectBuffers {
    tones: Option<wgpu::Buffer>,
    /// Sways of the plants, and the phases of the wind.
    wind: Option<[wgpu::Buffer; 2]>,
    bindings: wgpu::BindGroup,
}

impl EffectBuffers {
    pub(super) fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, effects: &Effects) -> Self {
        use wgpu::BufferUsages as Usage;
        let storage = Usage::STORAGE | Usage::COPY_DST;
        let tones = effects.contrast.map(|_| buffer(device, "foliage tones", storage, size_of::<Tone>() as u64));
        let wind = effects.wind.map(|_| {
            let uniform = Usage::UNIFORM | Usage::COPY_DST;
            let sways = buffer(device, "foliage sways", storage, size_of::<Sway>() as u64);
            [sways, buffer(device, "foliage wind", uniform, size_of::<[f32; 4]>() as u64)]
        });
        let bindings = bind(device, layout, tones.as_ref(), wind.as_ref());
        Self { tones, wind, bindings }
    }

    /// What each buffer is for.
    pub(super) fn labels(&self) -> Vec<&'static str> {
        let tones = self.tones.iter().map(|_| "tones");
        tones.chain(self.wind.iter().flat_map(|_| ["sways", "wind"])).collect()
    }

    pub(super) fn bindings(&self) -> &wgpu::BindGroup {
        &self.bindings
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
        if let Some([sways, phases]) = &mut self.wind {
            is_rebound |= fill(device, queue, sways, &list.sways);
            queue.write_buffer(phases, 0, bytemuck::bytes_of(&list.phases));
        }
        if is_rebound {
            self.bindings = bind(device, layout, self.tones.as_ref(), self.wind.as_ref());
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
    wind: Option<&[wgpu::Buffer; 2]>,
) -> wgpu::BindGroup {
    let of_wind = wind.into_iter().flat_map(|[sways, phases]| [(SWAYS, sways), (PHASES, phases)]);
    let buffers = tones.map(|tones| (TONES, tones)).into_iter().chain(of_wind);
    let entries: Vec<_> = buffers
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("foliage effects"), layout, entries: &entries })
}
