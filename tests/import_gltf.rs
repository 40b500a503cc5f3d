//! Import of glTF features, from files built in memory.
#![cfg(feature = "simplify")]

#[path = "common/glb.rs"]
mod glb;

use foliage_lod::{
    Plant,
    import::{Group, ImportOptions, Imported, load_gltf_bytes},
    material::{AlphaMode, Wrap},
};
use glb::{Gltf, cards};
use serde_json::json;
use std::path::Path;

fn import(file: &Gltf) -> Imported {
    let options = ImportOptions { group: Group::Piece, ..ImportOptions::default() };
    load_gltf_bytes(&file.glb(), Path::new("made.glb"), &options).unwrap_or_else(|error| panic!("{error}"))
}

fn plant(file: &Gltf) -> Plant {
    import(file).plant
}

fn f32_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn each_card_is_a_leaf_with_its_centroid_as_pivot() {
    let plant = plant(&cards(5));
    assert_eq!((plant.leaves.len(), plant.vertices.len(), plant.wood.triangles()), (5, 20, 0));
    assert_eq!(plant.leaves[4].pivot, [12.5, 0.5, 0.0]);
    assert_eq!(plant.materials[0].alpha_mode, AlphaMode::Mask);
    assert_eq!(plant.materials[0].alpha_cutoff, 0.5);
}

#[test]
fn missing_normals_are_the_faces_own_and_missing_uvs_are_zero() {
    let mut file = cards(5);
    file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let plant = plant(&file);
    assert!(plant.vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0] && v.uv == [0.0; 2] && v.color == [1.0; 4]));
}

#[test]
fn order_of_triangles_within_a_leaf_leaves_no_trace() {
    let file = cards(6);
    let mut shuffled = file.clone();
    let indices = shuffled.buffer.len() - 6 * 12;
    for leaf in shuffled.buffer[indices..].chunks_exact_mut(12) {
        // Puts the second triangle first and starts both at another corner.
        leaf.rotate_left(6);
        leaf[..6].rotate_left(2);
        leaf[6..].rotate_left(4);
    }
    assert_ne!(shuffled.buffer, file.buffer);
    assert_eq!(plant(&shuffled), plant(&file));
}

#[test]
fn node_chains_carry_and_mirrors_turn_the_winding() {
    let mut file = cards(4);
    file.json["nodes"] = json!([
        { "children": [1], "translation": [10.0, 0.0, 0.0] },
        { "children": [2], "matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 0,0,0,1] },
        { "mesh": 0, "scale": [-2.0, 1.0, 1.0] }
    ]);
    let plant = plant(&file);
    // (x, y) is scaled to (-2 x, y), rotated to (-y, -2 x) and translated.
    assert_eq!(plant.aabb().min, [9.0, -20.0, 0.0]);
    assert_eq!(plant.aabb().max, [10.0, 0.0, 0.0]);
    for corners in plant.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| glam::Vec3::from(plant.vertices[corners[i] as usize].position));
        let normal = glam::Vec3::from(plant.vertices[corners[0] as usize].normal);
        assert!((b - a).cross(c - a).dot(normal) > 0.0, "normal and winding disagree");
    }
}

#[test]
fn without_scenes_every_root_node_is_drawn() {
    let mut file = cards(4);
    file.json.as_object_mut().unwrap().remove("scenes");
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [0.0, 5.0, 0.0] }]);
    assert_eq!(plant(&file).leaves.len(), 8);
}

#[test]
fn strips_fans_and_plain_vertices_give_the_same_leaf_triangles() {
    let listed = plant(&cards(4));
    let mut strip = cards(4);
    let indices: Vec<u8> = [1u16, 2, 0, 3, 3, 5, 5, 6, 4, 7, 7, 9, 9, 10, 8, 11, 11, 13, 13, 14, 12, 15]
        .iter()
        .flat_map(|index| index.to_le_bytes())
        .collect();
    let accessor = strip.push(&indices, json!({ "componentType": 5123, "type": "SCALAR", "count": 22 }));
    strip.json["meshes"][0]["primitives"][0]["indices"] = json!(accessor);
    strip.json["meshes"][0]["primitives"][0]["mode"] = json!(5);
    let strip = plant(&strip);
    assert_eq!((strip.leaves.len(), strip.leaf_triangles()), (4, listed.leaf_triangles()));
    assert_eq!(strip.aabb(), listed.aabb());
    let mut fan = cards(4);
    let primitive = |first: u32| json!({ "attributes": { "POSITION": 3 + first }, "material": 0, "mode": 6 });
    let views = json!({ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4 });
    for i in 0..4 {
        let mut view = views.clone();
        view["byteOffset"] = json!(i * 48);
        fan.json["accessors"].as_array_mut().unwrap().push(view);
    }
    fan.json["meshes"][0]["primitives"] = (0..4).map(primitive).collect();
    let fan = plant(&fan);
    assert_eq!((fan.leaves.len(), fan.leaf_triangles(), fan.aabb()), (4, 8, listed.aabb()));
}

