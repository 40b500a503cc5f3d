//! Offscreen drawing with wgpu: a multisampled target, its resolve texture and readback buffer.

use super::{
    backdrop_pass::Backdrop,
    buffers::buffer,
    device::{GpuDevice, LONGEST_WAIT, one_line},
    pipeline::TargetFormat,
    renderer::FoliageRenderer,
    timer::FrameTimer,
};
use crate::{Error, Result, software::Image};

/// Formats and sample count of an [`Offscreen`]: four samples per pixel, which every adapter
/// supports.
pub const TARGET: TargetFormat =
    TargetFormat { color: wgpu::TextureFormat::Rgba8UnormSrgb, depth: wgpu::TextureFormat::Depth32Float, samples: 4 };
/// Formats of an [`Offscreen`]'s motion vectors, for [`FoliageRenderer::with_motion`].
pub const MOTION: TargetFormat =
    TargetFormat { color: wgpu::TextureFormat::Rg32Float, depth: wgpu::TextureFormat::Depth32Float, samples: 1 };

/// Offscreen render target with readback, reused between pictures.
pub struct Offscreen {
    gpu: GpuDevice,
    size: [u32; 2],
    /// The multisampled texture; `None` with one sample per pixel.
    samples: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    resolved: wgpu::Texture,
    readback: wgpu::Buffer,
    backdrop: Backdrop,
}

impl Offscreen {
    /// Creates a target of `size` (width, height) in pixels, for renderers with the format
    /// [`TARGET`].
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if a side is 0 or exceeds the device's texture limit;
    /// [`Error::Gpu`] if the device fails.
    pub fn new(gpu: &GpuDevice, size: [u32; 2]) -> Result<Self> {
        Self::with_samples(gpu, size, TARGET.samples)
    }

    /// Same as [`new`](Self::new), for renderers with another sample count: 1 or 4, which every
    /// adapter supports.
    ///
    /// # Errors
    /// Same as [`new`](Self::new).
    pub fn with_samples(gpu: &GpuDevice, size: [u32; 2], samples: u32) -> Result<Self> {
        let format = TargetFormat { samples, ..TARGET };
        let largest = gpu.device().limits().max_texture_dimension_2d;
        if size.iter().any(|side| !(1..=largest).contains(side)) {
            return Err(Error::invalid(
                "size",
                format!("{}x{}", size[0], size[1]),
                format!("1 to {largest} pixels on a side"),
            ));
        }
        use wgpu::TextureUsages as Usage;
        let texture = |format, samples, usage| texture(gpu.device(), size, format, samples, usage);
        let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
        let resolved = texture(TARGET.color, 1, Usage::RENDER_ATTACHMENT | Usage::COPY_SRC);
        let target = Self {
            samples: (samples > 1).then(|| view(texture(format.color, samples, Usage::RENDER_ATTACHMENT))),
            depth: view(texture(format.depth, samples, Usage::RENDER_ATTACHMENT)),
            readback: buffer(
                gpu.device(),
                "picture",
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                u64::from(row_bytes(size[0], &resolved)) * u64::from(size[1]),
            ),
            resolved,
            backdrop: Backdrop::new(gpu.device(), format),
            gpu: gpu.clone(),
            size,
        };
        gpu.check()?;
        Ok(target)
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Draws the frame prepared by `foliage` in front of the backdrop, without reading it back.
    /// Waits until the device has finished.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails or does not respond.
    pub fn draw(&self, foliage: &FoliageRenderer) -> Result<()> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        self.encode(&mut encoder, foliage, true);
        self.gpu.wait(self.gpu.submit([encoder.finish()])?, LONGEST_WAIT)
    }

