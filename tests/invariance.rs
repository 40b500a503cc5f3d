//! A world a million times larger or smaller, or a million units away, produces the same results.
#![cfg(all(feature = "render", feature = "simplify"))]

#[path = "common/glb.rs"]
mod glb;
#[path = "common/gpu.rs"]
mod gpu;

use foliage_lod::{
    FoliageModel, FoliageRenderer, Grove, Instance, Look, LookAt, Plant,
    export::write_glb,
    gpu::{Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, Imported, load_gltf_bytes},
    leaf::Vertex,
    scene::{Kind, Placement},
    simplify::{CpuFragments, Quiet, Simplified, SimplifyOptions, simplify},
    software::{DrawList, DrawOptions, Image, Painter, Placed, draw_model},
};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use glb::Gltf;
use serde_json::json;
use std::path::Path;

/// A world relative to one of ordinary size at the origin: its scale and where its origin is.
#[derive(Debug, Clone, Copy)]
struct World {
    scale: f64,
    shift: DVec3,
}

const HERE: World = World { scale: 1.0, shift: DVec3::ZERO };
const AWAY: DVec3 = DVec3::new(1e6, -0.3e6, 0.7e6);
const WORLDS: [World; 4] = [
    World { scale: 1e-6, shift: DVec3::ZERO },
    World { scale: 1e6, shift: DVec3::ZERO },
    World { scale: 1.0, shift: AWAY },
    World { scale: 1e6, shift: AWAY },
];
const SIZE: [u32; 2] = [192, 160];

impl World {
    fn point(&self, point: DVec3) -> DVec3 {
        point * self.scale + self.shift
    }

    fn place(&self, place: &DAffine3) -> DAffine3 {
        DAffine3 { matrix3: place.matrix3 * self.scale, translation: self.point(place.translation) }
    }

    fn camera(&self, camera: &LookAt) -> LookAt {
        let [eye, target] = [camera.eye, camera.target].map(|point| self.point(point));
        LookAt { eye, target, near: camera.near * self.scale, ..*camera }
    }
}

fn birch(leaves: u32) -> Plant {
    let options = GrowOptions { leaves: Some(leaves), ..GrowOptions::default() };
    grow(&Species::embedded("betula-populifolia").unwrap(), &options).unwrap()
}

fn simplified(plant: &Plant, options: SimplifyOptions) -> Simplified {
    let options = SimplifyOptions { resolution: 64, ..options };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap()
}

/// A model, the transforms of three plants of it, and a camera.
fn scene() -> (FoliageModel, [DAffine3; 3], LookAt) {
    let model = simplified(&birch(300), SimplifyOptions::paper()).model;
    let radius = model.sphere().radius;
    let camera = LookAt::framing(&model.sphere(), DVec3::new(0.4, 0.3, 1.0), 0.8, 1.2).with_aspect(1.2);
    let place = |x: f64, z: f64, turn: f64| DAffine3 {
        translation: DVec3::new(x, 0.0, z) * radius,
        ..DAffine3::from_rotation_y(turn)
    };
    (model, [place(0.0, 0.0, 0.0), place(-1.0, -3.0, 1.0), place(2.0, -9.0, 2.0)], camera)
}

/// A picture of the first `n` leaves, framed from the side.
fn picture(model: &FoliageModel, n: usize) -> Image {
    let camera = LookAt::framing(&model.sphere(), DVec3::new(0.4, 0.3, 1.0), 0.8, 1.2);
    draw_model(model, n, &camera.camera(160), [160; 2], &DrawOptions::default()).unwrap()
}

/// Mean difference over all channels, from 0 to 1.
fn difference(a: &Image, b: &Image) -> f64 {
    let sum: u64 = a.rgba.iter().zip(&b.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / (255 * a.rgba.len()) as f64
}

#[test]
fn instances_and_camera_moved_and_scaled_together_give_the_same_counts() {
    let (model, _, camera) = scene();
    let golden = |i: u32| f64::from(i) * 2.4;
    let places: Vec<DAffine3> = (0..200)
        .map(|i| {
            let away = 3.0 * f64::from(i + 1) * model.sphere().radius;
            DAffine3::from_rotation_translation(
                DQuat::from_rotation_y(golden(i)),
                DVec3::new(golden(i).cos(), 0.0, golden(i).sin()) * away,
            )
        })
        .collect();
    let counts = |world: &World| {
        let placement = |place: &DAffine3| Placement { kind: 0, world_from_plant: world.place(place) };
        let placements: Vec<Placement> = places.iter().map(placement).collect();
        let mut active = Vec::new();
        Grove::new(vec![Kind::new(&model)], &placements)
            .unwrap()
            .select(&world.camera(&camera).camera(1080), &mut active);
        active
    };
    let expected = counts(&HERE);
    assert!(expected.len() > 20);
    for world in WORLDS {
        let found = counts(&world);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.instance, expected.instance);
            assert!((found.count / expected.count - 1.0).abs() < 1e-5, "{found:?}, {expected:?} in {world:?}");
        }
    }
}

