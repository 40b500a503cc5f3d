//! `foliage-lod report --paper`, small: every figure is there, and the numbers make sense.
//!
//! Without an adapter the test says so and passes; with `FOLIAGE_REQUIRE_ADAPTER=1` it fails.
#![cfg(feature = "cli")]

mod common;

use common::gpu::gpu;
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
    // Three species at eleven distances, with a level of detail and full; four forests of five sizes.
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
    let output = report(folder.path(), Some("no such adapter"));
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    let told = message.lines().find(|line| line.starts_with("error: ") && !line.contains("XDG")).unwrap();
    assert!(told.contains("the report needs a GPU or a software Vulkan driver"), "{told}");
}
