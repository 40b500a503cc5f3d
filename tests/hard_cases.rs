//! Edge cases, each checked against an oracle or an invariant that is independent of the code.
#![cfg(feature = "simplify")]

mod common;

use common::{
    models::{SIZE, all_options, bare, covered_px, model_of, picture},
    naive::Naive,
    plants::{self, Random, closed_box},
};
use foliage_lod::{
    Error, FoliageModel, LookAt, Plant, Swap, Timeline,
    extract::{Blend, CookLambda, Hysteresis, LodPolicy, Sight},
    leaf::Vertex,
    model::{Prune, Recipe},
    plant::{Wood, WoodPart},
    simplify::{Compensate, CpuFragments, Quiet, SimplifyOptions, order, simplify},
    software::draw_plant,
    stochastic::{AreaRule, Stochastic, lambda::FLOOR, visible_factor},
};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

fn prunes_of(plant: &Plant, options: &SimplifyOptions) -> Vec<Prune> {
    order(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap().0
}

/// The plant with every position mapped by `to`.
fn moved(plant: &Plant, to: impl Fn(Vec3) -> Vec3) -> Plant {
    let mut plant = plant.clone();
    let vertices = plant.vertices.iter_mut().chain(&mut plant.wood.vertices).map(|vertex| &mut vertex.position);
    let positions = vertices.chain(plant.leaves.iter_mut().map(|leaf| &mut leaf.pivot));
    positions.for_each(|position| *position = to(Vec3::from(*position)).to_array());
    plant
}

/// Twenty leaves inside a closed box of wood.
fn walled_in() -> Plant {
    let mut plant = moved(&plants::quads(20, 1.0, 5), |position| position * 0.2);
    let Plant { vertices, indices, .. } = closed_box(Vec3::NEG_ONE, Vec3::ONE);
    plant.wood = Wood { parts: vec![WoodPart { indices: [0, indices.len() as u32], material: 0 }], vertices, indices };
    plant
}

/// Rows of lambda, r and (1 - (1 - r)^(1/lambda)) / r, computed with 400 decimal digits from
/// exactly these binary values of lambda and r.
const AREA_FACTORS: [[f64; 3]; 23] = [
    [0.3, 5e-324, 3.3333333333333335],
    [0.7, 1e-310, 1.4285714285714286],
    [1e-06, 1e-20, 999999.999999995],
    [1e-06, 1e-12, 999999.5000006667],
    [1e-06, 1e-06, 632120.742768355],
    [1e-06, 0.01, 100.0],
    [0.005, 1e-12, 199.9999999801],
    [0.005, 0.0001, 198.0230695677932],
    [0.005, 0.01, 86.6020325142038],
    [0.005, 0.1, 9.99999999294492],
    [0.03, 0.002, 32.27773164870726],
    [0.03, 0.07, 13.014163886831687],
    [0.1, 0.01, 9.56179249911955],
    [0.3, 0.0001, 3.332944461728251],
    [0.3, 0.3, 2.31816309134096],
    [0.3, 0.999999, 1.000001000001],
    [0.5, 0.5, 1.5],
    [0.75, 0.99, 1.0079248134444123],
    [0.9999999999999999, 1e-12, 1.0],
    [0.9999999999999999, 0.5, 1.0],
    [1.0, 1e-12, 1.0],
    [1.0, 0.37, 1.0],
    [0.3, 0.9999999999999999, 1.0000000000000002],
];

#[test]
fn area_factors_equal_those_of_four_hundred_digits() {
    for [lambda, r, factor] in AREA_FACTORS {
        let error = visible_factor(lambda, r) / factor - 1.0;
        assert!(error.abs() < 1e-12, "lambda {lambda:e}, r {r:e}: {error:e} off {factor}");
        if lambda >= FLOOR {
            let drawn = AreaRule::Visible.linear_scale(lambda, r) as f32;
            let error = f64::from(drawn) / factor.sqrt() - 1.0;
            assert!(error.abs() < 1e-6, "lambda {lambda:e}, r {r:e}: {error:e} off in single precision");
        }
    }
}

proptest! {
    #[test]
    fn area_factors_lie_between_1_and_what_keeps_the_surface(lambda in 0.005..1.0_f64, r in 0.0..=1.0_f64, power in -320..0) {
        for r in [r, r * 10_f64.powi(power)] {
            let factor = visible_factor(lambda, r);
            prop_assert!(factor >= 1.0 && factor <= lambda.recip(), "{} at r {}", factor, r);
            prop_assert_eq!(AreaRule::Visible.linear_scale(1.0, r), 1.0);
        }
    }
}

#[test]
fn a_hundred_thousand_enlargements_of_one_leaf_are_undone_to_the_bit() {
    let leaves = 100_000_u32;
    let scale_at = |n: u32| 1.0 + (leaves - n) as f32 * 1e-4;
    let mut plant = plants::bare("one for all");
    let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0; 3], uv: [0.0; 2], color: [1.0; 4] };
    for _ in 0..leaves {
        plant.push_leaf(&[corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)], &[0, 1, 2], [0.0; 3], 0);
    }
    let prune = |leaf| Prune { leaf, target: 0, target_scale: scale_at(leaf), error: 0.0 };
    let prunes: Vec<Prune> = (1..leaves).rev().map(prune).collect();
    let model = FoliageModel::assemble(&plant, &prunes, Recipe::default()).unwrap();
    assert_eq!(model.max_scale, scale_at(1));
    assert_eq!(model.enlarged_aabb().max, [scale_at(1), scale_at(1), 0.0]);
    let (timeline, mut swap) = (Timeline::new(&model), Swap::new(&model));
    for n in [0, leaves, 0, leaves, 1, 50_000, leaves - 1, 0, leaves] {
        swap.set_active(n);
        assert_eq!([timeline.scale(0, n), swap.scales()[0]], [scale_at(n.max(1)); 2], "at {n}");
        assert!(swap.scales()[1..].iter().all(|&scale| scale == 1.0));
    }
    let slots: Vec<f32> = model.leaves.iter().map(|leaf| leaf.scale).collect();
    assert_eq!(swap.slots(), slots);
}

