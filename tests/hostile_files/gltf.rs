//! glTF, with and without compression, instances, skins and morph targets.

use super::{check, outcome, survive_reading};
use crate::{
    common::plants,
    glb::{Gltf, cards},
    mutate::{Random, damage, damage_json},
    text::SPECIES,
};
use foliage_lod::{
    Result,
    grow::Species,
    import::{ImportOptions, load_gltf_bytes},
};
use serde_json::{Value, json};
use std::path::Path;

/// The five cards of [`cards`] as the Draco and meshopt encoders write them.
const DRACO: &str = "445241434f02020101000000140a000a000004dff77d1fff02554001ff0000010009030000020101010103ec09a92affffffffdf350389\
    0835032502ffffffffffffffffffffffffffffb745040f35c2ce172100a1d2b123e8c60ebe8000000000ff070000000000000000000000000000\
    000050410b";
const MESHOPT_POSITIONS: &str = "a000000533f3f3f3ffff80807fff403fa0201ff300000060201f0133c000807e7d800000050cccccccffffffffffffffcc0000\
    00ffff050ccccccc7e7d7e7d7e7d7ecc0000007d7e000000000000000000000000000000000000000000000000000000000000000000000000";
const MESHOPT_INDICES: &str = "e1f000f000f000f000f000007687566778a9866589689801690000";

fn bytes_of(hex: &str) -> Vec<u8> {
    hex.as_bytes().chunks(2).map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap()).collect()
}

/// Appends `bytes` to the buffer and returns the index of their buffer view.
fn push_bytes(file: &mut Gltf, bytes: &[u8]) -> usize {
    let accessor = file.push(bytes, json!({ "componentType": 5121, "type": "SCALAR", "count": bytes.len() }));
    file.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize
}

/// Five textured cards with two instances, under a rotated and scaled node, with one texture
/// coordinate replaced by a sparse accessor.
fn rich() -> Gltf {
    let mut file = cards(5);
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let vectors = json!({ "componentType": 5126, "type": "VEC3", "count": 2 });
    let places = file.push(&floats(&[0.0, 0.0, 0.0, 0.0, 4.0, 0.0]), vectors);
    let image = push_bytes(&mut file, &plants::masked(1, 1).textures[0].bytes);
    let [replaced, values] = [vec![7], floats(&[0.5, 0.25])].map(|bytes| push_bytes(&mut file, &bytes));
    file.json["accessors"][1]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": replaced, "componentType": 5121 }, "values": { "bufferView": values }
    });
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    file.json["nodes"] = json!([
        { "children": [1], "rotation": [0.0, 0.6, 0.0, 0.8], "scale": [1.0, 2.0, 1.0] },
        { "mesh": 0, "name": "crown", "translation": [1.0, 2.0, 3.0], "extensions": instancing }
    ]);
    file.json["images"] = json!([{ "bufferView": image, "mimeType": "image/png" }]);
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    let transform = json!({ "KHR_texture_transform": { "offset": [0.1, 0.2], "rotation": 0.3, "scale": [2.0, 1.0] } });
    let texture = json!({ "index": 0, "extensions": transform });
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": texture });
    file.json["materials"][0]["alphaCutoff"] = json!(0.3);
    file
}

fn draco() -> Gltf {
    let mut file = cards(5);
    let view = push_bytes(&mut file, &bytes_of(DRACO));
    let extension = json!({ "bufferView": view, "attributes": { "POSITION": 0 } });
    file.json["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_draco_mesh_compression": extension });
    file
}

fn meshopt() -> Gltf {
    let mut file = cards(5);
    for (view, hex, count, stride, mode) in
        [(0, MESHOPT_POSITIONS, 20, 12, "ATTRIBUTES"), (2, MESHOPT_INDICES, 30, 2, "TRIANGLES")]
    {
        let encoded = push_bytes(&mut file, &bytes_of(hex));
        let mut extension = file.json["bufferViews"][encoded].clone();
        (extension["count"], extension["byteStride"]) = (json!(count), json!(stride));
        extension["mode"] = json!(mode);
        file.json["bufferViews"][view]["extensions"] = json!({ "EXT_meshopt_compression": extension });
    }
    file
}

