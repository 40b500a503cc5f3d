//! Files of models: what version 2 keeps, what quantisation changes, and how small it gets.
#![cfg(all(feature = "simplify", feature = "measure"))]

mod common;
#[path = "common/glb.rs"]
mod glb;
#[path = "common/memory.rs"]
mod memory;

use common::{
    models::{all_options, model_of},
    plants, version1, version2,
};
use foliage_lod::{
    Error, FoliageModel, Plant,
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load_gltf_bytes},
    leaf::Vertex,
    model::{ModelFile, Precision, Prune, Recipe},
    software::{DrawOptions, draw_model},
};
use glam::{Mat3, Quat, Vec3};
use glb::{Gltf, cards};
use memory::within_bounds;
use proptest::prelude::*;
use serde_json::json;
use std::path::Path;

/// Any small plant, scaled and moved, some of its numbers far out of the ordinary.
fn any_plant() -> impl Strategy<Value = Plant> {
    let scale = prop_oneof![Just(1.0_f32), Just(1e-30), Just(1e-6), Just(1e6), 0.1..10.0_f32];
    let odd = (0..6, prop_oneof![Just(-0.0_f32), Just(0.1), Just(1e9), Just(1e-40), Just(-3.7)]);
    (0..7, 1..30_usize, any::<u64>(), scale, 0.0..100.0_f32, odd).prop_map(|(kind, leaves, seed, scale, far, odd)| {
        let mut plant = match kind {
            0 => plants::quads(leaves, 3.0, seed),
            1 => plants::bent(leaves, seed),
            2 => plants::crossed(leaves, seed),
            3 => plants::twins(leaves + 1, seed),
            4 => plants::with_wood(leaves, seed),
            5 => plants::repeated(leaves, seed),
            _ => plants::masked(leaves, seed),
        };
        let moved = |point: [f32; 3]| point.map(|x| (x + far) * scale);
        plant.vertices.iter_mut().chain(&mut plant.wood.vertices).for_each(|v| v.position = moved(v.position));
        plant.leaves.iter_mut().for_each(|leaf| leaf.pivot = moved(leaf.pivot));
        let middle = plant.vertices.len() / 2;
        match odd {
            (0, number) => plant.vertices[middle].uv[1] = number,
            (1, number) => plant.vertices[middle].color[0] = number,
            (2, number) => plant.vertices[middle].normal[2] = number,
            (3, number) => plant.vertices[middle].color[3] = number,
            _ => {}
        }
        plant
    })
}

/// Every bit of the model.
fn bits(model: &FoliageModel) -> (Vec<u8>, Precision) {
    (version1::bytes(model), model.precision)
}

