//! Selection from a grove, compared with a scan of all plants.
#![cfg(feature = "render")]

use foliage_lod::{
    Camera, Depth, Frustum, Grove, LookAt,
    bounds::Sphere,
    extract::{Blend, CookLambda, LodPolicy, Sight, Sizes},
    scene::{Active, Kind, Placement},
};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use proptest::prelude::*;

const HEIGHT_PX: u32 = 480;

fn kinds() -> Vec<Kind> {
    let kind = |leaves, radius| Kind {
        leaves,
        min_leaves: 3,
        sphere: Sphere { center: [0.0, radius, 0.0], radius },
        reach: Sphere { center: [0.0, radius * 1.1, 0.0], radius: radius * 1.2 },
        policy: Box::new(Blend::default()),
    };
    vec![kind(1000, 4.0), kind(20, 0.5)]
}

fn at(kind: u32, position: DVec3, scale: f64, turn: f64) -> Placement {
    let turned = DQuat::from_rotation_y(turn);
    Placement {
        kind,
        world_from_plant: DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turned, position),
    }
}

fn selected(placements: &[Placement], camera: &Camera) -> Vec<Active> {
    let mut out = Vec::new();
    Grove::new(kinds(), placements).unwrap().select(camera, &mut out);
    out
}

/// Whether the centre of the sphere, or any of many sample points on it, is inside the picture.
fn is_seen(camera: &Camera, center: DVec3, radius: f64) -> bool {
    let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
    let point = |i: u32| {
        let y = 1.0 - f64::from(i) / 200.0;
        let (around, level) = (golden * f64::from(i), (1.0 - y * y).max(0.0).sqrt());
        center + DVec3::new(around.cos() * level, y, around.sin() * level) * radius
    };
    (0..=400).map(point).chain([center]).any(|point| {
        let clip = camera.clip_from_world * point.extend(1.0);
        clip.w > 0.0 && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w
    })
}

/// Whether the sphere is entirely outside one frustum plane, from a symmetric camera's angles.
fn is_outside(camera: &LookAt, center: DVec3, radius: f64) -> bool {
    let seen = camera.camera_from_world().transform_point3(center);
    let half_y = camera.fov_y_radians * 0.5;
    let half_x = (half_y.tan() * camera.aspect).atan();
    let beyond = |sideways: f64, half: f64| sideways.abs() * half.cos() + seen.z * half.sin() > radius * (1.0 + 1e-6);
    beyond(seen.x, half_x) || beyond(seen.y, half_y) || seen.z > radius * (1.0 + 1e-6)
}

fn camera(eye: DVec3, target: DVec3, fov_y: f64, aspect: f64) -> LookAt {
    LookAt { eye, target, up: DVec3::Y, fov_y_radians: fov_y, aspect, near: 0.01 }
}

proptest! {
    #[test]
    fn what_is_seen_is_listed_and_what_lies_outside_is_not(
        spots in prop::collection::vec((0..2_u32, -60.0..60.0, -60.0..60.0, 0.2..3.0, 0.0..6.3), 1..120),
        eye in (-50.0..50.0, 0.0..20.0, -50.0..50.0), target in (-50.0..50.0, 0.0..5.0, -50.0..50.0),
        fov_deg in prop_oneof![Just(1.0), Just(170.0), 20.0..100.0_f64], aspect in 0.3..3.0,
        origin in prop_oneof![Just(0.0), Just(1e6), Just(-3e7)],
    ) {
        let origin = DVec3::new(origin, -origin * 0.1, origin * 0.5);
        let placements: Vec<Placement> = spots.iter()
            .map(|&(kind, x, z, scale, turn)| at(kind, origin + DVec3::new(x, 0.0, z), scale, turn)).collect();
        let camera = camera(origin + DVec3::from(eye), origin + DVec3::from(target), fov_deg.to_radians(), aspect);
        let viewer = camera.camera(HEIGHT_PX);
        let active = selected(&placements, &viewer);
        prop_assert!(active.windows(2).all(|pair| pair[0].instance < pair[1].instance));
        for (i, placement) in placements.iter().enumerate() {
            let scale = spots[i].3;
            let reach = kinds()[placement.kind as usize].reach;
            let center = placement.world_from_plant.transform_point3(reach.center());
            let found = active.iter().find(|active| active.instance as usize == i);
            if is_seen(&viewer, center, reach.radius * scale) {
                prop_assert!(found.is_some(), "plant {} is missed", i);
            }
            if is_outside(&camera, center, reach.radius * scale) {
                prop_assert!(found.is_none(), "plant {} is listed", i);
            }
            if let Some(found) = found {
                let kind = &kinds()[placement.kind as usize];
                let distance = placement.world_from_plant.transform_point3(kind.sphere.center()).distance(camera.eye);
                let radius = kind.sphere.radius * scale;
                let sight = Sight {
                    distance: distance as f32, radius: radius as f32, fov_y: camera.fov_y_radians as f32, height_px: HEIGHT_PX as f32,
                };
                let wanted = (kind.policy.lod(&sight) * kind.leaves as f32).clamp(3.0, kind.leaves as f32);
                prop_assert!((found.count - wanted).abs() < 1e-3 * wanted + 1e-3, "{} for {}", found.count, wanted);
            }
        }
    }
}

