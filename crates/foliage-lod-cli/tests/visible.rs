//! Plants that the command must not show as nothing.

#[path = "common/command.rs"]
#[allow(dead_code)]
mod command;

use command::{error_line, run, succeeds};
use serde_json::{Value, json};
use std::{fmt::Write, fs, process::Output};
use tempfile::TempDir;

/// Corners of card `i` of a row.
fn corners(i: u8) -> [[f32; 3]; 4] {
    let x = f32::from(i) * 1.5;
    [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]]
}

/// A folder with `cards.obj`, three cards without wood.
fn three_cards() -> TempDir {
    let mut obj = "o card\n".to_owned();
    (0..3).flat_map(corners).for_each(|[x, y, z]| writeln!(obj, "v {x} {y} {z}").unwrap());
    (0..3).for_each(|i| writeln!(obj, "f {} {} {} {}", 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * i + 4).unwrap());
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("cards.obj"), obj).unwrap();
    folder
}

/// A folder with `faded.gltf`, six cards that are cut out at alpha 0.5 and have an alpha of 0.2.
fn faded_cards() -> TempDir {
    let floats = (0..6).flat_map(corners).flatten().flat_map(f32::to_le_bytes);
    let indices = (0..6_u16).flat_map(|i| [0, 1, 2, 0, 2, 3].map(|corner| 4 * i + corner)).flat_map(u16::to_le_bytes);
    let bytes: Vec<u8> = floats.chain(indices).collect();
    let hex = bytes.iter().fold(String::new(), |hex, byte| hex + &format!("%{byte:02x}"));
    let gltf = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{
            "name": "faded", "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, 0.2] }
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 24 },
            { "bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 36 }
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 288 },
            { "buffer": 0, "byteOffset": 288, "byteLength": 72 }
        ],
        "buffers": [{ "byteLength": 360, "uri": format!("data:application/octet-stream,{hex}") }]
    });
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("faded.gltf"), gltf.to_string()).unwrap();
    folder
}

fn json_of(output: &Output) -> Value {
    succeeds(output);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_plant_of_three_cards_shows_a_leaf_at_a_low_level_of_detail() {
    let folder = three_cards();
    succeeds(&run(&folder, &["simplify", "cards.obj", "--leaves", "card", "-o", "cards.vds", "--raster", "cpu"]));
    let picture = |option: &str, value: &str| {
        let arguments = ["render", "cards.vds", "-o", "cards.png", option, value, "--size", "64x64", "--raster", "cpu"];
        succeeds(&run(&folder, &arguments));
        fs::read(folder.path().join("cards.png")).unwrap()
    };
    let nothing = picture("--lod", "0");
    assert_eq!(picture("--leaves-count", "0"), nothing);
    let one = picture("--leaves-count", "1");
    assert_ne!(one, nothing);
    assert_eq!([picture("--lod", "0.15"), picture("--lod", "0.001")], [one.clone(), one]);
}

#[test]
fn a_material_of_which_nothing_is_drawn_gives_a_warning_whose_flag_works() {
    let folder = faded_cards();
    let simplify = ["simplify", "faded.gltf", "-o", "faded.vds", "--raster", "cpu"];
    let simplified = run(&folder, &simplify);
    succeeds(&simplified);
    let line = String::from_utf8(simplified.stderr).unwrap();
    let start = "warning: material \"faded\" is cut out at alpha 0.5 and its largest alpha is 0.2: ";
    assert!(line.starts_with(start) && line.contains("--alpha-cutoff to 0.1") && line.lines().count() == 1, "{line}");
    let inspected = String::from_utf8(run(&folder, &["inspect", "faded.gltf"]).stdout).unwrap();
    assert!(inspected.contains(line.trim_end()), "{inspected}");
    for output in
        [run(&folder, &["inspect", "faded.gltf", "--json"]), run(&folder, &[&simplify[..], &["--json"]].concat())]
    {
        let warning = json_of(&output)["warnings"][0].clone();
        assert_eq!(warning["kind"], "invisible");
        assert!(warning["fix"].as_str().unwrap().contains("--alpha-cutoff to 0.1"), "{warning}");
    }
    let mended = run(&folder, &[&simplify[..], &["--alpha-cutoff", "0.1"]].concat());
    succeeds(&mended);
    assert!(mended.stderr.is_empty());
    let line = error_line_of(&folder, "1.5");
    assert!(line.contains("--alpha-cutoff is 1.5; it must be from 0 to 1"), "{line}");
}

fn error_line_of(folder: &TempDir, cutoff: &str) -> String {
    error_line(&run(folder, &["inspect", "faded.gltf", "--alpha-cutoff", cutoff]), 2)
}
