//! Continuous glTF: what was written is read, also where a tool has rewritten the file, and what
//! cannot be read is told.
#![cfg(feature = "simplify")]

mod common;
#[path = "common/glb.rs"]
mod glb;

use common::plants;
use foliage_lod::{
    Error, FoliageModel, Plant,
    continuous::{is_glb, read},
    export::{GlbOptions, write_continuous, write_glb},
    glam::Vec3,
    grow::{GrowOptions, Species, grow},
    leaf::Vertex,
    material::{AlphaMode, Wrap},
    model::{ErrorCurve, NO_LEAF},
    plant::Wood,
    simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
};
use glb::Gltf;
use serde_json::{Value, json};

const EXACT: GlbOptions = GlbOptions { exact: true, z_up: false, scale: 1.0 };

fn simplified(plant: &Plant) -> FoliageModel {
    let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::paper() };
    simplify(plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model
}

fn grown(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    simplified(&grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap())
}

/// Leaves of two materials, one of them blended, beside wood of a third.
fn mixed() -> FoliageModel {
    let mut plant = plants::repeated(40, 4);
    let masked = plants::masked(1, 1);
    let texture = plant.textures.len() as u32;
    plant.textures.extend(masked.textures);
    let mut veil = masked.materials[masked.leaves[0].material as usize].clone();
    (veil.name, veil.texture, veil.alpha_mode, veil.alpha_cutoff) =
        ("veil \"2\"\n".into(), Some(texture), AlphaMode::Blend, 0.2);
    (veil.wrap, veil.base_color) = ([Wrap::Mirror, Wrap::Clamp], [0.5, 0.25, 1.0, 0.75]);
    let own = plant.materials.len() as u32;
    plant.materials.push(veil);
    plant.leaves.iter_mut().step_by(3).for_each(|leaf| leaf.material = own);
    let with_wood = plants::with_wood(4, 2);
    plant.wood = with_wood.wood;
    plant.wood.parts.iter_mut().for_each(|part| part.material += own + 1);
    plant.materials.extend(with_wood.materials);
    simplified(&plant)
}

/// Corners of the triangles of wood.
fn corners(wood: &Wood) -> Vec<Vertex> {
    wood.indices.iter().map(|&index| wood.vertices[index as usize]).collect()
}

/// Checks that leaves, scales, targets and order are the same, and all else within a distance.
fn assert_same(found: &FoliageModel, model: &FoliageModel, within: f32, of: impl Fn([f32; 3]) -> Vec3) {
    assert_eq!((&found.name, found.leaves.len()), (&model.name, model.leaves.len()));
    assert_eq!((found.max_scale, &found.indices), (model.max_scale, &model.indices));
    let [curve, own] = [found, model].map(ErrorCurve::of);
    assert_eq!((curve.size_px, curve.size_power), (own.size_px, own.size_power));
    for n in (0..=model.leaves.len()).map(|n| n as f64) {
        let [error, own, of_none] = [curve.error_px(n), own.error_px(n), own.error_px(0.0)];
        assert!((error - own).abs() <= 1e-3 * of_none, "{error} of {of_none} with {n} leaves, not {own}");
    }
    let is_near = |found: [f32; 3], own: [f32; 3]| {
        let off = Vec3::from(found).distance(of(own));
        assert!(off <= within, "{found:?} is {off} off {:?}", of(own));
    };
    for (leaf, own) in found.leaves.iter().zip(&model.leaves) {
        assert_eq!((leaf.vertices, leaf.indices), (own.vertices, own.indices));
        assert_eq!((leaf.leaf_to_split, leaf.leaf_to_collapse), (own.leaf_to_split, own.leaf_to_collapse));
        assert_eq!(leaf.scale, own.scale);
        is_near(leaf.pivot, own.pivot);
        let [mut material, other] = [(found, leaf), (model, own)].map(|(of, leaf)| {
            let material = &of.materials[leaf.material as usize];
            let texture = material.texture.map(|texture| of.textures[texture as usize].clone());
            (material.clone(), texture)
        });
        material.0.texture = other.0.texture;
        assert_eq!(material, other);
    }
    let vertices = found.vertices.iter().copied().chain(corners(&found.wood));
    for (found, own) in vertices.zip(model.vertices.iter().copied().chain(corners(&model.wood))) {
        is_near(found.position, own.position);
        // Without a texture there are no coordinates.
        let off = found.uv.iter().zip(own.uv).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(found.uv == [0.0; 2] || off <= if within > 0.0 { 1e-5 } else { 0.0 }, "{found:?} {own:?}");
        assert!(found.color.iter().zip(own.color).all(|(a, b)| (a - b.min(1.0)).abs() <= 0.5 / 255.0));
        let turned = (of(own.normal) - of([0.0; 3])).normalize();
        assert!(Vec3::from(found.normal).distance(turned) < 0.01, "{found:?} {turned}");
    }
    assert_eq!(found.wood.triangles(), model.wood.triangles());
}