#[test]
fn a_count_that_jumps_between_none_and_all_gets_there_at_once() {
    for dead_band in [0.0, 0.02, 1e9, -1.0, f32::INFINITY, f32::NAN] {
        let mut hysteresis = Hysteresis::new(dead_band);
        for _ in 0..3 {
            assert_eq!([0, 100_000].map(|n| hysteresis.settle(n, 100_000, 0)), [0, 100_000], "{dead_band}");
        }
    }
}

/// Valid and invalid values for distances and ranges.
const ODD: [f32; 12] =
    [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -5.0, 1.0, 5.0, 1e-38, 1e19, 1e38, f32::MAX, f32::MIN_POSITIVE];

fn at(distance: f32) -> Sight {
    Sight { distance, radius: 1.0, fov_y: 1.0, height_px: 1080.0 }
}

#[test]
fn lod_never_rises_with_distance_whatever_the_range() {
    let distances =
        [0.0, 1e-38, 0.5, 1.0, 1.000_000_1, 2.0, 5.0, 5.000_001, 1e3, 1e18, 1e20, 1e38, f32::INFINITY].map(at);
    for a in ODD {
        for b in ODD {
            let blend = Blend { near: a, far: b, ..Blend::default() };
            let cook = CookLambda { start: a, half_area: b };
            for policy in [&blend as &dyn LodPolicy, &cook] {
                let lods = distances.map(|sight| policy.lod(&sight));
                assert!(lods.windows(2).all(|pair| pair[0] >= pair[1]), "{a} {b}: {lods:?}");
            }
        }
    }
}

