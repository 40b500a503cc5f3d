//! Wood drawn by its order: the same on the GPU and on the CPU, at any size, with every leaf on it.
//!
//! Without an adapter the comparisons print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they
//! fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt,
    draw::{self, Prepared, Upload},
    effects::{Effects, Shadow, Wind},
    extract::{Blend, LodPolicy, REFERENCE_FOV_Y, Sight, fewest_leaves, leaf_count},
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    material::Material,
    plant::WoodPart,
    software::{Image, SoftwareRenderer},
    stochastic::shuffled,
    wood::{WoodLevels, nearest_stems, stems, vanishing},
};
use glam::{DAffine3, DVec3, Vec3};

fn model(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let mut model = shuffled(&plant, 1).unwrap();
    model.quantize();
    model.order_wood();
    model
}

/// A camera in whose square picture the plant's sphere fills all but an eighth.
fn camera(model: &FoliageModel) -> LookAt {
    LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.5, 1.0)
}

/// Draws a plant on the GPU.
fn drawn(gpu: &GpuDevice, model: &FoliageModel, look: Look, active: f32, side: u32) -> (Image, Prepared) {
    let target = Offscreen::new(gpu, [side; 2]).unwrap();
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
    let plant = Instance::new(id, DAffine3::IDENTITY, active);
    let prepared = foliage.prepare(gpu.device(), gpu.queue(), camera(model).camera(side), &[plant]).unwrap();
    assert_eq!(foliage.diagnostics().model_bytes, draw::gpu_bytes(model));
    (target.picture(&foliage).unwrap(), prepared)
}

/// Draws a plant on the CPU.
fn painted(model: &FoliageModel, look: Look, active: f32, side: u32) -> (Image, Prepared) {
    let mut painter = SoftwareRenderer::new(look).unwrap();
    let id = painter.add_model(model).unwrap();
    let plant = Instance::new(id, DAffine3::IDENTITY, active);
    let drawing = painter.draw(camera(model).camera(side), &[plant], [side; 2]).unwrap();
    (drawing.image, drawing.prepared)
}

#[test]
fn the_gpu_draws_the_wood_that_the_cpu_draws() {
    let Some(gpu) = gpu() else { return };
    for (species, leaves) in [("english-oak", 900), ("betula-populifolia", 700)] {
        let model = model(species, leaves);
        let all = model.wood.triangles() as u64;
        let mut before = all + 1;
        for side in [256, 96, 40] {
            for active in [0.0, leaves as f32] {
                // The GPU takes 4 samples per pixel and the CPU 16, which twigs show: all wood does
                // too.
                let whole = Look { wood_error_px: 0.0, ..Look::default() };
                let in_full =
                    difference(&drawn(&gpu, &model, whole, active, side).0, &painted(&model, whole, active, side).0);
                let (drawn, of_gpu) = drawn(&gpu, &model, Look::default(), active, side);
                let (painted, of_cpu) = painted(&model, Look::default(), active, side);
                let (mean, percentile) = difference(&drawn, &painted);
                let triangles = of_cpu.wood_triangles;
                let told =
                    format!("{species}, {active} leaves at {side}: {mean:.2} {percentile}, in full {in_full:.2?}");
                println!("{told}, {triangles} of {all} triangles");
                if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
                    let path = std::path::Path::new(&folder).join(format!("{species}-{active}-{side}.png"));
                    Image::side_by_side(&[drawn, painted], 4).write_png(path).unwrap();
                }
                assert_eq!(of_gpu.wood_triangles, triangles);
                assert!(mean < f64::max(3.0, in_full.0 + 0.3) && percentile < 40.max(in_full.1 + 6), "{told}");
                if active == 0.0 {
                    assert!(triangles < before, "{triangles} at {side}, {before} before");
                    before = triangles;
                }
            }
        }
        assert!(before * 20 < all, "{species}: {before} of {all}");
    }
}

