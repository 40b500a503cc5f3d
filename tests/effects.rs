//! Effects on the GPU: what is not called for does not exist, what is skipped cannot be seen, and the CPU draws the same.
//!
//! Without an adapter the tests say so and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    effects::{Contrast, Count, CrownNormals, Effects, Fade, FadeBy, Translucency, Wind, wind::Shape},
    grow::{GrowOptions, Species, grow},
    model::{FoliageModel, Timeline},
    render::{
        camera::Camera,
        device::GpuDevice,
        foliage::{FoliageRenderer, Frame, Instance, ModelId, Prepared},
        image::Image,
        look::{Look, Variant},
        offscreen::{Offscreen, TARGET},
        software::{DrawList, DrawOptions, Drawn, Painter, Placed, Tone, mean_leaf_color},
    },
    simplify::{Quiet, SimplifyOptions, raster::CpuFragments, simplify},
    stochastic::contrast,
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

fn camera(model: &FoliageModel, factor: f64) -> Camera {
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    Camera::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.8, factor).with_aspect(aspect)
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
        let look = Look { effects, ..Look::default() };
        let mut foliage = FoliageRenderer::with_look(gpu.device(), TARGET, look);
        let model = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
        Some(Self { gpu, target, foliage, model })
    }

    fn draw(&mut self, camera: &Camera, active: f32) -> (Image, Prepared) {
        let frame = Frame::new(camera, SIZE[1]).at(SECONDS);
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
    }
}

