//! Situations that real glTF files put an importer into: rest poses, parts that are not to be
//! drawn, vertex colours that are none, requirements that ask for nothing.
//!
//! Files named by `FOLIAGE_CASES` and `FOLIAGE_TREES` are checked where these variables are set.
#![cfg(feature = "simplify")]

#[path = "common/cases.rs"]
mod cases;
#[path = "common/glb.rs"]
mod glb;

use cases::{case, f32_bytes, import, joined, places, read, refused, trees, warnings};
use foliage_lod::import::Verdict;
use glam::Vec3;
use glb::{Gltf, cards};
use serde_json::{Value, json};

/// Adds a skin of two joints, 10 and 20 above the origin, which hold every vertex of the mesh by a
/// quarter and by three quarters. The node of the mesh is 100 to the right, where no skin looks.
fn skinned(count: u16) -> Gltf {
    let mut file = cards(count);
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0] },
        { "children": [2], "translation": [0.0, 10.0, 0.0] },
        { "translation": [0.0, 10.0, 0.0] }
    ]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.json["skins"] = json!([{ "joints": [1, 2] }]);
    hold(&mut file, [0, 1, 0, 0], [0.25, 0.75, 0.0, 0.0], 0);
    file
}

/// Adds set `set` of joints and weights, the same for every vertex.
fn hold(file: &mut Gltf, joints: [u8; 4], weights: [f32; 4], set: usize) {
    let count = file.json["accessors"][0]["count"].as_u64().unwrap() as usize;
    let joints = file.push(&joints.repeat(count), json!({ "componentType": 5121, "type": "VEC4", "count": count }));
    let weights = f32_bytes(&weights.repeat(count));
    let weights = file.push(&weights, json!({ "componentType": 5126, "type": "VEC4", "count": count }));
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes[format!("JOINTS_{set}")] = json!(joints);
    attributes[format!("WEIGHTS_{set}")] = json!(weights);
}

/// Gives the skin inverse bind matrices, by columns.
fn bind(file: &mut Gltf, matrices: &[[f32; 16]]) {
    let values = f32_bytes(&matrices.concat());
    let accessor = file.push(&values, json!({ "componentType": 5126, "type": "MAT4", "count": matrices.len() }));
    file.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
}

const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

#[test]
fn joints_place_a_skinned_mesh_and_its_node_does_not() {
    let mut file = skinned(4);
    let imported = import(&file);
    assert_eq!((imported.plant.aabb().min, imported.plant.aabb().max), ([0.0, 17.5, 0.0], [10.0, 18.5, 0.0]));
    assert_eq!(imported.plant.leaves.len(), 4);
    // The bind pose is at rest: the matrices undo what the joints do.
    let down = |by: f32| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., -by, 0., 1.];
    bind(&mut file, &[down(10.0), down(20.0)]);
    assert_eq!(import(&file).plant.aabb().max, [10.0, 1.0, 0.0]);
}

#[test]
fn a_second_set_of_joints_counts() {
    let mut file = skinned(4);
    // The sums are 0.25 and 1.75 in parts of 2.
    hold(&mut file, [1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0], 1);
    assert_eq!(import(&file).plant.aabb().min, [0.0, 18.75, 0.0]);
}

#[test]
fn a_skin_that_mirrors_turns_normals_and_winding() {
    let mut file = skinned(4);
    let mirror = [-1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    bind(&mut file, &[mirror, mirror]);
    let normals = f32_bytes(&[0.0, 0.0, 1.0].repeat(16));
    let normals = file.push(&normals, json!({ "componentType": 5126, "type": "VEC3", "count": 16 }));
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let plant = import(&file).plant;
    assert_eq!(plant.aabb().min, [-10.0, 17.5, 0.0]);
    for corners in plant.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(plant.vertices[corners[i] as usize].position));
        let normal = Vec3::from(plant.vertices[corners[0] as usize].normal);
        assert_eq!(normal, Vec3::Z);
        assert!((b - a).cross(c - a).dot(normal) > 0.0, "normal and winding disagree");
    }
}

#[test]
fn the_skinned_tree_stands_as_large_as_the_plain_one() {
    let (Some(skinned), Some(plain)) = (case("08-skinned-leaves.glb"), case("12-blend-factor-043.glb")) else { return };
    let [skinned, plain] = [skinned, plain].map(|path| read(&path).plant.aabb());
    for (a, b) in [(skinned.min, plain.min), (skinned.max, plain.max)] {
        assert!(Vec3::from(a).distance(Vec3::from(b)) < 1e-3, "{skinned:?} {plain:?}");
    }
}