#[test]
fn wood_without_error_is_drawn_in_full_and_a_model_without_an_order_as_before() {
    let Some(gpu) = gpu() else { return };
    let model = model("betula-populifolia", 300);
    let plain = FoliageModel { wood_order: None, ..model.clone() };
    let whole = Look { wood_error_px: 0.0, ..Look::default() };
    let [(with, counts), (without, _)] = [&model, &plain].map(|model| drawn(&gpu, model, whole, 300.0, 160));
    assert_eq!(counts.wood_triangles, model.wood.triangles() as u64);
    assert!(difference(&with, &without).0 < 0.1);
    let [(with, _), (without, _)] = [&model, &plain].map(|model| painted(model, whole, 300.0, 160));
    assert!(difference(&with, &without).0 < 0.1);
    assert_eq!(painted(&plain, Look::default(), 0.0, 40).1.wood_triangles, model.wood.triangles() as u64);
}

#[test]
fn wood_of_two_materials_slides_in_each() {
    let Some(gpu) = gpu() else { return };
    let mut model = model("betula-populifolia", 200);
    let last = model.materials.len() as u32;
    let red =
        Material { base_color: [1.0, 0.1, 0.1, 1.0], ..model.materials[model.wood.parts[0].material as usize].clone() };
    model.materials.push(red);
    // Both materials share vertices.
    let [all, material] = [model.wood.indices.len() as u32, model.wood.parts[0].material];
    let middle = all / 6 * 3;
    model.wood.parts =
        vec![WoodPart { indices: [0, middle], material }, WoodPart { indices: [middle, all], material: last }];
    model.order_wood();
    let upload = Upload::sliding(&model);
    assert_eq!(upload.wood_slides.len(), upload.wood_vertices.len());
    for (vertex, slide) in upload.wood_vertices.iter().zip(&upload.wood_slides) {
        assert_eq!(vertex.material, upload.wood_vertices[slide.parent as usize].material);
    }
    let look = Look { wood_error_px: 4.0, ..Look::default() };
    let (drawn, painted) = (drawn(&gpu, &model, look, 0.0, 192).0, painted(&model, look, 0.0, 192).0);
    let (mean, percentile) = difference(&drawn, &painted);
    println!("{mean:.2}, {percentile}");
    assert!(mean < 3.0 && percentile < 40, "{mean} {percentile}");
}

#[test]
fn wood_in_the_wind_and_its_shadow_are_drawn_by_its_order() {
    let Some(gpu) = gpu() else { return };
    let model = model("english-oak", 300);
    let effects = Effects { wind: Some(Wind::default()), shadow: Some(Shadow::default()), ..Effects::default() };
    for effects in [Effects { shadow: None, ..effects }, effects] {
        let look = Look { effects, ..Look::default() };
        let [drawn, painted] = [drawn(&gpu, &model, look, 0.0, 128), painted(&model, look, 0.0, 128)];
        let (mean, percentile) = difference(&drawn.0, &painted.0);
        println!("{mean:.2}, {percentile}");
        // The CPU casts no shadows.
        assert!(mean < if effects.shadow.is_some() { 8.0 } else { 4.0 }, "{mean} {percentile}");
    }
}

#[test]
fn an_order_survives_its_file_and_quantized_wood_stays_in_one_piece() {
    for species in ["english-oak", "carya-illinoinensis"] {
        let species = Species::embedded(species).unwrap();
        let plant = grow(&species, &GrowOptions { leaves: Some(200), ..GrowOptions::default() }).unwrap();
        let exact = shuffled(&plant, 1).unwrap();
        let pieces = |model: &FoliageModel| {
            let mut model = model.clone();
            model.order_wood();
            let order = model.wood_order.clone().unwrap();
            (order.stems.len(), vanishing(&model.wood, &order).iter().filter(|&&end| end == 0.0).count())
        };
        let mut model = exact.clone();
        model.quantize();
        let ((exact_stems, _), (stems, _)) = (pieces(&exact), pieces(&model));
        println!("{exact_stems} stems, {stems} quantized");
        assert!(stems.abs_diff(exact_stems) * 50 <= exact_stems, "{stems} stems, {exact_stems} before");
        let without = model.to_bytes().unwrap();
        model.order_wood();
        let with = model.to_bytes().unwrap();
        println!("{} bytes, {} with an order", without.len(), with.len());
        let again = FoliageModel::from_bytes(&with).unwrap();
        assert!(again == model && again.to_bytes().unwrap() == with);
        assert!(FoliageModel { wood_order: None, ..again }.to_bytes().unwrap() == without);
    }
}

