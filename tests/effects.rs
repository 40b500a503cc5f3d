//! Effects on the GPU: a disabled effect has no buffers, passes or shader code, skipping distant
//! plants is invisible, and the CPU renderer draws the same picture.
//!
//! Without an adapter the tests print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt,
    draw::{Ground, Lighting, ModelId, Prepared, Variant},
    effects::{Contrast, Count, CrownNormals, Effects, Fade, FadeBy, Shadow, Sky, Translucency, Wind, WindShape},
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{Image, SoftwareRenderer},
};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [192, 160];
const SECONDS: f64 = 12.5;

fn birch(leaves: u32) -> FoliageModel {
    let species = Species::embedded("betula-populifolia").unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::balanced() };
    simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn camera(model: &FoliageModel, factor: f64) -> LookAt {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, factor).with_aspect(aspect)
}

struct Stage {
    gpu: GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    model: ModelId,
}

impl Stage {
    fn new(model: &FoliageModel, effects: Effects) -> Option<Self> {
        let gpu = gpu()?;
        let target = Offscreen::new(&gpu, SIZE).unwrap();
        let look = Look { effects, tone: false, ..Look::default() };
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        let model = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        Some(Self { gpu, target, foliage, model })
    }

    fn draw(&mut self, camera: &LookAt, active: f32) -> (Image, Prepared) {
        let frame = Frame::new(&camera.camera(SIZE[1])).at(SECONDS);
        let instance = Instance::new(self.model, DAffine3::IDENTITY, active);
        let prepared = self.foliage.prepare(self.gpu.device(), self.gpu.queue(), frame, &[instance]).unwrap();
        (self.target.picture(&self.foliage).unwrap(), prepared)
    }
}

fn all() -> Effects {
    Effects {
        fade: Some(Fade { by: FadeBy::Alpha, half_width: 0.05, ..Fade::default() }),
        contrast: Some(Contrast::default()),
        crown_normals: Some(CrownNormals::default()),
        wind: Some(Wind { strength: 0.06, ..Wind::default() }),
        translucency: Some(Translucency::default()),
        shadow: Some(Shadow { resolution: 1024, distance: 60.0, lod: 1.0, softness: 1.0 }),
        sky: Some(Sky::default()),
    }
}

/// Draws the model with the same effects on the CPU.
fn painted(model: &FoliageModel, effects: &Effects, camera: &LookAt, active: f32) -> Image {
    let mut foliage = SoftwareRenderer::new(Look { effects: *effects, tone: false, ..Look::default() }).unwrap();
    let id = foliage.add_model(model).unwrap();
    let frame = Frame::new(&camera.camera(SIZE[1])).at(SECONDS);
    foliage.draw(frame, &[Instance::new(id, DAffine3::IDENTITY, active)], SIZE).unwrap().image
}

#[test]
fn each_effect_shows_and_the_cpu_draws_it_as_the_gpu_does() {
    let model = birch(900);
    // Backlit: the camera looks towards the sun.
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let camera = LookAt::framing(&model.sphere(), DVec3::new(-0.5, 0.1, -0.5), 0.8, 1.0).with_aspect(aspect);
    let Some(mut plain) = Stage::new(&model, Effects::default()) else { return };
    let (without, _) = plain.draw(&camera, 300.0);
    for (name, effects) in all().each().chain([("all", all())]) {
        let (with, prepared) = Stage::new(&model, effects).unwrap().draw(&camera, 300.0);
        let by_cpu = painted(&model, &effects, &camera, 300.0);
        if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
            let path = std::path::Path::new(&folder).join(format!("effect-{name}.png"));
            Image::side_by_side(&[without.clone(), with.clone(), by_cpu.clone()], 4).write_png(path).unwrap();
        }
        let (shown, _) = difference(&with, &without);
        let (mean, percentile) = difference(&with, &by_cpu);
        println!("{name}: changes the picture by {shown:.2}; CPU differs by {mean:.2}, 95th percentile {percentile}");
        assert!(shown > 0.1, "{name} changes nothing");
        // The GPU takes 4 samples per pixel and filters between mip levels; the CPU takes 16 and
        // uses the nearest level. The CPU casts no shadows.
        let has_shadow = effects.shadow.is_some();
        assert!(has_shadow || mean < 3.0 && percentile < 48, "{name}: {mean} {percentile}");
        assert!(prepared.effects.named().all(|(_, count)| count.simulated > 0), "{name}: {:?}", prepared.effects);
    }
}

