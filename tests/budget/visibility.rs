//! What shows of plants behind others, against rays.

use super::{forest, oracle::Random};
use foliage_lod::{
    Camera, FoliageModel, Grove, Instance, Look, LookAt, Plant,
    extract::Blend,
    grow::{GrowOptions, Species, grow},
    leaf::Vertex,
    model::{Prune, Recipe},
    scene::{
        Kind, Placement, SharedBudget,
        budget::Rule,
        visibility::{Crown, CrownShape, FRAMES, Parts, ROWS, Visibility},
    },
    software::{Background, DrawOptions, SoftwareRenderer, draw_plant},
};
use glam::{DAffine3, DVec3, Vec3};

pub fn looking(eye: DVec3, target: DVec3, fov: f64) -> Camera {
    let look = LookAt { eye, target, up: DVec3::Y, fov_y_radians: fov.to_radians(), aspect: 1.5, near: 0.1 };
    look.camera(1080)
}

/// Crowns at random before a camera at the origin.
fn crowns(random: &mut Random, count: u32) -> Vec<Crown<'static>> {
    let mut unit = || f64::from(random.unit());
    (0..count)
        .map(|instance| Crown {
            instance,
            center: DVec3::new(60.0 * unit() - 30.0, 12.0 * unit() - 4.0, -8.0 - 80.0 * unit()),
            half: [1.0 + 2.0 * unit(), 1.0 + 4.0 * unit()],
            opacity: 0.9 * unit() as f32,
            parts: Parts::default(),
        })
        .collect()
}