/// From 3 to 60 radii, the wood alone changes from frame to frame at most a tenth more than if all
/// of it were drawn; where it is smaller than 40 pixels, at most a fourth more.
#[test]
fn wood_that_loses_detail_changes_no_more_than_all_of_it() {
    let model = model("english-oak", 300);
    let frames = 60;
    let greatest = |wood_error_px: f32| {
        let mut painter = SoftwareRenderer::new(Look { wood_error_px, ..Look::default() }).unwrap();
        let id = painter.add_model(&model).unwrap();
        let plant = Instance::new(id, DAffine3::IDENTITY, 0.0);
        let picture = |frame: i32| {
            // Framed by a factor of 1, the plant is four radii away.
            let factor = 0.75 * 20_f64.powf(f64::from(frame) / f64::from(frames - 1));
            let camera = LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.5, factor);
            painter.draw(camera.camera(160), &[plant], [160; 2]).unwrap().image
        };
        let change = |a: &Image, b: &Image| {
            let squares = a.rgba.iter().zip(&b.rgba).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
            (squares.sum::<f64>() / a.rgba.len() as f64).sqrt()
        };
        let pictures: Vec<Image> = (0..frames).map(picture).collect();
        let changes: Vec<f64> = pictures.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
        // The whole way, and its farther half, where the plant is small.
        [&changes[..], &changes[changes.len() / 2..]].map(|part| part.iter().copied().fold(0.0, f64::max))
    };
    let (drawn, full) = (greatest(0.5), greatest(0.0));
    println!("{drawn:.2?}, in full {full:.2?}");
    assert!(drawn[0] <= 1.1 * full[0] && drawn[1] <= 1.25 * full[1], "{drawn:?}, in full {full:?}");
}

/// At half a pixel, wood alone covers within 2 % of all wood's area, and twigs drawn for others
/// differ from its silhouette by up to 32 %. Of plants with the leaves that the default policy
/// draws, enlarged to cover as much as all, silhouettes differ by less than 1 %.
#[test]
fn silhouettes_of_plants_hardly_differ_if_their_wood_loses_detail() {
    let model = model("english-oak", 20_146);
    let plain = FoliageModel { wood_order: None, ..model.clone() };
    let sphere = model.sphere();
    let mut painter = SoftwareRenderer::new(Look::default()).unwrap();
    let [all, ordered] = [&plain, &model].map(|model| painter.add_model(model).unwrap());
    for (side, most_triangles, most_xor) in [(256, 7_600, 0.17), (128, 3_450, 0.24), (64, 1_400, 0.32)] {
        // A screen of 1080 rows.
        let slope = f64::from(REFERENCE_FOV_Y / 2.0).tan() * f64::from(side) / 1080.0;
        let distance = (sphere.radius / slope.atan().sin()) as f32;
        let sight = Sight { distance, radius: sphere.radius as f32, fov_y: REFERENCE_FOV_Y, height_px: 1080.0 };
        let all_leaves = model.leaves.len() as u32;
        let leaves = leaf_count(Blend::default().lod(&sight), all_leaves, fewest_leaves(all_leaves));
        let leaf_scale = (all_leaves as f32 / leaves as f32).sqrt();
        let differing = |active: u32| {
            let (mut covered, mut area, mut xor, mut triangles) = (0.0, 0.0, 0.0, 0);
            for view in 0..4 {
                let turn = 0.3 + f64::from(view);
                let direction = DVec3::new(turn.sin(), 0.2 * f64::from(view), turn.cos());
                let camera = LookAt::framing(&sphere, direction, 0.1, 1.0).camera(side);
                let [full, drawn] = [all, ordered].map(|id| {
                    let plant = Instance { leaf_scale, ..Instance::new(id, DAffine3::IDENTITY, active as f32) };
                    painter.cutout(camera, &[plant], [side; 2]).unwrap()
                });
                let alphas = full.image.rgba.iter().zip(&drawn.image.rgba).skip(3).step_by(4);
                for (full, drawn) in alphas.map(|(a, b)| (f64::from(*a), f64::from(*b))) {
                    area += full;
                    covered += drawn;
                    xor += (full - drawn).abs();
                }
                triangles = drawn.prepared.wood_triangles;
            }
            (covered / area - 1.0, xor / area, triangles)
        };
        let [alone, with_leaves] = [0, leaves].map(differing);
        println!("{side}: alone {alone:.4?}, with {leaves} leaves {with_leaves:.4?}");
        assert!(alone.2 <= most_triangles, "{} triangles at {side}", alone.2);
        assert!(alone.0.abs() < 0.02 && alone.1 < most_xor, "{alone:?} at {side}");
        assert!(with_leaves.1 < 0.01, "{with_leaves:?} at {side}");
    }
}

