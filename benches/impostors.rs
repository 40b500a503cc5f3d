//! Frames of many small plants: as impostors, as plain alpha-tested quads of equal area, and as
//! leaves.
//!
//! `cargo bench --bench impostors`, on the adapter that `GpuOptions::from_env` selects. The plants
//! stand in a grid across the view, so many that their area on the screen is the same at any size.
//! All kinds of frame alternate within each sample; leaves are drawn only of few plants.

mod common;

use criterion::{Criterion, SamplingMode};
use foliage_lod::{
    Camera, FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    extract::Far,
    gpu::{Backdrop, GpuDevice, Offscreen, TARGET, texture},
    simplify::SimplifyOptions,
    software::{BakeOptions, bake},
};
use glam::{DAffine3, DVec3};
use std::time::{Duration, Instant};

const SIZE: [u32; 2] = [1280, 720];
/// Diameters in pixels.
const DIAMETERS: [u32; 3] = [8, 24, 64];
/// Number of plants at the least diameter.
const PLANTS: u32 = 100_000;
/// Part of the leaves of a plant that is drawn with leaves.
const SHARE: f32 = 0.02;
/// Most plants that are drawn with leaves: each has tens of thousands of triangles of wood.
const MOST_WITH_LEAVES: usize = 2000;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let Some(gpu) = common::gpu() else { return };
    let model = model();
    for diameter in DIAMETERS {
        bench(&mut criterion, &gpu, &model, diameter);
    }
    criterion.final_summary();
}

fn model() -> FoliageModel {
    let leaves = if common::as_test() { 30 } else { 3000 };
    let plant = common::plant("betula-populifolia", Some(leaves));
    let mut model = common::simplified(&plant, &SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() });
    let sizes =
        if common::as_test() { BakeOptions { across: 2, ..BakeOptions::default() } } else { Default::default() };
    model.impostor = Some(bake(&model, &sizes, &mut |_| true).expect("a sound model"));
    model
}

/// A camera, and the places of the plants before it.
fn grid(model: &FoliageModel, diameter: u32) -> (Camera, Vec<DAffine3>) {
    let plants = if common::as_test() { 64 } else { PLANTS * DIAMETERS[0] * DIAMETERS[0] / (diameter * diameter) };
    let sphere = model.sphere();
    let fov_y_radians = 0.5_f64;
    let ppu = 0.5 * f64::from(SIZE[1]) / (0.5 * fov_y_radians).tan();
    let away = 2.0 * sphere.radius * ppu / f64::from(diameter);
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let eye = sphere.center() + DVec3::Z * away;
    let look_at = LookAt { eye, target: sphere.center(), up: DVec3::Y, fov_y_radians, aspect, near: 0.1 };
    let half = away * (0.5 * fov_y_radians).tan();
    let columns = (f64::from(plants) * aspect).sqrt().ceil();
    let rows = (f64::from(plants) / columns).ceil();
    let place = |i: u32| {
        let (x, y) = (f64::from(i) % columns, (f64::from(i) / columns).floor());
        let at = |step: f64, steps: f64| 2.0 * (step + 0.5) / steps - 1.0;
        let depth = (f64::from(i) * 0.618_034).fract() * sphere.radius;
        DAffine3::from_translation(DVec3::new(at(x, columns) * half * aspect, at(y, rows) * half, depth))
    };
    (look_at.camera(SIZE[1]), (0..plants).map(place).collect())
}

fn bench(criterion: &mut Criterion, gpu: &GpuDevice, model: &FoliageModel, diameter: u32) {
    let (camera, places) = grid(model, diameter);
    let target = Offscreen::new(gpu, SIZE).expect("a small target");
    let far = Some(Far { at_px: 1024.0, ..Far::default() });
    let kinds = if places.len() > MOST_WITH_LEAVES { &[far][..] } else { &[far, None] };
    let drawn = kinds.iter().map(|&far| {
        let look = Look { far, ..Look::default() };
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).expect("a usable device");
        let id = foliage.add_model(gpu.device(), gpu.queue(), model).expect("the model fits");
        let active = SHARE * model.leaves.len() as f32;
        let plants: Vec<Instance> = places.iter().map(|&place| Instance::new(id, place, active)).collect();
        foliage.prepare(gpu.device(), gpu.queue(), camera, &plants).expect("the plants fit");
        foliage
    });
    let drawn: Vec<FoliageRenderer> = drawn.collect();
    let plain = Plain::new(gpu, model, &camera, &places);
    let mut times = [const { Vec::new() }; 3];
    let mut group = criterion.benchmark_group("impostors");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(500));
    group.bench_function(format!("{} plants of {diameter} pixels", places.len()), |bencher| {
        bencher.iter_custom(|iterations| {
            let first = times[0].len();
            for _ in 0..iterations {
                let started = Instant::now();
                target.draw(&drawn[0]).expect("the device answers");
                times[0].push(started.elapsed());
                times[1].push(plain.draw(gpu));
                if let Some(leaves) = drawn.get(1) {
                    let started = Instant::now();
                    target.draw(leaves).expect("the device answers");
                    times[2].push(started.elapsed());
                }
            }
            times[0][first..].iter().sum()
        });
    });
    group.finish();
    let [sprites, plain, leaves] = times.map(common::median_ms);
    if let Some((sprites, plain)) = sprites.zip(plain) {
        let plants = places.len();
        println!(
            "{plants} plants of {diameter} px: {sprites:.2} ms, plain quads {plain:.2} ms, ratio {:.3}",
            sprites / plain
        );
        if let Some(leaves) = leaves {
            let percent = 100.0 * SHARE;
            println!("... with {percent:.0} % of their leaves {leaves:.2} ms, ratio {:.3}", sprites / leaves);
        }
    }
}

