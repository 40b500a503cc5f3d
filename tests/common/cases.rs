//! Imports of files that put an importer into some situation, built in memory or from the folders
//! `FOLIAGE_CASES` and `FOLIAGE_TREES`.

#![allow(dead_code)] // Each test binary uses only some of it.

use super::glb::{Gltf, cards};
use foliage_lod::import::{self, Group, ImportOptions, Imported};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The path of `file`; `None`, with a note printed, if `FOLIAGE_CASES` is not set.
pub fn case(file: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("FOLIAGE_CASES") else {
        eprintln!("skipped: FOLIAGE_CASES is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(file);
    assert!(path.is_file(), "{} is missing", path.display());
    Some(path)
}

/// The trees made by others; none, with a note printed, if `FOLIAGE_TREES` is not set.
pub fn trees() -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else {
        eprintln!("skipped: FOLIAGE_TREES is not set");
        return Vec::new();
    };
    let is_tree = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "glb" || extension == "obj");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut trees: Vec<PathBuf> = entries.filter(is_tree).collect();
    trees.sort();
    assert!(!trees.is_empty());
    trees
}

/// Options under which each piece is a leaf.
pub fn by_piece() -> ImportOptions {
    ImportOptions { group: Group::Piece, ..ImportOptions::default() }
}

/// Imports a file of a folder.
pub fn read(path: &Path) -> Imported {
    import::inspect(path, &ImportOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Imports a file built in memory, each piece a leaf.
pub fn import(file: &Gltf) -> Imported {
    let imported = import::load_gltf_bytes(&file.glb(), Path::new("made.glb"), &by_piece());
    imported.unwrap_or_else(|error| panic!("{error}"))
}

/// The import of `file` must fail with a single line that contains `says`.
pub fn refused(file: &Gltf, says: &str) {
    let error = import::load_gltf_bytes(&file.glb(), Path::new("made.glb"), &by_piece()).expect_err(says).to_string();
    assert!(error.contains(says) && !error.contains('\n'), "{error:?} does not say {says:?} in one line");
}

/// The warnings of one kind, each in one line.
pub fn warnings(imported: &Imported, kind: &str) -> Vec<String> {
    let of_kind = imported.warnings.iter().filter(|warning| warning.kind.to_string() == kind);
    let warnings: Vec<String> = of_kind.map(ToString::to_string).collect();
    assert!(warnings.iter().all(|warning| !warning.contains('\n')), "{warnings:?}");
    warnings
}

/// Little-endian bytes of numbers.
pub fn f32_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Four cards at each of several root nodes with these names, 5 apart along z.
pub fn places(names: &[&str]) -> Gltf {
    let mut file = cards(4);
    let node = |(i, name): (usize, &&str)| json!({ "mesh": 0, "name": name, "translation": [0, 0, 5 * i] });
    file.json["nodes"] = names.iter().enumerate().map(node).collect();
    file.json["scenes"][0]["nodes"] = (0..names.len()).collect();
    file
}

/// Four cards at each of several root nodes with these names and places along x, turned by 15
/// degrees so that each row has a footprint.
pub fn joined(names: &[(&str, f32)]) -> Gltf {
    let mut file = cards(4);
    let node = |(name, x): &(&str, f32)| -> Value {
        json!({ "mesh": 0, "name": name, "translation": [x, 0, 0], "rotation": [0.0, 0.130_526_2, 0.0, 0.991_444_9] })
    };
    file.json["nodes"] = names.iter().map(node).collect();
    file.json["scenes"][0]["nodes"] = (0..names.len()).collect();
    file
}
