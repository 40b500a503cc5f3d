//! Pictures of patches: far plants that are fewer cover as much, and the order of the cells is as
//! good as sorting.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    Camera, FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    draw::Ground,
    gpu::{Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    scene::{
        Footing,
        patch::{CellOrder, Patch, PatchEntry, PatchPlant, Placing, PlantKind, Scratch, Sweep, TileKey},
    },
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{Image, SoftwareRenderer},
};
use glam::{DAffine3, DVec3};
use std::sync::LazyLock;

/// Grown and simplified.
fn model(species: &str) -> FoliageModel {
    let plant = grow(&Species::embedded(species).unwrap(), &GrowOptions::default()).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::fast() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

static GRASS: LazyLock<FoliageModel> = LazyLock::new(|| model("meadow-grass"));

/// A square of plants in cells of 1.
fn patch(cells: u32, placing: Placing, density: f32) -> Patch {
    let kind = PlantKind { density, ..PlantKind::new("grass", 1.0, [0.5, 0.9]) };
    let side = f64::from(cells);
    let entry = PatchEntry { area: Some([side; 2]), cells, placing, ..PatchEntry::new(vec![kind]) };
    entry.patch(vec![None], None).unwrap()
}

fn plants(patch: &Patch) -> Vec<PatchPlant> {
    let mut plants = Vec::new();
    patch.tile(TileKey { layer: 0, at: [0, 0] }, &mut Scratch::default(), &mut plants);
    plants
}

/// Covered fraction of a picture of plants, each with a factor of its size.
fn coverage(plants: &[(PatchPlant, f64)], camera: &Camera, size: [u32; 2]) -> f64 {
    let mut foliage = SoftwareRenderer::new(Look::default()).unwrap();
    let id = foliage.add_model(&GRASS).unwrap();
    let footing = Footing::new(&GRASS, None);
    let leaves = GRASS.leaves.len() as f32;
    let instance = |(plant, growth): &(PatchPlant, f64)| {
        let larger = PatchPlant { height: plant.height * *growth as f32, ..*plant };
        Instance::new(id, footing.world_from_patch(&larger), leaves)
    };
    let instances: Vec<Instance> = plants.iter().map(instance).collect();
    let image = foliage.cutout(*camera, &instances, size).unwrap().image;
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha) / 255.0).sum::<f64>()
        / f64::from(size[0] * size[1])
}

#[test]
fn a_quarter_of_the_plants_twice_as_large_covers_as_much() {
    let patch = patch(128, Placing::BlueNoise, 0.5);
    let all = plants(&patch);
    let kind = &patch.kinds()[0];
    let far = |share: f64| kind.reach() * (1.0 - f64::from(kind.thins_over) * share);
    let size = [300, 60];
    // Seen from 60 away, a plant is about two pixels high.
    let look = |target: [f64; 3], eye: [f64; 3]| LookAt {
        eye: eye.into(),
        target: target.into(),
        up: DVec3::Y,
        fov_y_radians: 0.25,
        aspect: 5.0,
        near: 0.1,
    };
    for (target, eye) in [([0.0, 0.0, 0.0], [0.0, 25.0, 60.0]), ([0.0, 0.0, 10.0], [30.0, 60.0, 60.0])] {
        let camera = look(target, eye).camera(size[1]);
        let covered = [1.0, 0.25].map(|share| {
            // What is seen once it has become so few, but has not begun to sink.
            let seen = |plant: &PatchPlant| kind.seen(plant.rank, far(share) - 1e-9).map(|seen| (*plant, seen.width));
            let seen: Vec<_> = all.iter().filter_map(seen).collect();
            let left = seen.len() as f64 / all.len() as f64;
            assert!((left - share).abs() < 0.02, "{left}");
            coverage(&seen, &camera, size)
        });
        let ratio = covered[1] / covered[0];
        println!("{covered:?}: {ratio}");
        assert!(covered[0] > 0.05 && covered[0] < 0.9 && (ratio - 1.0).abs() < 0.02, "{covered:?}: {ratio}");
    }
}

fn linear(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Linear colour multiplied by alpha, and alpha; the picture's colour is if it `is_multiplied`.
fn pixels(image: &Image, is_multiplied: bool) -> Vec<[f32; 4]> {
    let pixel = |p: &[u8; 4]| {
        let alpha = f32::from(p[3]) / 255.0;
        let [r, g, b] = [0, 1, 2].map(|i| linear(p[i]) * if is_multiplied { 1.0 } else { alpha });
        [r, g, b, alpha]
    };
    image.rgba.as_chunks().0.iter().map(pixel).collect()
}

/// Draws layers over each other, the first one at the back.
fn blended<'a>(layers: impl Iterator<Item = &'a Vec<[f32; 4]>>) -> Vec<[f32; 4]> {
    let mut picture: Vec<[f32; 4]> = Vec::new();
    for layer in layers {
        picture.resize(layer.len(), [0.0; 4]);
        for (under, over) in picture.iter_mut().zip(layer) {
            *under = std::array::from_fn(|i| over[i] + under[i] * (1.0 - over[3]));
        }
    }
    picture
}