/// What shows of a crown along rays through its outline, seen level, of those in the picture.
fn along_rays(camera: &Camera, crowns: &[Crown<'_>], of: &Crown<'_>) -> f64 {
    let place = |crown: &Crown| {
        let clip = camera.clip_from_world * crown.center.extend(1.0);
        let row = camera.clip_from_world.row(1).truncate().length();
        let [wide, high] = crown.half.map(|half| half * row / clip.w);
        ([clip.x / clip.w * 1.5, clip.y / clip.w], [wide, high])
    };
    let nearer: Vec<&Crown> = crowns.iter().filter(|other| other.center.length() < of.center.length()).collect();
    let (at, half) = place(of);
    let (mut sum, mut count) = (0.0, 0);
    for step in 0..4096 {
        let [x, y] = [step % 64, step / 64].map(|i| (f64::from(i) + 0.5) / 32.0 - 1.0);
        let ray = [at[0] + x * half[0], at[1] + y * half[1]];
        if x * x + y * y > 1.0 || ray[0].abs() > 1.5 || ray[1].abs() > 1.0 {
            continue;
        }
        let passes = |other: &&Crown| {
            let (at, half) = place(other);
            let from = [0, 1].map(|i| (ray[i] - at[i]) / half[i]);
            if from[0] * from[0] + from[1] * from[1] <= 1.0 { 1.0 - f64::from(other.opacity) } else { 1.0 }
        };
        sum += nearer.iter().map(passes).product::<f64>();
        count += 1;
    }
    // Of those that are mostly beside the picture, few pixels are seen.
    if count > 2000 { sum / f64::from(count) } else { f64::NAN }
}

#[test]
fn what_shows_of_crowns_is_what_rays_pass() {
    let camera = looking(DVec3::ZERO, DVec3::NEG_Z, 50.0);
    let mut random = Random(3);
    let (mut checked, mut worst) = (0, 0.0_f64);
    for _ in 0..20 {
        let crowns = crowns(&mut random, 60);
        let mut visibility = Visibility::new();
        visibility.update(&camera, crowns.iter().copied(), None);
        for crown in &crowns {
            let rays = along_rays(&camera, &crowns, crown);
            let size_px = crown.half[0] / crown.center.length() / 25_f64.to_radians().tan() * f64::from(ROWS);
            if size_px < 8.0 || !rays.is_finite() {
                continue;
            }
            // Weights are rounded down to eighths of an octave, and no less than 1/256.
            let shown = f64::from(visibility.weight(crown.instance));
            let off = (shown.log2() - rays.max(1.0 / 256.0).log2()).abs() - 0.125;
            worst = worst.max(off.min((shown - rays).abs() - 0.09 * rays));
            checked += 1;
        }
    }
    println!("{checked} crowns, at most {worst:.3} off");
    assert!(checked > 500 && worst < 0.05, "{checked} crowns, at most {worst} off");
}

#[test]
fn weights_depend_neither_on_the_order_of_the_plants_nor_on_odd_ones() {
    let mut random = Random(5);
    let mut crowns = crowns(&mut random, 200);
    let weights = |crowns: &[Crown<'_>], camera: &Camera| -> Vec<f32> {
        let mut visibility = Visibility::new();
        visibility.update(camera, crowns.iter().copied(), None);
        (0..200).map(|instance| visibility.weight(instance)).collect()
    };
    let camera = looking(DVec3::ZERO, DVec3::NEG_Z, 50.0);
    let all = weights(&crowns, &camera);
    crowns.reverse();
    assert_eq!(weights(&crowns, &camera), all);
    let odd = |number: u32, center: DVec3, half: [f64; 2], opacity: f32| Crown {
        instance: 200 + number,
        center,
        half,
        opacity,
        parts: Parts::default(),
    };
    let (before, nan) = (DVec3::new(0.0, 0.0, -2.0), f64::NAN);
    crowns.extend([
        odd(0, DVec3::ZERO, [3.0, 3.0], 1.0),
        odd(1, DVec3::splat(nan), [3.0, 3.0], 1.0),
        odd(2, before, [nan, 3.0], 1.0),
        odd(3, before, [3.0, f64::INFINITY], 1.0),
        odd(4, before, [0.0, 0.0], 1.0),
        odd(5, before, [0.5, 0.5], f32::NAN),
        odd(6, -before, [1.5, 1.5], 1.0),
        odd(7, DVec3::splat(f64::INFINITY), [3.0, 3.0], 1.0),
    ]);
    assert_eq!(weights(&crowns, &camera), all);
    for fov in [1.0, 170.0] {
        let camera = looking(DVec3::ZERO, DVec3::NEG_Z, fov);
        assert!(weights(&crowns, &camera).iter().all(|weight| (1.0 / 256.0..=1.0).contains(weight)), "{fov}");
    }
    let broken = Camera { clip_from_world: glam::DMat4::from_cols_array(&[nan; 16]), ..camera };
    assert!(weights(&crowns, &broken).iter().all(|weight| *weight == 1.0));
}

/// A row of dense crowns, and one far behind it.
fn hedge() -> Vec<Crown<'static>> {
    let in_row = |i: u32| Crown {
        instance: i,
        center: DVec3::new(4.0 * f64::from(i) - 80.0, 0.0, -20.0),
        half: [3.0, 6.0],
        opacity: 0.95,
        parts: Parts::default(),
    };
    let behind = Crown {
        instance: 41,
        center: DVec3::new(0.0, 0.0, -60.0),
        half: [4.0, 4.0],
        opacity: 0.9,
        parts: Parts::default(),
    };
    (0..=40).map(in_row).chain([behind]).collect()
}

#[test]
fn what_comes_out_from_behind_a_hedge_shows_within_eight_frames_and_goes_slowly() {
    let crowns = hedge();
    let mut visibility = Visibility::new();
    let [level, above] = [0.0, 60.0].map(|y| looking(DVec3::Y * y, DVec3::new(0.0, 0.0, -60.0), 60.0));
    let mut step = |camera: &Camera| {
        visibility.update(camera, crowns.iter().copied(), Some(1.0 / 60.0));
        visibility.weight(41)
    };
    // The first estimate is made at once.
    let hidden = step(&level);
    assert!(hidden < 0.05, "{hidden}");
    let still: Vec<f32> = (0..60).map(|_| step(&level)).collect();
    assert!(still.iter().all(|weight| *weight == hidden), "a camera that stands still changes nothing");
    let rising: Vec<f32> = (0..2 * FRAMES).map(|_| step(&above)).collect();
    assert_eq!(rising.last(), Some(&1.0), "{rising:?}");
    let falling: Vec<f32> = (0..120).map(|_| step(&level)).collect();
    let octaves = |pair: &[f32]| (pair[0] / pair[1]).log2();
    let fastest = falling.windows(2).map(octaves).fold(0.0, f32::max);
    assert!(fastest < 8.1 / 60.0, "{fastest}");
    let at = |share: f32| falling.iter().position(|weight| *weight <= share).unwrap();
    assert!(at(hidden) < 90 && at(0.5) > 8, "{falling:?}");
}

