//! Pictures through wgpu without a window: a target, its samples and its way back into memory.

use super::{
    backdrop_pass::Backdrop,
    buffers::buffer,
    device::{GpuDevice, LONGEST_WAIT, gpu_error, one_line},
    foliage::FoliageRenderer,
    image::Image,
    surface::TargetFormat,
};
use crate::{Error, Result};

/// Formats and samples of an [`Offscreen`]: four samples a pixel, which every adapter offers.
pub const TARGET: TargetFormat =
    TargetFormat { color: wgpu::TextureFormat::Rgba8UnormSrgb, depth: wgpu::TextureFormat::Depth32Float, samples: 4 };
/// Formats of an [`Offscreen`]'s motion vectors, for [`FoliageRenderer::with_motion`].
pub const MOTION: TargetFormat =
    TargetFormat { color: wgpu::TextureFormat::Rg32Float, depth: wgpu::TextureFormat::Depth32Float, samples: 1 };

/// A picture-sized target, kept between pictures.
pub struct Offscreen {
    gpu: GpuDevice,
    size: [u32; 2],
    samples: wgpu::TextureView,
    depth: wgpu::TextureView,
    resolved: wgpu::Texture,
    readback: wgpu::Buffer,
    backdrop: Backdrop,
}

impl Offscreen {
    /// A target of `size` pixels, width and height.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] when a side is 0 or beyond what the adapter draws; [`Error::Gpu`] when the device fails or
    /// its vertex shaders cannot read storage buffers.
    pub fn new(gpu: &GpuDevice, size: [u32; 2]) -> Result<Self> {
        gpu.require(wgpu::DownlevelFlags::VERTEX_STORAGE)?;
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
            samples: view(texture(TARGET.color, TARGET.samples, Usage::RENDER_ATTACHMENT)),
            depth: view(texture(TARGET.depth, TARGET.samples, Usage::RENDER_ATTACHMENT)),
            readback: buffer(
                gpu.device(),
                "picture",
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                u64::from(row_bytes(size[0], &resolved)) * u64::from(size[1]),
            ),
            resolved,
            backdrop: Backdrop::new(gpu.device(), TARGET),
            gpu: gpu.clone(),
            size,
        };
        gpu.check()?;
        Ok(target)
    }

    /// Draws what `foliage` has prepared before the backdrop, without reading it back. Waits until the device is done.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device fails or does not answer.
    pub fn draw(&self, foliage: &FoliageRenderer) -> Result<()> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        self.encode(&mut encoder, foliage);
        self.gpu.wait(self.gpu.submit([encoder.finish()])?, LONGEST_WAIT)
    }

    /// Draws what `foliage` has prepared before the backdrop.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device fails or does not answer.
    pub fn picture(&self, foliage: &FoliageRenderer) -> Result<Image> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        self.encode(&mut encoder, foliage);
        let [width, height] = self.size;
        let rgba = self.read(encoder, &self.resolved, &self.readback)?;
        Ok(Image { width, height, rgba })
    }

    /// Motion vectors of what `foliage` has prepared, row by row from the top, as
    /// [`render_motion`](FoliageRenderer::render_motion) tells them; 0 where it draws nothing. The renderer must have been made
    /// with those of kind [`MOTION`]; from one without any come zeros alone.
    ///
    /// # Errors
    /// [`Error::Gpu`] when the device fails or does not answer.
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
                depth_stencil_attachment: Some(cleared(&depth.create_view(&Default::default()))),
                ..Default::default()
            });
            foliage.render_motion(&mut pass);
        }
        let bytes = self.read(encoder, &vectors, &readback)?;
        Ok(bytes.chunks_exact(size_of::<[f32; 2]>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// Runs what was encoded, then brings a picture-sized texture into memory.
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
        // What becomes of the mapping shows when it is read.
        readback.map_async(wgpu::MapMode::Read, .., |_| {});
        self.gpu.wait(submission, LONGEST_WAIT)?;
        let row = (self.size[0] * texel_bytes(from)) as usize;
        let mut bytes = Vec::with_capacity(row * self.size[1] as usize);
        {
            let mapped = readback.get_mapped_range(..);
            let mapped = mapped.map_err(|error| gpu_error(format!("picture cannot be read: {}", one_line(&error))))?;
            for padded in mapped.chunks_exact(stride as usize) {
                bytes.extend_from_slice(&padded[..row]);
            }
        }
        readback.unmap();
        Ok(bytes)
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, foliage: &FoliageRenderer) {
        foliage.render_before(encoder);
        let resolved = self.resolved.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("offscreen"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.samples,
                depth_slice: None,
                resolve_target: Some(&resolved),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
            })],
            depth_stencil_attachment: Some(cleared(&self.depth)),
            ..Default::default()
        });
        self.backdrop.render(&mut pass);
        foliage.render(&mut pass);
    }
}

/// Bytes from one row to the next in a buffer that a texture is copied to.
fn row_bytes(width: u32, texture: &wgpu::Texture) -> u32 {
    (texel_bytes(texture) * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn texel_bytes(texture: &wgpu::Texture) -> u32 {
    texture.format().block_copy_size(None).unwrap_or(4)
}

/// Reversed depth, of use to this pass alone.
fn cleared(depth: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view: depth,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
        stencil_ops: None,
    }
}

pub(super) fn texture(
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