/// Root mean square difference of the pictures as sRGB, of 255, before a grey.
fn rmse(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let shown = |p: &[f32; 4], i: usize| {
        let value = p[i] + 0.2 * (1.0 - p[3]);
        if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
    };
    let squares = a.iter().zip(b).flat_map(|(a, b)| [0, 1, 2].map(|i| f64::from(shown(a, i) - shown(b, i)).powi(2)));
    255.0 * (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

/// Sprites of a field that are blended in the order of their cells, in that of their distance, and
/// drawn by alpha to coverage: at most 2 of 255 between the first two, 6 to the last.
#[test]
fn cells_in_order_look_as_if_they_were_sorted() {
    let Some(gpu) = gpu() else { return };
    let cells = 16;
    let patch = patch(cells, Placing::Jitter, 0.8);
    let all = plants(&patch);
    let (footing, leaves, size) = (Footing::new(&GRASS, None), GRASS.leaves.len() as f32, [240, 120]);
    let half = 0.5 * f64::from(cells);
    for degrees in [0.0_f64, 22.0, 45.0, 67.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let eye = DVec3::new(-18.0 * cos, 4.0, -18.0 * sin);
        let look = LookAt { eye, target: DVec3::ZERO, up: DVec3::Y, fov_y_radians: 0.6, aspect: 2.0, near: 0.1 };
        let camera = look.camera(size[1]);
        let mut foliage = SoftwareRenderer::new(Look::default()).unwrap();
        let id = foliage.add_model(&GRASS).unwrap();
        let instance = |id, plant: &PatchPlant| Instance::new(id, footing.world_from_patch(plant), leaves);
        let layer = |plant| pixels(&foliage.cutout(camera, &[instance(id, plant)], size).unwrap().image, false);
        let layers: Vec<_> = all.iter().map(layer).collect();
        let mut sorted: Vec<usize> = (0..all.len()).collect();
        sorted.sort_by(|&a, &b| all[b].at.distance(eye).total_cmp(&all[a].at.distance(eye)));
        let exact = blended(sorted.iter().map(|&plant| &layers[plant]));
        let cell = |plant: &PatchPlant| [plant.at.x, plant.at.z].map(|at| (at + half).floor() as u32);
        let in_cells = |sweep| {
            let order = CellOrder::new(cells, [cos, sin], [eye.x + half, eye.z + half], sweep);
            let cells = (0..order.len()).filter_map(|index| order.sorted_index(index));
            let plants: Vec<usize> = cells.filter_map(|of| all.iter().position(|plant| cell(plant) == of)).collect();
            assert_eq!(plants.len(), all.len());
            rmse(&blended(plants.iter().map(|&plant| &layers[plant])), &exact)
        };
        let computed = [Sweep::Octants, Sweep::Axes].map(in_cells);
        let mut renderer = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
        let id = renderer.add_model(gpu.device(), gpu.queue(), &GRASS).unwrap();
        let instances: Vec<Instance> = all.iter().map(|plant| instance(id, plant)).collect();
        renderer.prepare(gpu.device(), gpu.queue(), camera, &instances).unwrap();
        let covered = Offscreen::new(&gpu, size).unwrap().cutout(&renderer).unwrap();
        let to_coverage = rmse(&pixels(&covered, true), &exact);
        println!("{degrees}: {computed:?} {to_coverage}");
        assert!(computed[0] <= 2.0 && to_coverage <= 6.0, "{degrees}: {computed:?}, {to_coverage}");
    }
}

#[test]
fn tints_are_factors_of_lit_colours_on_both_processors() {
    let (size, tint) = ([160, 120], [0.5, 1.0, 1.6]);
    let sphere = GRASS.sphere();
    let camera = LookAt::framing(&sphere, DVec3::new(0.4, 0.3, 1.0), 0.6, 1.0).with_aspect(4.0 / 3.0).camera(size[1]);
    let on_cpu = |tints: bool, tint: [f32; 3]| {
        let mut foliage = SoftwareRenderer::new(Look { tints, ..Look::default() }).unwrap();
        let id = foliage.add_model(&GRASS).unwrap();
        let plant = Instance { tint, ..Instance::new(id, DAffine3::IDENTITY, GRASS.leaves.len() as f32) };
        foliage.cutout(camera, &[plant], size).unwrap().image
    };
    let [plain, tinted] = [[1.0; 3], tint].map(|tint| on_cpu(true, tint));
    assert_eq!(on_cpu(false, tint), plain, "the look has no tints");
    for (plain, tinted) in pixels(&plain, false).iter().zip(&pixels(&tinted, false)) {
        let expected = [0, 1, 2].map(|i| (plain[i] * tint[i]).min(plain[3]));
        assert!((0..3).all(|i| (tinted[i] - expected[i]).abs() < 0.012), "{plain:?} {tinted:?}");
    }
    let Some(gpu) = gpu() else { return };
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look { tints: true, ..Look::default() }).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), &GRASS).unwrap();
    let plant = |tint| Instance { tint, ..Instance::new(id, DAffine3::IDENTITY, GRASS.leaves.len() as f32) };
    let target = Offscreen::new(&gpu, size).unwrap();
    // The second plant stands behind the eye: tints belong to plants, whatever their order.
    let behind = Instance { world_from_plant: DAffine3::from_translation(camera.eye * 3.0), ..plant([9.0; 3]) };
    foliage.prepare(gpu.device(), gpu.queue(), camera, &[behind, plant(tint)]).unwrap();
    let (mean, _) = difference(&target.picture(&foliage).unwrap(), &{
        let mut here = SoftwareRenderer::new(Look { tints: true, ..Look::default() }).unwrap();
        let id = here.add_model(&GRASS).unwrap();
        here.draw(camera, &[Instance { model: id, ..plant(tint) }], size).unwrap().image
    });
    assert!(mean < 1.5, "{mean}");
    assert!(foliage.diagnostics().effect_buffers.contains(&"tints"));
}