#[test]
fn damaged_skins_are_refused_in_one_line() {
    let broken = |says: &str, damage: &dyn Fn(&mut Gltf)| {
        let mut file = skinned(4);
        damage(&mut file);
        refused(&file, says);
    };
    broken("skin 3 is referenced and 1 exist", &|file| file.json["nodes"][0]["skin"] = json!(3));
    broken("skin 0 has no joints", &|file| file.json["skins"][0]["joints"] = json!([]));
    broken("skin 0 has node 9 as a joint", &|file| file.json["skins"][0]["joints"] = json!([1, 9]));
    broken("2 joints and 1 inverse bind matrices", &|file| bind(file, &[IDENTITY]));
    broken("inverse bind matrix of joint 1 is not finite", &|file| bind(file, &[IDENTITY, [f32::NAN; 16]]));
    broken("held by joint 7 of a skin with 2", &|file| hold(file, [7, 0, 0, 0], [1.0, 0.0, 0.0, 0.0], 0));
    broken("has 4 components", &|file| file.json["skins"][0]["inverseBindMatrices"] = json!(3));
    broken("out of range", &|file| {
        let short = file.push(&[0; 4], json!({ "componentType": 5121, "type": "VEC4", "count": 1 }));
        file.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(short);
    });
    broken("the number of joints", &|file| file.json["skins"][0]["joints"] = json!(vec![1; 5000]));
}

#[test]
fn vertices_that_no_joint_holds_move_with_the_first_and_are_counted() {
    let mut file = skinned(4);
    hold(&mut file, [1, 1, 0, 0], [0.0; 4], 0);
    let imported = import(&file);
    assert_eq!(imported.plant.aabb().min, [0.0, 10.0, 0.0]);
    let warnings = warnings(&imported, "pose");
    assert!(warnings.len() == 1 && warnings[0].contains("16 vertices"), "{warnings:?}");
}

/// Adds a morph target that lifts every vertex by one.
fn morphed(count: u16) -> Gltf {
    let mut file = cards(count);
    let vertices = usize::from(count) * 4;
    let lift = f32_bytes(&[0.0, 1.0, 0.0].repeat(vertices));
    let lift = file.push(&lift, json!({ "componentType": 5126, "type": "VEC3", "count": vertices }));
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": lift }]);
    file
}

#[test]
fn default_morph_weights_are_applied_those_of_the_node_first() {
    let mut file = morphed(4);
    assert_eq!(import(&file).plant.aabb().min[1], 0.0);
    file.json["meshes"][0]["weights"] = json!([0.5]);
    assert_eq!(import(&file).plant.aabb().min[1], 0.5);
    file.json["nodes"] = json!([{ "mesh": 0, "weights": [2.0] }, { "mesh": 0, "translation": [0.0, 0.0, 5.0] }]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let plant = import(&file).plant;
    assert_eq!((plant.aabb().min, plant.aabb().max), ([0.0, 0.5, 0.0], [10.0, 3.0, 5.0]));
}

#[test]
fn sparse_targets_move_their_vertices_and_normals() {
    let mut file = morphed(4);
    let place = file.push(&15u16.to_le_bytes(), json!({ "componentType": 5123, "type": "SCALAR", "count": 1 }));
    let move_by = file.push(&f32_bytes(&[4.0, 0.0, 1.0]), json!({ "componentType": 5126, "type": "VEC3", "count": 1 }));
    let view = |file: &Gltf, accessor: usize| file.json["accessors"][accessor]["bufferView"].clone();
    let sparse = json!({ "count": 1,
        "indices": { "bufferView": view(&file, place), "componentType": 5123 },
        "values": { "bufferView": view(&file, move_by) } });
    let accessors = file.json["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "componentType": 5126, "type": "VEC3", "count": 16, "sparse": sparse }));
    let target = accessors.len() - 1;
    let normals = f32_bytes(&[1.0, 0.0, 0.0].repeat(16));
    let normals = file.push(&normals, json!({ "componentType": 5126, "type": "VEC3", "count": 16 }));
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target, "NORMAL": target }]);
    file.json["meshes"][0]["weights"] = json!([0.25]);
    let plant = import(&file).plant;
    // Vertex 15 was at (9, 1, 0) with the normal (1, 0, 0).
    let moved = plant.vertices.iter().find(|vertex| vertex.position == [10.0, 1.0, 0.25]).expect("moved");
    assert!(Vec3::from(moved.normal).distance(Vec3::new(2.0, 0.0, 0.25).normalize()) < 1e-6, "{moved:?}");
    assert_eq!(plant.vertices.iter().filter(|vertex| vertex.normal == [1.0, 0.0, 0.0]).count(), 15);
}

