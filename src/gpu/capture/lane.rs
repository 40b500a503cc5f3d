//! Lane: the buffers of one job in flight, reused by the next one.

use super::{
    Corner, MaskBuffers, Params, Pipelines, TARGET_FORMAT, UNCERTAIN,
    job::{Job, is_for_gpu},
};
use crate::{
    Error, Result,
    gpu::{
        buffers::{buffer, grow},
        device::{GpuDevice, LONGEST_WAIT, one_line},
    },
    simplify::fragments::{AlphaMask, AlphaTest, Coverage, NO_MASK, ViewTriangles},
};
use std::sync::{Arc, Mutex, PoisonError};

/// Size in bytes of the fragment count that precedes the entries.
const HEADER_BYTES: u64 = size_of::<u32>() as u64;

type MapResult = Arc<Mutex<Option<std::result::Result<(), wgpu::BufferAsyncError>>>>;

/// Buffers, target and bind group of one job.
pub(super) struct Lane {
    /// Corners of the job's masked triangles, and their alpha tests in the same order.
    masked: Vec<Corner>,
    alpha_tests: Vec<AlphaTest>,
    /// Corners of the other triangles; they follow the masked ones in the vertex buffer.
    plain: Vec<Corner>,
    corner_buffer: wgpu::Buffer,
    alpha_buffer: wgpu::Buffer,
    params: wgpu::Buffer,
    fragments: wgpu::Buffer,
    readback: wgpu::Buffer,
    target: Option<(u32, wgpu::TextureView)>,
    bindings: Option<wgpu::BindGroup>,
    in_flight: Option<(wgpu::SubmissionIndex, MapResult)>,
}