#[test]
fn plants_stand_in_the_haze_of_the_ground_on_both_processors() {
    let size = [240, 120];
    let ground = Some(Ground { color: [0.1, 0.15, 0.05], height: 0.0, haze: 20.0 * GRASS.sphere().radius });
    let radius = GRASS.sphere().radius;
    let [near, far] = [5.0, 80.0].map(|radii| DVec3::new(0.0, 0.0, -radii * radius));
    // Both are as large in the picture.
    let place = |at: DVec3| DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(-at.z / near.z.abs()));
    let eye = DVec3::new(0.0, 0.5 * radius, 0.0);
    let look_at = LookAt { eye, target: near, up: DVec3::Y, fov_y_radians: 0.5, aspect: 2.0, near: 0.01 * radius };
    let camera = look_at.camera(size[1]);
    let picture = |haze: f64, at: DVec3| {
        let look = Look { ground: ground.map(|ground| Ground { haze, ..ground }), ..Look::default() };
        let mut foliage = SoftwareRenderer::new(look).unwrap();
        let id = foliage.add_model(&GRASS).unwrap();
        let plant = Instance::new(id, place(at), GRASS.leaves.len() as f32);
        let on_cpu = foliage.draw(camera, &[plant], size).unwrap().image;
        let cutout = foliage.cutout(camera, &[plant], size).unwrap().image;
        if let Some(gpu) = gpu() {
            let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
            let id = foliage.add_model(gpu.device(), gpu.queue(), &GRASS).unwrap();
            foliage.prepare(gpu.device(), gpu.queue(), camera, &[Instance { model: id, ..plant }]).unwrap();
            let on_gpu = Offscreen::new(&gpu, size).unwrap().picture(&foliage).unwrap();
            let (mean, _) = difference(&on_gpu, &on_cpu);
            assert!(mean < 1.5, "{haze} {at}: {mean}");
        }
        let mean = pixels(&cutout, false)
            .iter()
            .fold([0.0; 4], |sum: [f32; 4], pixel| [0, 1, 2, 3].map(|i| sum[i] + pixel[i]));
        [0, 1, 2].map(|i| mean[i] / mean[3])
    };
    let haze = 20.0 * radius;
    let clear = picture(1e9, near);
    // What is added is the same light, the sky's at the horizon.
    let added = [near, far].map(|at| {
        let (kept, hazy) = ((-at.length() / haze).exp() as f32, picture(haze, at));
        [0, 1, 2].map(|i| (hazy[i] - clear[i] * kept) / (1.0 - kept))
    });
    assert!((0..3).all(|i| (added[0][i] - added[1][i]).abs() < 0.06 && added[1][i] > 0.6), "{added:?}");
}