#[test]
fn damaged_morph_targets_are_refused_in_one_line() {
    let mut file = morphed(4);
    file.json["meshes"][0]["weights"] = json!([0.5, 1.0]);
    refused(&file, "2 morph weights are given for 1 targets");
    file.json["meshes"][0]["weights"] = json!([1.0]);
    file.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(77);
    refused(&file, "accessor 77");
    file.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(1);
    refused(&file, "has 2 components");
}

#[test]
fn animations_are_ignored_with_one_warning() {
    let mut file = cards(4);
    let times = file.push(&f32_bytes(&[0.0]), json!({ "componentType": 5126, "type": "SCALAR", "count": 1 }));
    let moves = file.push(&f32_bytes(&[9.0; 3]), json!({ "componentType": 5126, "type": "VEC3", "count": 1 }));
    let animation = json!({
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": times, "output": moves }]
    });
    file.json["animations"] = json!([animation, animation]);
    let imported = import(&file);
    let warnings = warnings(&imported, "pose");
    assert!(warnings.len() == 1 && warnings[0].contains("2 animations"), "{warnings:?}");
    assert_eq!(imported.plant.aabb().max, [10.0, 1.0, 0.0]);
}

#[test]
fn of_a_chain_of_levels_only_the_finest_is_read() {
    let chains = [
        ["Oak_LOD0", "Oak_LOD1", "Oak_LOD2_Billboard"],
        ["LOD0_Oak", "LOD1_Oak", "Oak_Imposter"],
        ["oak lod0", "oak lod1", "oak_impostor"],
        ["Oak", "Oak_LOD1", "Oak_LOD_2"],
    ];
    for names in chains {
        let imported = import(&places(&names));
        assert_eq!(imported.plant.leaves.len(), 4, "{names:?}");
        assert_eq!(imported.findings[0].name, names[0]);
        let warnings = warnings(&imported, "left-out");
        let lists = |name: &&str| warnings[0].contains(&format!("{name:?}"));
        assert!(warnings.len() == 1 && names[1..].iter().all(lists) && !lists(&names[0]), "{warnings:?}");
    }
}

#[test]
fn groups_and_mesh_names_are_levels_too_and_a_lone_level_stays() {
    let mut file = places(&["", ""]);
    file.json["nodes"] = json!([
        { "name": "LOD1", "children": [2] },
        { "name": "LOD0", "children": [3] },
        { "mesh": 0, "name": "leaves" },
        { "mesh": 0, "name": "leaves", "translation": [0.0, 9.0, 0.0] }
    ]);
    assert_eq!(import(&file).plant.aabb().min[1], 9.0);
    let mesh = file.json["meshes"][0].clone();
    file.json["meshes"] = json!([mesh, mesh]);
    file.json["meshes"][0]["name"] = json!("Oak_LOD1");
    file.json["meshes"][1]["name"] = json!("Oak_LOD0");
    file.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "translation": [0.0, 9.0, 0.0] }]);
    assert_eq!(import(&file).plant.aabb().min[1], 9.0);
    let alone = import(&places(&["Oak_LOD0"]));
    assert_eq!((alone.plant.leaves.len(), alone.warnings.len()), (4, 0));
    assert_eq!(import(&places(&["Oak_Billboard"])).plant.leaves.len(), 4, "nothing else is there");
}

#[test]
fn the_chain_of_the_example_file_is_read_as_its_finest_level() {
    let Some(path) = case("02-lods-as-siblings.glb") else { return };
    let imported = read(&path);
    assert_eq!((imported.plant.leaves.len(), imported.plant.wood.triangles()), (96, 16));
    let warnings = warnings(&imported, "left-out");
    assert!(warnings.len() == 1 && warnings[0].contains("\"Oak_LOD3_Billboard\""), "{warnings:?}");
}

