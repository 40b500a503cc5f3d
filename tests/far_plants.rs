//! Impostors of real plants, with every leaf as the reference: likeness, coverage and colour from
//! held-out views, even change while turning, size, shadow and light from behind.
//!
//! The eight plants take minutes, so they run only when asked for, with the folder of trees that
//! others made; without an adapter, shadows are left out. With `FOLIAGE_SHEETS` the hand-over is
//! written into that folder, picture by picture:
//!
//! ```text
//! FOLIAGE_TREES=... cargo test --features measure,render,simplify \
//!     --test far_plants -- --ignored --nocapture
//! ```
#![cfg(all(feature = "measure", feature = "render", feature = "simplify"))]

mod common;

use common::gpu::gpu;
use foliage_lod::{
    Camera, FoliageModel, FoliageRenderer, Instance, Look, LookAt, Plant,
    draw::{Ground, Lighting},
    effects::{Effects, Shadow},
    extract::{Blend, Far, LodPolicy, REFERENCE_FOV_Y, Sight},
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    measure::{Comparison, far_camera, far_cameras},
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
    software::{BakeOptions, Image, SoftwareRenderer, bake, mean_color},
    stochastic::shuffled,
};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use std::path::PathBuf;

/// Diameters in pixels at which likeness is measured: that of the hand-over, and half of it.
const DIAMETERS: [u32; 2] = [64, 32];
/// Height of the eye above the horizon while it turns, in radians, and its step.
const HEIGHT: f64 = 0.25;
const STEP: f64 = std::f64::consts::TAU / 3600.0;

/// What holds of a plant's impostor. Shares are relative to the plant with every leaf.
struct Bounds {
    name: &'static str,
    /// An embedded species, or a file in the folder of trees.
    source: &'static str,
    /// Least structural similarity at both diameters; wanted are 0.92 and 0.95.
    ssim: [f64; 2],
    /// Largest difference of the mean coverage and of one view's; wanted are 0.01 and 0.03.
    coverage: [f64; 2],
    /// Largest difference of the mean luminance; wanted is 0.01.
    light: f64,
    /// Least change per degree of turning; wanted is 0.6. It is never above 1.1.
    change: f64,
    /// Largest difference of the shadow's area; wanted is 0.05.
    shadow: f64,
}

#[derive(Debug)]
struct Measured {
    ssim: [f64; 2],
    /// Differences of the mean, and of the view where it is largest.
    coverage: [f64; 2],
    light: f64,
    /// The same with the sun from behind.
    relit: f64,
    /// Change per degree over the plant's.
    change: f64,
    /// Largest change of a step over that of the middle one.
    step: f64,
    bytes: u64,
    shadow: Option<f64>,
}

fn look(is_far: bool, lighting: Lighting) -> Look {
    Look { far: is_far.then_some(Far { at_px: 1024.0, ..Far::default() }), lighting, ..Look::default() }
}

fn cutouts(model: &FoliageModel, look: Look, cameras: &[Camera]) -> Vec<Image> {
    let mut renderer = SoftwareRenderer::new(look).unwrap();
    let id = renderer.add_model(model).unwrap();
    let plant = Instance::new(id, DAffine3::IDENTITY, model.leaves.len() as f32);
    let draw = |camera: &Camera| renderer.cutout(*camera, &[plant], [camera.height_px; 2]).unwrap().image;
    cameras.par_iter().map(draw).collect()
}

/// Pictures of the impostor, and of every leaf.
fn both(model: &FoliageModel, lighting: Lighting, cameras: &[Camera]) -> [Vec<Image>; 2] {
    [true, false].map(|is_far| cutouts(model, look(is_far, lighting), cameras))
}

fn covered(image: &Image) -> f64 {
    image.rgba.iter().skip(3).step_by(4).map(|&alpha| f64::from(alpha)).sum()
}

/// How much brighter the first pictures are than the second, as a part of these.
fn brighter([far, near]: &[Vec<Image>; 2]) -> f64 {
    let [far, near] = [far, near].map(|images| {
        let [r, g, b] = mean_color(images).map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    });
    far / near - 1.0
}

fn rmse(a: &Image, b: &Image) -> f64 {
    Comparison::of(a, b).unwrap().quality().rmse
}

/// Mean change between views a degree apart, all around.
fn change_per_degree(model: &FoliageModel, is_far: bool) -> f64 {
    let camera = |i: u32| far_camera(&model.sphere(), [f64::from(i / 2 * 50 + i % 2 * 10) * STEP, HEIGHT], 64);
    let cameras: Vec<Camera> = (0..144).map(camera).collect();
    let images = cutouts(model, look(is_far, Lighting::default()), &cameras);
    images.chunks_exact(2).map(|pair| rmse(&pair[0], &pair[1])).sum()
}

