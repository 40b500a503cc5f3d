//! `foliage-lod report` on small inputs: every figure, page and table is written, and the numbers
//! are plausible.
//!
//! Without an adapter the test prints a note and passes; with `FOLIAGE_REQUIRE_ADAPTER=1` it fails.

#[path = "../../../tests/common/gpu.rs"]
mod gpu;

use gpu::gpu;
use std::{fs, path::Path, process::Command};

fn report(folder: &Path, adapter: Option<&str>) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    command.args(["report", "--paper", "--leaves", "120", "--size", "48x32", "--json", "-o"]).arg(folder);
    if let Some(adapter) = adapter {
        command.env("WGPU_ADAPTER_NAME", adapter);
    }
    command.output().unwrap()
}

#[test]
fn the_papers_figures_are_measured_and_written() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/for/it");
    let output = report(&out, None);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = json["rows"].as_array().unwrap();
    let of_figure = |figure: u64| rows.iter().filter(move |row| row["figure"] == figure);
    // Three species at eleven distances, with level of detail and at full detail; four series of
    // forests of five sizes.
    assert_eq!([3, 4, 5, 7].map(|figure| of_figure(figure).count()), [66, 33, 20, 1]);
    assert!(of_figure(3).chain(of_figure(5)).all(|row| row["frame_ms"].as_f64().unwrap() > 0.0));
    assert!(of_figure(4).all(|row| row["extraction_us"].as_f64().unwrap() >= 0.0 && row["frame_ms"].is_null()));
    let leaves = |row: &serde_json::Value| row["leaves"].as_u64().unwrap();
    let oaks: Vec<u64> = of_figure(4).filter(|row| row["plant"] == "English oak").map(leaves).collect();
    assert!(oaks[0] == 120 && oaks.windows(2).all(|pair| pair[1] <= pair[0]), "{oaks:?}");
    let nine = leaves(of_figure(7).next().unwrap()) as f64 / (9.0 * 120.0);
    assert!((nine - 0.276).abs() < 0.02, "nine oaks drawn with {nine} of their leaves");
    let csv = fs::read_to_string(out.join("paper.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + rows.len());
    assert!(csv.lines().all(|line| line.matches(',').count() == 7));
    for name in ["figure-3.svg", "figure-4.svg", "figure-5.svg"] {
        let svg = fs::read_to_string(out.join(name)).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("English oak") && svg.trim_end().ends_with("</svg>"));
    }
    for (name, size) in [("figure-6.png", (48 * 3 + 16, 32)), ("figure-7.png", (48, 32))] {
        assert_eq!(image::image_dimensions(out.join(name)).unwrap(), size);
    }
}

#[test]
fn without_an_adapter_the_report_says_what_it_needs() {
    let folder = tempfile::tempdir().unwrap();
    let unmade = folder.path().join("unmade");
    let output = report(&unmade, Some("no such adapter"));
    assert!(!unmade.exists(), "an empty folder is left behind");
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    let error = message.lines().find(|line| line.starts_with("error: ") && !line.contains("XDG")).unwrap();
    assert!(error.contains("the report needs a GPU or a software Vulkan driver"), "{error}");
}

fn study(folder: &Path, more: &[&str]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    command.args(["report", "betula-populifolia", "--leaves", "400", "--levels", "0.5,0.1", "--pixels", "48"]);
    command.args(["--json", "-o"]).arg(folder).args(more).output().unwrap()
}

