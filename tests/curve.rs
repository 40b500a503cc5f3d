//! Measured error curves, against pictures and against each other.
#![cfg(feature = "simplify")]

mod common;

use common::{models::model_of, plants};
use foliage_lod::{
    Error, FoliageModel, LookAt,
    model::ErrorCurve,
    simplify::{CurveOptions, SimplifyOptions, curve_steps, error_curve},
    software::{Background, DrawOptions, draw_model},
};
use glam::DVec3;

const OPTIONS: CurveOptions = CurveOptions { side_px: 32, samples: 4, steps: 2 };

fn measured(model: &FoliageModel, options: &CurveOptions) -> ErrorCurve {
    let mut steps = 0;
    let curve = error_curve(model, options, &mut |done| {
        steps = done;
        true
    });
    assert_eq!(steps, curve_steps(model.leaves.len() as u32, options));
    FoliageModel { curve: curve.as_ref().ok().cloned(), ..model.clone() }.validate().unwrap();
    curve.unwrap()
}

fn simplified(preset: SimplifyOptions) -> FoliageModel {
    model_of(&plants::with_wood(400, 5), &SimplifyOptions { resolution: 64, threads: 1, ..preset })
}

#[test]
fn the_error_without_leaves_is_the_area_that_they_cover() {
    let plant = plants::quads(300, 4.0, 9);
    let model = model_of(&plant, &SimplifyOptions { resolution: 32, threads: 1, ..SimplifyOptions::paper() });
    let curve = measured(&model, &OPTIONS);
    // Squares of the coverage, in pictures from the same places.
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let eyes =
        [DVec3::new(0.0, 1.0, phi), DVec3::new(phi, 0.0, 1.0), DVec3::new(0.0, 1.0, -phi), DVec3::new(-phi, 0.0, 1.0)];
    let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
    let fov = 2.0 * (1.0_f64 / 8.0_f64.sqrt()).atan();
    let squares: f64 = eyes
        .iter()
        .map(|&toward| {
            let camera = LookAt::framing(&model.sphere(), toward, fov, 1.0).camera(32);
            let image = draw_model(&model, 300, &camera, [32; 2], &options).unwrap();
            image.rgba.iter().skip(3).step_by(4).map(|&alpha| (f64::from(alpha) / 255.0).powi(2)).sum::<f64>()
        })
        .sum();
    let (error, squares) = (curve.error_px(0.0), squares / 4.0);
    // Colours, all alike, add little; normals of leaves that face anywhere a little more.
    assert!((0.97..1.35).contains(&(error / squares)), "{error} of {squares}");
}

#[test]
fn every_preset_has_a_curve_and_better_ones_have_less_error() {
    let presets =
        [SimplifyOptions::paper(), SimplifyOptions::fast(), SimplifyOptions::balanced(), SimplifyOptions::best()];
    let curves = presets.map(|preset| measured(&simplified(preset), &OPTIONS));
    let errors = curves.each_ref().map(|curve| [200.0, 100.0, 40.0].map(|leaves| curve.error_px(leaves)));
    println!("{errors:.3?}");
    for (level, _) in errors[0].iter().enumerate() {
        assert!(errors[2][level] < errors[0][level], "{errors:?}");
    }
    for curve in &curves {
        assert!(curve.corners.len() > 8 && curve.error_px(400.0) == 0.0 && curve.error_px(0.0) > 10.0, "{curve:?}");
        assert!((1.5..3.5).contains(&curve.size_power), "{}", curve.size_power);
    }
}

#[test]
fn the_power_tells_the_error_at_another_size() {
    let model = simplified(SimplifyOptions::balanced());
    let [small, large] = [32, 64].map(|side_px| measured(&model, &CurveOptions { side_px, ..OPTIONS }));
    for leaves in [20.0, 60.0, 120.0, 200.0] {
        let told = small.error_px(leaves) * 2.0_f64.powf(f64::from(small.size_power));
        let ratio = told / large.error_px(leaves);
        assert!((0.6..1.6).contains(&ratio), "{leaves} leaves: {ratio}");
    }
}

#[test]
fn threads_change_no_bit() {
    let model = simplified(SimplifyOptions::paper());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| measured(&model, &OPTIONS))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn one_leaf_and_hidden_leaves_have_curves() {
    let options = SimplifyOptions { resolution: 32, threads: 1, ..SimplifyOptions::paper() };
    let one = measured(&model_of(&plants::quads(1, 1.0, 3), &options), &OPTIONS);
    assert_eq!(one.corners.len(), 2);
    assert!(one.error_px(0.0) > 1.0);
    // Wood in front of everything.
    let mut plant = plants::quads(6, 0.001, 4);
    let corners = [[-9.0, -9.0, -9.0], [9.0, -9.0, -9.0], [9.0, 9.0, -9.0], [-9.0, 9.0, -9.0]];
    let around = corners.map(|[x, y, z]| [[x, y, z], [x, y, -z], [z, x, y], [-z, x, y], [y, z, x], [y, -z, x]]);
    for side in 0..6 {
        let first = plant.wood.vertices.len() as u32;
        let vertex = |position: [f32; 3]| foliage_lod::leaf::Vertex { position, ..plant.vertices[0] };
        plant.wood.vertices.extend(around.iter().map(|corner| vertex(corner[side])));
        plant.wood.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    plant.wood.parts = vec![foliage_lod::plant::WoodPart { indices: [0, 36], material: 0 }];
    let hidden = measured(&model_of(&plant, &options), &OPTIONS);
    assert!(hidden.corners.iter().all(|corner| corner.error_px == 0.0), "{hidden:?}");
}

#[test]
fn other_options_are_refused_and_a_curve_may_be_interrupted() {
    let model = simplified(SimplifyOptions::paper());
    for (side_px, samples, steps) in [(4, 4, 2), (1024, 1, 2), (30, 4, 2), (512, 8, 2), (32, 0, 2), (32, 4, 0)] {
        let refused = error_curve(&model, &CurveOptions { side_px, samples, steps }, &mut |_| true);
        assert!(matches!(refused, Err(Error::InvalidOption { .. })), "{side_px} {samples} {steps}");
    }
    let stopped = error_curve(&model, &OPTIONS, &mut |done| done < 5);
    assert!(matches!(stopped, Err(Error::Interrupted)));
}
