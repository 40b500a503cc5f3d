//! Plants drawn on the GPU, compared with the CPU renderer and with each other.
//!
//! Without an adapter the tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::{
    gpu::{difference, gpu},
    plants,
};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Swap,
    draw::{self, Coloring, ModelId, Prepared},
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    material::Wrap,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{DrawList, DrawOptions, Image, Painter, Placed},
    stochastic::shuffled,
};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [192, 160];

fn model(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn camera(model: &FoliageModel) -> LookAt {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, 1.0).with_aspect(aspect)
}

/// Rows of the screen that thin stems are left out for. The CPU leaves none out: more rows than the
/// pictures have keep nearly all.
const HEIGHT_PX: u32 = 1080;

/// A device with one target and the models of the test.
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
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
        let add = |model: &&FoliageModel| foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        let models = models.iter().map(add).collect();
        Some(Self { gpu, target, foliage, models })
    }

    fn prepare(&mut self, camera: &LookAt, instances: &[Instance]) -> Prepared {
        self.foliage.prepare(self.gpu.device(), self.gpu.queue(), camera.camera(HEIGHT_PX), instances).unwrap()
    }

    fn picture(&mut self, camera: &LookAt, instances: &[Instance]) -> Image {
        self.prepare(camera, instances);
        self.target.picture(&self.foliage).unwrap()
    }

    fn at_origin(&self, active: f32) -> Instance {
        Instance::new(self.models[0], DAffine3::IDENTITY, active)
    }
}

/// A turned card whose picture repeats and covers its left quarter but for one column of texels:
/// what covers lies two texels beyond its right edge.
#[test]
fn a_card_shows_nothing_at_an_edge_where_its_picture_is_transparent() {
    let mut plant = plants::masked(0, 1);
    let covering = |i: u32| [80, 160, 60, if (1..16).contains(&(i % 64)) { 255 } else { 0 }];
    let image = image::RgbaImage::from_raw(64, 64, (0..64 * 64).flat_map(covering).collect()).unwrap();
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    plant.textures[0].bytes = png.into_inner();
    (plant.materials[0].alpha_cutoff, plant.materials[0].wrap) = (0.2, [Wrap::Repeat; 2]);
    let (along, across) = (Vec3::new(-0.3, 2.0, 0.0), Vec3::new(2.0, 0.3, 0.0));
    let base = -0.5 * along;
    plants::push_card(&mut plant, base, along, across, base);
    let model = shuffled(&plant, 1).unwrap();
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    for zoom in [1.0, 0.7, 0.5, 0.4] {
        let camera = LookAt::framing(&model.sphere(), DVec3::Z, 0.8, zoom).with_aspect(1.2);
        let [bare, drawn] = [0.0, 1.0].map(|active| {
            let instance = stage.at_origin(active);
            stage.picture(&camera, &[instance])
        });
        let pixels = bare.rgba.chunks_exact(4).zip(drawn.rgba.chunks_exact(4)).zip(0_u32..);
        let shown = pixels.filter(|((bare, drawn), _)| bare != drawn).map(|(_, pixel)| pixel % SIZE[0]);
        let (left, right): (Vec<u32>, Vec<u32>) = shown.partition(|&column| column < SIZE[0] / 2);
        println!("{zoom}: {} pixels on the left, {} on the right", left.len(), right.len());
        assert!(left.len() > 200 && right.is_empty(), "{} pixels on the left, {right:?}", left.len());
    }
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
            let painted = painter.draw(&list, &camera.camera(SIZE[1]), SIZE, &DrawOptions::default()).unwrap();
            let (mean, percentile) = difference(&drawn, &painted);
            println!("{species} at {n}: mean {mean:.2}, 95th percentile {percentile}");
            if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
                let path = std::path::Path::new(&folder).join(format!("{species}-{n}.png"));
                Image::side_by_side(&[drawn, painted], 4).write_png(path).unwrap();
            }
            // The GPU takes 4 samples per pixel and filters between mip levels; the CPU takes 16
            // and uses the nearest level.
            assert!(mean < 3.0 && percentile < 40, "{species} at {n}: {mean} {percentile}");
        }
    }
}