fn any_model(plant: &Plant, options: usize) -> FoliageModel {
    model_of(plant, &all_options(16)[options])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn files_keep_every_bit_and_are_written_as_they_were_read(plant in any_plant(), options in 0..24_usize) {
        let exact = any_model(&plant, options);
        let mut quantized = exact.clone();
        quantized.quantize();
        for model in [exact, quantized] {
            let bytes = model.to_bytes().unwrap();
            let read = FoliageModel::from_bytes(&bytes).unwrap();
            prop_assert!(bits(&read) == bits(&model) && read.copies == model.copies);
            prop_assert!(read.to_bytes().unwrap() == bytes);
        }
    }

    #[test]
    fn quantized_models_are_sound_and_within_their_precision(plant in any_plant(), options in 0..24_usize) {
        let exact = any_model(&plant, options);
        let mut model = exact.clone();
        model.quantize();
        prop_assert!(model.validate().is_ok());
        let Precision { position, normal_rad, uv, color } = model.precision;
        let near = |a: &[f32], b: &[f32], error: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= error * 1.000_01);
        let all = |model: &FoliageModel| -> Vec<Vertex> { model.vertices.iter().chain(&model.wood.vertices).copied().collect() };
        for (old, new) in all(&exact).iter().zip(&all(&model)) {
            prop_assert!(near(&old.position, &new.position, position), "{:?} {:?} {}", old, new, position);
            prop_assert!(Vec3::from(old.normal).distance(Vec3::from(new.normal)) <= normal_rad + 1e-3 * f32::from(normal_rad > 0.0));
            prop_assert!(near(&old.uv, &new.uv, uv) && near(&old.color[..3], &new.color[..3], color));
            prop_assert!(old.color[3].to_bits() == new.color[3].to_bits());
        }
        for (old, new) in exact.leaves.iter().zip(&model.leaves) {
            prop_assert!(near(&old.pivot, &new.pivot, position));
            let record = foliage_lod::model::Leaf { pivot: old.pivot, ..new.clone() };
            prop_assert!(record == *old, "everything else is exact");
        }
        let size = exact.aabb().size().max_element();
        let far = exact.sphere().center().length() as f32 * 2.0_f32.powi(-22);
        prop_assert!(position <= size / 65_536.0 + far, "{} of {}", position, size);
        let mut again = model.clone();
        again.quantize();
        prop_assert!(bits(&again) == bits(&model));
    }

    #[test]
    fn files_of_version_1_are_read_and_equal(plant in any_plant(), options in 0..24_usize) {
        let model = any_model(&plant, options);
        let file = ModelFile::from_bytes(&version1::bytes(&model)).unwrap();
        prop_assert!(file.version == 1 && bits(&file.model) == bits(&model));
    }
}

#[test]
fn numbers_that_no_grid_suits_stay_exact() {
    let quantized = |change: fn(&mut Vertex)| {
        let mut model = any_model(&plants::masked(12, 1), 0);
        change(&mut model.plant.vertices[5]);
        model.quantize();
        model.precision
    };
    let usual = quantized(|_| {});
    assert!([usual.position, usual.normal_rad, usual.uv, usual.color].iter().all(|&error| error > 0.0));
    assert_eq!(quantized(|vertex| vertex.normal = [0.0; 3]), Precision { normal_rad: 0.0, ..usual });
    assert_eq!(quantized(|vertex| vertex.uv[0] = 1e5), Precision { uv: 0.0, ..usual });
    assert_eq!(quantized(|vertex| vertex.color[2] = 1e5), Precision { color: 0.0, ..usual });
    assert_eq!(quantized(|vertex| vertex.position[0] = 1e31).position, 0.0);
}

fn sections() -> version2::Sections {
    version2::Sections::of(&any_model(&plants::masked(12, 1), 0).to_bytes().unwrap())
}

#[test]
fn unknown_sections_are_skipped_and_told_unless_they_are_required() {
    let model = FoliageModel::from_bytes(&sections().file()).unwrap();
    for at in 0..=sections().0.len() {
        let with = |flags| {
            let mut sections = sections();
            sections.0.insert(at, version2::Section { tag: *b"FARI", flags, bytes: vec![1; 99] });
            ModelFile::from_bytes(&sections.file())
        };
        let file = with(0).unwrap();
        assert_eq!(file.model, model);
        assert_eq!((file.skipped[0].name.as_str(), file.skipped[0].bytes), ("FARI", 99));
        assert!(with(2).is_ok(), "flags without meaning are ignored");
        let refused = with(1).unwrap_err();
        assert!(matches!(refused, Error::Unsupported { .. }) && refused.to_string().contains("FARI"), "{refused}");
    }
}

#[test]
fn sections_that_lack_occur_twice_or_overlap_are_refused() {
    let refused = |change: &dyn Fn(&mut version2::Sections)| {
        let mut sections = sections();
        change(&mut sections);
        FoliageModel::from_bytes(&sections.file()).unwrap_err().to_string()
    };
    for index in 0..sections().0.len() {
        let tag = String::from_utf8(sections().0[index].tag.to_vec()).unwrap();
        assert!(refused(&|sections| drop(sections.0.remove(index))).contains(&format!("no section {tag}")));
        let twice = refused(&|sections| sections.0.push(sections.0[index].clone()));
        assert!(twice.contains(&format!("section {tag} occurs twice")), "{twice}");
    }
    let mut shuffled = sections();
    shuffled.0.reverse();
    assert!(FoliageModel::from_bytes(&shuffled.file()).is_ok(), "their order is free");
}

