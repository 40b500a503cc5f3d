//! Tests of `foliage-lod export`, run the way a user runs it.

#[path = "common/command.rs"]
#[allow(dead_code)]
mod command;

use command::{error_line, names, run, succeeds};
use serde_json::Value;
use std::{fs, path::Path, process::Output, sync::LazyLock};
use tempfile::TempDir;

fn json(output: &Output) -> Value {
    succeeds(output);
    serde_json::from_slice(&output.stdout).unwrap()
}

fn read(folder: &TempDir, name: &str) -> Vec<u8> {
    fs::read(folder.path().join(name)).unwrap()
}

fn lods(folder: &TempDir, name: &str) -> Vec<Value> {
    let told: Value = serde_json::from_slice(&read(folder, name)).unwrap();
    told["levels"].as_array().unwrap().clone()
}

/// A model of 200 leaves.
static MODEL: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    succeeds(&run(&folder, &["grow", "betula-populifolia", "-o", "tree.glb", "--leaves", "200"]));
    let made = ["simplify", "tree.glb", "-o", "a.vds", "--resolution", "32", "--raster", "cpu", "--growth", "scale"];
    succeeds(&run(&folder, &made));
    read(&folder, "a.vds")
});

fn folder_with_model() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("a.vds"), &*MODEL).unwrap();
    folder
}

#[test]
fn a_model_is_exported_for_viewers_and_browsers() {
    let folder = folder_with_model();
    let told = json(&run(&folder, &["export", "a.vds", "-o", "a.glb", "--json"]));
    for key in ["path", "kind", "leaves", "triangles", "bytes"] {
        assert!(!told["files"][0][key].is_null(), "{key}");
    }
    assert_eq!((&told["files"][0]["leaves"], &told["leaves"]), (&200.into(), &200.into()));
    assert!(told["seconds"].is_number() && read(&folder, "a.glb").starts_with(b"glTF"));
    succeeds(&run(&folder, &["export", "a.vds", "-o", "a.html"]));
    assert!(read(&folder, "a.html").starts_with(b"<!doctype html>"));
    assert_eq!(names(&folder), ["a.glb", "a.html", "a.vds"]);
}