#[test]
fn levels_of_msft_lod_are_not_drawn_inside_or_outside_the_scene() {
    let mut file = places(&["fine", "coarse"]);
    file.json["nodes"][0]["extensions"] = json!({ "MSFT_lod": { "ids": [1] } });
    file.json["extensionsRequired"] = json!(["MSFT_lod"]);
    let in_scene = import(&file);
    assert_eq!((in_scene.plant.leaves.len(), warnings(&in_scene, "left-out").len()), (4, 1));
    file.json["scenes"][0]["nodes"] = json!([0]);
    let outside = import(&file);
    assert_eq!((outside.plant.leaves.len(), outside.warnings.len()), (4, 0));
}

#[test]
fn hidden_nodes_hide_all_below_them() {
    let mut file = places(&["crown", "hidden", "below"]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.json["nodes"][1]["children"] = json!([2]);
    file.json["nodes"][1]["extensions"] = json!({ "KHR_node_visibility": { "visible": false } });
    file.json["nodes"][2]["extensions"] = json!({ "KHR_node_visibility": { "visible": true } });
    let imported = import(&file);
    assert_eq!(imported.plant.leaves.len(), 4);
    let warnings = warnings(&imported, "left-out");
    assert!(warnings.len() == 1 && warnings[0].contains("\"hidden\""), "{warnings:?}");
    file.json["nodes"][0]["extensions"] = file.json["nodes"][1]["extensions"].clone();
    refused(&file, "KHR_node_visibility hides everything");
}

#[test]
fn the_level_that_is_visible_is_the_one_that_is_read() {
    let mut file = places(&["Oak_LOD0", "Oak_LOD1"]);
    file.json["nodes"][0]["extensions"] = json!({ "KHR_node_visibility": { "visible": false } });
    assert_eq!(import(&file).plant.aabb().min[2], 5.0);
}

#[test]
fn collision_shapes_are_left_out() {
    for shape in ["UCX_Oak_01", "UBX_Oak", "USP_Oak", "Oak-colonly", "Oak_collision", "Oak-col"] {
        let imported = import(&places(&["Oak", shape]));
        assert_eq!((imported.plant.leaves.len(), imported.plant.aabb().max[2]), (4, 0.0), "{shape}");
        assert!(warnings(&imported, "left-out")[0].contains(shape));
    }
    // A suffix of what is both drawn and solid.
    assert_eq!(import(&places(&["crown", "trunk-col"])).plant.leaves.len(), 8);
}

/// Appends a node with a square around (`x`, `y`, 0), `side` wide, opaque.
fn push_square(file: &mut Gltf, name: &str, [x, y]: [f32; 2], side: f32) {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let corners = corners.map(|[a, b]| [x + a * side / 2.0, y, b * side / 2.0]).concat();
    let positions = file.push(&f32_bytes(&corners), json!({ "componentType": 5126, "type": "VEC3", "count": 4 }));
    let indices: Vec<u8> = [0u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()).collect();
    let indices = file.push(&indices, json!({ "componentType": 5123, "type": "SCALAR", "count": 6 }));
    let array = |file: &mut Gltf, key: &str, value: Value| {
        let array = file.json[key].as_array_mut().unwrap();
        array.push(value);
        array.len() - 1
    };
    let material = array(file, "materials", json!({ "name": "plain" }));
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": material });
    let mesh = array(file, "meshes", json!({ "primitives": [primitive] }));
    let node = array(file, "nodes", json!({ "name": name, "mesh": mesh }));
    file.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
}

#[test]
fn wide_ground_below_a_plant_is_left_out_and_a_shelf_is_not() {
    let ground = |at: [f32; 2], side: f32, name: &str| {
        let mut file = cards(4);
        push_square(&mut file, name, at, side);
        let imported = import(&file);
        (imported.plant.wood.triangles(), warnings(&imported, "left-out").len())
    };
    assert_eq!(ground([5.0, 0.0], 30.0, "Plane"), (0, 1));
    assert_eq!(ground([5.0, -0.5], 8.0, "Ground"), (0, 1), "a telling name");
    assert_eq!(ground([5.0, 0.0], 8.0, "Plane"), (2, 0), "narrower than the plant");
    assert_eq!(ground([5.0, 0.9], 30.0, "Plane"), (2, 0), "above the base");
    let mut alone = cards(4);
    alone.json["nodes"] = json!([]);
    alone.json["scenes"][0]["nodes"] = json!([]);
    push_square(&mut alone, "Ground", [0.0; 2], 9.0);
    let options = foliage_lod::import::ImportOptions { leaves: vec!["Ground".into()], ..Default::default() };
    let path = std::path::Path::new("made.glb");
    assert_eq!(foliage_lod::import::load_gltf_bytes(&alone.glb(), path, &options).unwrap().plant.leaves.len(), 1);
}

#[test]
fn ground_below_a_named_node_is_left_out_unless_it_is_named_itself() {
    let mut file = cards(4);
    push_square(&mut file, "Plane", [5.0, 0.0], 30.0);
    file.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "oak", "children": [0, 1] }));
    file.json["scenes"][0]["nodes"] = json!([2]);
    let counts = |leaves: &[&str]| {
        let leaves = leaves.iter().map(|name| (*name).to_owned()).collect();
        let options = foliage_lod::import::ImportOptions { leaves, ..Default::default() };
        let path = std::path::Path::new("made.glb");
        let plant = foliage_lod::import::load_gltf_bytes(&file.glb(), path, &options).unwrap().plant;
        (plant.leaves.len(), plant.wood.triangles())
    };
    assert_eq!([counts(&["oak"]), counts(&["cr*"])], [(4, 0); 2]);
    assert_eq!([counts(&["oak", "Plane"]), counts(&["crown,plain"])], [(5, 0); 2]);
}

