//! Claims about plants drawn on the GPU, against the CPU drawer and against themselves.
//!
//! Without an adapter the tests say so and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    grow::{GrowOptions, Species, grow},
    model::FoliageModel,
    render::{
        camera::Camera,
        device::GpuDevice,
        foliage::{FoliageRenderer, Instance, ModelId, Prepared},
        image::Image,
        offscreen::{Offscreen, TARGET},
        software::{DrawList, DrawOptions, Painter},
    },
    simplify::{Quiet, SimplifyOptions, raster::CpuFragments, simplify},
};
use glam::{DAffine3, DVec3};

const SIZE: [u32; 2] = [192, 160];

fn model(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn camera(model: &FoliageModel) -> Camera {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    Camera::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).with_aspect(aspect)
}

/// A device with one target and the models of a test.
struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    models: Vec<ModelId>,
}

impl Stage {
    fn new(models: &[&FoliageModel]) -> Option<Self> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, SIZE).unwrap();
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET);
        let add = |model: &&FoliageModel| foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        let models = models.iter().map(add).collect();
        Some(Self { gpu, target, foliage, models })
    }

    fn prepare(&mut self, camera: &Camera, instances: &[Instance]) -> Prepared {
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), camera, instances).unwrap()
    }

    fn picture(&mut self, camera: &Camera, instances: &[Instance]) -> Image {
        self.prepare(camera, instances);
        self.target.picture(&self.foliage).unwrap()
    }

    fn at_origin(&self, active: f32) -> Instance {
        Instance { model: self.models[0], world_from_plant: DAffine3::IDENTITY, active, window: 1.0, scales: None }
    }
}

/// Mean difference of all channels, and the one that 95 % of the pixels stay below.
fn difference(a: &Image, b: &Image) -> (f64, u8) {
    let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
    let mut differences: Vec<u8> =
        pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap()).collect();
    let sum: u64 = a.rgba.iter().zip(&b.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    differences.sort_unstable();
    (sum as f64 / a.rgba.len() as f64, differences[differences.len() * 95 / 100])
}

#[test]
fn the_gpu_draws_what_the_cpu_draws() {
    for (species, leaves) in [("english-oak", 900), ("betula-populifolia", 700), ("carya-illinoinensis", 400)] {
        let model = model(species, leaves);
        let Some(mut stage) = Stage::new(&[&model]) else { return };
        let camera = camera(&model);
        let painter = Painter::new(&model.materials, &model.textures).unwrap();
        for share in [1.0, 0.5, 0.15] {
            let n = (leaves as f32 * share).round();
            let drawn = stage.picture(&camera, &[stage.at_origin(n)]);
            let list = DrawList::of_model(&model, n as usize);
            let painted = painter.draw(&list, &camera, SIZE, &DrawOptions::default()).unwrap();
            let (mean, percentile) = difference(&drawn, &painted);
            println!("{species} at {n}: mean {mean:.2}, 95th percentile {percentile}");
            if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
                let path = std::path::Path::new(&folder).join(format!("{species}-{n}.png"));
                Image::side_by_side(&[drawn, painted], 4).write_png(path).unwrap();
            }
            // Four samples against sixteen, filtered levels against nearest ones.
            assert!(mean < 3.0 && percentile < 40, "{species} at {n}: {mean} {percentile}");
        }
    }
}