#[test]
fn a_thousand_plants_on_one_spot_and_none_at_all_are_fine() {
    let viewer = camera(DVec3::Z * 30.0, DVec3::ZERO, 1.0, 1.0).camera(HEIGHT_PX);
    assert!(selected(&[], &viewer).is_empty());
    assert_eq!(selected(&[at(0, DVec3::ZERO, 1.0, 0.0); 1000], &viewer).len(), 1000);
    assert!(selected(&[at(0, DVec3::Z * 99.0, 1.0, 0.0); 1000], &viewer).is_empty());
}

#[test]
fn a_trembling_camera_changes_no_count_and_a_dolly_changes_it_little_by_little() {
    let mut grove = Grove::new(kinds(), &[at(0, DVec3::ZERO, 1.0, 0.0)]).unwrap();
    let mut out = Vec::new();
    let mut count = |z: f64| {
        grove.select(&camera(DVec3::new(0.0, 4.0, z), DVec3::Y * 4.0, 1.0, 1.0).camera(HEIGHT_PX), &mut out);
        out[0].count
    };
    let still = count(100.0);
    for i in 0..10 {
        assert_eq!(count(100.0 + 0.2 * f64::from(i % 3 - 1)), still);
    }
    let counts: Vec<f32> = (0..2000).map(|i| count(100.0 + 0.05 * f64::from(i))).collect();
    assert!(counts.windows(2).all(|pair| pair[1] <= pair[0] && pair[0] - pair[1] < 1.0));
    assert!(counts[1999] < 0.75 * still);
}

/// Kinds whose policies draw few leaves, also up close.
fn sparing_kinds() -> Vec<Kind> {
    let policies: [Box<dyn LodPolicy + Send + Sync>; 3] = [
        Box::new(Blend { near: 0.1, far: 0.4, nearness_weight: 1.0, area_weight: 0.0 }),
        Box::new(CookLambda { start: 0.4, half_area: 0.4 }),
        Box::new(Sizes::new(&[(10.0, 0.05), (200.0, 0.3)]).unwrap()),
    ];
    policies.into_iter().map(|policy| Kind { policy, ..kinds().swap_remove(0) }).collect()
}

#[test]
fn from_inside_a_plant_at_least_half_of_it_is_drawn_however_it_is_scaled_and_turned() {
    let turns = [DQuat::IDENTITY, DQuat::from_euler(glam::EulerRot::XYZ, 1.0, 2.0, -0.5)];
    let scales = [DVec3::ONE, DVec3::splat(0.02), DVec3::splat(300.0), DVec3::new(2.0, 0.5, 1.0)];
    let inside = [DVec3::ZERO, DVec3::new(0.9, 0.0, 0.0), DVec3::new(-0.4, 0.7, 0.5), DVec3::new(0.0, -0.99, 0.0)];
    let sphere = kinds()[0].sphere;
    let mut out = Vec::new();
    for (turn, scale) in turns.into_iter().flat_map(|turn| scales.map(|scale| (turn, scale))) {
        let world_from_plant = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::new(40.0, -3.0, 7e4));
        let placements = [0, 1, 2].map(|kind| Placement { kind, world_from_plant });
        let mut grove = Grove::new(sparing_kinds(), &placements).unwrap();
        let mut counts = |grove: &mut Grove, eye_in_radii: DVec3| {
            let eye = world_from_plant.transform_point3(sphere.center() + eye_in_radii * sphere.radius);
            grove.select_all(&camera(eye, eye + DVec3::X, 1.0, 1.0).camera(HEIGHT_PX), &mut out);
            out.iter().map(|active| active.count).collect::<Vec<f32>>()
        };
        for eye in inside {
            let found = counts(&mut grove, eye);
            assert!(found.iter().all(|&count| count >= 500.0), "{scale} {eye}: {found:?}");
        }
        assert!(counts(&mut grove, DVec3::X * 9.0).iter().all(|&count| count < 400.0));
        grove.set_dead_band(0.0);
        let far = scale.max_element() / scale.x;
        let at = |step: u32| DVec3::X * far * (2.0 - 0.002 * f64::from(step));
        let walk: Vec<Vec<f32>> = (0..=1000).map(|step| counts(&mut grove, at(step))).collect();
        for plant in 0..placements.len() {
            let steps = walk.windows(2).map(|pair| (pair[1][plant] - pair[0][plant]).abs());
            let largest = steps.fold(0.0, f32::max);
            assert!(largest > 1.0 && largest < 10.0, "{scale}, policy {plant}: {largest} leaves at once");
        }
    }
}