/// Quads that face the camera, with one texture and an alpha test, before the same backdrop.
struct Plain {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    color: wgpu::TextureView,
    resolved: wgpu::TextureView,
    depth: wgpu::TextureView,
    count: u32,
    backdrop: Backdrop,
}

const PLAIN: &str = "
struct Quads { clip_from_world: mat4x4<f32>, radius: f32 }
@group(0) @binding(0) var<uniform> quads: Quads;
@group(0) @binding(1) var<storage, read> places: array<vec4<f32>>;
@group(0) @binding(2) var picture: texture_2d<f32>;
@group(0) @binding(3) var filtering: sampler;
struct Corner { @builtin(position) clip: vec4<f32>, @location(0) uv: vec2<f32> }
@vertex fn corner(@builtin(vertex_index) i: u32, @builtin(instance_index) number: u32) -> Corner {
    let at = vec2(select(-1.0, 1.0, i == 1u || i == 2u || i == 4u), select(-1.0, 1.0, i == 2u || i >= 4u));
    let clip = quads.clip_from_world * vec4(places[number].xyz + vec3(at * quads.radius, 0.0), 1.0);
    return Corner(clip, at * vec2(0.5, -0.5) + 0.5);
}
@fragment fn color(corner: Corner) -> @location(0) vec4<f32> {
    let texel = textureSample(picture, filtering, corner.uv);
    if texel.a < 0.5 { discard; }
    return texel;
}";

impl Plain {
    fn new(gpu: &GpuDevice, model: &FoliageModel, camera: &Camera, places: &[DAffine3]) -> Self {
        use wgpu::util::DeviceExt;
        let (device, queue) = (gpu.device(), gpu.queue());
        let sphere = model.sphere();
        let clip_from_world: Vec<f32> = camera.clip_from_world.as_mat4().to_cols_array().to_vec();
        let uniform = [clip_from_world, vec![sphere.radius as f32, 0.0, 0.0, 0.0]].concat();
        let centers: Vec<[f32; 4]> = places
            .iter()
            .map(|place| place.transform_point3(sphere.center()).as_vec3().extend(0.0).to_array())
            .collect();
        let buffer = |usage, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let uniform = buffer(wgpu::BufferUsages::UNIFORM, bytemuck::cast_slice(&uniform));
        let centers = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&centers));
        let impostor = model.impostor.as_ref().expect("baked above");
        let side = impostor.frame_px;
        let texel_bytes = (4 * side * side) as usize;
        let picture = device.create_texture_with_data(
            queue,
            &wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8UnormSrgb,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            &impostor.color[..texel_bytes],
        );
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(PLAIN.into()),
        });
        let target = Some(wgpu::ColorTargetState::from(TARGET.color));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: TARGET.depth,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState { count: TARGET.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: std::slice::from_ref(&target),
            }),
            multiview_mask: None,
            cache: None,
        });
        let view = picture.create_view(&Default::default());
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let resources = [
            uniform.as_entire_binding(),
            centers.as_entire_binding(),
            wgpu::BindingResource::TextureView(&view),
            wgpu::BindingResource::Sampler(&sampler),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let attachment = |format, samples| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
            texture(device, SIZE, format, samples, usage).create_view(&Default::default())
        };
        Self {
            pipeline,
            bindings,
            color: attachment(TARGET.color, TARGET.samples),
            resolved: attachment(TARGET.color, 1),
            depth: attachment(TARGET.depth, TARGET.samples),
            count: places.len() as u32,
            backdrop: Backdrop::new(device, TARGET),
        }
    }

    fn draw(&self, gpu: &GpuDevice) -> Duration {
        let started = Instant::now();
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color,
                depth_slice: None,
                resolve_target: Some(&self.resolved),
                ops: wgpu::Operations::default(),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.backdrop.render(&mut pass);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..6, 0..self.count);
        drop(pass);
        let submission = gpu.submit([encoder.finish()]).expect("the device answers");
        gpu.wait(submission, Duration::from_secs(60)).expect("the device answers");
        started.elapsed()
    }
}
