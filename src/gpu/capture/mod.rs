//! Fragment capture on the GPU: one pass appends every covered pixel of every triangle to a storage
//! buffer.
//!
//! The result equals the CPU rasteriser's, pixel for pixel. Corners are snapped to 1/256 pixel
//! beforehand. Triangles that reach beyond the view are left to the CPU, because adapters may clip
//! them differently; a view that frames its plant has none. Alpha tests in which rounding could
//! select another texel are repeated by the CPU.
//!
//! A view is cut into jobs that fit the buffers, by an estimate of the pixels that its triangles
//! cover. A job that did not fit is run again with the count that it reported, or in halves. Two
//! lanes of buffers alternate: while the device draws one job, the other is packed or read back.
//! Buffers are reused between calls.
//!
//! Limits: an adapter that snaps positions more coarsely than to 1/256 pixel covers different
//! pixels; one triangle may cover at most [`MAX_FRAGMENTS_PER_JOB`] pixels.

mod job;
mod lane;

use super::{buffers::filled, device::GpuDevice, guard::guarded};
use crate::{
    Error, Result,
    draw::shader::{ShaderSource, wrap_number},
    material::Wrap,
    simplify::fragments::{AlphaMask, Coverage, FragmentSource, ViewTriangles},
};
use job::{Job, cover_outside};
use lane::Lane;
use std::collections::VecDeque;

/// Maximum number of fragments in one job: 32 MiB, and as many as the largest view has pixels.
pub const MAX_FRAGMENTS_PER_JOB: u32 = 1 << 22;
/// Flag in [`Coverage::triangle`]: the CPU must repeat the alpha test.
const UNCERTAIN: u32 = 1 << 31;
/// Generous bound on the relative error of a texture coordinate: four roundings of a plane,
/// contracted or not, a division within Vulkan's tolerance (2.5 units in the last place) and a
/// product add up to 12 * 2^-24, once on the GPU and once on the CPU.
const ROUNDING: f32 = 1.0 / (1 << 19) as f32;
/// Texel index beyond which rounding alone may select the neighbouring texel.
const LARGEST_CELL: f32 = (1 << 22) as f32;

/// Uniforms of a job.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Params {
    /// Width and height of the view in pixels.
    pub resolution: u32,
    /// Number of entries that fit into the fragment buffer.
    pub capacity: u32,
}

/// One corner of a triangle, as the vertex shader reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
struct Corner {
    clip_xy: [f32; 2],
    /// Index of the triangle within its view.
    triangle: u32,
}

/// Location and size of one alpha mask in the buffer of mask words.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MaskHeader {
    /// Index of its first word.
    pub first_word: u32,
    /// Number of texels in a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Wrap modes along u and v, as numbered by `wrap_number`.
    pub wrap: [u32; 2],
}

/// WGSL of the fragment pass.
pub fn wgsl() -> String {
    ShaderSource::new()
        .constant_u32("UNCERTAIN", UNCERTAIN)
        .constant_u32("WRAP_MIRROR", wrap_number(Wrap::Mirror))
        .constant_u32("WRAP_CLAMP", wrap_number(Wrap::Clamp))
        .constant_f32("ROUNDING", ROUNDING)
        .constant_f32("LARGEST_CELL", LARGEST_CELL)
        .with_body(include_str!("../../../shaders/fragment_pass.wgsl"))
}

/// A [`FragmentSource`] that rasterises on the GPU.
pub struct GpuFragments {
    gpu: GpuDevice,
    pipelines: Pipelines,
    masks: Vec<AlphaMask>,
    mask_buffers: MaskBuffers,
    lanes: [Lane; 2],
}

/// Pipelines of the pass with and without the alpha test, and their common bind group layout.
struct Pipelines {
    plain: wgpu::RenderPipeline,
    masked: wgpu::RenderPipeline,
    bindings: wgpu::BindGroupLayout,
}

/// Alpha masks, as the shader reads them.
struct MaskBuffers {
    headers: wgpu::Buffer,
    words: wgpu::Buffer,
}

impl GpuFragments {
    /// Compiles the pass.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the adapter's fragment shaders cannot write to storage buffers, if its
    /// vertex shaders cannot read them, or if the device fails.
    pub fn new(gpu: &GpuDevice) -> Result<Self> {
        gpu.require(wgpu::DownlevelFlags::FRAGMENT_WRITABLE_STORAGE | wgpu::DownlevelFlags::VERTEX_STORAGE)?;
        guarded(|| {
            let pipelines = Pipelines::new(gpu.device());
            let mask_buffers = MaskBuffers::new(gpu.device(), &[]);
            let lanes = [Lane::new(gpu.device()), Lane::new(gpu.device())];
            gpu.check()?;
            Ok(Self { gpu: gpu.clone(), pipelines, masks: Vec::new(), mask_buffers, lanes })
        })
    }

    /// Rejects a view larger than the device's textures, or with more triangles than the bits of an
    /// index allow.
    fn check_view(&self, view: &ViewTriangles<'_>) -> Result<()> {
        let side = self.gpu.device().limits().max_texture_dimension_2d;
        let limits = [
            ("view resolution", view.resolution as u64, side as u64),
            ("number of triangles of a view", view.screen.len() as u64, UNCERTAIN as u64 - 1),
        ];
        for (what, value, limit) in limits {
            if value > limit {
                let fix = "lower `resolution` or use `CpuFragments`".into();
                return Err(Error::TooLarge { what: what.into(), value, limit, fix });
            }
        }
        Ok(())
    }