#[test]
fn a_plants_report_is_one_page_with_every_method_at_every_level() {
    let folder = tempfile::tempdir().unwrap();
    let glb = folder.path().join("lod.glb");
    let mut grow = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    assert!(grow.args(["grow", "betula-populifolia", "--leaves", "200", "-o"]).arg(&glb).status().unwrap().success());
    let output = study(folder.path(), &["--against", glb.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = json["rows"].as_array().unwrap();
    for method in ["paper", "fast", "balanced", "best", "random", "cook", "gomez, linear 1/lambda"] {
        let levels: Vec<f64> =
            rows.iter().filter(|row| row["method"] == method).map(|row| row["level"].as_f64().unwrap()).collect();
        assert_eq!(levels, [0.5, 0.1], "{method}");
    }
    let written = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let against: Vec<_> = rows.iter().filter(|row| row["method"] == "against").collect();
    assert_eq!(against.len(), 1);
    assert!((against[0]["level"].as_f64().unwrap() - 0.5).abs() < 0.1);
    let csv_keys = written("report.csv").lines().next().unwrap().to_owned();
    assert!(rows.iter().all(|row| csv_keys.split(',').all(|key| row.get(key).is_some())), "{csv_keys}");
    assert!(["frame_seconds", "grain", "fragment_share", "matched_xor"].iter().all(|key| csv_keys.contains(key)));
    let of = |key: &str, method: &str, level: f64| {
        let row = rows.iter().find(|row| row["method"] == method && row["level"] == level).unwrap();
        row[key].as_f64().unwrap()
    };
    for rmse in ["rmse", "matched_rmse"] {
        assert!(of(rmse, "balanced", 0.1) < of(rmse, "random", 0.1));
        assert!(of(rmse, "balanced", 0.5) < of(rmse, "balanced", 0.1));
    }
    for (level, pixels) in [(0.5, 181.0), (0.1, 81.0)] {
        assert_eq!(of("matched_pixels", "fast", level), pixels);
        assert_eq!(of("leaf_share", "fast", level), level);
        assert!((of("triangle_share", "fast", level) - level).abs() < 1e-9, "all leaves of a birch are alike");
        assert!((of("fragment_share", "random", level) / level - 1.0).abs() < 0.2);
        assert!(of("fragment_share", "balanced", level) > 1.3 * level, "enlarged leaves have more fragments");
        assert!(of("fragment_share", "cook", level) > 1.3 * level);
        assert!((0.1..1.2).contains(&of("grain", "balanced", level)));
    }
    let offline = json["offline"].as_array().unwrap();
    assert_eq!(offline.len(), 14);
    let keys = ["plant", "preset", "resolution", "views", "criterion", "seconds", "peak_bytes"];
    assert!(offline.iter().all(|row| keys.iter().all(|key| row.get(key).is_some())));
    assert_eq!(serde_json::from_str::<serde_json::Value>(&written("report.json")).unwrap(), json);
    assert_eq!(written("report.csv").lines().count(), 1 + rows.len());
    let page = written("report.html");
    let without_names = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!without_names.contains("http") && !page.contains(" src=\"/") && page.contains("data:image/png;base64,"));
    assert!(page.contains("At the matched size") && page.contains("<th>fragments</th>"));
    assert!(page.contains("class=\"front\"") && page.matches("<svg").count() >= 3);
}

#[test]
fn small_plants_are_measured_where_they_are_asked_for() {
    let Some(trees) = std::env::var_os("FOLIAGE_TREES") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    command.arg("report").arg(Path::new(&trees).join("Fern_1.glb"));
    command.args(["--levels", "0.5", "--pixels", "48", "--brief", "--far", "4x16", "--json", "-o"]);
    let output = command.arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = json["impostors"].as_array().unwrap();
    let methods =
        ["every leaf", "prefix", "prefix, error of the impostor", "impostor", "both", "three levels", "crossed cards"];
    let of = |key: &str, method: &str, px: u64| {
        let row = rows.iter().find(|row| row["method"] == method && row["diameter_px"] == px).unwrap();
        row[key].as_f64().unwrap()
    };
    let is_timed = gpu().is_some();
    for px in [8, 16, 32, 64, 128] {
        for method in methods {
            assert!(of("rmse", method, px) >= 0.0 && of("change_per_degree", method, px) > 0.0, "{method}");
            assert!(!is_timed || of("frame_seconds", method, px) > 0.0 && of("bytes", method, px) > 0.0, "{method}");
        }
        assert!(of("leaves", "every leaf", px) == 9.0 && of("rmse", "every leaf", px) == 0.0);
        assert!(of("leaves", "impostor", px) == 0.0 && of("leaves", "crossed cards", px) == 3.0);
        let equal = "prefix, error of the impostor";
        assert!(of("rmse", equal, px) <= of("rmse", "impostor", px));
    }
    assert_eq!(rows.len(), methods.len() * 5);
    // Sixteen frames of 16 texels, two pages with all their mip levels.
    assert!(!is_timed || of("bytes", "impostor", 64) == f64::from(16 * 2 * 4 * (256 + 64 + 16 + 4 + 1)));
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Small on screen") && page.matches("width=\"128\" height=\"128\"").count() == rows.len());
}