#[test]
fn disabled_effects_have_no_buffers_passes_or_shader_code() {
    let model = birch(300);
    let camera = camera(&model, 1.0);
    let plain = Variant::default();
    let Some(mut none) = Stage::new(&model, Effects::default()) else { return };
    let (_, prepared) = none.draw(&camera, 100.0);
    assert_eq!(prepared.effects.named().count(), 0);
    let found = none.foliage.diagnostics();
    assert!(found.effect_buffers.is_empty() && found.passes.is_empty() && found.effect_bytes == 0, "{found:?}");
    assert_eq!([found.leaf_variants, found.wood_variants], [vec![plain], vec![plain]]);
    let expected = [
        ("fade", vec![], vec![plain, Variant { alpha: true, ..plain }], plain),
        ("contrast", vec!["tones"], vec![Variant { contrast: true, ..plain }], plain),
        ("crown_normals", vec![], vec![plain], plain),
        ("wind", vec!["sways"], vec![Variant { wind: true, ..plain }], Variant { wind: true, ..plain }),
        ("translucency", vec![], vec![plain], plain),
        ("shadow", vec!["shadow map"], vec![plain], plain),
        ("sky", vec![], vec![plain], plain),
    ];
    for ((name, effects), (_, buffers, leaves, wood)) in all().each().zip(expected) {
        let mut stage = Stage::new(&model, effects).unwrap();
        stage.draw(&camera, 100.0);
        let found = stage.foliage.diagnostics();
        assert_eq!(found.effect_buffers, buffers, "{name}");
        let passes = match name {
            "shadow" => vec!["shadow map"],
            "sky" => vec!["landscape"],
            _ => vec![],
        };
        assert_eq!(found.passes, passes, "{name}");
        assert_eq!([found.leaf_variants, found.wood_variants], [leaves, vec![wood]], "{name}");
    }
}

#[test]
fn an_effect_that_changes_nothing_leaves_every_bit() {
    let model = birch(400);
    let camera = camera(&model, 1.0);
    let Some(mut plain) = Stage::new(&model, Effects::default()) else { return };
    let idle = Effects {
        fade: Some(Fade { half_width: 0.0, ..Fade::default() }),
        contrast: Some(Contrast { strength: 0.0 }),
        wind: Some(Wind { strength: 0.0, branches: 0.0, flutter: 0.0, ..Wind::default() }),
        ..Effects::default()
    };
    let mut stage = Stage::new(&model, idle).unwrap();
    for active in [400.0, 120.0, 17.0, 0.0] {
        let ((with, prepared), (without, _)) = (stage.draw(&camera, active), plain.draw(&camera, active));
        assert_eq!(prepared.effects.wind, Some(Count { simulated: 0, skipped: 1 }), "no wind, no simulation");
        // Contrast mixes each colour with the mean; with strength 0 only rounding changes.
        assert!(difference(&with, &without).0 < 0.01, "{active}");
    }
    let still = Effects { contrast: None, ..idle };
    let (with, without) = (Stage::new(&model, still).unwrap().draw(&camera, 120.0).0, plain.draw(&camera, 120.0).0);
    assert_eq!(with, without);
}