#[test]
fn lines_are_left_out_with_a_warning() {
    let mut file = cards(4);
    let mut lines = file.json["meshes"][0]["primitives"][0].clone();
    lines["mode"] = json!(1);
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
    let imported = import(&file);
    assert_eq!((imported.plant.leaves.len(), imported.warnings.len()), (4, 1));
}

#[test]
fn sparse_values_replace_their_elements() {
    let mut file = cards(4);
    let places = file.push(&15u16.to_le_bytes(), json!({ "componentType": 5123, "type": "SCALAR", "count": 1 }));
    let values = file.push(&f32_bytes(&[9.0, 7.0, 0.5]), json!({ "componentType": 5126, "type": "VEC3", "count": 1 }));
    let view = |file: &Gltf, accessor: usize| file.json["accessors"][accessor]["bufferView"].clone();
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": view(&file, places), "componentType": 5123 },
        "values": { "bufferView": view(&file, values) }
    });
    assert_eq!(plant(&file).aabb().max, [10.0, 7.0, 0.5]);
}

#[test]
fn normalised_and_plain_integers_are_read_by_the_rules() {
    let mut file = cards(4);
    let colors: Vec<u8> = (0..16).flat_map(|_| [255, 0, 51]).collect();
    let color = file.push(&colors, json!({ "componentType": 5121, "type": "VEC3", "count": 16, "normalized": true }));
    let shorts: Vec<u8> = (0..4i16)
        .flat_map(|i| [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[x, y]| [x + 3 * i, y, -7]))
        .flatten()
        .flat_map(i16::to_le_bytes)
        .collect();
    let position = file.push(&shorts, json!({ "componentType": 5122, "type": "VEC3", "count": 16 }));
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let plant = plant(&file);
    assert_eq!(plant.vertices[0].color, [1.0, 0.0, 0.2, 1.0]);
    assert_eq!(plant.aabb().max, [10.0, 1.0, -7.0]);
}

#[test]
fn texture_transforms_are_baked_and_a_missing_texture_makes_its_material_opaque() {
    let mut file = cards(4);
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorTexture": {
        "index": 0,
        "extensions": { "KHR_texture_transform": { "offset": [0.5, 0.25], "scale": [0.1, 2.0] } }
    } });
    file.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    file.json["images"] = json!([{ "uri": "not-there.png" }]);
    let imported = import(&file);
    let plant = imported.plant;
    let [least, most] = [f32::min, f32::max]
        .map(|pick| plant.vertices.iter().map(|v| v.uv).reduce(|a, b| [pick(a[0], b[0]), pick(a[1], b[1])]).unwrap());
    assert_eq!((least, most), ([0.5, 0.25], [0.6, 2.25]));
    assert_eq!((plant.materials[0].texture, plant.materials[0].alpha_mode), (None, AlphaMode::Opaque));
    assert_eq!(plant.materials[0].wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(imported.warnings[0].message.contains("not-there.png"), "{:?}", imported.warnings);
}

#[test]
fn instances_are_leaves_of_their_own() {
    let mut file = cards(1);
    let translations: Vec<f32> = (0..20).flat_map(|i| [i as f32 * 5.0, 0.0, 0.0]).collect();
    let scales: Vec<f32> = (0..20).flat_map(|_| [2.0; 3]).collect();
    let vec3 = json!({ "componentType": 5126, "type": "VEC3", "count": 20 });
    let translation = file.push(&f32_bytes(&translations), vec3.clone());
    let scale = file.push(&f32_bytes(&scales), vec3);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": {
        "attributes": { "TRANSLATION": translation, "SCALE": scale }
    } });
    let plant = plant(&file);
    assert_eq!((plant.leaves.len(), plant.aabb().max), (20, [97.0, 2.0, 0.0]));
    assert_eq!(plant.leaves[3].pivot, [16.0, 1.0, 0.0]);
}

#[test]
fn leaves_with_a_node_each_are_judged_together() {
    let mut file = cards(1);
    file.json["nodes"] = (0..30).map(|i| json!({ "mesh": 0, "translation": [i * 3, 0, 0] })).collect();
    file.json["scenes"][0]["nodes"] = (0..30).collect();
    assert_eq!(plant(&file).leaves.len(), 30);
}

#[test]
fn a_buffer_in_a_data_uri_is_read() {
    let mut file = cards(4);
    let same = plant(&file);
    let hex: String = file.buffer.iter().map(|byte| format!("%{byte:02x}")).collect();
    file.json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream,{hex}"));
    let text = file.json.to_string();
    let options = ImportOptions { group: Group::Piece, ..ImportOptions::default() };
    assert_eq!(load_gltf_bytes(text.as_bytes(), Path::new("made.glb"), &options).unwrap().plant, same);
}