#[test]
fn an_intrinsic_cost_has_a_section_unless_it_is_0_and_is_refused_out_of_range() {
    let with = |bytes: &[u8]| {
        let mut sections = sections();
        sections.0.push(version2::Section { tag: *b"INTR", flags: 0, bytes: bytes.to_vec() });
        FoliageModel::from_bytes(&sections.file())
    };
    assert_eq!(FoliageModel::from_bytes(&sections().file()).unwrap().recipe.intrinsic, 0.0);
    let model = with(&0.01_f32.to_le_bytes()).unwrap();
    assert_eq!(model.recipe.intrinsic, 0.01);
    assert_eq!(FoliageModel::from_bytes(&model.to_bytes().unwrap()).unwrap(), model);
    for bytes in [f32::NAN, -0.1, 1.5, f32::INFINITY].map(f32::to_le_bytes) {
        let refused = with(&bytes).unwrap_err().to_string();
        assert!(refused.contains("INTR") && !refused.contains('\n'), "{refused}");
    }
    assert!(with(&[0; 3]).is_err() && with(&[0; 5]).is_err());
}

/// Counts of an `ABOU` section: its last five numbers, of leaves, vertices, indices, and of the
/// wood's vertices and indices.
#[test]
fn counts_that_a_file_does_not_account_for_are_refused_before_memory_is_taken() {
    for count in 0..5 {
        for number in [1 << 20, 1 << 22, (1 << 22) + 1, 1 << 27, 1 << 40, u64::MAX] {
            let mut sections = sections();
            let about = &mut sections.0[0].bytes;
            let at = about.len() - 40 + 8 * count;
            about[at..at + 8].copy_from_slice(&number.to_le_bytes());
            let file = sections.file();
            let (read, _) = within_bounds(file.len() as u64, || FoliageModel::from_bytes(&file));
            assert!(matches!(read, Err(Error::Unreadable { .. } | Error::InvalidModel { .. })), "{count}: {number}");
        }
    }
}

/// A model of the plant whose leaves go in random order.
fn shuffled(plant: &Plant) -> FoliageModel {
    let mut random = plants::Random(7);
    let mut order: Vec<u32> = (0..plant.leaves.len() as u32).collect();
    order.sort_by_cached_key(|_| random.next());
    let mut scale = 1.0;
    let prune = |step: usize| {
        scale *= 1.000_01;
        Prune { leaf: order[step], target: order[step + 1], target_scale: scale, error: 0.01 * step as f32 }
    };
    let prunes: Vec<Prune> = (0..order.len() - 1).map(prune).collect();
    FoliageModel::assemble(plant, &prunes, Recipe::default()).unwrap()
}