/// Largest change of a step of a tenth of a degree, over that of the middle one.
fn largest_step(model: &FoliageModel, steps: u32) -> f64 {
    let camera = |i: u32| far_camera(&model.sphere(), [f64::from(i) * STEP, HEIGHT], 64);
    let cameras: Vec<Camera> = (0..=steps).map(camera).collect();
    let images = cutouts(model, look(true, Lighting::default()), &cameras);
    let mut changes: Vec<f64> = images.windows(2).map(|pair| rmse(&pair[0], &pair[1])).collect();
    changes.sort_by(f64::total_cmp);
    changes[changes.len() - 1] / changes[changes.len() / 2]
}

/// Light that the plant's shadow takes from the ground.
fn shade(gpu: &GpuDevice, model: &FoliageModel, is_far: bool) -> f64 {
    let (device, queue) = (gpu.device(), gpu.queue());
    let sphere = model.sphere();
    let down = sphere.center() - DVec3::Y * sphere.radius * 1.1;
    let eye = sphere.center() + DVec3::new(0.0, 6.0, 3.0) * sphere.radius;
    let near = 0.1 * sphere.radius;
    let camera = LookAt { eye, target: down, up: DVec3::Y, fov_y_radians: 0.7, aspect: 1.0, near }.camera(128);
    let shadow = Shadow { distance: (20.0 * sphere.radius) as f32, lod: 1.0, ..Shadow::default() };
    let lighting = Lighting { towards_sun: Vec3::new(0.4, 0.9, 0.3), ..Lighting::default() };
    let look = Look {
        ground: Some(Ground { color: [0.3; 3], height: down.y, haze: 1e6 }),
        effects: Effects { shadow: Some(shadow), ..Effects::default() },
        ..look(is_far, lighting)
    };
    let mut foliage = FoliageRenderer::new(device, TARGET, look).unwrap();
    let id = foliage.add_model(device, queue, model).unwrap();
    let plant = [Instance::new(id, DAffine3::IDENTITY, model.leaves.len() as f32)];
    let mut light = |casters: &[Instance]| {
        foliage.prepare_with_casters(device, queue, camera, &[], casters).unwrap();
        let image = Offscreen::new(gpu, [128; 2]).unwrap().picture(&foliage).unwrap();
        image.rgba.chunks_exact(4).map(|pixel| (f64::from(pixel[1]) / 255.0).powf(2.2)).sum::<f64>()
    };
    light(&[]) - light(&plant)
}

fn measured(plant: &Plant, steps: u32) -> Measured {
    let mut model = shuffled(plant, 1).unwrap();
    model.impostor = Some(bake(&model, &BakeOptions::default(), &mut |_| true).unwrap());
    let sphere = model.sphere();
    let at = DIAMETERS.map(|px| both(&model, Lighting::default(), &far_cameras(&sphere, px)));
    let ssim = [0, 1].map(|i| {
        let pairs = at[i][1].iter().zip(&at[i][0]);
        let sums = pairs.map(|(near, far)| Comparison::of(near, far).unwrap());
        sums.fold(Comparison::default(), Comparison::plus).quality().ssim
    });
    let own = at[0][0].iter().zip(&at[0][1]).map(|(far, near)| covered(far) / covered(near) - 1.0);
    let worst = own.fold(0.0, |worst: f64, own| if own.abs() > worst.abs() { own } else { worst });
    let [far, near] = [&at[0][0], &at[0][1]].map(|images| images.iter().map(covered).sum::<f64>());
    let towards_sun = Lighting::default().towards_sun * Vec3::new(-1.0, 1.0, -1.0);
    let behind = Lighting { towards_sun, ..Lighting::default() };
    Measured {
        ssim,
        coverage: [far / near - 1.0, worst],
        light: brighter(&at[0]),
        relit: brighter(&both(&model, behind, &far_cameras(&sphere, 64))),
        change: change_per_degree(&model, true) / change_per_degree(&model, false),
        step: largest_step(&model, steps),
        bytes: model.impostor.as_ref().unwrap().gpu_bytes(),
        shadow: gpu().map(|gpu| shade(&gpu, &model, true) / shade(&gpu, &model, false) - 1.0),
    }
}