#[test]
fn what_is_written_is_read() {
    let models =
        [grown("betula-populifolia", 500), grown("english-oak", 300), mixed(), simplified(&plants::quads(1, 1.0, 3))];
    for model in models {
        let side = {
            let points = model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
            let all = foliage_lod::bounds::Aabb::of_points(points.chain(model.leaves.iter().map(|leaf| leaf.pivot)));
            all.size().max_element()
        };
        // Half a step along each axis, and the rounding of the file's own transform.
        let step = 0.9 * side / 65535.0 + 1e-6 * side;
        for (exact, within) in [(true, 0.0), (false, step)] {
            let bytes = write_continuous(&model, &GlbOptions { exact, ..EXACT }).unwrap();
            assert!(is_glb(&bytes) && !is_glb(&model.to_bytes().unwrap()));
            assert_same(&read(&bytes).unwrap(), &model, within, Vec3::from);
        }
        let turned = GlbOptions { exact: true, z_up: true, scale: 100.0 };
        let of = |point: [f32; 3]| Vec3::new(point[0], -point[2], point[1]) * 100.0;
        assert_same(&read(&write_continuous(&model, &turned).unwrap()).unwrap(), &model, 1e-4 * side, of);
    }
}

#[test]
fn a_model_that_was_read_is_written_as_it_was() {
    // Unit vectors that are made unit vectors again may change by a bit.
    let bare = |mut model: FoliageModel| {
        let plant = &mut model.plant;
        plant.vertices.iter_mut().chain(&mut plant.wood.vertices).for_each(|vertex| vertex.normal = [0.0; 3]);
        model
    };
    let bytes = write_continuous(&mixed(), &EXACT).unwrap();
    let model = read(&bytes).unwrap();
    let again = write_continuous(&model, &EXACT).unwrap();
    assert_eq!(Gltf::of(&again).json, Gltf::of(&bytes).json);
    assert_eq!(bare(read(&again).unwrap()), bare(model));
}

/// The continuous glTF of the mixed plant, to be changed.
fn file(exact: bool) -> Gltf {
    Gltf::of(&write_continuous(&mixed(), &GlbOptions { exact, ..EXACT }).unwrap())
}

/// Where the values of an accessor are.
fn place(gltf: &Gltf, primitive: usize, name: &str) -> (usize, usize) {
    let primitive = &gltf.json["meshes"][0]["primitives"][primitive];
    let accessor = if name == "indices" { &primitive[name] } else { &primitive["attributes"][name] };
    let accessor = &gltf.json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &gltf.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    (view["byteOffset"].as_u64().unwrap() as usize, accessor["count"].as_u64().unwrap() as usize)
}