#[test]
fn several_plants_in_one_file_are_listed_once() {
    let several = |file: &Gltf| warnings(&import(file), "several-plants");
    // The cards of each are in a row 10 wide.
    let apart = several(&joined(&[("oak", 0.0), ("pine", 20.0), ("birch", 40.0)]));
    assert!(apart.len() == 1 && apart[0].contains("3 plants"), "{apart:?}");
    assert!(["oak", "pine", "birch"].iter().all(|name| apart[0].contains(name)), "{apart:?}");
    assert!(several(&joined(&[("twigs", 0.0), ("leaves", 1.0)])).is_empty(), "one on the other");
    let mut wrapped = joined(&[("oak", 0.0), ("pine", 20.0)]);
    wrapped.json["nodes"].as_array_mut().unwrap().push(json!({ "name": "root", "children": [0, 1] }));
    wrapped.json["scenes"][0]["nodes"] = json!([2]);
    assert_eq!(several(&wrapped).len(), 1);
    let Some(fern) = trees().into_iter().find(|path| path.ends_with("fern_02.glb")) else { return };
    assert!(warnings(&read(&fern), "several-plants")[0].contains("4 plants"));
}

/// Gives every vertex of `count` cards a colour of 8 bits, by card and corner.
fn colored(count: u16, color: impl Fn(u16, usize) -> [u8; 4]) -> Gltf {
    let mut file = cards(count);
    let colors: Vec<u8> = (0..count)
        .flat_map(|card| (0..4).map(move |corner| (card, corner)))
        .flat_map(|(card, corner)| color(card, corner))
        .collect();
    let accessor = json!({ "componentType": 5121, "type": "VEC4", "count": count * 4, "normalized": true });
    let color = file.push(&colors, accessor);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    file
}

#[test]
fn wind_weights_in_the_vertex_colours_are_suspected() {
    let wind = colored(20, |card, corner| [100 + (card * 7) as u8, if corner < 2 { 0 } else { 255 }, 0, 255]);
    let imported = import(&wind);
    let suspected = warnings(&imported, "vertex-colors");
    assert!(suspected.len() == 1 && suspected[0].contains("\"leaf\""), "{suspected:?}");
    let shaded = colored(20, |card, corner| [20 + corner as u8 * 30, 60 + (card * 7) as u8, 10, 255]);
    assert!(warnings(&import(&shaded), "vertex-colors").is_empty());
    let Some(path) = case("01b-wind-weights-as-colour.glb") else { return };
    assert_eq!(warnings(&read(&path), "vertex-colors").len(), 1);
}

#[test]
fn colours_of_trees_are_not_suspected() {
    for path in trees() {
        assert!(warnings(&read(&path), "vertex-colors").is_empty(), "{}", path.display());
    }
}