/// Each effect alone.
fn each() -> [(&'static str, Effects); 5] {
    let (all, none) = (all(), Effects::default());
    [
        ("fade", Effects { fade: all.fade, ..none }),
        ("contrast", Effects { contrast: all.contrast, ..none }),
        ("crown_normals", Effects { crown_normals: all.crown_normals, ..none }),
        ("wind", Effects { wind: all.wind, ..none }),
        ("translucency", Effects { translucency: all.translucency, ..none }),
    ]
}

/// What the CPU makes of the same effects.
fn painted(model: &FoliageModel, effects: &Effects, camera: &Camera, active: f32) -> Image {
    let look = Look { effects: *effects, ..Look::default() };
    let lighting = look.lighting.with_effects(effects);
    let leaves = model.leaves.len() as u32;
    let fade = effects.fade.unwrap_or(Fade { half_width: 0.0, ..Fade::default() });
    let transition = fade.transition(f64::from(active), leaves);
    let timeline = Timeline::new(model);
    let list = DrawList::of_drawn(model, &timeline, &Drawn { transition, by: fade.by, leaf_scale: 1.0 });
    let tone = effects.contrast.map(|_| Tone {
        kept: contrast::kept(f64::from(active) / f64::from(leaves)) as f32,
        mean: mean_leaf_color(model, &lighting).unwrap(),
    });
    let corners = model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
    let shape = Shape::new(&foliage_lod::bounds::Aabb::of_points(corners));
    let sway = effects.wind.map(|wind| {
        let moment = wind.at(SECONDS);
        (moment.sway(&shape, &DAffine3::IDENTITY), moment.phases())
    });
    let placed = Placed { tone, sway, ..Placed::new(&list, DAffine3::IDENTITY) };
    let options = DrawOptions { lighting, ..DrawOptions::default() };
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    painter.draw_placed(&[placed], camera, SIZE, &options).unwrap()
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
fn each_effect_shows_and_the_cpu_draws_it_as_the_gpu_does() {
    let model = birch(900);
    // Against the sun.
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let camera = Camera::framing(&model.sphere(), DVec3::new(-0.5, 0.1, -0.5), 0.8, 1.0).with_aspect(aspect);
    let Some(mut plain) = Stage::new(&model, Effects::default()) else { return };
    let (without, _) = plain.draw(&camera, 300.0);
    for (name, effects) in each().into_iter().chain([("all", all())]) {
        let (with, prepared) = Stage::new(&model, effects).unwrap().draw(&camera, 300.0);
        let by_cpu = painted(&model, &effects, &camera, 300.0);
        if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
            let path = std::path::Path::new(&folder).join(format!("effect-{name}.png"));
            Image::side_by_side(&[without.clone(), with.clone(), by_cpu.clone()], 4).write_png(path).unwrap();
        }
        let (shown, _) = difference(&with, &without);
        let (mean, percentile) = difference(&with, &by_cpu);
        println!("{name}: shows {shown:.2}, CPU differs by {mean:.2}, 95th percentile {percentile}");
        assert!(shown > 0.1, "{name} does nothing");
        // Four samples against sixteen, filtered levels against nearest ones.
        assert!(mean < 3.0 && percentile < 48, "{name}: {mean} {percentile}");
        assert!(prepared.effects.named().all(|(_, count)| count.simulated > 0), "{name}: {:?}", prepared.effects);
    }
}

#[test]
fn what_is_not_called_for_does_not_exist() {
    let model = birch(300);
    let camera = camera(&model, 1.0);
    let plain = Variant::default();
    let Some(mut none) = Stage::new(&model, Effects::default()) else { return };
    let (_, prepared) = none.draw(&camera, 100.0);
    assert_eq!(prepared.effects.named().count(), 0);
    assert_eq!((none.foliage.effect_buffers(), none.foliage.compiled()), (vec![], [vec![plain], vec![plain]]));
    let expected = [
        ("fade", vec![], vec![plain, Variant { alpha: true, ..plain }], plain),
        ("contrast", vec!["tones"], vec![Variant { contrast: true, ..plain }], plain),
        ("crown_normals", vec![], vec![plain], plain),
        ("wind", vec!["sways", "wind"], vec![Variant { wind: true, ..plain }], Variant { wind: true, ..plain }),
        ("translucency", vec![], vec![plain], plain),
    ];
    for ((name, effects), (_, buffers, leaves, wood)) in each().into_iter().zip(expected) {
        let mut stage = Stage::new(&model, effects).unwrap();
        stage.draw(&camera, 100.0);
        assert_eq!(stage.foliage.effect_buffers(), buffers, "{name}");
        assert_eq!(stage.foliage.compiled(), [leaves, vec![wood]], "{name}");
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
        // Contrast mixes each colour with the mean; by nothing, but not to the last bit.
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
    let mut foliage = FoliageRenderer::with_look(gpu.device(), TARGET, look);
    let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
    let radius = model.sphere().radius;
    // A row of plants into the distance.
    let plants: Vec<Instance> = (0..60)
        .map(|i| {
            let place = DVec3::new(f64::from(i % 5) - 2.0, 0.0, -f64::from(i)) * radius * 1.5;
            Instance::new(id, DAffine3::from_translation(place), 300.0)
        })
        .collect();
    let mut simulated = Vec::new();
    for away in [4.0, 50.0, 70.0, 100.0, 200.0] {
        let eye = model.sphere().center() + DVec3::new(0.0, 0.5, away) * radius;
        let camera = Camera { eye, target: model.sphere().center(), ..camera(&model, 1.0) };
        let frame = Frame::new(&camera, SIZE[1]).at(SECONDS);
        let prepared = foliage.prepare(gpu.device(), gpu.queue(), frame, &plants).unwrap();
        let Count { simulated: moved, skipped } = prepared.effects.wind.unwrap();
        assert_eq!(moved + skipped, 60);
        simulated.push(moved);
    }
    println!("plants that move, ever farther away: {simulated:?}");
    assert!(simulated[0] == 60 && simulated[4] == 0 && simulated.windows(2).all(|pair| pair[0] > pair[1]));

    // Rows decide what moves: a frame that claims to be taller simulates everything.
    let target = Offscreen::new(&gpu, SIZE).unwrap();
    let eye = model.sphere().center() + DVec3::new(0.0, 0.5, 70.0) * radius;
    let camera = Camera { eye, target: model.sphere().center(), ..camera(&model, 1.0) };
    let mut draw = |height_px| {
        let frame = Frame::new(&camera, height_px).at(SECONDS);
        let prepared = foliage.prepare(gpu.device(), gpu.queue(), frame, &plants).unwrap();
        (target.picture(&foliage).unwrap(), prepared.effects.wind.unwrap())
    };
    let ((some, skipping), (every, whole)) = (draw(SIZE[1]), draw(1_000_000));
    assert!(skipping.skipped > 10 && whole.skipped == 0, "{skipping:?} {whole:?}");
    let (mean, _) = difference(&some, &every);
    println!("skipping {} of 60 plants changes the picture by {mean:.4} of 255", skipping.skipped);
    assert!(mean < 1.0, "{mean}");
}

#[test]
fn leaves_stay_on_their_twigs() {
    let model = birch(2000);
    let corners = || model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
    let shape = Shape::new(&foliage_lod::bounds::Aabb::of_points(corners()));
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
            let moved = |point: Vec3| point + sway.offset(point, moment.phases());
            // The twig's triangle stays flat: its point moves with its corners.
            let stretched = moved(pivot).distance(point(corners.map(moved), weights)) - apart(&(corners, weights));
            worst = worst.max(stretched.abs() / shape.height);
        }
    }
    println!("a leaf and its twig part by at most {worst:.1e} of the height");
    assert!(worst < 1e-4, "{worst}");
}

/// Weights of a triangle's corners at its point nearest to `p`: the foot of the perpendicular, or the best of the edges.
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
