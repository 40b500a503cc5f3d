//! Properties of every model, for any plant and any options.
#![cfg(feature = "simplify")]

mod common;

use common::{
    models::{SIZE, all_options, bare, model_of},
    plants,
};
use foliage_lod::{
    LookAt, Plant, Timeline,
    model::{Transition, scaled},
    simplify::{SimplifyOptions, VIEW_COUNTS},
    software::{draw_model, draw_plant},
};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

/// Any small plant, with any kind of leaf.
fn any_plant() -> impl Strategy<Value = Plant> {
    (0..6, 1..40_usize, any::<u64>()).prop_map(|(kind, leaves, seed)| match kind {
        0 => plants::quads(leaves, 3.0, seed),
        1 => plants::bent(leaves, seed),
        2 => plants::crossed(leaves, seed),
        3 => plants::twins(leaves + 1, seed),
        4 => plants::with_wood(leaves, seed),
        _ => plants::masked(leaves, seed),
    })
}

fn any_options() -> impl Strategy<Value = SimplifyOptions> {
    let resolution = prop_oneof![Just(1), 2..40_u32];
    let max_scale = prop_oneof![Just(1.0), 1.0..64.0_f32, Just(64.0)];
    (0..24_usize, resolution, 0..VIEW_COUNTS.len(), any::<bool>(), max_scale).prop_map(
        |(i, resolution, views, background, max_scale)| SimplifyOptions {
            views: VIEW_COUNTS[views],
            background,
            max_scale,
            ..all_options(resolution)[i].clone()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_model_by_any_options_is_sound_and_holds_every_leaf(plant in any_plant(), options in any_options()) {
        let model = model_of(&plant, &options);
        prop_assert!(model.validate().is_ok());
        prop_assert!(model.max_scale <= options.max_scale);
        let sorted = |mut pivots: Vec<[u32; 3]>| {
            pivots.sort_unstable();
            pivots
        };
        let of_model = model.leaves.iter().map(|leaf| leaf.pivot.map(f32::to_bits)).collect();
        let of_plant = plant.leaves.iter().map(|leaf| leaf.pivot.map(f32::to_bits)).collect();
        prop_assert_eq!(sorted(of_model), sorted(of_plant));
    }

    #[test]
    fn no_drawn_scale_falls_while_leaves_go(plant in any_plant(), options in any_options()) {
        let model = model_of(&plant, &options);
        let timeline = Timeline::new(&model);
        for leaf in 0..timeline.leaves() {
            let scales: Vec<f32> = (0..=timeline.leaves()).rev().map(|n| timeline.scale(leaf, n)).collect();
            prop_assert_eq!(scales[0], 1.0);
            prop_assert!(scales.windows(2).all(|pair| pair[0] <= pair[1]), "leaf {}: {:?}", leaf, scales);
        }
    }

    #[test]
    fn drawn_leaves_stay_in_the_enlarged_bounds_at_every_count(
        plant in any_plant(), options in any_options(), window in 1.0..50.0_f32
    ) {
        let model = model_of(&plant, &options);
        let timeline = Timeline::new(&model);
        let (aabb, sphere, leaves) = (model.enlarged_aabb(), model.enlarged_sphere(), timeline.leaves());
        let slack = 1e-5 * sphere.radius;
        for step in 0..=leaves * 3 {
            let transition = Transition::new(f64::from(step) / 3.0, window, leaves);
            for leaf in 0..transition.drawn() {
                let record = &model.leaves[leaf as usize];
                for vertex in &model.vertices[record.geometry().vertex_range()] {
                    let point = scaled(vertex.position, record.pivot, timeline.scale_at(leaf, &transition));
                    let point = Vec3::from(point).as_dvec3();
                    let inside = point.clamp(Vec3::from(aabb.min).as_dvec3(), Vec3::from(aabb.max).as_dvec3());
                    prop_assert!(inside.distance(point) <= slack, "leaf {} at {:?}", leaf, transition);
                    prop_assert!(point.distance(sphere.center()) <= sphere.radius + slack);
                }
            }
        }
    }

    #[test]
    fn no_view_shows_more_than_the_enlarged_bounds(
        plant in any_plant(), options in any_options(), share in 0.0..=1.0_f64,
        direction in (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64)
    ) {
        let model = model_of(&plant, &options);
        let n = (share * model.leaves.len() as f64).round() as usize;
        let aabb = model.enlarged_aabb();
        let slack = Vec3::splat(1e-5 * model.enlarged_sphere().radius as f32);
        let bounds = plants::closed_box(Vec3::from(aabb.min) - slack, Vec3::from(aabb.max) + slack);
        let camera = LookAt::framing(&model.enlarged_sphere(), DVec3::from(direction), 0.8, 1.1).camera(SIZE[1]);
        let shown = draw_model(&model, n, &camera, SIZE, &bare()).unwrap();
        let within = draw_plant(&bounds, &camera, SIZE, &bare()).unwrap();
        let alphas = shown.rgba.iter().zip(&within.rgba).skip(3).step_by(4);
        prop_assert!(alphas.clone().any(|(_, within)| *within > 0));
        prop_assert!(alphas.into_iter().all(|(shown, within)| shown <= within));
    }
}