/// Two levels of five cards, coloured, skinned and bent by a morph target, beside a hidden node and
/// an animation.
fn posed() -> Gltf {
    let mut file = cards(5);
    let floats = |values: Vec<f32>| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let of =
        |component: u32, kind: &str, count: usize| json!({ "componentType": component, "type": kind, "count": count });
    let joints = file.push(&[0, 1, 1, 0].repeat(20), of(5121, "VEC4", 20));
    let weights = file.push(&floats([0.5, 0.25, 0.25, 0.0].repeat(20)), of(5126, "VEC4", 20));
    let binds =
        [[1.0f32, 0.0, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 0.0, 1.0]].concat().repeat(2);
    let binds = file.push(&floats(binds), of(5126, "MAT4", 2));
    let bend = file.push(&floats([0.1, 0.2, 0.3].repeat(20)), of(5126, "VEC3", 20));
    let color = file.push(
        &[200, 0, 250, 240].repeat(20),
        json!({ "componentType": 5121, "type": "VEC4", "count": 20, "normalized": true }),
    );
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["targets"] = json!([{ "POSITION": bend, "NORMAL": bend }]);
    for (name, accessor) in [("JOINTS_0", joints), ("WEIGHTS_0", weights), ("COLOR_0", color)] {
        primitive["attributes"][name] = json!(accessor);
    }
    file.json["meshes"][0]["weights"] = json!([0.5]);
    file.json["skins"] = json!([{ "joints": [2, 3], "inverseBindMatrices": binds }]);
    file.json["nodes"] = json!([
        { "mesh": 0, "name": "Oak_LOD0", "skin": 0, "weights": [2.0] },
        { "mesh": 0, "name": "Oak_LOD1" },
        { "children": [3], "rotation": [0.0, 0.6, 0.0, 0.8] },
        { "translation": [0.0, 1.0, 0.0] },
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } }
    ]);
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 4]);
    let channel = json!({ "sampler": 0, "target": { "node": 3, "path": "translation" } });
    file.json["animations"] = json!([{ "channels": [channel], "samplers": [{ "input": 0, "output": bend }] }]);
    file
}

fn read_gltf(bytes: &[u8]) -> Result<()> {
    check(load_gltf_bytes(bytes, Path::new("hostile.glb"), &ImportOptions::default()))
}

/// Keys and values with a meaning in glTF.
const GLTF_WORDS: &str = " MASK BLEND SCALAR VEC2 VEC3 VEC4 MAT4 matrix children skin mode min normalized COLOR_0 NORMAL TEXCOORD_1 \
    ROTATION EXPONENTIAL OCTAHEDRAL INDICES image/webp uri data:;base64,AAAA no\nsuch.png \u{1b}[31m extensionsRequired \
    skins joints weights targets JOINTS_0 WEIGHTS_1 Oak_LOD0 Oak_Billboard UCX_Oak KHR_node_visibility visible MSFT_lod ids";

#[test]
fn damaged_gltf_is_refused_or_sound() {
    let files = [cards(5), rich(), draco(), meshopt(), posed()];
    files.iter().for_each(|file| read_gltf(&file.glb()).expect("the undamaged file is valid"));
    let make = move |random: &mut Random| {
        let mut file = random.pick(&files);
        let kind = random.below(4);
        if kind < 2 {
            damage_json(&mut file.json, GLTF_WORDS, random);
        }
        if kind == 2 {
            damage(&mut file.buffer, random);
        }
        let mut bytes = file.glb();
        if kind == 3 {
            damage(&mut bytes, random);
        }
        bytes
    };
    survive_reading("glTF", &["accepted", "unreadable", "leafless"], make, read_gltf);
}

/// Writes a name into a file's JSON.
type Naming = fn(&mut Value, Value);

#[test]
fn names_in_a_file_leave_messages_and_warnings_plain_lines() {
    let name = || json!("a\n\u{1b}[31m%0Ab");
    let places: [(&str, Naming); 4] = [
        ("unreadable", |file, name| file["buffers"][0]["uri"] = name),
        ("unsupported", |file, name| file["extensionsRequired"] = json!([name])),
        ("unknown name", |file, name| file["materials"][0]["name"] = name),
        ("unknown name", |file, name| file["images"][0] = json!({ "uri": name, "name": name })),
    ];
    for (expected, place) in places {
        let mut file = rich();
        place(&mut file.json, name());
        let options = ImportOptions { leaves: vec!["none".into()], ..ImportOptions::default() };
        assert_eq!(outcome(check(load_gltf_bytes(&file.glb(), Path::new("names.glb"), &options))), expected);
        outcome(read_gltf(&file.glb()));
    }
    let species = SPECIES[0].replace("leaves =", "\"lea\\nves\" =");
    assert_eq!(outcome(Species::from_toml(&species, Path::new("names.toml")).map(drop)), "unreadable");
}

#[test]
fn an_alpha_cutoff_beyond_all_numbers_counts_as_one_half() {
    let mut file = rich();
    for (cutoff, expected) in [(json!(0.3), 0.3), (json!(1e39), 0.5)] {
        file.json["materials"][0]["alphaCutoff"] = cutoff;
        let imported = load_gltf_bytes(&file.glb(), Path::new("cutoff.glb"), &ImportOptions::default()).unwrap();
        assert_eq!(imported.plant.materials[0].alpha_cutoff, expected);
    }
}
