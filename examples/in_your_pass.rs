//! Draws a birch in your own render pass.

use foliage_lod::glam::{DAffine3, DVec3, dcamera::rh::proj::directx::perspective, dcamera::rh::view::look_at_mat4};
use foliage_lod::simplify::{CpuFragments, Quiet, SimplifyOptions, simplify};
use foliage_lod::{Camera, Depth, FoliageRenderer, Instance, Look, gpu::TargetFormat, grow};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Your device and targets.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let (color, depth) = (wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::Depth32Float);
    let view = |format| foliage_lod::gpu::texture(&device, [512; 2], format, 1, wgpu::TextureUsages::RENDER_ATTACHMENT);
    let [color_view, depth_view] = [color, depth].map(|format| view(format).create_view(&Default::default()));

    // Once. A model comes from `FoliageModel::read("birch.vds")`, or is made as here.
    let birch = grow::grow(&grow::Species::embedded("betula-populifolia")?, &Default::default())?;
    let model = simplify(&birch, &SimplifyOptions::fast(), &mut CpuFragments::new(), &mut Quiet)?.model;
    let mut foliage = FoliageRenderer::new(&device, TargetFormat { color, depth, samples: 1 }, Look::default())?;
    let id = foliage.add_model(&device, &queue, &model)?;

    // Each frame: your matrix, and trees, each with as many leaves as you like. This one has half
    // of its leaves.
    let eye = DVec3::new(0.0, 6.0, 20.0);
    let clip_from_world = perspective(1.0, 1.0, 0.1, 1000.0) * look_at_mat4(eye, DVec3::Y * 5.0, DVec3::Y);
    let camera = Camera { clip_from_world, eye, height_px: 512, depth: Depth::Standard };
    let tree = Instance::new(id, DAffine3::IDENTITY, 0.5 * model.leaves.len() as f32);
    let drawn = foliage.prepare(&device, &queue, camera, &[tree])?;
    let mut encoder = device.create_command_encoder(&Default::default());
    foliage.render(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &color_view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth_view,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    }));
    queue.submit([encoder.finish()]);
    println!("{} leaves in {} draw calls", drawn.leaves, drawn.draws);
    Ok(())
}