#[test]
fn what_comes_into_view_shows_until_it_is_known() {
    let crowns = hedge();
    let mut visibility = Visibility::new();
    let camera = looking(DVec3::ZERO, DVec3::new(0.0, 0.0, -60.0), 60.0);
    for _ in 0..100 {
        visibility.update(&camera, crowns.iter().copied(), Some(1.0 / 60.0));
    }
    assert!(visibility.weight(41) < 0.05);
    // It is culled for a while.
    for _ in 0..3 * FRAMES {
        visibility.update(&camera, crowns[..41].iter().copied(), Some(1.0 / 60.0));
    }
    assert_eq!(visibility.weight(41), 1.0);
    visibility.update(&camera, crowns.iter().copied(), Some(1.0 / 60.0));
    assert!(visibility.weight(41) > 0.85);
}

/// A ball of leaves on nothing, 6 m across.
fn ball() -> FoliageModel {
    let mut random = Random(1);
    let mut plant = Plant { materials: vec![Default::default()], ..Plant::default() };
    while plant.leaves.len() < 900 {
        let at = [0; 3].map(|_| 6.0 * random.unit() - 3.0);
        if Vec3::from(at).length() < 3.0 {
            let corner = |x: f32, y: f32| Vertex {
                position: [at[0] + 0.3 * x, at[1] + 3.5 + 0.3 * y, at[2] + 0.3 * x],
                normal: [0.0, 0.0, 1.0],
                uv: [x, y],
                color: [1.0; 4],
            };
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], corners[0].position, 0);
        }
    }
    let prunes: Vec<Prune> =
        (1..900).rev().map(|leaf| Prune { leaf, target: leaf / 2, target_scale: 1.5, error: 0.0 }).collect();
    FoliageModel::assemble(&plant, &prunes, Recipe::default()).unwrap()
}

fn models() -> Vec<FoliageModel> {
    let model = ball();
    forest::curves().into_iter().map(|curve| FoliageModel { curve: Some(curve), ..model.clone() }).collect()
}

/// The share of the crown's outline that its leaves cover, measured on a picture from beside.
#[test]
fn crowns_take_the_light_that_their_leaves_cover() {
    for species in ["english-oak", "betula-populifolia", "carya-illinoinensis"] {
        let options = GrowOptions { leaves: Some(6000), ..GrowOptions::default() };
        let mut plant = grow(&Species::embedded(species).unwrap(), &options).unwrap();
        plant.wood = Default::default();
        let model = FoliageModel::assemble(&plant, &[], Recipe::default());
        let model = model.unwrap_or_else(|_| {
            let prunes = (1..plant.leaves.len() as u32).rev();
            let prunes = prunes.map(|leaf| Prune { leaf, target: 0, target_scale: 1.0, error: 0.0 });
            FoliageModel::assemble(&plant, &prunes.collect::<Vec<_>>(), Recipe::default()).unwrap()
        });
        let shape = CrownShape::new(&model);
        let sphere = model.sphere();
        let camera = LookAt::framing(&sphere, DVec3::Z, 0.05, 1.0).camera(256);
        let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
        let image = draw_plant(&plant, &camera, [256; 2], &options).unwrap();
        // Half a picture is a radius, nearly: the eye is far away.
        let y = f64::from(shape.height) * 128.0;
        let [wide, high] = shape.half.map(|half| f64::from(half) * 128.0);
        let (mut covered, mut area) = (0.0, 0.0);
        for (at, pixel) in image.rgba.chunks_exact(4).enumerate() {
            let [column, row] = [(at % 256) as f64 + 0.5 - 128.0, 128.0 - (at / 256) as f64 - 0.5 - y];
            if (column / wide).powi(2) + (row / high).powi(2) <= 1.0 {
                (covered, area) = (covered + f64::from(pixel[3]) / 255.0, area + 1.0);
            }
        }
        println!("{species}: {shape:?}, covered {:.3}", covered / area);
        assert!((f64::from(shape.opacity) - covered / area).abs() < 0.15, "{species}: {shape:?}, {}", covered / area);
    }
}