#[test]
fn triangles_in_another_order_and_nodes_below_others_give_the_same_model() {
    let plain = read(&file(true).glb()).unwrap();
    let mut moved = file(true);
    // Leaves back to front, each with its triangles as they were; 16-bit indices.
    for primitive in 0..2 {
        let (start, count) = place(&moved, primitive, "indices");
        let triangles: Vec<Vec<u8>> = moved.buffer[start..start + 2 * count].chunks(6).map(<[u8]>::to_vec).collect();
        let (leaf_at, _) = place(&moved, primitive, "_LEAF");
        let leaf = |triangle: &[u8]| {
            let corner = u16::from_le_bytes([triangle[0], triangle[1]]) as usize;
            f32::from_le_bytes(moved.buffer[leaf_at + 4 * corner..][..4].try_into().unwrap())
        };
        let mut sorted = triangles.clone();
        sorted.sort_by(|a, b| leaf(b).total_cmp(&leaf(a)));
        assert_ne!(sorted, triangles);
        moved.buffer[start..start + 2 * count].copy_from_slice(&sorted.concat());
    }
    // The plant's node below one that turns it by a quarter and one that moves it back.
    let node = moved.json["nodes"][0].take();
    let half = 0.5_f64.sqrt();
    moved.json["nodes"] = json!([
        { "children": [2], "rotation": [0.0, half, 0.0, half] },
        node,
        { "children": [1], "matrix": [0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1] },
    ]);
    let found = read(&moved.glb()).unwrap();
    assert_eq!((&found.leaves.len(), &found.indices), (&plain.leaves.len(), &plain.indices));
    for (found, plain) in found.leaves.iter().zip(&plain.leaves) {
        assert_eq!((found.leaf_to_split, found.scale), (plain.leaf_to_split, plain.scale));
    }
    for (found, plain) in found.vertices.iter().zip(&plain.vertices) {
        assert!(Vec3::from(found.position).distance(plain.position.into()) < 1e-5, "{found:?} {plain:?}");
        assert!(Vec3::from(found.normal).distance(plain.normal.into()) < 1e-5);
    }
}

#[test]
fn a_file_without_a_curve_or_materials_is_read() {
    let mut bare = file(true);
    bare.json["nodes"][0]["extras"]["foliageLod"]["curve"] = Value::Null;
    bare.json.as_object_mut().unwrap().remove("materials");
    for primitive in bare.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive.as_object_mut().unwrap().remove("material");
    }
    let model = read(&bare.glb()).unwrap();
    assert_eq!((model.plant.materials.len(), model.plant.textures.len()), (1, 0));
    // Budgets need some curve.
    let curve = ErrorCurve::of(&model);
    let errors = [0.0, 10.0, 20.0, 40.0].map(|leaves| curve.error_px(leaves));
    assert!(errors.windows(2).all(|pair| pair[0] > pair[1]) && errors[3] == 0.0, "{errors:?}");
}

/// Changes a file.
type Change = fn(&mut Gltf);