#[test]
fn far_plants_stand_still_and_nobody_sees_it() {
    let model = birch(600);
    let effects = Effects { wind: Some(Wind::default()), ..Effects::default() };
    let Some(gpu) = gpu() else { return };
    let look = Look { effects, ..Look::default() };
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
    let radius = model.sphere().radius;
    // Plants receding into the distance.
    let plants: Vec<Instance> = (0..60)
        .map(|i| {
            let place = DVec3::new(f64::from(i % 5) - 2.0, 0.0, -f64::from(i)) * radius * 1.5;
            Instance::new(id, DAffine3::from_translation(place), 300.0)
        })
        .collect();
    let mut simulated = Vec::new();
    for away in [4.0, 50.0, 70.0, 100.0, 200.0] {
        let eye = model.sphere().center() + DVec3::new(0.0, 0.5, away) * radius;
        let camera = LookAt { eye, target: model.sphere().center(), ..camera(&model, 1.0) };
        let frame = Frame::new(&camera.camera(SIZE[1])).at(SECONDS);
        let prepared = foliage.prepare(gpu.device(), gpu.queue(), frame, &plants).unwrap();
        let Count { simulated: moved, skipped } = prepared.effects.wind.unwrap();
        assert_eq!(moved + skipped, 60);
        simulated.push(moved);
    }
    println!("animated plants, from near to far: {simulated:?}");
    assert!(simulated[0] == 60 && simulated[4] == 0 && simulated.windows(2).all(|pair| pair[0] > pair[1]));

    // The frame height decides which plants move: a frame that claims to be taller simulates all.
    let target = Offscreen::new(&gpu, SIZE).unwrap();
    let eye = model.sphere().center() + DVec3::new(0.0, 0.5, 70.0) * radius;
    let camera = LookAt { eye, target: model.sphere().center(), ..camera(&model, 1.0) };
    let mut draw = |height_px| {
        let frame = Frame::new(&camera.camera(height_px)).at(SECONDS);
        let prepared = foliage.prepare(gpu.device(), gpu.queue(), frame, &plants).unwrap();
        (target.picture(&foliage).unwrap(), prepared.effects.wind.unwrap())
    };
    let ((some, skipping), (every, whole)) = (draw(SIZE[1]), draw(1_000_000));
    assert!(skipping.skipped > 10 && whole.skipped == 0, "{skipping:?} {whole:?}");
    let (mean, percentile) = difference(&some, &every);
    println!("skipping {} of 60 plants changes the picture by {mean:.4} of 255", skipping.skipped);
    // The only changes are edges that move within their pixel.
    assert!(mean < 0.1 && percentile <= 2, "{mean} {percentile}");
}

/// Mean brightness of the pixels in `rows`, counted from the top.
fn brightness(image: &Image, rows: std::ops::Range<u32>) -> f64 {
    let pixels: Vec<[u8; 4]> =
        rows.flat_map(|y| (0..image.width).map(move |x| (x, y))).filter_map(|(x, y)| image.pixel(x, y)).collect();
    let sum: u64 = pixels.iter().map(|[r, g, b, _]| u64::from(*r) + u64::from(*g) + u64::from(*b)).sum();
    sum as f64 / (3 * pixels.len()) as f64
}