    fn run(&mut self, mut jobs: VecDeque<Job>, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Result<()> {
        let mut in_flight: VecDeque<(usize, Job)> = VecDeque::new();
        let mut free: Vec<usize> = (0..self.lanes.len()).collect();
        loop {
            if let Some(lane) = free.pop_if(|_| !jobs.is_empty()) {
                let Some(job) = jobs.pop_front() else { break };
                self.lanes[lane].submit(&self.gpu, &self.pipelines, &self.mask_buffers, &job, &views[job.view])?;
                in_flight.push_back((lane, job));
                continue;
            }
            let Some((lane, job)) = in_flight.pop_front() else { break };
            let found = self.lanes[lane].collect(&self.gpu, &job, &views[job.view], &self.masks, &mut out[job.view])?;
            free.push(lane);
            if found > job.capacity {
                jobs.extend(job.again(found)?);
            }
        }
        Ok(())
    }
}

impl FragmentSource for GpuFragments {
    fn adapter(&self) -> Option<String> {
        Some(self.gpu.adapter_name())
    }

    fn prepare(&mut self, masks: &[AlphaMask]) -> Result<()> {
        let bytes = masks.iter().map(|mask| 4 * mask.bits.len() as u64).sum::<u64>();
        let limits = self.gpu.device().limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > limit {
            let fix = "use smaller textures or `CpuFragments`".into();
            return Err(Error::TooLarge { what: "size in bytes of alpha masks".into(), value: bytes, limit, fix });
        }
        guarded(|| {
            self.mask_buffers = MaskBuffers::new(self.gpu.device(), masks);
            self.masks = masks.to_vec();
            self.lanes.iter_mut().for_each(Lane::forget_bindings);
            self.gpu.check()
        })
    }

    fn capture(&mut self, view: ViewTriangles<'_>, out: &mut Vec<Coverage>) -> Result<()> {
        self.capture_batch(&[view], std::slice::from_mut(out))
    }

    fn capture_batch(&mut self, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Result<()> {
        let mut jobs = VecDeque::new();
        for (i, (view, out)) in views.iter().zip(out.iter_mut()).enumerate() {
            self.check_view(view)?;
            cover_outside(view, &self.masks, out);
            jobs.extend(Job::plan(i, view));
        }
        let result = guarded(|| self.run(jobs, views, out));
        if result.is_err() {
            self.lanes.iter_mut().for_each(|lane| lane.abandon(&self.gpu));
        }
        result
    }
}

impl MaskBuffers {
    fn new(device: &wgpu::Device, masks: &[AlphaMask]) -> Self {
        let mut words = Vec::new();
        let mut headers = Vec::new();
        for mask in masks {
            headers.push(MaskHeader {
                first_word: words.len() as u32,
                width: mask.width,
                height: mask.height,
                wrap: mask.wrap.map(wrap_number),
            });
            words.extend_from_slice(&mask.bits);
        }
        // A binding must not be empty.
        if headers.is_empty() {
            headers.push(bytemuck::Zeroable::zeroed());
            words.push(0);
        }
        let buffer = |label, contents| filled(device, label, wgpu::BufferUsages::STORAGE, contents);
        Self {
            headers: buffer("mask headers", bytemuck::cast_slice(&headers)),
            words: buffer("mask words", bytemuck::cast_slice(&words)),
        }
    }
}

/// Format of the target. Nothing is written to it, but the pass needs one.
const TARGET_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

impl Pipelines {
    fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("fragment_pass"),
            source: wgpu::ShaderSource::Wgsl(wgsl().into()),
        });
        let bindings = create_bindings(device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("fragment_pass"),
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        let plain = create_pipeline(device, &module, &layout, ["corner", "append_plain"]);
        let masked = create_pipeline(device, &module, &layout, ["masked_corner", "append_masked"]);
        Self { plain, masked, bindings }
    }
}

fn create_bindings(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let read = wgpu::BufferBindingType::Storage { read_only: true };
    let written = wgpu::BufferBindingType::Storage { read_only: false };
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    let uses = [
        (fragment, wgpu::BufferBindingType::Uniform),
        (vertex, read),
        (vertex, read),
        (fragment, read),
        (fragment, written),
    ];
    let entries: Vec<_> = (0..)
        .zip(uses)
        .map(|(binding, (visibility, ty))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("fragment_pass"), entries: &entries })
}

fn create_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex_entry_point, fragment_entry_point]: [&str; 2],
) -> wgpu::RenderPipeline {
    let corners = wgpu::VertexBufferLayout {
        array_stride: size_of::<Corner>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x2, 1 => Uint32],
    };
    let target = wgpu::ColorTargetState { format: TARGET_FORMAT, blend: None, write_mask: wgpu::ColorWrites::empty() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment_entry_point),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex_entry_point),
            compilation_options: Default::default(),
            buffers: &[Some(corners)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment_entry_point),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