#[test]
fn a_range_without_width_or_end_is_a_step_or_all() {
    let nearness =
        |near, far, distance| Blend { near, far, nearness_weight: 1.0, area_weight: 0.0 }.lod_outside(&at(distance));
    for far in [5.0, 4.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
        let lods = [0.0, 5.0, 5.000_001, f32::INFINITY].map(|distance| nearness(5.0, far, distance));
        assert_eq!(lods, [1.0, 1.0, 0.0, 0.0], "far {far}");
    }
    assert_eq!([0.0, 1e38, f32::INFINITY].map(|distance| nearness(5.0, f32::INFINITY, distance)), [1.0; 3]);
    assert_eq!([0.0, 5.0, f32::INFINITY].map(|distance| nearness(f32::NAN, 5.0, distance)), [0.0; 3]);
}

#[test]
fn outlines_in_pixels_follow_the_formula_from_1_to_170_degrees() {
    for fov_deg in [1.0_f64, 60.0, 170.0] {
        for distance in [1.5_f64, 3.0, 1e3, 1e6] {
            let expected = 540.0 / ((distance * distance - 1.0).sqrt() * (0.5 * fov_deg.to_radians()).tan());
            for scale in [1e-6, 1.0, 1e6] {
                let (distance, radius) = ((distance * scale) as f32, scale as f32);
                let sight = Sight { distance, radius, fov_y: fov_deg.to_radians() as f32, height_px: 1080.0 };
                let error = f64::from(sight.radius_px()) / expected - 1.0;
                assert!(error.abs() < 2e-6, "{fov_deg} degrees, {distance} of {radius}: {error:e}");
            }
        }
    }
}

#[test]
fn plants_a_million_times_smaller_or_larger_are_pruned_and_drawn_alike() {
    // Scaling by a power of two changes no mantissa, so every result is bit-identical.
    let powers = [2_f32.powi(-20), 2_f32.powi(20)];
    for plant in [plants::with_wood(60, 3), plants::masked(60, 4), plants::bent(60, 5)] {
        for options in all_options(24) {
            let prunes = prunes_of(&plant, &options);
            for factor in powers {
                let other = moved(&plant, |position| position * factor);
                assert_eq!(prunes_of(&other, &options), prunes, "{} by {options:?} at {factor}", plant.name);
            }
        }
        let [small, model, large] = [powers[0], 1.0, powers[1]].map(|factor| {
            model_of(
                &moved(&plant, |position| position * factor),
                &SimplifyOptions { resolution: 24, ..SimplifyOptions::fast() },
            )
        });
        for fov_deg in [1.0, 60.0, 170.0] {
            for n in [60, 20, 3] {
                let expected = picture(&model, n, fov_deg);
                assert!(covered_px(&expected) > 10.0, "{n} leaves at {fov_deg} degrees");
                assert!(picture(&small, n, fov_deg) == expected && picture(&large, n, fov_deg) == expected);
            }
        }
    }
}

#[test]
fn decimal_factors_of_a_million_change_the_picture_by_rounding_alone() {
    let plant = plants::with_wood(60, 3);
    let options = SimplifyOptions { resolution: 24, ..SimplifyOptions::paper() };
    let expected = picture(&model_of(&plant, &options), 60, 40.0);
    for factor in [1e-6, 1e6] {
        let other = picture(&model_of(&moved(&plant, |position| position * factor), &options), 60, 40.0);
        let differs = expected.rgba.iter().zip(&other.rgba).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        assert!(differs * 500 < expected.rgba.len(), "{differs} bytes at {factor}");
    }
}