#[test]
fn leaves_without_vertex_alpha_are_left_out_and_a_constant_alpha_is_the_materials() {
    let file = colored(8, |card, _| [255, 255, 255, [255, 255, 255, 255, 255, 191, 127, 0][usize::from(card)]]);
    let imported = import(&file);
    // Cut at 0.5: 191 of 255 is seen, 127 and 0 are not.
    assert_eq!((imported.plant.leaves.len(), imported.plant.materials.len()), (6, 2));
    assert_eq!(imported.plant.materials[1].base_color, [1.0, 1.0, 1.0, 0.75]);
    assert_eq!(imported.plant.leaves[5].material, 1);
    assert!(imported.plant.vertices.iter().all(|vertex| vertex.color == [1.0; 4]));
    let invisible = warnings(&imported, "invisible");
    assert!(invisible.len() == 1 && invisible[0].contains("2 leaves"), "{invisible:?}");
    refused(&colored(8, |_, _| [255, 255, 255, 0]), "their vertex alpha makes them invisible");
}

#[test]
fn an_alpha_that_varies_over_a_leaf_is_named() {
    let varying = import(&colored(8, |_, corner| [255, 255, 255, if corner < 2 { 100 } else { 255 }]));
    let named = warnings(&varying, "vertex-colors");
    assert!(varying.plant.leaves.len() == 8 && named.len() == 1 && named[0].contains("8 leaves"), "{named:?}");
    let mut opaque = colored(20, |_, _| [255, 255, 255, 0]);
    opaque.json["materials"][0].as_object_mut().unwrap().remove("alphaMode");
    assert_eq!((import(&opaque).plant.leaves.len(), import(&opaque).warnings.len()), (20, 0));
}

#[test]
fn requirements_that_only_describe_are_met() {
    let harmless = [
        "EXT_structural_metadata",
        "EXT_mesh_features",
        "EXT_instance_features",
        "EXT_feature_metadata",
        "KHR_xmp_json_ld",
        "AGI_articulations",
        "AGI_stk_metadata",
        "CESIUM_primitive_outline",
        "KHR_audio_emitter",
        "KHR_node_visibility",
        "MPEG_audio_spatial",
        "CESIUM_RTC",
    ];
    let mut file = cards(4);
    file.json["extensionsRequired"] = json!(harmless);
    file.json["extensions"] = json!({ "CESIUM_RTC": { "center": [4e6, 5e5, 4e6] } });
    let imported = import(&file);
    let moved = warnings(&imported, "moved");
    assert!(imported.plant.leaves.len() == 4 && moved.len() == 1 && moved[0].contains("CESIUM_RTC"), "{moved:?}");
    file.json["extensionsRequired"] = json!(["EXT_structural_metadata", "ACME_moves_vertices"]);
    refused(&file, "ACME_moves_vertices");
}

#[test]
fn a_tree_on_its_side_is_suspected_and_a_hedge_is_not() {
    let lying = |rotation: [f32; 4], scale: [f32; 3]| {
        let mut file = cards(1);
        file.json["nodes"] = json!((0..30).map(|i| {
            json!({ "mesh": 0, "translation": [(i % 5) as f32 - 2.5, i as f32, (i % 7) as f32 - 3.5], "name": "leaf" })
        }).collect::<Vec<Value>>());
        let mut nodes: Vec<Value> = file.json["nodes"].as_array().unwrap().clone();
        nodes.push(json!({ "children": (0..30).collect::<Vec<_>>(), "rotation": rotation, "scale": scale }));
        file.json["nodes"] = Value::Array(nodes);
        file.json["scenes"][0]["nodes"] = json!([30]);
        warnings(&import(&file), "up").len()
    };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let to_z = [half, 0.0, 0.0, half];
    assert_eq!(lying(to_z, [1.0; 3]), 1);
    assert_eq!(lying([0.0, 0.0, 0.0, 1.0], [1.0; 3]), 0, "a tree");
    assert_eq!(lying([0.0, 0.0, 0.0, 1.0], [1.0, 0.1, 9.0]), 0, "a hedge along z");
    for path in trees() {
        assert!(warnings(&read(&path), "up").is_empty(), "{}", path.display());
    }
}

#[test]
fn every_reason_names_a_part_that_is_still_there() {
    let imported = import(&places(&["Oak_LOD0", "Oak_LOD1"]));
    assert_eq!(imported.findings.len(), 1);
    assert_eq!(imported.findings[0].verdict, Verdict::Leaf);
}