#[test]
fn plants_that_stay_keep_their_counts_when_others_come_and_go() {
    let placements: Vec<Placement> =
        (0..9).map(|i| at(0, DVec3::new(0.0, 0.0, 20.0 * f64::from(i)), 1.0, 0.0)).collect();
    let (mut grove, mut out) = (Grove::new(kinds(), &placements).unwrap(), Vec::new());
    grove.set_dead_band(0.2);
    let mut counts = |grove: &mut Grove, x: f64| {
        grove.select_all(&camera(DVec3::new(x, 0.0, -9.0), DVec3::ZERO, 1.0, 1.0).camera(HEIGHT_PX), &mut out);
        out.iter().map(|active| active.count).collect::<Vec<f32>>()
    };
    counts(&mut grove, 0.0);
    let settled = counts(&mut grove, 3.0);
    grove.replace(&placements[2..]).unwrap();
    assert_eq!(counts(&mut grove, 3.0), settled[2..]);
    let mut fresh = Grove::new(kinds(), &placements[2..]).unwrap();
    fresh.set_dead_band(0.2);
    assert_ne!(counts(&mut fresh, 3.0), settled[2..], "their dead band shows");
}

#[test]
fn whatever_a_frustum_does_not_see_is_out_of_the_picture() {
    let view = camera(DVec3::new(1e6, 2.0, 5.0), DVec3::new(1e6, 0.0, 0.0), 1.0, 1.5).camera(HEIGHT_PX);
    let anchor = DVec3::new(1e6, 0.0, 0.0);
    let frustum = Frustum::new(&view, anchor);
    let mut seen = 0;
    for i in 0..4000_u32 {
        let unit = |salt: u32| f64::from((3 * i + salt).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5;
        let center = DVec3::new(40.0 * unit(0), 20.0 * unit(1), 40.0 * unit(2));
        let may_see = frustum.may_see(center, 0.7);
        seen += u32::from(may_see);
        assert!(may_see || !is_seen(&view, anchor + center, 0.7), "{center}");
    }
    assert!((200..2000).contains(&seen), "{seen}");
}

#[test]
fn a_placement_that_is_not_finite_or_of_no_kind_is_refused_by_number() {
    let broken = [
        at(0, DVec3::new(f64::NAN, 0.0, 0.0), 1.0, 0.0),
        at(1, DVec3::ZERO, f64::INFINITY, 0.0),
        at(2, DVec3::ZERO, 1.0, 0.0),
        Placement { kind: 0, world_from_plant: DAffine3::from_mat3(DMat3::NAN) },
        at(0, DVec3::splat(f64::MAX), 1e300, 0.0),
    ];
    for placement in broken {
        let error = Grove::new(kinds(), &[at(0, DVec3::ZERO, 1.0, 0.0), placement]).err().unwrap().to_string();
        assert!(error.starts_with("placement is number 1, of kind"), "{error}");
        assert!(!error.contains('\n'));
    }
}

#[test]
fn a_viewer_that_is_not_a_number_sees_all_and_counts_stay_in_range() {
    let placements = [at(0, DVec3::ZERO, 1.0, 0.0), at(1, DVec3::X * 1e5, 1.0, 0.0)];
    let viewer = Camera { eye: DVec3::NAN, clip_from_world: DMat4::NAN, height_px: 0, depth: Depth::Reversed };
    let active = selected(&placements, &viewer);
    assert_eq!(active.len(), 2);
    assert!(active.iter().all(|active| active.count >= 3.0 && active.count <= 1000.0), "{active:?}");
}