impl Lane {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        use wgpu::BufferUsages as Usage;
        Self {
            masked: Vec::new(),
            alpha_tests: Vec::new(),
            plain: Vec::new(),
            corner_buffer: buffer(device, "corners", Usage::VERTEX | Usage::COPY_DST, size_of::<Corner>() as u64),
            alpha_buffer: buffer(
                device,
                "alpha tests",
                Usage::STORAGE | Usage::COPY_DST,
                size_of::<AlphaTest>() as u64,
            ),
            params: buffer(device, "params", Usage::UNIFORM | Usage::COPY_DST, size_of::<Params>() as u64),
            fragments: buffer(
                device,
                "fragments",
                Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC,
                fragment_bytes(1),
            ),
            readback: buffer(device, "readback", Usage::MAP_READ | Usage::COPY_DST, fragment_bytes(1)),
            target: None,
            bindings: None,
            in_flight: None,
        }
    }

    /// Drops the bind group, because the mask buffers were replaced.
    pub(super) fn forget_bindings(&mut self) {
        self.bindings = None;
    }

    /// Packs, uploads and submits a job, and requests the readback.
    pub(super) fn submit(
        &mut self,
        gpu: &GpuDevice,
        pipelines: &Pipelines,
        masks: &MaskBuffers,
        job: &Job,
        view: &ViewTriangles<'_>,
    ) -> Result<()> {
        self.pack(job, view);
        self.make_room(gpu.device(), job, view.resolution);
        self.upload(gpu.queue(), job, view.resolution);
        self.bind(gpu.device(), pipelines, masks);
        gpu.check()?;
        let commands = self.encode(gpu.device(), pipelines, job);
        let submission = gpu.submit([commands])?;
        let mapped = MapResult::default();
        let report = mapped.clone();
        self.readback.map_async(wgpu::MapMode::Read, 0..fragment_bytes(job.capacity), move |result| {
            *report.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        });
        self.in_flight = Some((submission, mapped));
        gpu.check()
    }

    /// Waits for the submitted job and returns the number of fragments that it found. Appends them
    /// to `out` if they are within the job's capacity.
    pub(super) fn collect(
        &mut self,
        gpu: &GpuDevice,
        job: &Job,
        view: &ViewTriangles<'_>,
        masks: &[AlphaMask],
        out: &mut Vec<Coverage>,
    ) -> Result<u32> {
        let Some((submission, mapped)) = self.in_flight.take() else { return Ok(0) };
        gpu.wait(submission, LONGEST_WAIT)?;
        match mapped.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(Ok(())) => {}
            other => return Err(Error::gpu(format!("fragments cannot be read back: {other:?}"))),
        }
        let found = self.read(job, out)?;
        self.readback.unmap();
        if found <= job.capacity && !masks.is_empty() {
            settle_uncertain(out, found as usize, view.alpha, view.resolution, masks);
        }
        Ok(found)
    }

    /// Waits for a submitted job, if there is one, and discards its result.
    pub(super) fn abandon(&mut self, gpu: &GpuDevice) {
        if let Some((submission, _)) = self.in_flight.take() {
            // The batch has already failed, so an error of this job does not matter.
            let _ = gpu.wait(submission, LONGEST_WAIT);
            self.readback.unmap();
        }
    }

    /// Sorts the job's triangles into masked and plain; skips triangles that are left to the CPU.
    fn pack(&mut self, job: &Job, view: &ViewTriangles<'_>) {
        self.masked.clear();
        self.alpha_tests.clear();
        self.plain.clear();
        for triangle in job.triangles.clone() {
            let corners = &view.screen[triangle];
            if !is_for_gpu(view, triangle) {
                continue;
            }
            let alpha_test = &view.alpha[triangle];
            let is_masked = alpha_test.mask != NO_MASK;
            let packed = if is_masked { &mut self.masked } else { &mut self.plain };
            packed.extend(corners.map(|corner| {
                let [x, y, ..] = view.clip_from_screen(corner);
                Corner { clip_xy: [x, y], triangle: triangle as u32 }
            }));
            self.alpha_tests.extend(is_masked.then_some(alpha_test));
        }
    }

    fn make_room(&mut self, device: &wgpu::Device, job: &Job, resolution: u32) {
        let corners = self.masked.len() + self.plain.len();
        grow(device, &mut self.corner_buffer, (corners * size_of::<Corner>()) as u64);
        let alpha_grew = grow(device, &mut self.alpha_buffer, size_of_val(&self.alpha_tests[..]) as u64);
        let fragments_grew = grow(device, &mut self.fragments, fragment_bytes(job.capacity));
        grow(device, &mut self.readback, fragment_bytes(job.capacity));
        if alpha_grew || fragments_grew {
            self.bindings = None;
        }
        if self.target.as_ref().is_none_or(|(side, _)| *side != resolution) {
            self.target = Some((resolution, create_target(device, resolution)));
        }
    }

    fn upload(&self, queue: &wgpu::Queue, job: &Job, resolution: u32) {
        let params = Params { resolution, capacity: job.capacity };
        queue.write_buffer(&self.corner_buffer, 0, bytemuck::cast_slice(&self.masked));
        queue.write_buffer(
            &self.corner_buffer,
            size_of_val(&self.masked[..]) as u64,
            bytemuck::cast_slice(&self.plain),
        );
        queue.write_buffer(&self.alpha_buffer, 0, bytemuck::cast_slice(&self.alpha_tests));
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
    }

    fn bind(&mut self, device: &wgpu::Device, pipelines: &Pipelines, masks: &MaskBuffers) {
        let buffers = [&self.params, &self.alpha_buffer, &masks.headers, &masks.words, &self.fragments];
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        self.bindings.get_or_insert_with(|| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("fragment_pass"),
                layout: &pipelines.bindings,
                entries: &entries,
            })
        });
    }

    fn encode(&self, device: &wgpu::Device, pipelines: &Pipelines, job: &Job) -> wgpu::CommandBuffer {
        let mut encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("fragment_pass") });
        encoder.clear_buffer(&self.fragments, 0, Some(HEADER_BYTES));
        let attachment = self.target.as_ref().map(|(_, view)| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("fragment_pass"),
            color_attachments: &[attachment],
            ..Default::default()
        });
        let masked = self.masked.len() as u32;
        pass.set_bind_group(0, self.bindings.as_ref(), &[]);
        pass.set_vertex_buffer(0, self.corner_buffer.slice(..));
        pass.set_pipeline(&pipelines.masked);
        pass.draw(0..masked, 0..1);
        pass.set_pipeline(&pipelines.plain);
        pass.draw(masked..masked + self.plain.len() as u32, 0..1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&self.fragments, 0, &self.readback, 0, fragment_bytes(job.capacity));
        encoder.finish()
    }

    /// Returns the number of fragments found; appends them to `out` if they are within the job's
    /// capacity.
    fn read(&self, job: &Job, out: &mut Vec<Coverage>) -> Result<u32> {
        let lost = |error| Error::gpu(format!("fragments cannot be read back: {}", one_line(&error)));
        let bytes = self.readback.get_mapped_range(0..fragment_bytes(job.capacity)).map_err(lost)?;
        let (header, entries) = bytes.split_at(HEADER_BYTES as usize);
        let found: u32 = bytemuck::pod_read_unaligned(header);
        if found <= job.capacity {
            let first = out.len();
            out.resize(first + found as usize, Coverage { pixel: 0, triangle: 0 });
            let appended = bytemuck::cast_slice_mut::<_, u8>(&mut out[first..]);
            appended.copy_from_slice(&entries[..appended.len()]);
        }
        Ok(found)
    }
}

/// Repeats the alpha test on the CPU for the fragments marked [`UNCERTAIN`] among the last `count`,
/// and removes the fragments that fail it.
fn settle_uncertain(out: &mut Vec<Coverage>, count: usize, alpha: &[AlphaTest], resolution: u32, masks: &[AlphaMask]) {
    let first = out.len() - count;
    let mut kept = first;
    for i in first..out.len() {
        let Coverage { pixel, triangle } = out[i];
        let is_marked = triangle & UNCERTAIN != 0;
        let triangle = triangle & !UNCERTAIN;
        let (x, y) = (i64::from(pixel % resolution), i64::from(pixel / resolution));
        if !is_marked || alpha[triangle as usize].row(masks, None, y).is_none_or(|alpha| alpha.covers(x)) {
            out[kept] = Coverage { pixel, triangle };
            kept += 1;
        }
    }
    out.truncate(kept);
}

fn fragment_bytes(count: u32) -> u64 {
    HEADER_BYTES + u64::from(count) * size_of::<Coverage>() as u64
}

fn create_target(device: &wgpu::Device, resolution: u32) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("fragment_pass target"),
        size: wgpu::Extent3d { width: resolution, height: resolution, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TARGET_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