#[test]
fn wood_with_less_detail_is_measured_where_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    command.args(["report", "hazel", "--leaves", "60", "--levels", "0.5", "--pixels", "48", "--brief"]);
    let output = command.args(["--wood", "--json", "-o"]).arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = json["wood"].as_array().unwrap();
    let of = |method: &str, px: u64| {
        rows.iter()
            .find(|row| row["method"] == method && row["diameter_px"] == px)
            .unwrap_or_else(|| panic!("{method}"))
    };
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
    let is_timed = gpu().is_some();
    let peers: &[&str] =
        if cfg!(feature = "peers") { &["meshopt simplify", "meshopt prune", "meshopt sloppy"] } else { &[] };
    for px in [256, 128, 64, 48] {
        let triangles = |method: &str| number(&of(method, px)["triangles"]);
        for method in ["all wood", "order", "stems by width"].iter().chain(peers) {
            for part in ["alone", "with_leaves"] {
                let seen = &of(method, px)[part];
                assert!(number(&seen["ssim"]) <= 1.0 && number(&seen["coverage"]).abs() < 1.0, "{method} {seen}");
                assert!(!is_timed || number(&seen["frame_seconds"]) > 0.0, "{method} {seen}");
                assert_eq!(*method == "all wood", number(&seen["xor"]) == 0.0, "{method} {seen}");
            }
        }
        assert!(triangles("order") < 0.5 * triangles("all wood"));
        assert!(number(&of("order", px)["alone"]["coverage"]).abs() < 0.15);
    }
    assert_eq!(rows.len(), 4 * (3 + peers.len()));
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Wood alone") && page.contains("With leaves"));
    assert_eq!(page.contains("without the feature <code>peers</code>"), peers.is_empty());
    let scene = folder.path().join("none.toml");
    fs::write(&scene, "").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    let output = command.args(["report", "--wood", "-o"]).arg(folder.path()).arg(&scene).output().unwrap();
    assert!(!output.status.success() && String::from_utf8_lossy(&output.stderr).contains("--wood"));
}

#[test]
fn what_cannot_be_reported_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        (vec!["report", "-o", "x"], "PLANT"),
        (vec!["report", "english-oak", "-o", "x", "--levels", "0"], "above 0 and at most 1"),
        (vec!["report", "english-oak", "-o", "x", "--pixels", "4"], "8..=2048"),
        (vec!["report", "no-such-tree", "-o", "x"], "no-such-tree"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
        let output = command.args(&arguments).current_dir(folder.path()).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        let lines: Vec<&str> = message.lines().filter(|line| !line.contains("XDG_RUNTIME_DIR")).collect();
        assert!(!output.status.success() && lines.len() == 1 && lines[0].contains(says), "{arguments:?}: {message}");
    }
}

#[test]
fn a_scenes_report_lists_the_cost_of_each_effect_and_of_motion_vectors() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("pair.toml");
    let text = "[[models]]\nname = \"birch\"\nspecies = \"betula-populifolia\"\nleaves = 120\n\n\
                [[plants]]\nmodel = \"birch\"\n\n[camera]\ntarget = [0, 6, 0]\nfov = 40\n\n\
                [camera.orbit]\ndistance = 22\nheight = 3\nseconds = 12\n\n[effects]\nwind = true\nsky = true\n";
    fs::write(&scene, text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    let output = command.args(["report", "--json", "-o"]).arg(folder.path()).arg(&scene).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = json["scenes"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["drawn"].as_str().unwrap()).collect();
    assert_eq!(names, ["every leaf, no effects", "no effects", "wind", "sky", "all effects", "motion vectors"]);
    assert!(rows.iter().all(|row| row["plants"] == 1 && row["frame_seconds"].as_f64().unwrap() > 0.0), "{rows:?}");
    assert!(rows[0]["leaves"] == 120 && rows[1]["effect_bytes"] == 0, "{rows:?}");
    assert!(rows[5]["effect_bytes"].as_u64().unwrap() > 640 * 360 * 8, "{rows:?}");
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("wind off and on") && page.contains("motion vectors off and on"));
}