/// A tuft of `leaves` cards with normals, each turned and placed at random, in `tufts` instances
/// that are turned, placed and scaled at random.
fn instanced(leaves: u16, tufts: usize) -> Gltf {
    let mut random = plants::Random(3);
    let mut between = |low: f32, high: f32| low + (high - low) * (random.next() >> 40) as f32 / (1 << 24) as f32;
    let mut anywhere = |reach: f32| Vec3::from_array([0; 3].map(|_| between(-reach, reach)));
    let mut file = cards(leaves);
    let mut normals = Vec::new();
    for card in 0..usize::from(leaves) {
        let turned = Quat::from_scaled_axis(anywhere(3.0));
        let place = anywhere(1.0);
        let axes = Mat3::from_quat(turned);
        for (corner, [x, y]) in [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].into_iter().enumerate() {
            let position = place + axes.x_axis * x + axes.y_axis * y;
            let at = (card * 4 + corner) * 12;
            file.buffer[at..at + 12].copy_from_slice(bytemuck::bytes_of(&position));
            normals.extend_from_slice(bytemuck::bytes_of(&axes.z_axis));
        }
    }
    let of = |kind: &str, count: usize| json!({ "componentType": 5126, "type": kind, "count": count });
    let normals = file.push(&normals, of("VEC3", usize::from(leaves) * 4));
    let turns: Vec<[f32; 4]> = (0..tufts).map(|_| Quat::from_scaled_axis(anywhere(3.0)).to_array()).collect();
    let places: Vec<Vec3> = (0..tufts).map(|_| anywhere(5.0)).collect();
    let sizes: Vec<Vec3> = (0..tufts).map(|_| Vec3::splat(1.0 + 0.5 * anywhere(0.5).x)).collect();
    let turns = file.push(bytemuck::cast_slice(&turns), of("VEC4", tufts));
    let places = file.push(bytemuck::cast_slice(&places), of("VEC3", tufts));
    let sizes = file.push(bytemuck::cast_slice(&sizes), of("VEC3", tufts));
    let attributes = json!({ "TRANSLATION": places, "ROTATION": turns, "SCALE": sizes });
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file
}

/// A model of leaves that repeat two shapes, exact and quantized.
fn repeated(leaves: usize) -> [FoliageModel; 2] {
    let exact = shuffled(&plants::repeated(leaves, 5));
    let mut quantized = exact.clone();
    quantized.quantize();
    [exact, quantized]
}

#[test]
fn leaves_that_repeat_two_shapes_take_at_most_40_bytes_and_look_the_same() {
    let [exact, model] = repeated(3000);
    let shapes: std::collections::BTreeSet<u32> = model.copies.iter().map(|copy| copy.of).collect();
    assert_eq!((shapes.len(), model.copies.len()), (2, 2998));
    let Precision { position, normal_rad, .. } = model.precision;
    for (old, new) in exact.vertices.iter().zip(&model.vertices) {
        let near = |a: f32, b: f32| (a - b).abs() <= position * 1.000_01;
        assert!(old.position.iter().zip(&new.position).all(|(a, b)| near(*a, *b)), "{old:?} {new:?} {position}");
        assert!(Vec3::from(old.normal).distance(new.normal.into()) <= normal_rad * 1.001, "{old:?} {new:?}");
    }
    let bytes = model.to_bytes().unwrap();
    println!("{:.1} bytes a leaf of 24 vertices", bytes.len() as f64 / 3000.0);
    // What is read takes 1.7 kB of memory a leaf, which the file has to account for.
    assert!(bytes.len() < 40 * 3000);
    let (read, _) = within_bounds(bytes.len() as u64, || FoliageModel::from_bytes(&bytes).unwrap());
    assert!(bits(&read) == bits(&model) && read.copies == model.copies);
    let difference = difference(&exact, &model);
    assert!(difference < 0.2, "pictures differ by {difference:.3} of 255");
}

#[test]
fn copies_that_do_not_give_every_bit_of_their_leaf_are_stored_as_other_leaves() {
    let [_, model] = repeated(60);
    let copies = model.copies.len();
    assert!(copies > 50);
    let changes: [fn(&mut FoliageModel); 7] = [
        |model| model.plant.vertices[1400].position[0] += 0.1,
        |model| model.plant.vertices[1400].uv[0] += 1e-3,
        |model| model.copies[9].turn.others[1] += 1e-3,
        |model| model.copies[9].of = u32::MAX,
        |model| model.copies[9].of = model.copies[9].leaf,
        |model| model.copies[9].of = model.copies[8].leaf,
        |model| model.copies[9].leaf = 0,
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut changed = model.clone();
        change(&mut changed);
        let read = FoliageModel::from_bytes(&changed.to_bytes().unwrap()).unwrap();
        assert!(bits(&read) == bits(&changed), "change {number}");
        assert_eq!(read.copies.len(), copies - 1, "change {number}");
    }
}