#[test]
fn a_plant_far_from_the_origin_is_pruned_as_at_the_origin() {
    // Corners and centroids are whole numbers, so an offset of 2^22 rounds none of them.
    let mut random = Random(8);
    let mut plant = plants::bare("whole numbers");
    for _ in 0..60 {
        let base = (random.in_ball() * 25.0).round() * 4.0;
        let [along, across] = [(); 2].map(|()| (random.direction() * 8.0).round() * 4.0);
        plants::push_card(&mut plant, base, along, across, base);
    }
    let far = moved(&plant, |position| position + Vec3::new(4_194_304.0, -4_194_304.0, 4_194_304.0));
    for options in all_options(24) {
        assert_eq!(prunes_of(&far, &options), prunes_of(&plant, &options), "{options:?}");
    }
}

#[test]
fn one_and_two_leaves_make_sound_models_by_any_options() {
    for count in [1, 2] {
        for options in all_options(16) {
            let model = model_of(&plants::quads(count, 1.0, 3), &options);
            model.validate().unwrap();
            assert_eq!(model.leaves.len(), count);
            assert!((0..=count).all(|n| Swap::new(&model).set_active(n as u32).len() <= 1));
        }
    }
}

#[test]
fn leaves_that_wood_hides_go_in_their_order_and_change_nothing() {
    let plant = walled_in();
    for options in all_options(16) {
        let prunes = prunes_of(&plant, &options);
        for (i, prune) in prunes.iter().enumerate() {
            assert_eq!((prune.leaf, prune.target_scale, prune.error), (i as u32, 1.0, 0.0), "{options:?}");
        }
    }
    let model = model_of(&plant, &SimplifyOptions { resolution: 16, ..SimplifyOptions::paper() });
    let bare = picture(&model, 0, 60.0);
    assert!(covered_px(&bare) > 1000.0);
    assert!(picture(&model, 1, 60.0) == bare && picture(&model, 20, 60.0) == bare);
    assert_eq!(Stochastic::new(&plant, 1, &mut CpuFragments::new()).unwrap().visible_share, 0.0);
}

#[test]
fn coincident_leaves_are_lost_without_error_and_where_views_decide_without_growth() {
    let mut plant = plants::bare("coincident");
    (0..40).for_each(|_| plants::push_card(&mut plant, Vec3::ZERO, Vec3::Y, Vec3::X, Vec3::ZERO));
    for options in all_options(16) {
        let model = model_of(&plant, &options);
        assert!(model.leaves.iter().all(|leaf| leaf.error == 0.0), "{options:?}");
        // `Nearest` adds the visible area of the pruned leaf to the nearest one, although that one
        // already covers the same pixels.
        if options.compensate != Compensate::Nearest {
            assert_eq!(model.max_scale, 1.0, "{options:?}");
            assert!(picture(&model, 1, 60.0) == picture(&model, 40, 60.0), "{options:?}");
        }
    }
}

#[test]
fn leaves_without_area_are_lost_without_error_and_nothing_grows_for_them() {
    let mut plant = plants::quads(30, 2.0, 9);
    for leaf in [0, 7, 8, 29] {
        let pivot = plant.leaves[leaf].pivot;
        let range = plant.leaves[leaf].vertex_range();
        plant.vertices[range].iter_mut().for_each(|vertex| vertex.position = pivot);
    }
    for options in all_options(16) {
        let mut scales = [1.0_f32; 30];
        for prune in prunes_of(&plant, &options) {
            let before = std::mem::replace(&mut scales[prune.target as usize], prune.target_scale);
            if [0, 7, 8, 29].contains(&prune.leaf) {
                assert_eq!((prune.error, prune.target_scale), (0.0, before), "leaf {} by {options:?}", prune.leaf);
            }
        }
    }
    let nowhere = moved(&plant, |_| Vec3::ONE);
    for options in all_options(16) {
        assert!(prunes_of(&nowhere, &options).iter().all(|prune| prune.error == 0.0 && prune.target_scale == 1.0));
    }
}