    /// Same as [`draw`](Self::draw), with the frame timed under this number.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub fn draw_timed(&self, foliage: &FoliageRenderer, timer: &mut FrameTimer, frame: u64) -> Result<()> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        timer.begin(frame, &mut encoder);
        self.encode(&mut encoder, foliage, true);
        timer.end(&mut encoder);
        let submission = self.gpu.submit([encoder.finish()])?;
        timer.submitted();
        self.gpu.wait(submission, LONGEST_WAIT)
    }

    /// Draws the frame prepared by `foliage` in front of the backdrop, and reads it back.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails or does not respond.
    pub fn picture(&self, foliage: &FoliageRenderer) -> Result<Image> {
        self.read_picture(foliage, true)
    }

    /// Draws the frame prepared by `foliage` without a backdrop, and reads it back: alpha is the
    /// fraction of a pixel's samples that are covered, and the linear colour is multiplied by it.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails or does not respond.
    pub fn cutout(&self, foliage: &FoliageRenderer) -> Result<Image> {
        self.read_picture(foliage, false)
    }

    fn read_picture(&self, foliage: &FoliageRenderer, has_backdrop: bool) -> Result<Image> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        self.encode(&mut encoder, foliage, has_backdrop);
        let [width, height] = self.size;
        let rgba = self.read(encoder, &self.resolved, &self.readback)?;
        Ok(Image { width, height, rgba })
    }

    /// Draws and reads back the motion vectors of the frame prepared by `foliage` (see
    /// [`render_motion`](FoliageRenderer::render_motion)), row by row from the top; 0 where nothing
    /// is drawn. The renderer's motion vectors must have been enabled with the format [`MOTION`];
    /// if they are disabled, all vectors are 0.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails or does not respond.
    pub fn motion(&self, foliage: &FoliageRenderer) -> Result<Vec<[f32; 2]>> {
        use wgpu::{BufferUsages, TextureUsages as Usage};
        let device = self.gpu.device();
        let vectors = texture(device, self.size, MOTION.color, 1, Usage::RENDER_ATTACHMENT | Usage::COPY_SRC);
        let depth = texture(device, self.size, MOTION.depth, 1, Usage::RENDER_ATTACHMENT);
        let bytes = u64::from(row_bytes(self.size[0], &vectors)) * u64::from(self.size[1]);
        let readback = buffer(device, "motion vectors", BufferUsages::COPY_DST | BufferUsages::MAP_READ, bytes);
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("motion vectors"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &vectors.create_view(&Default::default()),
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(cleared(&depth.create_view(&Default::default()), foliage)),
                ..Default::default()
            });
            foliage.render_motion(&mut pass);
        }
        let bytes = self.read(encoder, &vectors, &readback)?;
        Ok(bytes.chunks_exact(size_of::<[f32; 2]>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// Submits the encoded commands, then reads a texture of the target's size back through
    /// `readback`. Removes the row padding.
    fn read(
        &self,
        mut encoder: wgpu::CommandEncoder,
        from: &wgpu::Texture,
        readback: &wgpu::Buffer,
    ) -> Result<Vec<u8>> {
        let stride = row_bytes(self.size[0], from);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(stride), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            from.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: readback, layout },
            from.size(),
        );
        let submission = self.gpu.submit([encoder.finish()])?;
        // A failure to map is reported by `get_mapped_range` below.
        readback.map_async(wgpu::MapMode::Read, .., |_| {});
        self.gpu.wait(submission, LONGEST_WAIT)?;
        let row = (self.size[0] * texel_bytes(from)) as usize;
        let mut bytes = Vec::with_capacity(row * self.size[1] as usize);
        {
            let mapped = readback.get_mapped_range(..);
            let mapped = mapped.map_err(|error| Error::gpu(format!("picture cannot be read: {}", one_line(&error))))?;
            for padded in mapped.chunks_exact(stride as usize) {
                bytes.extend_from_slice(&padded[..row]);
            }
        }
        readback.unmap();
        Ok(bytes)
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, foliage: &FoliageRenderer, has_backdrop: bool) {
        foliage.render_before(encoder);
        let resolved = self.resolved.create_view(&Default::default());
        let store = if self.samples.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("offscreen"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.samples.as_ref().unwrap_or(&resolved),
                depth_slice: None,
                resolve_target: self.samples.as_ref().map(|_| &resolved),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store },
            })],
            depth_stencil_attachment: Some(cleared(&self.depth, foliage)),
            ..Default::default()
        });
        if has_backdrop {
            self.backdrop.render(&mut pass);
        }
        foliage.render(&mut pass);
    }
}

/// Row stride in bytes, padded as wgpu requires, of a buffer that a texture is copied to.
fn row_bytes(width: u32, texture: &wgpu::Texture) -> u32 {
    (texel_bytes(texture) * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn texel_bytes(texture: &wgpu::Texture) -> u32 {
    texture.format().block_copy_size(None).unwrap_or(4)
}

/// Depth attachment of a pass that draws `foliage`: cleared before it, discarded after it.
fn cleared<'a>(depth: &'a wgpu::TextureView, foliage: &FoliageRenderer) -> wgpu::RenderPassDepthStencilAttachment<'a> {
    wgpu::RenderPassDepthStencilAttachment {
        view: depth,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(foliage.depth_clear_value()),
            store: wgpu::StoreOp::Discard,
        }),
        stencil_ops: None,
    }
}

/// Creates a texture with one mip level, for use as a render target.
pub fn texture(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("offscreen"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