#[test]
fn instances_and_camera_moved_and_scaled_together_give_the_same_picture() {
    let (model, places, camera) = scene();
    let list = DrawList::of_model(&model, 150);
    let painter = Painter::new(&model.materials, &model.textures).unwrap();
    let on_cpu = |world: &World| {
        let placed = places.each_ref().map(|place| Placed::new(&list, world.place(place)));
        painter.draw_placed(&placed, &world.camera(&camera).camera(SIZE[1]), SIZE, &DrawOptions::default()).unwrap()
    };
    let expected = on_cpu(&HERE);
    for world in WORLDS {
        let found = difference(&on_cpu(&world), &expected);
        assert!(found < 1e-5, "{found} on the CPU in {world:?}");
    }
    let Some(gpu) = gpu::gpu() else { return };
    let target = Offscreen::new(&gpu, SIZE).unwrap();
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, Look::default()).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), &model).unwrap();
    let mut on_gpu = |world: &World| {
        let instances = places.each_ref().map(|place| Instance::new(id, world.place(place), 150.0));
        foliage.prepare(gpu.device(), gpu.queue(), world.camera(&camera).camera(SIZE[1]), &instances).unwrap();
        target.picture(&foliage).unwrap()
    };
    let expected = on_gpu(&HERE);
    for world in WORLDS {
        let found = difference(&on_gpu(&world), &expected);
        assert!(found < 1e-5, "{found} on the GPU in {world:?}");
    }
}

/// The plant imported from a file whose only scene is under a node with the transform of `world`.
fn imported(plant: &Plant, world: &World) -> Imported {
    let mut file = Gltf::of(&write_glb(plant).unwrap());
    let roots = file.json["scenes"][0]["nodes"].clone();
    let (translation, scale) = (world.shift.to_array(), [world.scale; 3]);
    let nodes = file.json["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "children": roots, "translation": translation, "scale": scale }));
    file.json["scenes"][0]["nodes"] = json!([nodes.len() - 1]);
    load_gltf_bytes(&file.glb(), Path::new("birch.glb"), &ImportOptions::default()).unwrap()
}

/// Pivots and centres of all leaves and centres of all wood triangles, relative to the plant's
/// centre and in units of its radius.
fn relative(plant: &Plant) -> Vec<DVec3> {
    let sphere = plant.sphere();
    let position = |position: [f32; 3]| (Vec3::from(position).as_dvec3() - sphere.center()) / sphere.radius;
    let middles = |vertices: &[Vertex], indices: &[u32]| -> Vec<DVec3> {
        let corners = indices.iter().map(|&index| position(vertices[index as usize].position));
        corners.collect::<Vec<_>>().chunks(3).map(|corners| corners.iter().sum::<DVec3>() / 3.0).collect()
    };
    let pivots = plant.leaves.iter().map(|leaf| position(leaf.pivot));
    let of_leaves = plant.leaves.iter().map(|leaf| {
        let middles = middles(&plant.vertices, &plant.indices[leaf.index_range()]);
        middles.iter().sum::<DVec3>() / middles.len() as f64
    });
    pivots.chain(of_leaves).chain(middles(&plant.wood.vertices, &plant.wood.indices)).collect()
}

/// Decimal factors round the numbers in the file, so a few fragments in a hundred thousand differ,
/// and ties may be broken differently.
#[test]
fn a_node_that_moves_and_scales_the_plant_changes_it_by_rounding_alone() {
    let plant = birch(1000);
    let here = imported(&plant, &HERE);
    assert_eq!(here.origin, [0.0; 3]);
    let expected = simplified(&here.plant, SimplifyOptions::paper());
    let errors = |model: &FoliageModel| {
        let full = picture(model, 1000);
        [500, 150].map(|n| difference(&picture(model, n), &full))
    };
    let expected_errors = errors(&expected.model);
    for world in WORLDS {
        let there = imported(&plant, &world);
        let is_far = world.shift.length() > 200.0 * there.plant.sphere().radius;
        assert_eq!([there.origin != [0.0; 3], there.warnings.len() == 1], [is_far; 2], "{world:?}");
        let pairs = relative(&here.plant).into_iter().zip(relative(&there.plant));
        let farthest = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(farthest < 1e-6, "{farthest} in {world:?}");
        let found = simplified(&there.plant, SimplifyOptions::paper());
        let ratio = found.fragments as f64 / expected.fragments as f64;
        assert!((ratio - 1.0).abs() < 2e-4, "{ratio} in {world:?}");
        let full = difference(&picture(&found.model, 1000), &picture(&expected.model, 1000));
        assert!(full < 1e-5, "{full} in {world:?}");
        for (found, expected) in errors(&found.model).into_iter().zip(expected_errors) {
            assert!((found / expected - 1.0).abs() < 0.01, "{found} for {expected} in {world:?}");
        }
    }
}

#[test]
fn a_node_that_scales_the_plant_by_a_power_of_two_changes_no_choice() {
    let plant = birch(300);
    for options in [SimplifyOptions::paper(), SimplifyOptions::balanced(), SimplifyOptions::best()] {
        let choices = |exponent: i32| {
            let world = World { scale: 2_f64.powi(exponent), ..HERE };
            let model = simplified(&imported(&plant, &world).plant, options.clone()).model;
            model
                .leaves
                .iter()
                .map(|leaf| (leaf.leaf_to_split, leaf.scale.to_bits(), leaf.error.to_bits()))
                .collect::<Vec<_>>()
        };
        let expected = choices(0);
        assert!(choices(-20) == expected && choices(20) == expected, "{}", options.preset);
    }
}