#[test]
fn views_of_one_to_three_pixels_are_pruned_as_by_the_naive_method() {
    for (resolution, background) in [(1, true), (1, false), (2, true), (3, true)] {
        let mut plant = plants::with_wood(60, 10);
        plant.canonicalize();
        let options = SimplifyOptions { resolution, background, ..SimplifyOptions::paper() };
        let expected = Naive::new(&plant, resolution, background, options.max_scale).run();
        assert_eq!(prunes_of(&plant, &options), expected, "{resolution} px, background {background}");
    }
}

fn camera_at(eye: DVec3, toward: DVec3, fov_deg: f64) -> LookAt {
    LookAt { eye, target: eye + toward, up: DVec3::Y, fov_y_radians: fov_deg.to_radians(), aspect: 1.0, near: 1e-3 }
}

#[test]
fn a_card_covers_what_its_angle_says_from_1_to_170_degrees() {
    for fov_deg in [1.0_f64, 60.0, 170.0] {
        let half_width = 0.5 * (0.5 * fov_deg.to_radians()).tan() as f32;
        let mut plant = plants::bare("card");
        let base = Vec3::NEG_Y * half_width;
        plants::push_card(&mut plant, base, Vec3::Y * 2.0 * half_width, Vec3::X * 2.0 * half_width, base);
        let camera = camera_at(DVec3::Z, DVec3::NEG_Z, fov_deg);
        let covered = covered_px(&draw_plant(&plant, &camera.camera(SIZE[1]), SIZE, &bare()).unwrap());
        assert!((covered - 48.0 * 48.0).abs() < 1.0, "{covered} pixels at {fov_deg} degrees");
        let away = LookAt { target: camera.eye + DVec3::Z, ..camera };
        assert_eq!(covered_px(&draw_plant(&plant, &away.camera(SIZE[1]), SIZE, &bare()).unwrap()), 0.0);
    }
}

#[test]
fn from_inside_a_closed_crown_every_pixel_is_leaf() {
    let mut crown = closed_box(Vec3::NEG_ONE, Vec3::ONE);
    crown.materials[0].double_sided = true;
    for eye in [DVec3::ZERO, DVec3::new(0.9, -0.5, 0.3)] {
        for toward in [DVec3::X, DVec3::NEG_Y, DVec3::new(-1.0, 0.4, 0.2), DVec3::ONE] {
            for fov_deg in [1.0, 60.0, 170.0] {
                let image =
                    draw_plant(&crown, &camera_at(eye, toward, fov_deg).camera(SIZE[1]), SIZE, &bare()).unwrap();
                assert_eq!(covered_px(&image), 96.0 * 96.0, "from {eye} to {toward} at {fov_deg} degrees");
            }
        }
    }
}

#[test]
fn a_number_that_is_none_is_refused_wherever_it_stands() {
    let plant = plants::with_wood(3, 11);
    let simplified = |plant: &Plant, options| simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet);
    let options = SimplifyOptions { resolution: 8, ..SimplifyOptions::paper() };
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let places: [fn(&mut Plant) -> &mut f32; 8] = [
            |plant| &mut plant.vertices[5].position[1],
            |plant| &mut plant.vertices[0].normal[2],
            |plant| &mut plant.vertices[11].uv[0],
            |plant| &mut plant.vertices[3].color[3],
            |plant| &mut plant.wood.vertices[7].position[0],
            |plant| &mut plant.leaves[2].pivot[2],
            |plant| &mut plant.materials[0].base_color[0],
            |plant| &mut plant.materials[1].alpha_cutoff,
        ];
        for (i, place) in places.iter().enumerate() {
            let mut broken = plant.clone();
            *place(&mut broken) = number;
            let result = simplified(&broken, options.clone());
            assert!(matches!(result, Err(Error::InvalidPlant { invariant: 3, .. })), "place {i}: {number}");
        }
        let result = simplified(&plant, SimplifyOptions { max_scale: number, ..options.clone() });
        assert!(matches!(result, Err(Error::InvalidOption { field, .. }) if field == "max_scale"), "{number}");
    }
}
