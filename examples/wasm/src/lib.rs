//! Draws a model in a browser, with a device of our own: WebGPU opens devices asynchronously, so
//! the library does not open one for you there.

use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    draw::ModelId,
    glam::{DAffine3, DVec3},
    gpu::{TargetFormat, texture},
};
use futures_channel::oneshot;
use wasm_bindgen::prelude::*;
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

const FORMAT: TargetFormat =
    TargetFormat { color: TextureFormat::Rgba8UnormSrgb, depth: TextureFormat::Depth32Float, samples: 4 };

/// A device with one model.
#[wasm_bindgen]
pub struct Tree {
    device: wgpu::Device,
    queue: wgpu::Queue,
    foliage: FoliageRenderer,
    model: FoliageModel,
    id: ModelId,
}

fn told(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

#[wasm_bindgen]
impl Tree {
    /// Opens a device and uploads the model of a `.vds` file.
    pub async fn open(vds: Vec<u8>) -> Result<Tree, JsError> {
        let model = FoliageModel::from_bytes(&vds).map_err(told)?;
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = instance.request_adapter(&Default::default()).await.map_err(told)?;
        // Vertex shaders read up to eight storage buffers, which the defaults allow.
        let (device, queue) = adapter.request_device(&Default::default()).await.map_err(told)?;
        let mut foliage = FoliageRenderer::new(&device, FORMAT, Look::default()).map_err(told)?;
        let id = foliage.add_model(&device, &queue, &model).map_err(told)?;
        Ok(Self { device, queue, foliage, model, id })
    }

    /// Number of leaves.
    pub fn leaves(&self) -> u32 {
        self.model.leaves.len() as u32
    }

    /// Pixels (sRGB, rows from the top) of the plant with `active` leaves, seen from an angle in
    /// radians. An application draws into its canvas instead.
    pub async fn picture(&mut self, width: u32, height: u32, active: f32, yaw: f64) -> Result<Vec<u8>, JsError> {
        let (size, row) = ([width, height], (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
        let direction = DVec3::new(yaw.sin(), 0.3, yaw.cos());
        let framing = LookAt::framing(&self.model.sphere(), direction, 0.7, 1.0);
        let camera = framing.with_aspect(f64::from(width) / f64::from(height)).camera(height);
        let plant = Instance::new(self.id, DAffine3::IDENTITY, active);
        self.foliage.prepare(&self.device, &self.queue, camera, &[plant]).map_err(told)?;

        let target = |format, samples, usage| texture(&self.device, size, format, samples, usage);
        let color = target(FORMAT.color, FORMAT.samples, TextureUsages::RENDER_ATTACHMENT);
        let depth = target(FORMAT.depth, FORMAT.samples, TextureUsages::RENDER_ATTACHMENT);
        let resolved = target(FORMAT.color, 1, TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC);
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.foliage.render_before(&mut encoder);
        let clear = wgpu::Color { r: 0.6, g: 0.72, b: 0.85, a: 1.0 };
        self.foliage.render(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view(&color),
                depth_slice: None,
                resolve_target: Some(&view(&resolved)),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Discard },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view(&depth),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(self.foliage.depth_clear_value()),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        }));
        let readback = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row) * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            resolved.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &readback, layout },
            resolved.size(),
        );
        self.queue.submit([encoder.finish()]);
        let (tell, mapped) = oneshot::channel();
        readback.map_async(wgpu::MapMode::Read, .., |result| drop(tell.send(result)));
        mapped.await.map_err(told)?.map_err(told)?;
        let bytes = readback.get_mapped_range(..).map_err(told)?;
        Ok(bytes.chunks_exact(row as usize).flat_map(|row| row[..4 * width as usize].to_vec()).collect())
    }
}