/// What is out of its bounds.
fn broken(bounds: &Bounds, measured: &Measured) -> Vec<String> {
    let Bounds { name, ssim, coverage, light, change, shadow, .. } = bounds;
    println!("{name}: {measured:.4?}");
    let Measured { step, bytes, .. } = *measured;
    let holds = [
        ("ssim", measured.ssim.iter().zip(ssim).all(|(found, least)| found >= least)),
        ("coverage", measured.coverage.iter().zip(coverage).all(|(found, most)| found.abs() <= *most)),
        ("light", measured.light.abs() <= *light),
        ("relit", measured.relit.abs() <= 0.05),
        ("change", (*change..=1.1).contains(&measured.change)),
        ("step", step <= 2.0),
        ("shadow", measured.shadow.is_none_or(|found| found.abs() <= *shadow)),
        ("bytes", bytes <= 6 << 20),
    ];
    let broken = holds.into_iter().filter(|(_, holds)| !holds);
    broken.map(|(what, _)| format!("{what} of {name}: {measured:?}")).collect()
}

fn grown(name: &str, leaves: Option<u32>) -> Plant {
    grow(&Species::embedded(name).unwrap(), &GrowOptions { leaves, ..GrowOptions::default() }).unwrap()
}

#[test]
fn the_impostor_of_a_small_birch_is_like_it() {
    let bounds = Bounds {
        name: "birch of 1,500 leaves",
        source: "",
        ssim: [0.92, 0.95],
        coverage: [0.01, 0.03],
        light: 0.02,
        // Three pictures are blended, which averages some of the twinkling out.
        change: 0.5,
        shadow: 0.05,
    };
    let broken = broken(&bounds, &measured(&grown("betula-populifolia", Some(1500)), 600));
    assert!(broken.is_empty(), "{broken:#?}");
}

const PLANTS: [Bounds; 8] = [
    // Leaves are finer than a frame's texels, so likeness falls short.
    Bounds {
        name: "oak",
        source: "english-oak",
        ssim: [0.9, 0.94],
        coverage: [0.01, 0.03],
        light: 0.01,
        change: 0.55,
        shadow: 0.05,
    },
    // Brightness is matched on average over three suns, not under each; leaves twinkle in the sun.
    Bounds {
        name: "birch",
        source: "betula-populifolia",
        ssim: [0.92, 0.95],
        coverage: [0.01, 0.03],
        light: 0.025,
        change: 0.45,
        shadow: 0.05,
    },
    // As of the oak.
    Bounds {
        name: "pecan",
        source: "carya-illinoinensis",
        ssim: [0.92, 0.94],
        coverage: [0.01, 0.03],
        light: 0.01,
        change: 0.5,
        shadow: 0.05,
    },
    // Fronds seen along their blades are thinner than a texel, and there are only 29.
    Bounds {
        name: "palm",
        source: "realistic_palm_10.glb",
        ssim: [0.92, 0.93],
        coverage: [0.01, 0.05],
        light: 0.015,
        change: 0.45,
        shadow: 0.09,
    },
    // Its 35 cards are dark on one side, so the light depends on the view.
    Bounds {
        name: "pine",
        source: "Pine_1.glb",
        ssim: [0.92, 0.95],
        coverage: [0.01, 0.03],
        light: 0.015,
        change: 0.6,
        shadow: 0.06,
    },
    // Four ferns apart, and low: between two rows of frames, 0 and about 17 degrees above the
    // horizon, one shows the ferns in front alone and the other those behind too, so that what only
    // one of them sees is half there. Views from 5 to 11 degrees lack a tenth, those from 23 to 29
    // have 5 % more; on the rows all is right. Sprites are up to 3 % darker.
    Bounds {
        name: "ferns",
        source: "fern_02.glb",
        ssim: [0.92, 0.95],
        coverage: [0.01, 0.11],
        light: 0.03,
        change: 0.6,
        shadow: 0.06,
    },
    // As of the oak.
    Bounds {
        name: "eztree-oak",
        source: "eztree_oak_medium.glb",
        ssim: [0.92, 0.94],
        coverage: [0.01, 0.03],
        light: 0.01,
        change: 0.6,
        shadow: 0.05,
    },
    // A thin crown of single leaves against the sky, each smaller than a texel.
    Bounds {
        name: "maple",
        source: "sapling_maple_12k_hex.glb",
        ssim: [0.75, 0.86],
        coverage: [0.01, 0.03],
        light: 0.03,
        change: 0.3,
        shadow: 0.06,
    },
];

#[test]
#[ignore = "takes minutes and needs FOLIAGE_TREES"]
fn impostors_of_eight_plants_are_like_them() {
    let trees = PathBuf::from(std::env::var("FOLIAGE_TREES").expect("FOLIAGE_TREES names the folder of the trees"));
    let mut all = Vec::new();
    for bounds in PLANTS {
        let plant = match bounds.source.ends_with(".glb") {
            true => load(&trees.join(bounds.source), &ImportOptions::default()).unwrap().plant,
            false => grown(bounds.source, None),
        };
        all.extend(broken(&bounds, &measured(&plant, 3600)));
    }
    assert!(all.is_empty(), "{all:#?}");
}

