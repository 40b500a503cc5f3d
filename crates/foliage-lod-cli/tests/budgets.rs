//! Budgets of the command: leaves, triangles and milliseconds, and their table in the report.
//!
//! Without an adapter, tests that need one print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1`
//! they fail.

#[path = "common/command.rs"]
mod command;
#[path = "../../../tests/common/gpu.rs"]
mod gpu;

use command::{error_line, run, succeeds};
use gpu::gpu;
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

const SCENE: &str = r#"
[[models]]
name = "birch"
species = "betula-populifolia"
leaves = 300

[[scatter]]
models = ["birch"]
count = 30
area = [120, 120]
spacing = 12

[camera]
target = [0, 4, 0]
orbit = { distance = 90, height = 6, seconds = 60 }

[ground]
"#;

fn scene(more: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("grove.toml"), format!("{SCENE}{more}")).unwrap();
    folder
}

fn render(folder: &TempDir, more: &[&str]) -> std::process::Output {
    run(folder, &[&["render", "grove.toml", "-o", "a.png", "--size", "96x54"], more].concat())
}

fn json(folder: &TempDir, more: &[&str]) -> Value {
    let output = render(folder, &[more, &["--json"]].concat());
    succeeds(&output);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn triangles_are_kept_to_with_all_wood_and_warned_of_where_wood_alone_is_more() {
    let folder = scene("[budget]\nleaves = 5\n");
    let on_cpu = ["--raster", "cpu", "--budget"];
    let drawn = json(&folder, &[&on_cpu[..], &["triangles=40000"]].concat());
    let budget = &drawn["budget"];
    assert_eq!((&budget["unit"], &budget["asked"]), (&"triangles".into(), &40000.0.into()));
    let [leaves, wood, used] =
        [&drawn["leaves_drawn"], &drawn["wood_triangles"], &budget["used"]].map(|number| number.as_f64().unwrap());
    // Leaves have two triangles; one more is on its way in each plant.
    assert!(used <= 40000.0 && (2.0 * leaves + wood - used).abs() < 0.05 * used, "{leaves} {wood} {used}");
    let less = 0.9 * wood;
    let output = render(&folder, &[&on_cpu[..], &[&format!("triangles={less}")]].concat());
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("wood and impostors alone take") && told.contains("wood_error"), "{told}");
    fs::write(
        folder.path().join("grove.toml"),
        format!("{SCENE}[budget]\ntriangles = {less}\n[lod]\nwood_error = 50\n"),
    )
    .unwrap();
    let output = render(&folder, &["--raster", "cpu"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !told.contains("alone take"), "the fix works: {told}");
    let inside = json(&folder, &[&on_cpu[..], &["leaves=100"]].concat());
    assert_eq!((&inside["budget"]["unit"], &inside["budget"]["asked"]), (&"leaves".into(), &100.0.into()));
}

#[test]
fn milliseconds_need_the_gpu_and_find_their_leaves() {
    let folder = scene("");
    let refused = error_line(&render(&folder, &["--budget", "ms=5", "--raster", "cpu"]), 2);
    assert!(refused.contains("leaves=N or triangles=N"), "{refused}");
    let refused = error_line(&render(&folder, &["--budget", "leaves=9", "--method", "full"]), 2);
    assert!(refused.contains("all leaves are drawn"), "{refused}");
    for (wrong, named) in [("ms=0", "budget.ms is 0"), ("5", "leaves=N, triangles=N or ms=X"), ("leaves=-1", "is -1")] {
        let refused = error_line(&render(&folder, &["--budget", wrong]), 2);
        assert!(refused.contains(named), "{refused}");
    }
    if gpu().is_none() {
        return;
    }
    let much = json(&folder, &["--budget", "ms=90000"]);
    assert_eq!(much["budget"]["unit"], "ms");
    assert!(much["budget"]["mu"] == 0.0 && much["budget"]["used"].as_f64().unwrap() < 90000.0, "{much}");
    assert!(much["leaves_drawn"].as_u64().unwrap() > 3000, "{much}");
    let output = render(&folder, &["--budget", "ms=0.001"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && told.contains("wood, ground and effects alone take that long"), "{told}");
}

#[test]
fn the_report_compares_the_rules_of_a_budget_with_every_leaf() {
    let folder = scene("");
    let refused = error_line(&run(&folder, &["report", "english-oak", "--budgets", "-o", "out"]), 2);
    assert!(refused.contains("given with a scene"), "{refused}");
    if gpu().is_none() {
        return;
    }
    let output = run(&folder, &["report", "grove.toml", "--budgets", "-o", "out", "--size", "96x54", "--json"]);
    succeeds(&output);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = told["budgets"].as_array().unwrap();
    assert_eq!(rows.len(), 14);
    assert_eq!((&rows[0]["rule"], &rows[0]["rmse"]), (&"every leaf".into(), &0.0.into()));
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap();
    for row in &rows[2..] {
        let share = number(row, "leaves") / number(&rows[0], "leaves");
        // Leaves on their way in count as whole ones, and parts of leaves as none.
        let budget = number(row, "budget");
        assert!((0.8 * budget..budget + 0.02).contains(&share), "{share} {row}");
        let times = &row["frame_seconds"];
        assert!(number(times, "p50") > 0.0 && number(times, "p50") <= number(times, "p99"), "{row}");
        assert!(number(row, "rmse") > 1.0 && number(row, "ssim") < 1.0, "{row}");
    }
    // The same share for all is least like every leaf.
    for (least, uniform) in [(2, 7), (8, 13)] {
        assert!(number(&rows[least], "ssim") > number(&rows[uniform], "ssim"), "{rows:?}");
    }
    assert_eq!(rows[0]["largest_change"], 1.0);
    assert!(rows.iter().all(|row| (0.2..5.0).contains(&number(row, "largest_change"))), "{rows:?}");
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("What accuracy costs in time") && page.contains("least error, by what shows"));
}