#[test]
fn models_without_shapes_have_no_copies_and_no_section_of_shapes() {
    let [exact, _] = repeated(60);
    let mut different = shuffled(&plants::bent(60, 1));
    different.quantize();
    for model in [exact, different] {
        let sections = version2::Sections::of(&model.to_bytes().unwrap());
        assert!(model.copies.is_empty() && sections.0.iter().all(|section| section.tag != *b"SHAP"));
    }
}

/// Readers from before shapes refuse files with them: the section is required.
#[test]
fn the_section_of_shapes_is_required_and_its_counts_are_checked_before_memory_is_taken() {
    let [_, model] = repeated(60);
    let sections = version2::Sections::of(&model.to_bytes().unwrap());
    let shapes = sections.0.iter().position(|section| section.tag == *b"SHAP").unwrap();
    assert_eq!(sections.0[shapes].flags, 1);
    let refused = |change: &dyn Fn(&mut version2::Section)| {
        let mut sections = sections.clone();
        change(&mut sections.0[shapes]);
        let file = sections.file();
        let (read, _) = within_bounds(file.len() as u64, || FoliageModel::from_bytes(&file));
        read.unwrap_err().to_string()
    };
    assert!(refused(&|section| section.tag = *b"SHAQ").contains("SHAQ"));
    let own = u64::from_le_bytes(sections.0[shapes].bytes[..8].try_into().unwrap());
    for number in [0, own - 1, own + 1, 1 << 20, 1 << 40, u64::MAX] {
        let message = refused(&|section| section.bytes[..8].copy_from_slice(&number.to_le_bytes()));
        assert!(message.contains("damaged"), "{message}");
    }
}

#[test]
fn a_plant_of_72000_instanced_leaves_from_251_kb_takes_at_most_6_mb() {
    let input = instanced(1800, 40).glb();
    let plant = load_gltf_bytes(&input, Path::new("tufts.glb"), &ImportOptions::default()).unwrap().plant;
    assert_eq!(plant.leaves.len(), 72_000);
    let mut model = shuffled(&plant);
    model.quantize();
    let bytes = model.to_bytes().unwrap();
    println!("{} bytes from {}: {:.1} a leaf", bytes.len(), input.len(), bytes.len() as f64 / 72_000.0);
    assert!(input.len() < 260_000 && bytes.len() < 6_000_000);
    let (read, held) = within_bounds(bytes.len() as u64, || FoliageModel::from_bytes(&bytes).unwrap());
    println!("{:.1} bytes of memory per byte", held as f64 / bytes.len() as f64);
    assert!(bits(&read) == bits(&model));
}

/// The whole oak, with wood and textures: 80 bytes a leaf, and pictures of 256 pixels whose bytes
/// differ by 0.2 on average.
#[test]
fn the_oak_takes_at_most_80_bytes_a_leaf_and_looks_the_same() {
    let plant = grow(&Species::embedded("english-oak").unwrap(), &GrowOptions::default()).unwrap();
    let exact = shuffled(&plant);
    let mut packed = exact.clone();
    packed.quantize();
    let bytes = packed.to_bytes().unwrap();
    println!("{} bytes, exact {}", bytes.len(), exact.to_bytes().unwrap().len());
    assert!(bytes.len() < 1_600_000);
    let difference = difference(&exact, &packed);
    println!("pictures differ by {difference:.3} of 255");
    assert!(difference < 0.2);
}

/// Mean difference of all bytes of the models' pictures.
fn difference(one: &FoliageModel, other: &FoliageModel) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for camera in foliage_lod::measure::cameras(&one.sphere()) {
        let camera = camera.camera(256);
        let picture =
            |model| draw_model(model, one.leaves.len(), &camera, [256; 2], &DrawOptions::default()).unwrap().rgba;
        let [one, other] = [one, other].map(picture);
        sum += one.iter().zip(&other).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
        count += one.len() as f64;
    }
    sum / count
}