/// A grown tree of few leaves, large on the small picture.
fn grown(species: &str) -> FoliageModel {
    let options = GrowOptions { leaves: Some(1200), ..GrowOptions::default() };
    let plant = grow(&Species::embedded(species).unwrap(), &options).unwrap();
    let prunes = (1..plant.leaves.len() as u32).rev();
    let prunes = prunes.map(|leaf| Prune { leaf, target: 0, target_scale: 1.0, error: 0.0 });
    FoliageModel::assemble(&plant, &prunes.collect::<Vec<_>>(), Recipe::default()).unwrap()
}

/// Share of the second plant that shows before the first, counted on pictures in which it is white
/// and black.
fn on_pictures(models: [&FoliageModel; 2], places: [DAffine3; 2], camera: &Camera) -> f64 {
    let mut renderer = SoftwareRenderer::new(Look { tints: true, ..Look::default() }).unwrap();
    let ids = models.map(|model| renderer.add_model(model).unwrap());
    let light = |before: bool, tint: f32| -> f64 {
        let plant = |i: usize, tint: f32| {
            let leaves = models[i].leaves.len() as f32;
            Instance { far: None, tint: [tint; 3], ..Instance::new(ids[i], places[i], leaves) }
        };
        let plants = if before { vec![plant(0, 0.0), plant(1, tint)] } else { vec![plant(1, tint)] };
        let image = renderer.cutout(*camera, &plants, [360, 240]).unwrap().image;
        image.rgba.chunks_exact(4).map(|pixel| f64::from(pixel[1]) * f64::from(pixel[3]) / 255.0).sum()
    };
    (light(true, 40.0) - light(true, 0.0)) / (light(false, 40.0) - light(false, 0.0))
}

/// From under the first tree, beside its trunk, the second one is behind its leaves, its trunk, or
/// neither.
#[test]
fn trees_around_the_eye_hide_others_with_their_leaves_and_trunks() {
    let models = ["english-oak", "betula-populifolia"].map(grown);
    let shapes = [0, 1].map(|i| CrownShape::new(&models[i]));
    let (mut sum, mut worst, mut discs, mut hidden) = (0.0, 0.0_f64, 0.0, 0);
    for turn in 0..24 {
        let angle = f64::from(turn) * 0.26;
        let ahead = DVec3::new(angle.sin(), 0.0, -angle.cos());
        let places = [(0.0, 0.5 * angle), (24.0, -angle)]
            .map(|(away, turn)| DAffine3::from_translation(ahead * away) * DAffine3::from_rotation_y(turn));
        let eye = DVec3::Y * 1.7 - ahead * 5.0 + ahead.cross(DVec3::Y) * (f64::from(turn % 5) - 2.0);
        let look = LookAt {
            eye,
            target: eye + ahead * 20.0 + DVec3::Y * 3.0,
            up: DVec3::Y,
            fov_y_radians: 0.9,
            aspect: 1.5,
            near: 0.1,
        };
        let camera = look.camera(240);
        let crown = |i: u32| {
            let (shape, sphere) = (&shapes[i as usize], models[i as usize].sphere());
            let (center, radius) = (places[i as usize].transform_point3(sphere.center()), sphere.radius);
            let turn = [0.5 * angle, -angle][i as usize];
            Crown {
                instance: i,
                center: center + DVec3::Y * f64::from(shape.height) * radius,
                half: shape.half.map(|half| f64::from(half) * radius),
                opacity: shape.opacity,
                parts: Parts { parts: &shape.parts, center, radius, turn: [turn.cos() as f32, turn.sin() as f32] },
            }
        };
        let weight = |has_parts: bool| {
            let mut visibility = Visibility::new();
            let crowns =
                [0, 1].map(crown).map(|of| if has_parts { of } else { Crown { parts: Parts::default(), ..of } });
            visibility.update(&camera, crowns.into_iter(), None);
            f64::from(visibility.weight(1))
        };
        let exact = on_pictures([&models[0], &models[1]], places, &camera);
        let [off, by_discs] = [true, false].map(|has_parts| (weight(has_parts) - exact).abs());
        println!("{turn}: {:.3}, exactly {exact:.3}", weight(true));
        (sum, worst, discs) = (sum + off / 24.0, worst.max(off), discs + by_discs / 24.0);
        hidden += u32::from(exact < 0.6);
    }
    println!("{sum:.3} off on average, at most {worst:.3}, {discs:.3} by discs; {hidden} mostly hidden");
    assert!(hidden > 5 && sum < 0.15 && worst < 0.35 && sum < 0.4 * discs, "{sum} {worst} {discs} {hidden}");
}