#[test]
fn shadows_fall_away_from_the_sun_on_the_ground_and_on_other_plants() {
    let model = birch(900);
    let Some(gpu) = gpu() else { return };
    let target = Offscreen::new(&gpu, SIZE).unwrap();
    let height = f64::from(model.aabb().size().y);
    let foot = DVec3::new(0.0, f64::from(model.aabb().min[1]), 0.0);
    let ground = Ground { color: [0.5; 3], height: foot.y, haze: 1e6 };
    // Looking straight down at the tree, with the sun 45 degrees above the horizon towards -X.
    let camera = LookAt {
        eye: foot + DVec3::new(0.0, 3.0 * height, 0.01),
        target: foot,
        up: DVec3::NEG_Z,
        fov_y_radians: 0.9,
        aspect: f64::from(SIZE[0]) / f64::from(SIZE[1]),
        near: 0.01,
    };
    let towards_sun = Vec3::new(-1.0, 1.0, 0.0);
    let draw = |shadow: Option<Shadow>| {
        let effects = Effects { shadow, ..Effects::default() };
        let lighting = Lighting { towards_sun, ..Lighting::default() };
        let look = Look { effects, ground: Some(ground), lighting, ..Look::default() };
        let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
        let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
        let plant = Instance::new(id, DAffine3::IDENTITY, 900.0);
        let behind = Instance { world_from_plant: DAffine3::from_translation(DVec3::Z * 40.0 * height), ..plant };
        let frame = Frame::new(&camera.camera(SIZE[1]));
        let prepared = foliage.prepare_with_casters(gpu.device(), gpu.queue(), frame, &[plant], &[plant, behind]);
        (target.picture(&foliage).unwrap(), prepared.unwrap().effects.shadow)
    };
    let distance = 5.0 * height as f32;
    let (lit, none) = draw(None);
    let (shaded, count) = draw(Some(Shadow { distance, lod: 1.0, ..Shadow::default() }));
    if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
        let path = std::path::Path::new(&folder).join("shadow-from-above.png");
        Image::side_by_side(&[lit.clone(), shaded.clone()], 4).write_png(path).unwrap();
    }
    assert_eq!((none, count), (None, Some(Count { simulated: 1, skipped: 1 })));
    // The sun is on the left, so the shadow falls to the right of the centre.
    let side = |image: &Image, columns: std::ops::Range<u32>| {
        let mut part = Image::filled(columns.end - columns.start, SIZE[1], [0; 4]);
        for y in 0..SIZE[1] {
            for x in columns.clone() {
                part.paste(&Image::filled(1, 1, image.pixel(x, y).unwrap()), x - columns.start, y);
            }
        }
        brightness(&part, 0..SIZE[1])
    };
    let half = SIZE[0] / 2;
    let [left, right] = [0..half - 20, half + 20..SIZE[0]].map(|part| side(&lit, part.clone()) - side(&shaded, part));
    println!("darker by {right:.2} away from the sun, by {left:.2} towards it");
    assert!(right > 2.0 && right > 8.0 * left.abs(), "{left} {right}");
}

#[test]
fn leaves_stay_on_their_twigs() {
    let model = birch(2000);
    let corners = || model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
    let shape = WindShape::new(&foliage_lod::bounds::Aabb::of_points(corners()));
    let wind = Wind { strength: 0.1, branches: 0.02, gustiness: 1.0, ..Wind::default() };
    let wood: Vec<Vec3> = model.wood.vertices.iter().map(|vertex| vertex.position.into()).collect();
    let triangles: Vec<[Vec3; 3]> =
        model.wood.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| wood[i as usize])).collect();
    let mut worst = 0.0_f32;
    for seconds in [0.0, 3.3, 17.0, 61.0] {
        let moment = wind.at(seconds);
        let sway = moment.sway(&shape, &DAffine3::IDENTITY);
        for leaf in model.leaves.iter().step_by(9) {
            let pivot = Vec3::from(leaf.pivot);
            let nearest = triangles.iter().map(|&corners| (corners, nearest_weights(pivot, corners)));
            let point = |corners: [Vec3; 3], weights: [f32; 3]| (0..3).map(|i| corners[i] * weights[i]).sum::<Vec3>();
            let apart = |(corners, weights): &([Vec3; 3], [f32; 3])| pivot.distance(point(*corners, *weights));
            let (corners, weights) = nearest.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap();
            let moved = |point: Vec3| point + sway.offset(point);
            // The twig's triangle stays flat, so a point on it moves with its corners.
            let stretched = moved(pivot).distance(point(corners.map(moved), weights)) - apart(&(corners, weights));
            worst = worst.max(stretched.abs() / shape.height);
        }
    }
    println!("a leaf and its twig separate by at most {worst:.1e} of the height");
    assert!(worst < 1e-4, "{worst}");
}

/// Barycentric weights of the triangle's point nearest to `p`: the foot of the perpendicular, or
/// the nearest point on an edge.
fn nearest_weights(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f32; 3] {
    let on_edge = |from: Vec3, to: Vec3| {
        let along = to - from;
        ((p - from).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared().max(f32::MIN_POSITIVE);
    let v = (p - a).cross(c - a).dot(normal) / area;
    let w = (b - a).cross(p - a).dot(normal) / area;
    if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
        return [1.0 - v - w, v, w];
    }
    let [ab, bc, ca] = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let edges = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let apart = |weights: &[f32; 3]| p.distance(a * weights[0] + b * weights[1] + c * weights[2]);
    edges.into_iter().min_by(|x, y| apart(x).total_cmp(&apart(y))).unwrap()
}