#[test]
fn a_mirrored_and_stretched_plant_is_lit_as_on_the_cpu() {
    let model = model("betula-populifolia", 400);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    let stretched = DAffine3::from_scale(DVec3::new(-1.0, 0.7, 1.4)) * DAffine3::from_rotation_y(0.8);
    let drawn = stage.picture(&camera, &[Instance { world_from_plant: stretched, ..stage.at_origin(400.0) }]);
    let list = DrawList::of_model(&model, 400);
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    let (placed, options) = ([Placed::new(&list, stretched)], DrawOptions::default());
    let painted = painter.draw_placed(&placed, &camera.camera(SIZE[1]), SIZE, &options).unwrap();
    let (mean, percentile) = difference(&drawn, &painted);
    assert!(mean < 3.0 && percentile < 40, "{mean} {percentile}");
}

#[test]
fn scales_that_the_plant_keeps_and_those_of_the_timeline_give_the_same_bytes() {
    let model = model("betula-populifolia", 300);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    let mut swap = Swap::new(&model);
    let (device, queue) = (stage.gpu.device().clone(), stage.gpu.queue().clone());
    // Another plant's scales come first in the buffer, so that the offset is not 0.
    stage.foliage.add_scales(&device, &queue, &swap).unwrap();
    let scales = stage.foliage.add_scales(&device, &queue, &swap).unwrap();
    for n in [300, 1, 299, 30, 150, 0] {
        let changed = swap.set_active(n).to_vec();
        stage.foliage.upload_scales(&queue, scales, &swap, &changed);
        let looked_up = stage.at_origin(n as f32);
        let kept = Instance { scales: Some(scales), ..looked_up };
        let [looked_up, kept] = [looked_up, kept].map(|instance| stage.picture(&camera, &[instance]));
        assert!(looked_up == kept, "at {n}");
    }
}

#[test]
fn between_two_counts_pictures_pass_from_one_to_the_other() {
    let model = model("english-oak", 40);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    let mut at = |active| {
        let instance = stage.at_origin(active);
        stage.picture(&camera, &[instance])
    };
    let steps: Vec<Image> = (0..=8).map(|i| at(12.0 + i as f32 / 8.0)).collect();
    assert!(steps[0] == at(12.0) && steps[8] == at(13.0) && steps[0] != steps[8]);
    let whole = difference(&steps[0], &steps[8]).0;
    for pair in steps.windows(2) {
        assert!(difference(&pair[0], &pair[1]).0 < 0.5 * whole, "the picture jumps within one leaf");
    }
}

#[test]
fn a_model_takes_72_bytes_for_each_leaf_that_is_a_quad_and_16_for_each_vertex_of_wood() {
    let model = model("english-oak", 900);
    let Some(stage) = Stage::new(&[&model]) else { return };
    let [leaves, wood] = stage.foliage.diagnostics().model_bytes;
    println!("{leaves} bytes for 900 leaves, {wood} for {} vertices of wood", model.wood.vertices.len());
    assert_eq!(draw::gpu_bytes(&model), [leaves, wood]);
    // The rest are looks, nearly all of them of the wood: 2.5 bytes for each of its vertices.
    let looks = leaves - 72 * 900;
    assert!(2 * looks < 5 * model.wood.vertices.len() as u64, "{looks}");
    assert_eq!(wood, (16 * model.wood.vertices.len() + 4 * model.wood.indices.len()) as u64);
}

#[test]
fn any_number_of_plants_takes_a_few_draws_a_model() {
    let [oak, birch] = [model("english-oak", 60), model("betula-populifolia", 80)];
    let Some(mut stage) = Stage::new(&[&oak, &birch]) else { return };
    let camera = camera(&oak);
    for count in [2, 10, 500] {
        let plants: Vec<Instance> = (0..count)
            .map(|i| {
                let place = DAffine3::from_translation(DVec3::X * i as f64);
                Instance::new(stage.models[i % 2], place, (i % 60 + 1) as f32)
            })
            .collect();
        let prepared = stage.prepare(&camera, &plants);
        assert_eq!((prepared.instances, prepared.skipped), (count as u32, 0));
        // One draw call for the leaves of each model, and one for each stem thickness cutoff.
        assert!((4..=16).contains(&prepared.draws), "{count} plants: {}", prepared.draws);
        assert_eq!(prepared.leaves, (0..count as u64).map(|i| i % 60 + 1).sum::<u64>());
    }
    // The draw order does not affect the picture.
    let mut plants = [stage.at_origin(60.0), Instance { model: stage.models[1], ..stage.at_origin(80.0) }];
    let drawn = stage.picture(&camera, &plants);
    plants.reverse();
    assert!(difference(&drawn, &stage.picture(&camera, &plants)).0 < 0.05);
}