#[test]
fn levels_have_a_file_each_and_end_with_cards() {
    let folder = folder_with_model();
    let levels = ["export", "a.vds", "-o", "b.glb", "--levels", "1,0.25", "--json"];
    let told = json(&run(&folder, &levels));
    let files = told["files"].as_array().unwrap();
    let kinds: Vec<&str> = files.iter().map(|file| file["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["level", "level", "cards", "levels"]);
    assert_eq!([&files[0]["leaves"], &files[1]["leaves"], &files[2]["cards"]], [200, 50, 3]);
    assert_eq!(names(&folder), ["a.vds", "b_LOD0.glb", "b_LOD1.glb", "b_LOD2.glb", "b_lods.json"]);
    let told = lods(&folder, "b_lods.json");
    let sizes: Vec<f64> = told.iter().map(|level| level["screen_coverage"].as_f64().unwrap()).collect();
    assert!(sizes[0] == 1.0 && sizes.windows(2).all(|pair| pair[1] < pair[0]), "{sizes:?}");
    for (number, level) in told.iter().enumerate() {
        assert_eq!(level["file"], format!("b_LOD{number}.glb"));
        assert!(level["triangles"].is_u64() && level["wood_triangles"].is_u64() && level["size_px"].is_number());
    }
    let all = || names(&folder).iter().map(|name| read(&folder, name)).collect::<Vec<_>>();
    let before = all();
    succeeds(&run(&folder, &levels));
    assert!(all() == before, "the same bytes");
    succeeds(&run(&folder, &["export", "a.vds", "-o", "c.glb", "--levels", "1,0.25", "--far-cards", "off"]));
    assert_eq!(lods(&folder, "c_lods.json").len(), 2);
}

#[test]
fn all_levels_may_be_in_one_file() {
    let folder = folder_with_model();
    let told = json(&run(&folder, &["export", "a.vds", "-o", "a.glb", "--levels", "1,0.25", "--msft-lod", "--json"]));
    assert_eq!(names(&folder), ["a.glb", "a.vds"]);
    let file = &told["files"][0];
    assert_eq!(
        (&file["kind"], &file["leaves"], file["levels"].as_array().unwrap().len()),
        (&"msft_lod".into(), &200.into(), 3)
    );
    let glb = read(&folder, "a.glb");
    let has = |text: &str| glb.windows(text.len()).any(|part| part == text.as_bytes());
    assert!(has("MSFT_lod") && has("MSFT_screencoverage") && has("_LOD2"));
}

#[test]
fn levels_by_quality_have_the_fewest_leaves_that_meet_it() {
    let folder = folder_with_model();
    let levels = |levels: &str| {
        let asked = ["export", "a.vds", "-o", "q.glb", "--far-cards", "off", "--json", "--levels", levels];
        json(&run(&folder, &asked));
        lods(&folder, "q_lods.json")
    };
    let told = levels("1,ssim=0.9@48,rmse=25@32");
    let leaves: Vec<u64> = told.iter().map(|level| level["leaves"].as_u64().unwrap()).collect();
    assert!(leaves[0] == 200 && leaves[1] < 200 && leaves[2] < leaves[1] && leaves[2] > 0, "{leaves:?}");
    assert!(told[1]["ssim"].as_f64().unwrap() >= 0.9 && told[2]["rmse"].as_f64().unwrap() <= 25.0, "{told:?}");
    assert_eq!((&told[1]["target"], &told[1]["size_px"]), (&"ssim=0.9@48".into(), &48.0.into()));
    let better = levels("ssim=0.97@48");
    assert!(better[0]["leaves"].as_u64().unwrap() > leaves[1], "{better:?}");
}

#[test]
fn species_are_grown_and_textures_made_smaller() {
    let folder = TempDir::new().unwrap();
    let export = |more: &[&str]| {
        let asked = ["export", "meadow-grass", "--preset", "fast", "--raster", "cpu", "--json", "-o"];
        json(&run(&folder, &[&asked, more].concat()))
    };
    let told = export(&["a.glb"]);
    let small = export(&["b.glb", "--textures", "16"]);
    assert_eq!(told["leaves"], small["leaves"]);
    assert!(small["files"][0]["bytes"].as_u64() < told["files"][0]["bytes"].as_u64(), "{told} {small}");
}

#[test]
fn what_cannot_be_written_is_told_in_one_line_and_nothing_is_left() {
    let folder = folder_with_model();
    succeeds(&run(&folder, &["export", "a.vds", "-o", "a.glb"]));
    fs::write(folder.path().join("a_LOD0.glb"), read(&folder, "a.glb")).unwrap();
    let before = names(&folder);
    for (arguments, says) in [
        (&["export", "a.vds", "-o", "b.fbx"][..], "b.glb, or a page (.html)"),
        (&["export", "a.vds", "-o", "b.html", "--levels", "1"], "b.glb"),
        (&["export", "a.glb", "-o", "a.glb"], "a.glb"),
        (&["export", "a_LOD0.glb", "-o", "a.glb", "--levels", "0.5"], "a_LOD0.glb"),
        (&["export", "a.vds", "-o", "b.glb", "--scale", "0"], "scale"),
        (&["export", "a.vds", "-o", "b.glb", "--scale", "1e-46"], "scale"),
        (&["export", "a.vds", "-o", "b.glb", "--up", "z"], "--z-up"),
        (&["export", "a.vds", "-o", "b.glb", "--preset", "fast"], "--preset"),
        (&["export", "none.vds", "-o", "b.glb"], "none.vds"),
        (&["export", "english-ok", "-o", "b.glb"], "english-oak"),
        (&["export", "english-oak", "-o", "b.glb", "--leaves", "x"], "species need none"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "0.2,0.5"], "--levels is LOD1 with 0.5 after 0.2"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "0.5,0.499"], "LOD1 with 100 leaves after 100"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "0.01,ssim=0.9@48"], "LOD1 with"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "ssim=2@48"], "SSIM 1.000"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "ssim=0.9"], "ssim=0.9@200"),
        (&["export", "a.vds", "-o", "b.glb", "--levels", "0"], "above 0"),
        (&["export", "a.vds", "-o", "b.glb", "--textures", "0"], "asis, or 1 to 8192"),
        (&["export", "a.vds", "-o", "b.glb", "--far-cards", "off"], "--levels"),
        (&["export", "a.vds", "-o", "b.glb", "--msft-lod"], "--levels"),
    ] {
        let output = run(&folder, arguments);
        let line = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && line.lines().count() == 1 && line.contains(says), "{arguments:?}: {line}");
        assert_eq!(names(&folder), before, "{arguments:?}");
    }
    // A file that cannot be replaced: those before it stay as they are.
    fs::create_dir(folder.path().join("c_LOD1.glb")).unwrap();
    fs::write(folder.path().join("c_LOD0.glb"), b"old").unwrap();
    error_line(&run(&folder, &["export", "a.vds", "-o", "c.glb", "--levels", "1,0.5", "--far-cards", "off"]), 1);
    assert_eq!(read(&folder, "c_LOD0.glb"), b"old");
}

#[test]
fn control_characters_of_names_are_spelled_out() {
    let folder = TempDir::new().unwrap();
    succeeds(&run(&folder, &["grow", "meadow-grass", "-o", "tree.glb"]));
    let grown = read(&folder, "tree.glb");
    let name = "x\u{1b}[31m\ny";
    fs::write(folder.path().join(format!("{name}.glb")), grown).unwrap();
    let input = Path::new(name).with_extension("glb");
    let arguments = ["export", input.to_str().unwrap(), "-o", "a.glb", "--preset", "fast", "--raster", "cpu"];
    let output = run(&folder, &arguments);
    succeeds(&output);
    let told = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert!(told.lines().count() == 4 && !told.contains('\u{1b}'), "{told:?}");
    assert!(told.contains("\\u{1b}[31m\\ny"), "{told:?}");
}
