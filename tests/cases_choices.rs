//! Choices of an import: which plant of a file, which axis is up, whether vertex colours count.
#![cfg(feature = "simplify")]

#[path = "common/cases.rs"]
mod cases;
#[path = "common/glb.rs"]
mod glb;

use cases::{by_piece, case, f32_bytes, joined, places, read, warnings};
use foliage_lod::{
    Error,
    import::{self, ImportOptions, Imported, Up, VertexColors},
};
use glb::{Gltf, cards};
use serde_json::json;
use std::path::Path;

fn import(file: &Gltf, options: ImportOptions) -> Result<Imported, Error> {
    import::load_gltf_bytes(&file.glb(), Path::new("made.glb"), &options)
}

fn plant(name: &str) -> ImportOptions {
    ImportOptions { plant: Some(name.to_owned()), ..by_piece() }
}

#[test]
fn a_named_plant_is_the_only_one_and_stays_where_it_stands() {
    let file = joined(&[("oak", 0.0), ("pine", 20.0)]);
    let pine = import(&file, plant("pine")).unwrap();
    assert_eq!((pine.plant.leaves.len(), pine.warnings.len()), (4, 0));
    assert_eq!((pine.findings.len(), pine.findings[0].name.as_str()), (1, "pine"));
    assert!(pine.plant.aabb().min[0] >= 20.0, "{:?}", pine.plant.aabb());
    let everything = import(&file, plant("*")).unwrap();
    assert_eq!((everything.plant.leaves.len(), everything.warnings.len()), (8, 0));
}

#[test]
fn a_name_takes_all_below_it_with_the_transforms_above_it() {
    let mut file = joined(&[("bark", 0.0), ("leaves", 20.0)]);
    file.json["nodes"].as_array_mut().unwrap().extend([
        json!({ "name": "oak", "children": [0] }),
        json!({ "name": "pine", "children": [1] }),
        json!({ "children": [2, 3], "translation": [0, 7, 0] }),
    ]);
    file.json["scenes"][0]["nodes"] = json!([4]);
    let pine = import(&file, plant("pine")).unwrap();
    assert_eq!((pine.findings[0].name.as_str(), pine.plant.aabb().min[1]), ("leaves", 7.0));
}

#[test]
fn a_node_named_as_foliage_counts_within_the_plant_that_is_named() {
    let mut file = joined(&[("card.1", 0.0), ("card.2", 20.0)]);
    file.json["nodes"].as_array_mut().unwrap().extend([
        json!({ "name": "crown", "children": [0] }),
        json!({ "name": "crown", "children": [1] }),
        json!({ "name": "oak", "children": [2] }),
        json!({ "name": "pine", "children": [3] }),
    ]);
    file.json["scenes"][0]["nodes"] = json!([4, 5]);
    let naming = |leaves: &str| import(&file, ImportOptions { leaves: vec![leaves.to_owned()], ..plant("pine") });
    for leaves in ["crown", "pine", "card.*"] {
        let pine = naming(leaves).unwrap().plant;
        assert_eq!((pine.leaves.len(), pine.aabb().min[0] >= 20.0), (4, true), "{leaves}");
    }
    let line = naming("oak").unwrap_err().to_string();
    assert!(line.contains("\"oak\"") && line.contains("crown") && !line.contains("card.1"), "{line}");
}

#[test]
fn an_unknown_plant_is_refused_with_the_names_there_are() {
    let error = import(&joined(&[("oak", 0.0), ("pine", 20.0)]), plant("yew")).unwrap_err();
    assert!(matches!(error, Error::InvalidOption { .. }), "{error}");
    let text = error.to_string();
    assert!(
        ["\"yew\"", "\"oak\"", "\"pine\""].iter().all(|name| text.contains(name)) && !text.contains('\n'),
        "{text}"
    );
    let text = "o oak\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let error = import::load_obj_bytes(text.as_bytes(), Path::new("made.obj"), &plant("yew")).unwrap_err().to_string();
    assert!(error.contains("\"oak\""), "{error}");
}