#[test]
fn plants_that_cannot_be_placed_are_skipped_and_counted() {
    let model = model("betula-populifolia", 60);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    let whole = stage.at_origin(60.0);
    let expected = stage.picture(&camera, &[whole]);
    let broken = [
        DAffine3::from_translation(DVec3::new(f64::NAN, 0.0, 0.0)),
        DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
        DAffine3::from_scale(DVec3::splat(1e300)),
    ]
    .map(|world_from_plant| Instance { world_from_plant, ..whole });
    let instances = [broken[0], whole, broken[1], broken[2]];
    let prepared = stage.prepare(&camera, &instances);
    assert_eq!((prepared.instances, prepared.skipped), (1, 3));
    assert!(stage.picture(&camera, &instances) == expected);
    for (active, leaves) in [(f32::NAN, 0), (-5.0, 0), (f32::INFINITY, 60), (1e30, 60), (59.5, 60)] {
        assert_eq!(stage.prepare(&camera, &[Instance { active, ..whole }]).leaves, leaves, "{active}");
    }
}

#[test]
fn a_plant_far_from_the_origin_looks_as_it_does_there() {
    let model = model("betula-populifolia", 200);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let here = camera(&model);
    let instance = stage.at_origin(200.0);
    let expected = stage.picture(&here, &[instance]);
    let away = DVec3::new(3e6, -1e6, 7e6);
    let there = LookAt { eye: here.eye + away, target: here.target + away, ..here };
    let moved = Instance { world_from_plant: DAffine3::from_translation(away), ..instance };
    let (mean, percentile) = difference(&expected, &stage.picture(&there, &[moved]));
    assert!(mean < 0.05 && percentile <= 1, "{mean} {percentile}");
}

#[test]
fn colourings_distinguish_leaves_and_show_their_order() {
    let model = model("english-oak", 200);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    let whole = stage.at_origin(200.0);
    let mut colors = |coloring, active| {
        stage.foliage.set_coloring(coloring);
        let picture = stage.picture(&camera, &[Instance { active, ..whole }]);
        picture.rgba.chunks_exact(4).filter(|rgba| u32::from(rgba[0]) > u32::from(rgba[2]) + 100).count()
    };
    let orange = [20.0, 200.0].map(|active| colors(Coloring::PruneOrder, active));
    assert!(orange[1] > 4 * orange[0].max(20), "few of the first leaves should be orange: {orange:?}");
    let sheets = colors(Coloring::Flat, 200.0);
    let edges = colors(Coloring::Wire, 200.0);
    assert!(edges <= sheets, "{edges} pixels of edges, {sheets} of filled leaves");
}

#[test]
fn a_target_without_pixels_or_beyond_the_adapter_is_refused() {
    let Some(gpu) = gpu() else { return };
    for size in [[0, 5], [5, 0], [1 << 20, 5]] {
        let error = Offscreen::new(&gpu, size).err().unwrap().to_string();
        assert!(error.starts_with(&format!("size is {}x{}; it must be 1 to ", size[0], size[1])), "{error}");
    }
}

#[test]
fn a_lost_device_is_an_error_and_not_a_panic() {
    let model = model("betula-populifolia", 60);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let instance = stage.at_origin(60.0);
    stage.prepare(&camera(&model), &[instance]);
    stage.gpu.device().destroy();
    let error = stage.target.picture(&stage.foliage).unwrap_err().to_string();
    assert!(error.starts_with("GPU: ") && !error.contains('\n'), "{error}");
}

/// Golden pictures, so that plants change only on purpose. `FOLIAGE_BLESS=1` rewrites them.
#[test]
fn pictures_stay_as_they_were() {
    let model = model("english-oak", 400);
    let Some(mut stage) = Stage::new(&[&model]) else { return };
    let camera = camera(&model);
    for active in [400.0, 120.5, 40.0] {
        let instance = Instance { window: 16.0, ..stage.at_origin(active) };
        let picture = stage.picture(&camera, &[instance]);
        let path = format!("{}/data/golden/oak-{active}.png", env!("CARGO_MANIFEST_DIR"));
        if std::env::var_os("FOLIAGE_BLESS").is_some() {
            picture.write_png(&path).unwrap();
        }
        let golden = image::open(&path).unwrap().into_rgba8();
        let golden = Image { width: golden.width(), height: golden.height(), rgba: golden.into_raw() };
        let (mean, percentile) = difference(&picture, &golden);
        // Adapters differ slightly in texture filtering and sample positions.
        assert!(mean < 1.0 && percentile < 12, "oak at {active}: mean {mean}, 95th percentile {percentile}");
    }
}
