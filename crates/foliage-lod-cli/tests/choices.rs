//! The command chooses a plant of a file, turns it and ignores its vertex colours; its warnings
//! spell the flags that do so.

#[path = "common/command.rs"]
#[allow(dead_code)] // The rest is for other tests.
mod command;
#[path = "../../../tests/common/glb.rs"]
mod glb;

use command::{error_line, run, succeeds};
use glb::cards;
use serde_json::{Value, json};
use std::fs;
use tempfile::TempDir;

/// A folder with `two.glb`, a chain of levels beside a tree, with weights as vertex colours.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let mut file = cards(20);
    let colors: Vec<u8> = (0..20)
        .flat_map(|_| [[0, 90, 0, 255], [0, 90, 0, 255], [255, 90, 0, 255], [255, 90, 0, 255]])
        .flatten()
        .collect();
    let accessor = json!({ "componentType": 5121, "type": "VEC4", "count": 80, "normalized": true });
    let color = file.push(&colors, accessor);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(color);
    let names = ["Oak_LOD0", "Oak_LOD1", "Pine"];
    let node = |(i, name): (usize, &&str)| json!({ "mesh": 0, "name": name, "translation": [0, 0, 5 * i] });
    file.json["nodes"] = names.iter().enumerate().map(node).collect();
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    fs::write(folder.path().join("two.glb"), file.glb()).unwrap();
    folder
}

fn inspect(folder: &TempDir, options: &[&str]) -> Value {
    let output = run(folder, &[&["inspect", "two.glb", "--json"], options].concat());
    succeeds(&output);
    serde_json::from_slice(&output.stdout).unwrap()
}

fn kinds(inspected: &Value) -> Vec<&str> {
    inspected["warnings"].as_array().unwrap().iter().map(|warning| warning["kind"].as_str().unwrap()).collect()
}

#[test]
fn every_fix_in_a_warning_is_a_flag_that_removes_it() {
    let folder = folder();
    let plain = inspect(&folder, &[]);
    assert_eq!(
        (plain["leaves"].as_u64(), kinds(&plain)),
        (Some(40), vec!["left-out", "vertex-colors", "several-plants"])
    );
    let fixes: Vec<&str> =
        plain["warnings"].as_array().unwrap().iter().map(|warning| warning["fix"].as_str().unwrap()).collect();
    assert!(
        fixes[0].contains("--plant") && fixes[1].contains("--vertex-colors ignore") && fixes[2].contains("--plant"),
        "{fixes:?}"
    );
    let fixed = inspect(&folder, &["--plant", "Pine", "--vertex-colors", "ignore"]);
    assert_eq!((fixed["leaves"].as_u64(), kinds(&fixed)), (Some(20), vec![]));
    assert_eq!(fixed["bounds"]["min"], json!([0.0, 0.0, 10.0]));
    let turned = inspect(&folder, &["--plant", "Pine", "--up", "z"]);
    assert_eq!(turned["bounds"]["min"], json!([0.0, 10.0, -1.0]));
    let lines = run(&folder, &["inspect", "two.glb"]);
    assert!(String::from_utf8(lines.stdout).unwrap().contains("use --vertex-colors ignore"));
}

#[test]
fn simplify_takes_the_same_choices_and_warns_on_stderr() {
    let folder = folder();
    let simplify = ["simplify", "two.glb", "-o", "two.vds", "--raster", "cpu", "--resolution", "32"];
    let plain = run(&folder, &simplify);
    succeeds(&plain);
    let warnings = String::from_utf8(plain.stderr).unwrap();
    assert_eq!(warnings.lines().count(), 3, "{warnings}");
    assert!(warnings.lines().all(|line| line.starts_with("warning: ")) && warnings.contains("--plant"), "{warnings}");
    let chosen = run(&folder, &[&simplify[..], &["--plant", "Oak", "--vertex-colors", "ignore", "--json"]].concat());
    succeeds(&chosen);
    let chosen: Value = serde_json::from_slice(&chosen.stdout).unwrap();
    assert_eq!((chosen["leaves"].as_u64(), kinds(&chosen)), (Some(20), vec![]));
    let unknown = error_line(&run(&folder, &[&simplify[..], &["--plant", "Yew"]].concat()), 2);
    assert!(unknown.contains("--plant is \"Yew\"") && unknown.contains("\"Pine\""), "{unknown}");
}

#[test]
fn an_intrinsic_cost_is_recorded_and_refused_for_other_criteria() {
    let folder = folder();
    let simplify = ["simplify", "two.glb", "-o", "two.vds", "--raster", "cpu", "--resolution", "32"];
    let with = |options: &[&str]| run(&folder, &[&simplify[..], &["--intrinsic", "0.25"], options].concat());
    let refused = error_line(&with(&["--criterion", "area"]), 2);
    assert!(refused.contains("--intrinsic is 0.25") && refused.contains("only `image`"), "{refused}");
    succeeds(&with(&[]));
    let inspected = run(&folder, &["inspect", "two.vds"]);
    assert!(String::from_utf8(inspected.stdout).unwrap().contains("criterion image with intrinsic cost 0.25,"));
    let inspected: Value = serde_json::from_slice(&run(&folder, &["inspect", "two.vds", "--json"]).stdout).unwrap();
    assert_eq!(inspected["intrinsic"], 0.25);
}