#[test]
fn what_is_left_out_can_be_named() {
    let mut file = places(&["Oak_LOD0", "Oak_LOD1", "hidden", "UCX_Oak"]);
    file.json["nodes"][2]["extensions"] = json!({ "KHR_node_visibility": { "visible": false } });
    let depth = |name: &str| import(&file, plant(name)).unwrap().plant.aabb();
    for (i, name) in ["Oak_LOD0", "Oak_LOD1", "hidden", "UCX_Oak"].into_iter().enumerate() {
        assert_eq!([depth(name).min[2], depth(name).max[2]], [5.0 * i as f32; 2], "{name}");
    }
    assert_eq!((depth("Oak").min[2], depth("Oak").max[2]), (0.0, 0.0), "the finest level of a chain");
    assert_eq!(import(&file, plant("*")).unwrap().plant.leaves.len(), 16);
}

#[test]
fn objects_of_obj_are_levels_and_plants() {
    let mut text = String::new();
    for (i, name) in ["Oak_LOD0", "Oak_LOD1", "Pine"].into_iter().enumerate() {
        text.push_str(&format!("o {name}\n"));
        for card in 0..16 {
            for [x, y] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                text.push_str(&format!("v {} {y} {}\n", x + 3 * card + 100 * i, card % 4));
            }
            text.push_str("f -4 -3 -2 -1\n");
        }
    }
    let read = |options: &ImportOptions| {
        import::load_obj_bytes(text.as_bytes(), Path::new("made.obj"), options)
            .unwrap_or_else(|error| panic!("{error}"))
    };
    let all = read(&by_piece());
    assert_eq!(all.plant.leaves.len(), 32);
    assert!(warnings(&all, "left-out")[0].contains("\"Oak_LOD1\""));
    assert!(warnings(&all, "several-plants")[0].contains("\"Pine\""), "{:?}", all.warnings);
    let pine = read(&plant("Pine"));
    assert_eq!((pine.plant.leaves.len(), pine.plant.aabb().min[0], pine.warnings.len()), (16, 200.0, 0));
}

#[test]
fn colours_that_are_ignored_are_white_and_opaque() {
    let mut file = cards(4);
    let colors: Vec<u8> = [255, 0, 0, 0].repeat(16);
    let accessor = json!({ "componentType": 5121, "type": "VEC4", "count": 16, "normalized": true });
    let color = file.push(&colors, accessor);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    assert!(import(&file, by_piece()).unwrap_err().to_string().contains("VertexColors::Ignore"));
    let ignored = import(&file, ImportOptions { vertex_colors: VertexColors::Ignore, ..by_piece() }).unwrap();
    assert_eq!((ignored.plant.leaves.len(), ignored.warnings.len()), (4, 0));
    assert!(ignored.plant.vertices.iter().all(|vertex| vertex.color == [1.0; 4]));
}

#[test]
fn z_becomes_y_and_y_becomes_minus_z() {
    let mut file = cards(4);
    let normals = f32_bytes(&[0.0, 0.0, 1.0].repeat(16));
    let normals = file.push(&normals, json!({ "componentType": 5126, "type": "VEC3", "count": 16 }));
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    file.json["nodes"][0]["translation"] = json!([0, 0, 5]);
    let turned = import(&file, ImportOptions { up: Up::Z, ..by_piece() }).unwrap().plant;
    assert_eq!((turned.aabb().min, turned.aabb().max), ([0.0, 5.0, -1.0], [10.0, 5.0, 0.0]));
    assert!(turned.vertices.iter().all(|vertex| vertex.normal == [0.0, 1.0, 0.0]));
}

#[test]
fn the_tree_on_its_side_is_suspected_and_stands_once_it_is_turned() {
    let Some(path) = case("17-obj-z-up.obj") else { return };
    let lying = read(&path);
    assert!(warnings(&lying, "up")[0].contains("Up::Z"));
    let standing = import::load(&path, &ImportOptions { up: Up::Z, ..Default::default() }).unwrap();
    assert!(warnings(&standing, "up").is_empty());
    let [low, high] = [standing.plant.aabb().min, standing.plant.aabb().max];
    assert!(low[1] == 0.0 && high[1] > 3.5 && low[2] < -1.0 && high[2] > 1.0, "{low:?} {high:?}");
}