/// Writes a float of an attribute of the first primitive.
fn put(gltf: &mut Gltf, name: &str, at: usize, value: f32) {
    let (start, _) = place(gltf, 0, name);
    gltf.buffer[start + 4 * at..][..4].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn what_cannot_be_read_is_told_in_one_line_with_its_fix() {
    let about = |gltf: &mut Gltf, key: &str, value: Value| gltf.json["nodes"][0]["extras"]["foliageLod"][key] = value;
    let changes: [(Change, &str); 26] = [
        (|gltf| gltf.json["nodes"][0]["extras"] = json!({}), "no continuous glTF"),
        (|gltf| gltf.json["nodes"] = json!([gltf.json["nodes"][0], gltf.json["nodes"][0]]), "several plants"),
        (|gltf| gltf.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]), "decompress the file"),
        (|gltf| gltf.json["extensionsRequired"] = json!(["a\nb"]), r#"the extension "a\nb" is not supported"#),
        (|gltf| gltf.json["buffers"][0]["uri"] = json!("oak.bin"), "pack it into one .glb"),
        (|gltf| gltf.json["accessors"][0]["sparse"] = json!({}), "dense accessors"),
        (|gltf| gltf.json["accessors"][0]["count"] = json!(1_u64 << 40), "POSITION reaches beyond its data"),
        (|gltf| gltf.json["accessors"][0]["componentType"] = json!(5130), "component type 5130"),
        (|gltf| gltf.json["accessors"][0]["type"] = json!("MAT4"), "POSITION is neither a number nor a vector"),
        (|gltf| gltf.json["bufferViews"][0]["byteStride"] = json!(0), "POSITION reaches beyond its data"),
        (|gltf| gltf.json["bufferViews"][0]["byteLength"] = json!(u64::MAX), "reaches beyond the file"),
        (|gltf| gltf.json["nodes"][0]["scale"] = json!([1, 1, -1]), "mirrored, flat or beyond all numbers"),
        (|gltf| gltf.json["nodes"][0]["children"] = json!([0]), "node 0 is in several places"),
        (
            |gltf| gltf.json["meshes"][0]["primitives"][0]["mode"] = json!(5),
            "mode 5 is not supported; export triangles",
        ),
        (|gltf| gltf.json["meshes"][0]["primitives"][0]["material"] = json!(9), "there is no material 9"),
        (
            |gltf| {
                drop(gltf.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("_SCALE"))
            },
            "leaves lack _SCALE; keep custom attributes",
        ),
        (
            |gltf| {
                gltf.json["meshes"][0]["primitives"][1] = gltf.json["meshes"][0]["primitives"][0].clone();
            },
            "differ in what they tell of it",
        ),
        (|gltf| put(gltf, "_LEAF", 0, 0.5), "_LEAF is 0.5, no whole number below 4194304"),
        (|gltf| put(gltf, "_LEAF", 0, -1.0), "_LEAF is -1, no whole number"),
        (|gltf| put(gltf, "_SCALE", 0, 7.0), "differ in what they tell of it"),
        (|gltf| (0..24).for_each(|i| put(gltf, "_TARGET", i, 40.0)), "has target 40; export it again"),
        (|gltf| (0..24).for_each(|i| put(gltf, "_SCALE", 24 + i, -1.0)), "model violates invariant 10"),
        (|gltf| (0..24).for_each(|i| put(gltf, "_PIVOT", 3 * i, 1e3)), "quantise all but POSITION"),
        (|gltf| put(gltf, "POSITION", 0, f32::NAN), "model violates invariant 3"),
        (
            |gltf| {
                let (start, _) = place(gltf, 0, "indices");
                gltf.buffer[start..start + 2].copy_from_slice(&30_u16.to_le_bytes());
            },
            "a tool has merged vertices; weld with _LEAF kept apart",
        ),
        (|gltf| gltf.buffer.truncate(200), "reaches beyond the file"),
    ];
    for (change, expected) in changes {
        let mut gltf = file(true);
        change(&mut gltf);
        let message = read(&gltf.glb()).unwrap_err().to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{message:?}, not {expected:?}");
    }
    for (key, value, expected) in [
        ("version", json!(2), "version 2 of continuous glTF is not supported"),
        ("leaves", json!(41), "leaf 40 of 41 is missing"),
        ("leaves", json!(39), "there is a leaf 39, of 39"),
        ("leaves", json!(1 << 23), "above the limit of 4194304"),
        ("leaves", json!(1 << 22), "is missing"),
        ("curve", json!({ "sizePx": 64, "sizePower": 2, "leaves": [0, 9], "errorsPx": [1, 0] }), "invariant 17"),
        (
            "curve",
            json!({ "sizePx": 64, "sizePower": 2, "leaves": [0, 40], "errorsPx": [0] }),
            "more counts than errors",
        ),
    ] {
        let mut gltf = file(false);
        about(&mut gltf, key, value);
        let message = read(&gltf.glb()).unwrap_err().to_string();
        assert!(message.contains(expected), "{message:?}, not {expected:?}");
    }
    // Quantised positions, and pivots that are not.
    let mut stale = file(true);
    stale.json["meshes"] = file(false).json["meshes"].clone();
    (stale.json["accessors"], stale.json["bufferViews"]) =
        (file(false).json["accessors"].clone(), file(false).json["bufferViews"].clone());
    stale.buffer = file(false).buffer;
    let pivots = stale.json["meshes"][0]["primitives"][0]["attributes"]["_PIVOT"].as_u64().unwrap() as usize;
    stale.json["accessors"][pivots]["normalized"] = json!(false);
    assert!(read(&stale.glb()).unwrap_err().to_string().contains("quantise all but POSITION"));
}

#[test]
fn other_files_are_refused() {
    let plain = write_glb(&grow(&Species::embedded("betula-populifolia").unwrap(), &GrowOptions::default()).unwrap());
    let told = read(&plain.unwrap()).unwrap_err().to_string();
    assert!(told.contains("no continuous glTF") && told.contains("foliage-lod export MODEL.vds -o TREE.glb"), "{told}");
    for bytes in [&b""[..], b"glTF", b"VDSFOLI\0", &mixed().to_bytes().unwrap()] {
        assert!(matches!(read(bytes), Err(Error::Unreadable { .. })));
    }
    let whole = file(false).glb();
    for length in (0..whole.len()).step_by(97) {
        assert!(read(&whole[..length]).is_err(), "{length} bytes");
    }
    assert_eq!(read(&whole).unwrap().leaves[0].leaf_to_split, NO_LEAF);
}
