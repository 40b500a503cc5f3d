//! Damaged and hostile files produce a one-line error or a valid plant, never a panic, a hang or
//! excessive memory use.
#![cfg(feature = "simplify")]

#[path = "common/glb.rs"]
mod glb;

use foliage_lod::{Error, import::*};
use glb::{Gltf, cards};
use serde_json::{Value, json};
use std::path::Path;

fn load(bytes: &[u8]) -> Result<Imported, Error> {
    load_gltf_bytes(bytes, Path::new("hostile.glb"), &ImportOptions::default())
}

/// Applies `damage` to a valid file; its import must fail with a single line that contains `says`.
fn refused(says: &str, damage: impl FnOnce(&mut Gltf)) {
    let mut file = cards(5);
    load(&file.glb()).expect("the undamaged file is valid");
    damage(&mut file);
    let error = load(&file.glb()).expect_err(says).to_string();
    assert!(error.contains(says) && !error.contains('\n'), "{error:?} does not say {says:?} in one line");
}

#[test]
fn node_graphs_that_are_no_forest_are_refused() {
    refused("its own ancestor", |file| file.json["nodes"] = json!([{ "mesh": 0, "children": [0] }]));
    refused("its own ancestor", |file| {
        file.json["nodes"] = json!([{ "mesh": 0 }, { "children": [2] }, { "children": [3] }, { "children": [1] }]);
    });
    refused("is a child of node 0 and of node 1", |file| {
        file.json["nodes"] = json!([{ "children": [2] }, { "children": [2] }, { "mesh": 0 }]);
    });
    refused("node 9 is referenced", |file| file.json["nodes"][0]["children"] = json!([9]));
    refused("node 7 is referenced", |file| file.json["scenes"][0]["nodes"] = json!([7]));
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_is_read() {
    let mut file = cards(5);
    let count = 100_000;
    let mut nodes: Vec<Value> = (1..count).map(|child| json!({ "children": [child] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    file.json["nodes"] = Value::Array(nodes);
    assert_eq!(load(&file.glb()).unwrap().plant.leaves.len(), 5);
}

#[test]
fn what_is_out_of_range_is_refused() {
    let accessor = |key: &'static str, value: Value| move |file: &mut Gltf| file.json["accessors"][0][key] = value;
    refused("do not fit into", accessor("count", json!(21)));
    refused("do not fit into", accessor("count", json!(u64::MAX)));
    refused("do not fit into", accessor("byteOffset", json!(u64::MAX)));
    refused("do not fit into", accessor("byteOffset", json!(4)));
    refused("buffer view 77", accessor("bufferView", json!(77)));
    refused("elements but has no buffer view", |file| {
        file.json["accessors"][0] = json!({ "componentType": 5126, "type": "VEC3", "count": 1u64 << 40 });
    });
    refused("buffer view 0 covers", |file| file.json["bufferViews"][0]["byteLength"] = json!(u64::MAX));
    refused("buffer view 0 covers", |file| file.json["bufferViews"][0]["byteOffset"] = json!(1u64 << 40));
    refused("buffer view 0 covers", |file| file.json["bufferViews"][0]["buffer"] = json!(3));
    refused("do not fit into", |file| file.json["bufferViews"][0]["byteStride"] = json!(255));
    refused("do not fit into", |file| file.json["bufferViews"][0]["byteStride"] = json!(4));
    refused("accessor 55", |file| file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(55));
    refused("accessor 56", |file| file.json["meshes"][0]["primitives"][0]["indices"] = json!(56));
    refused("material 5", |file| file.json["meshes"][0]["primitives"][0]["material"] = json!(5));
    refused("mesh 6", |file| file.json["nodes"][0]["mesh"] = json!(6));
    refused("index 65535 is out of range", |file| {
        let end = file.buffer.len();
        file.buffer[end - 2..].copy_from_slice(&[255, 255]);
    });
}

#[test]
fn wrong_types_are_refused() {
    refused("must be scalar unsigned integers", |file| {
        file.json["accessors"][2]["componentType"] = json!(5126);
        file.json["accessors"][2]["count"] = json!(15);
    });
    refused("an unknown component type", |file| file.json["accessors"][0]["componentType"] = json!(5124));
    refused("has 2 components", |file| file.json["accessors"][0]["type"] = json!("VEC2"));
    refused("no positions", |file| file.json["meshes"][0]["primitives"][0]["attributes"] = json!({}));
    refused("not valid glTF", |file| file.json["nodes"] = json!(7));
    refused("is not supported", |file| file.json["extensionsRequired"] = json!(["ACME_unknown"]));
}

#[test]
fn sparse_places_beyond_the_accessor_are_refused() {
    for (place, says) in [(20, "replaces element 20 of 20"), (19, "do not fit into")] {
        refused(says, |file| {
            let scalar = json!({ "componentType": 5121, "type": "SCALAR", "count": 1 });
            let accessor = file.push(&[place], scalar);
            let view = file.json["accessors"][accessor]["bufferView"].clone();
            file.json["accessors"][0]["sparse"] = json!({
                "count": 1,
                "indices": { "bufferView": view, "componentType": 5121 },
                "values": { "bufferView": view }
            });
        });
    }
}

#[test]
fn positions_that_are_no_numbers_are_refused_by_index() {
    for value in [f32::NAN, f32::INFINITY] {
        refused("the position of vertex 7", |file| file.buffer[7 * 12..][..4].copy_from_slice(&value.to_le_bytes()));
    }
    refused("moves a vertex to", |file| file.json["nodes"][0]["scale"] = json!([3e38, 1.0, 1.0]));
}

#[test]
fn sharing_can_not_multiply_a_small_file_into_much_memory() {
    refused("number of indices for a file of its size", |file| {
        let primitive = file.json["meshes"][0]["primitives"][0].clone();
        file.json["meshes"][0]["primitives"] = Value::Array(vec![primitive; 10_000]);
    });
}

#[test]
fn compressed_views_that_can_not_be_are_refused() {
    let compress = |change: Value| {
        move |file: &mut Gltf| {
            let mut extension = json!({
                "buffer": 0, "byteOffset": 0, "byteLength": 240, "byteStride": 12, "count": 20, "mode": "ATTRIBUTES"
            });
            let changes = change.as_object().expect("an object").clone();
            extension.as_object_mut().expect("an object").extend(changes);
            file.json["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": extension });
        }
    };
    refused("cannot come from", compress(json!({ "count": 1u64 << 40 })));
    refused("cannot come from", compress(json!({ "count": u64::MAX, "byteStride": u64::MAX })));
    refused("attributes start with", compress(json!({})));
    refused("unsupported stride of 0", compress(json!({ "byteStride": 0 })));
    refused("unknown mode", compress(json!({ "mode": "MAGIC" })));
    refused("unknown filter", compress(json!({ "filter": "MAGIC" })));
    refused("covers 999999 bytes", compress(json!({ "byteLength": 999_999 })));
    refused("byteStride is missing", compress(json!({ "byteStride": -4 })));
}

#[test]
fn zero_leaves_and_one_leaf_are_handled() {
    let error = load(&cards(0).glb()).unwrap_err();
    assert!(matches!(error, Error::NoLeaves { .. }), "{error}");
    let error = load(&cards(1).glb()).unwrap_err();
    assert!(matches!(error, Error::NoLeaves { .. }), "{error}");
    let named = ImportOptions { leaves: vec!["leaf".to_owned()], ..ImportOptions::default() };
    let plant = load_gltf_bytes(&cards(1).glb(), Path::new("one.glb"), &named).unwrap().plant;
    assert_eq!(plant.leaves.len(), 1);
}

#[test]
fn every_truncation_of_a_binary_file_is_refused() {
    let bytes = cards(5).glb();
    for length in 0..bytes.len() {
        assert!(load(&bytes[..length]).is_err(), "{length} of {} bytes were accepted", bytes.len());
    }
}

/// Pseudorandom numbers, the same on every run (Knuth's linear congruential generator).
fn numbers(mut state: u64) -> impl FnMut(usize) -> usize {
    move |below| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below.max(1)
    }
}

/// Imports `count` damaged copies of `bytes`. The import validates every plant that it returns.
fn survive(bytes: &[u8], count: usize, import: impl Fn(&[u8])) {
    let mut number = numbers(bytes.len() as u64);
    for _ in 0..count {
        let mut damaged = bytes.to_vec();
        for _ in 0..=number(3) {
            let at = number(damaged.len());
            match number(3) {
                0 => damaged[at] ^= 1 << number(8),
                1 => damaged[at] = b"0123456789-.e,:[]{}\" /\n"[number(23)],
                _ => damaged[at] = number(256) as u8,
            }
        }
        import(&damaged);
    }
}

#[test]
fn flipped_bits_never_panic() {
    survive(&cards(5).glb(), 6000, |bytes| drop(load(bytes)));
}

const OBJ: &str = "mtllib none.mtl\no tree\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
    g leaves\nusemtl leaf\nf 1/1/1 2/2/1 3/2/1 4/1/1\nv 5 0 0 1 1 1\nv 6 0 0\nv 6 1 0\nv 5 1 0\nf -4//1 -3//1 -2//1 -1//1\n\
    f 1 2 3\nl 1 2\np 1\n";

fn load_obj(bytes: &[u8]) -> Result<Imported, Error> {
    let named = ImportOptions { leaves: vec!["leaf".to_owned()], ..ImportOptions::default() };
    drop(load_obj_bytes(bytes, Path::new("hostile.obj"), &named));
    load_obj_bytes(bytes, Path::new("hostile.obj"), &ImportOptions::default())
}

#[test]
fn damaged_obj_never_panics() {
    for length in 0..OBJ.len() {
        drop(load_obj(&OBJ.as_bytes()[..length]));
    }
    survive(OBJ.as_bytes(), 6000, |bytes| drop(load_obj(bytes)));
}

#[test]
fn obj_of_many_cards_without_materials_is_foliage() {
    let mut text = String::new();
    for i in 0..20 {
        for [x, y] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
            text.push_str(&format!("v {} {y} 0\n", x + 3 * i));
        }
        text.push_str("f -4 -3 -2 -1\n");
    }
    let imported = load_obj(text.as_bytes()).unwrap();
    assert_eq!((imported.plant.leaves.len(), imported.plant.leaf_triangles()), (20, 40));
    let error = load_obj(text.replace("v 3 1 0", "v nan 1 0").as_bytes()).unwrap_err().to_string();
    assert!(error.contains("finite") && !error.contains('\n'), "{error}");
}

#[test]
fn damaged_compressed_trees_never_panic() {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else {
        eprintln!("skipped: FOLIAGE_TREES is not set");
        return;
    };
    for file in ["fern_02_meshopt_webp.glb", "eztree_oak_medium_draco.glb"] {
        let bytes = std::fs::read(Path::new(&folder).join(file)).unwrap();
        survive(&bytes, 12, |bytes| drop(load(bytes)));
    }
}