/// Rows of trees behind each other, and a walker before them.
fn wood() -> (Grove, Camera) {
    let kinds = models().into_iter().map(|model| {
        let sphere = model.sphere();
        let leaves = model.curve.as_ref().unwrap().leaves();
        Kind { leaves, min_leaves: 0, sphere, reach: sphere, policy: Box::new(Blend::default()) }
    });
    let place = |i: u32| DVec3::new(f64::from(i % 40) * 5.0 - 100.0, 0.0, -6.0 - 5.0 * f64::from(i / 40));
    let placement = |i: u32| Placement { kind: i % 3, world_from_plant: DAffine3::from_translation(place(i)) };
    let grove = Grove::new(kinds.collect(), &(0..1600).map(placement).collect::<Vec<_>>()).unwrap();
    (grove, looking(DVec3::new(0.0, 1.7, 4.0), DVec3::new(0.0, 4.0, -40.0), 60.0))
}

#[test]
fn leaves_of_hidden_trees_go_to_those_that_show() {
    let (mut grove, camera) = wood();
    let mut seen = Vec::new();
    let mut counts = |budget: &mut SharedBudget| {
        let spent = grove.select_within(&camera, budget, None, &mut seen);
        let near: f64 = seen.iter().filter(|active| active.instance < 80).map(|active| f64::from(active.count)).sum();
        (spent.used, near)
    };
    let plain = counts(&mut SharedBudget::new(&models(), Rule::default(), 60_000.0));
    let mut budget = SharedBudget::new(&models(), Rule::default(), 60_000.0).with_visibility(&models());
    let aware = counts(&mut budget);
    let estimate = budget.visibility().unwrap().estimate();
    println!("{plain:?}, aware {aware:?}, {estimate:?}");
    assert!(aware.0 > 59_990.0 && aware.0 <= 60_000.0 && aware.1 > 1.2 * plain.1, "{plain:?} {aware:?}");
    assert!(estimate.hidden > estimate.drawn / 2 && estimate.shown < 0.5, "{estimate:?}");
    // A wall before everything hides all alike.
    budget.visibility_mut().unwrap().set_opaque(Some(|_: [f32; 2]| 2.0), camera.aspect());
    let walled = counts(&mut budget);
    assert!(walled.0 > 59_990.0 && budget.visibility().unwrap().estimate().shown == 0.0, "{walled:?}");
    assert!(seen.iter().all(|active| active.count.is_finite()));
}

#[test]
fn a_camera_that_stands_still_changes_no_count() {
    let (mut grove, camera) = wood();
    let mut budget = SharedBudget::new(&models(), Rule::default(), 60_000.0).with_visibility(&models());
    let mut frames = (0..240).map(|_| {
        let mut seen = Vec::new();
        grove.select_within(&camera, &mut budget, Some(1.0 / 60.0), &mut seen);
        seen
    });
    let settled = frames.nth(150).unwrap();
    assert!(frames.all(|seen| seen == settled));
}

#[test]
fn visibility_is_left_out_where_it_costs_more_than_it_saves() {
    let (mut grove, camera) = wood();
    let mut seen = Vec::new();
    for (unit_seconds, times) in [(0.0, 1), (1.0, 0)] {
        let mut budget = SharedBudget::new(&models(), Rule::default(), 60_000.0).with_visibility(&models());
        budget.unit_seconds = Some(unit_seconds);
        let mut last = 1.0;
        for frame in 0..700 {
            grove.select_within(&camera, &mut budget, Some(1.0 / 60.0), &mut seen);
            // A plant that is hidden falls slowly once visibility counts again.
            let weight = budget.visibility().unwrap().weight(1200);
            assert!(frame == 0 || weight > 0.85 * last, "{weight} after {last} at {frame}");
            last = weight;
            if frame == 130 {
                let is_hiding = (0..1600).any(|instance| budget.visibility().unwrap().weight(instance) < 0.1);
                assert_eq!(is_hiding, times == 0);
            }
        }
        assert_eq!(times == 0, budget.times_left_out() == 0);
    }
}