/// Distance of a point from the nearest of some triangles, each as thick as twice the number beside
/// it.
fn from_triangles(point: Vec3, triangles: &[([Vec3; 3], f32)]) -> f32 {
    let from_segment = |a: Vec3, b: Vec3| {
        let along = b - a;
        let share = ((point - a).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        point.distance_squared(a + along * share)
    };
    let distance = |&([a, b, c], half): &([Vec3; 3], f32)| {
        let normal = (b - a).cross(c - a);
        let is_inside = |from: Vec3, to: Vec3| (to - from).cross(point - from).dot(normal) >= 0.0;
        if normal.length_squared() > 0.0 && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
            let across = (point - a).dot(normal);
            return across.abs() / normal.length() - half;
        }
        from_segment(a, b).min(from_segment(b, c)).min(from_segment(c, a)).sqrt() - half
    };
    triangles.iter().map(distance).fold(f32::INFINITY, f32::min).max(0.0)
}

/// A leaf whose stem is at least half a pixel wide is at most a pixel farther from the wood that is
/// drawn than from all wood, at any size and count.
#[test]
fn no_leaf_hangs_in_the_air() {
    for (species, leaves) in [("english-oak", 1500), ("betula-populifolia", 1500)] {
        let model = model(species, leaves);
        let order = model.wood_order.as_ref().unwrap();
        let levels = WoodLevels::with_ribbons(&model.wood, order);
        let widths: Vec<f32> = stems(&model.wood, order).iter().map(|stem| stem.width).collect();
        let pivots = || model.leaves.iter().map(|leaf| leaf.pivot);
        let nearest = nearest_stems(&model.wood, order, pivots());
        let diameter = 2.0 * model.sphere().radius as f32;
        // With half of the width of ribbons, whose triangles are still on the centre line.
        let triangles = |error: f32| -> Vec<([Vec3; 3], f32)> {
            let level = levels.at(error);
            let corner = |index: u32| Vec3::from(level.vertices[index as usize].position);
            let half = |index: u32| level.across[index as usize].length();
            let drawn = level.triangles.iter().map(|(corners, _)| corners);
            drawn.map(|of| (of.map(corner), of.map(half).into_iter().fold(0.0, f32::max))).collect()
        };
        let full = triangles(0.0);
        let in_full: Vec<f32> = pivots().map(|pivot| from_triangles(pivot.into(), &full)).collect();
        let mut seen = 0;
        for side_px in [2048.0, 1024.0, 512.0, 256.0, 96.0, 40.0] {
            let pixel = diameter / side_px;
            let drawn = triangles(0.5 * pixel);
            let is_seen = |leaf: usize| nearest[leaf].is_some_and(|stem| widths[stem as usize] >= 0.5 * pixel);
            let gap = |leaf: usize| (from_triangles(model.leaves[leaf].pivot.into(), &drawn) - in_full[leaf]) / pixel;
            // Drawn leaves are a prefix: one count stands for all below it.
            let gaps: Vec<(usize, f32)> =
                (0..model.leaves.len()).filter(|&leaf| is_seen(leaf)).map(|leaf| (leaf, gap(leaf))).collect();
            let worst = gaps.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
            let off = gaps.iter().filter(|gap| gap.1 > 1.0).count();
            println!("{species} at {side_px}: {off} of {} off, at most {worst:?}", gaps.len());
            assert!(off == 0, "{species} at {side_px}: {off} of {} leaves, {worst:?}", gaps.len());
            seen += gaps.len();
        }
        assert!(seen > 200, "{species}: {seen} leaves checked");
    }
}