/// Side of the pictures of a hand-over, the diameters between which a camera backs away, and that
/// at which it turns: the band of a plant whose seed is 0 is from 68 to 44 pixels.
const HANDOVER_PX: u32 = 80;
const BACKS_AWAY: [f64; 2] = [72.0, 42.0];
const TURNS_AT: f64 = 54.4;

/// How plants are drawn on the way.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    HandedOver,
    Leaves,
    EveryLeaf,
}

/// Pictures of a plant from directions at diameters, with the leaves of the default policy on a
/// screen of 1080 rows.
fn on_the_way(model: &FoliageModel, way: Way, views: &[(f64, f64)]) -> Vec<Image> {
    let far = (way == Way::HandedOver).then(Far::default);
    let mut renderer = SoftwareRenderer::new(Look { far, ..Look::default() }).unwrap();
    let id = renderer.add_model(model).unwrap();
    let (sphere, leaves) = (model.sphere(), model.leaves.len() as f32);
    let (policy, radius) = (Blend::default(), sphere.radius as f32);
    let draw = |&(px, turn): &(f64, f64)| {
        let slope = f64::from(0.5 * REFERENCE_FOV_Y).tan() * px / 1080.0;
        let distance = (sphere.radius / slope) as f32;
        let lod = policy.lod(&Sight { distance, radius, fov_y: REFERENCE_FOV_Y, height_px: 1080.0 });
        let (count, least) = if way == Way::EveryLeaf { (leaves, None) } else { (lod * leaves, Some(policy.far(lod))) };
        let plant = Instance { far: least, ..Instance::new(id, DAffine3::IDENTITY, count) };
        let direction = DVec3::new(turn.sin(), 0.2, turn.cos());
        let look = LookAt::framing(&sphere, direction, 0.1, f64::from(HANDOVER_PX) / px);
        renderer.draw(look.camera(HANDOVER_PX), &[plant], [HANDOVER_PX; 2]).unwrap().image
    };
    views.par_iter().map(draw).collect()
}

/// Largest change from picture to picture, and after which it is.
fn largest_change(images: &[Image]) -> (f64, usize) {
    let changes = images.windows(2).map(|pair| rmse(&pair[0], &pair[1]));
    changes.zip(0..).fold((0.0, 0), |most, next| if next.0 > most.0 { next } else { most })
}

/// Writes every n-th picture of all ways below each other, if a folder is asked for.
fn write_sheet(name: &str, ways: &[Vec<Image>]) {
    let Some(folder) = std::env::var_os("FOLIAGE_SHEETS") else { return };
    let (across, side) = (24, HANDOVER_PX + 2);
    let mut sheet = Image::filled(across * side, ways.len() as u32 * side, [60, 60, 60, 255]);
    for (row, images) in (0..).zip(ways) {
        for (column, image) in (0..across).zip(images.iter().step_by(images.len() / across as usize)) {
            sheet.paste(image, column * side, row * side);
        }
    }
    sheet.write_png(PathBuf::from(folder).join(format!("{name}.png"))).unwrap();
}

#[test]
#[ignore = "takes minutes"]
fn a_dolly_and_a_turn_through_the_band_change_no_more_at_once_than_the_plant_does() {
    let [from, to] = BACKS_AWAY;
    let dolly: Vec<(f64, f64)> = (0..300).map(|i| (from * (to / from).powf(f64::from(i) / 299.0), 0.46)).collect();
    let turn: Vec<(f64, f64)> = (0..360).map(|i| (TURNS_AT, f64::from(i).to_radians())).collect();
    for name in ["english-oak", "betula-populifolia"] {
        let options = SimplifyOptions::fast();
        let mut model = simplify(&grown(name, None), &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        model.impostor = Some(bake(&model, &BakeOptions::default(), &mut |_| true).unwrap());
        for (path, views) in [("dolly", &dolly), ("turn", &turn)] {
            let ways = [Way::HandedOver, Way::Leaves, Way::EveryLeaf].map(|way| on_the_way(&model, way, views));
            write_sheet(&format!("{name}-{path}"), &ways);
            let [own, leaves, every] = [0, 1, 2].map(|way| {
                let (change, at) = largest_change(&ways[way]);
                (change, views[at].0, views[at].1.to_degrees())
            });
            println!("{name}, {path}: {own:.3?} by leaves {leaves:.3?}, every leaf {every:.3?}");
            assert!(own.0 < 1.25 * every.0, "{name}, {path}: {own:?} against {every:?}");
        }
    }
}
