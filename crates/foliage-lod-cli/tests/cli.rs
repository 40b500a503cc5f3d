//! Tests of the `foliage-lod` command, run the way a user runs it.

use serde_json::Value;
use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};
use tempfile::TempDir;

/// Builds the command with `arguments`, to be run in `folder`.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_foliage-lod"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    command(folder.path(), arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Returns the single stderr line of a run that exited with `code` and printed nothing else.
fn error_line(output: &Output, code: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(output.stdout.is_empty(), "{}", stdout(output));
    assert!(text.starts_with("error: ") && text.ends_with('\n') && text.lines().count() == 1, "{text:?}");
    text
}

/// Parses the single JSON object on stdout of a successful run.
fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&stdout(output)).unwrap()
}

fn assert_has_keys(object: &Value, keys: &[&str]) {
    let missing: Vec<_> = keys.iter().filter(|key| object.get(key).is_none()).collect();
    assert!(missing.is_empty(), "{missing:?} are missing in {object}");
}

fn names(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Creates a temporary folder that holds `tree.glb`, a birch with `leaves` leaves.
fn folder_with_tree(leaves: u32) -> TempDir {
    let folder = TempDir::new().unwrap();
    let grown = run(&folder, &["grow", "betula-populifolia", "-o", "tree.glb", "--leaves", &leaves.to_string()]);
    assert!(grown.status.success(), "{}", String::from_utf8_lossy(&grown.stderr));
    folder
}

#[test]
fn help_and_version_go_to_stdout_and_succeed() {
    let folder = TempDir::new().unwrap();
    let help = run(&folder, &["--help"]);
    assert!(help.status.success());
    for subcommand in ["simplify", "inspect", "grow", "render"] {
        assert!(stdout(&help).contains(subcommand), "{subcommand}");
        assert!(stdout(&run(&folder, &[subcommand, "--help"])).contains("Usage:"));
    }
    assert_eq!(stdout(&run(&folder, &["--version"])).trim(), concat!("foliage-lod ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_senseless_command_line_is_one_line_and_exit_code_2() {
    let folder = folder_with_tree(20);
    let senseless: [&[&str]; 9] = [
        &["prune"],
        &["simplify"],
        &["simplify", "tree.glb"],
        &["simplify", "tree.glb", "-o", "a.vds", "--preset", "magic"],
        &["simplify", "tree.glb", "-o", "a.vds", "--resolution", "0"],
        &["simplify", "tree.glb", "-o", "a.vds", "--views", "7"],
        &["simplify", "tree.glb", "-o", "a.vds", "--max-scale", "nan"],
        &["grow", "no-such-tree", "-o", "a.glb"],
        &["render", "a.vds", "-o", "a.png", "--size", "10"],
    ];
    for arguments in senseless {
        error_line(&run(&folder, arguments), 2);
    }
    assert_eq!(names(&folder), ["tree.glb"]);
}

#[test]
fn an_input_that_cannot_be_read_is_named_and_nothing_is_written() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("cube.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 2 4\n")
        .unwrap();
    fs::write(folder.path().join("noise.glb"), b"glTF\x02\0\0\0\xff\xff\xff\xff").unwrap();
    fs::write(folder.path().join("noise.vds"), b"VDSFOLI\0 and then nothing of sense").unwrap();
    let before = names(&folder);
    for file in ["none.glb", "cube.obj", "noise.glb"] {
        let line = error_line(&run(&folder, &["simplify", file, "-o", "a.vds"]), 1);
        assert!(line.contains(file.trim_end_matches(".obj")), "{line}");
    }
    for arguments in [["inspect", "noise.vds"], ["inspect", "none.vds"], ["inspect", "noise.glb"]] {
        error_line(&run(&folder, &arguments), 1);
    }
    error_line(&run(&folder, &["render", "noise.vds", "-o", "a.png"]), 1);
    assert_eq!(names(&folder), before);
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_work() {
    let folder = folder_with_tree(20);
    fs::create_dir(folder.path().join("folder")).unwrap();
    for output in ["none/a.vds", "folder"] {
        let line = error_line(&run(&folder, &["simplify", "none.glb", "-o", output]), 1);
        assert!(line.contains(output), "the output should be checked before the input: {line}");
        error_line(&run(&folder, &["grow", "english-oak", "-o", output]), 1);
        error_line(&run(&folder, &["render", "none.vds", "-o", output]), 1);
    }
    let pictures = ["simplify", "none.glb", "-o", "a.vds", "--pictures", "none"];
    assert!(error_line(&run(&folder, &pictures), 1).contains("100.png"));
    assert_eq!(names(&folder), ["folder", "tree.glb"]);
}

#[test]
fn json_of_every_subcommand_has_its_keys_and_agrees() {
    let folder = TempDir::new().unwrap();
    let grown = json(&run(&folder, &["grow", "betula-populifolia", "-o", "t.glb", "--leaves", "150", "--json"]));
    assert_eq!(grown["leaves"], 150);
    let plant = json(&run(&folder, &["inspect", "t.glb", "--json"]));
    assert_has_keys(&plant, &["leaf_triangles", "wood_triangles", "materials", "bounds", "findings"]);
    assert_eq!((&plant["kind"], &plant["leaves"]), (&"plant".into(), &150.into()));
    let arguments = ["simplify", "t.glb", "-o", "t.vds", "--resolution", "64", "--raster", "cpu", "--json"];
    let simplified = json(&run(&folder, &arguments));
    let keys = "leaves preset criterion compensate resolution views raster adapter fragments max_scale trial seconds \
                peak_bytes model_bytes";
    assert_has_keys(&simplified, &keys.split_whitespace().collect::<Vec<_>>());
    assert_has_keys(&simplified["seconds"], &["import", "growth", "fragments", "prune", "write", "total"]);
    assert_eq!((&simplified["raster"], &simplified["adapter"]), (&"cpu".into(), &Value::Null));
    let bytes = fs::metadata(folder.path().join("t.vds")).unwrap().len();
    assert_eq!(simplified["model_bytes"], bytes);
    let model = json(&run(&folder, &["inspect", "t.vds", "--json"]));
    assert_eq!((&model["kind"], &model["leaves"]), (&"model".into(), &150.into()));
    for key in ["leaf_triangles", "wood_triangles", "materials"] {
        assert_eq!(model[key], plant[key], "{key}");
    }
    let sum: u64 = model["bytes"].as_object().unwrap().values().map(|bytes| bytes.as_u64().unwrap()).sum();
    assert_eq!((sum, &model["version"], &model["skipped"]), (bytes, &2.into(), &serde_json::json!({})));
    assert!(model["precision"]["position"].as_f64().unwrap() > 0.0 && model["precision"] == simplified["precision"]);
    let exact = json(&run(&folder, &[&arguments[..], &["--exact"]].concat()));
    let exact_model = json(&run(&folder, &["inspect", "t.vds", "--json"]));
    assert!(exact["model_bytes"].as_u64() > simplified["model_bytes"].as_u64());
    assert_eq!((&exact_model["bounds"], &exact_model["precision"]["position"]), (&plant["bounds"], &0.0.into()));
    let rendered =
        json(&run(&folder, &["render", "t.vds", "-o", "t.png", "--size", "64x48", "--lod", "0.5", "--json"]));
    assert_has_keys(&rendered, &["instances", "draws", "effects", "seconds"]);
    assert_eq!(rendered["leaves_drawn"], 75);
    assert_eq!(names(&folder), ["t.glb", "t.png", "t.vds"]);
}

/// Adds a section with a tag of its own to a model's file: `flags` is 1 if it is required.
fn add_section(path: &Path, flags: u32) {
    let file = fs::read(path).unwrap();
    let count = u32::from_le_bytes(file[12..16].try_into().unwrap());
    let (entries, sections) = file[20..].split_at(28 * count as usize);
    let mut table = Vec::new();
    for entry in entries.chunks(28) {
        let start = u64::from_le_bytes(entry[8..16].try_into().unwrap()) + 28;
        table.extend([&entry[..8], &start.to_le_bytes(), &entry[16..]].concat());
    }
    table.extend([&b"FARI"[..], &flags.to_le_bytes(), &(file.len() as u64 + 28).to_le_bytes()].concat());
    table.extend([&4_u64.to_le_bytes()[..], &crc32fast::hash(b"1234").to_le_bytes()].concat());
    let head = [&file[8..12], &(count + 1).to_le_bytes()].concat();
    let crc = crc32fast::hash(&[&head[..], &table].concat()).to_le_bytes();
    fs::write(path, [&file[..8], &head, &crc, &table, sections, b"1234"].concat()).unwrap();
}

#[test]
fn sections_that_are_not_known_give_a_warning_or_an_error() {
    let folder = folder_with_model();
    let path = folder.path().join("a.vds");
    let whole = fs::read(&path).unwrap();
    add_section(&path, 0);
    let arguments = ["render", "a.vds", "-o", "a.png", "--size", "32x32", "--raster", "cpu"];
    let rendered = run(&folder, &arguments);
    assert!(rendered.status.success());
    let warning = String::from_utf8(rendered.stderr).unwrap();
    assert!(warning.contains("warning: section FARI (4 bytes)"), "{warning}");
    let told = stdout(&run(&folder, &["inspect", "a.vds"]));
    assert!(told.contains("FARI 4 B") && told.contains("leaf vertices") && told.contains("positions within"), "{told}");
    fs::write(&path, whole).unwrap();
    add_section(&path, 1);
    assert!(error_line(&run(&folder, &arguments), 1).contains("section FARI"));
}

/// Creates a temporary folder that holds `a.vds`, the model of a birch with 200 leaves.
fn folder_with_model() -> TempDir {
    let folder = folder_with_tree(200);
    let arguments = ["simplify", "tree.glb", "-o", "a.vds", "--resolution", "32", "--raster", "cpu"];
    assert!(run(&folder, &arguments).status.success());
    fs::remove_file(folder.path().join("tree.glb")).unwrap();
    folder
}

#[test]
fn rows_rings_and_forests_draw_each_tree_at_its_own_level_of_detail() {
    let folder = folder_with_model();
    let small = ["render", "a.vds", "-o", "a.png", "--size", "48x32", "--raster", "cpu", "--json"];
    let rendered = |more: &[&str]| json(&run(&folder, &[&small[..], more].concat()));
    let at = |distance| rendered(&["--distance", distance])["leaves_drawn"].as_u64().unwrap();
    let row = rendered(&["--row", "3,20,59"]);
    assert_eq!((&row["instances"], &row["adapter"]), (&3.into(), &Value::Null));
    assert_eq!(row["leaves_drawn"], at("3") + at("20") + at("59"));
    assert!(at("59") < at("20") && at("20") < 200 && at("3") == 200);
    let ring = rendered(&["--ring", "5", "--leaves-count", "30"]);
    assert_eq!((&ring["instances"], &ring["leaves_drawn"]), (&5.into(), &150.into()));
    let forest = rendered(&["--grid", "6"]);
    assert_eq!(forest["instances"], 36);
    let leaves = forest["leaves_drawn"].as_u64().unwrap();
    assert!(leaves > 36 && leaves < 36 * 200, "{leaves}");
}

#[test]
fn a_picture_that_cannot_be_laid_out_is_one_line_and_exit_code_2() {
    let folder = folder_with_model();
    let senseless: [&[&str]; 9] = [
        &["--row", "0.5,3"],
        &["--row", "3,nan"],
        &["--row", "1.5,1.5,1.5"],
        &["--row", "3,"],
        &["--row", "3", "--ring", "4"],
        &["--row", "3", "--distance", "4"],
        &["--ring", "0"],
        &["--grid", "101"],
        &["--size", "0x9"],
    ];
    for arguments in senseless {
        error_line(&run(&folder, &[&["render", "a.vds", "-o", "a.png", "--raster", "cpu"], arguments].concat()), 2);
    }
    assert_eq!(names(&folder), ["a.vds"]);
}

#[test]
fn a_gpu_draws_a_forest_in_a_few_draws() {
    let folder = folder_with_model();
    let arguments = ["render", "a.vds", "-o", "a.png", "--size", "48x32", "--raster", "gpu", "--json"];
    let rendered = |more: &[&str]| run(&folder, &[&arguments[..], more].concat());
    let single = rendered(&[]);
    if !single.status.success() {
        assert!(std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none(), "{single:?}");
        return assert!(error_line(&single, 1).contains("GPU: "));
    }
    let (single, forest) = (json(&single), json(&rendered(&["--grid", "4"])));
    assert_eq!((&single["instances"], &forest["instances"]), (&1.into(), &16.into()));
    // One draw call for the leaves of all trees and, for their wood, one per distinct number of
    // stems drawn.
    let draws = |rendered: &Value| rendered["draws"].as_u64().unwrap();
    assert!(draws(&forest) <= draws(&single) + 8, "{single} {forest}");
    assert!(forest["adapter"].is_string());
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = folder_with_tree(300);
    for threads in ["1", "2"] {
        let (output, rest) = (format!("{threads}.vds"), ["--resolution", "64", "--raster", "cpu", "--threads"]);
        let simplified = run(&folder, &[&["simplify", "tree.glb", "-o", &output][..], &rest, &[threads]].concat());
        assert!(simplified.status.success());
    }
    let [one, two] = ["1.vds", "2.vds"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(one == two);
}

#[test]
fn every_step_is_printed_and_pictures_are_drawn_on_request() {
    let folder = folder_with_tree(60);
    let arguments = ["simplify", "tree.glb", "-o", "a.vds", "--resolution", "32", "--raster", "cpu", "--pictures", "."];
    let simplified = run(&folder, &arguments);
    let text = stdout(&simplified);
    let steps: Vec<_> = text.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(steps, ["read", "simplify", "wood", "curve", "write", "draw", "draw", "draw"], "{text}");
    assert!(text.contains("15.png: 9 leaves"), "{text}");
    assert_eq!(names(&folder), ["100.png", "15.png", "50.png", "a.vds", "tree.glb"]);
    let summary = stdout(&run(&folder, &["inspect", "a.vds"]));
    assert!(summary.contains("60 leaves") && summary.contains("invariants: all hold"), "{summary}");
    assert!(summary.contains("wrong pixels of 64") && summary.contains("error curve of "), "{summary}");
}

#[test]
fn a_damaged_model_is_refused_with_one_line() {
    let folder = folder_with_tree(30);
    let model = folder.path().join("a.vds");
    assert!(run(&folder, &["simplify", "tree.glb", "-o", "a.vds", "--resolution", "16"]).status.success());
    let bytes = fs::read(&model).unwrap();
    for kept in [4, 30, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&model, &bytes[..kept]).unwrap();
        assert!(error_line(&run(&folder, &["inspect", "a.vds"]), 1).contains("a.vds"));
    }
}

#[test]
fn a_reader_that_goes_away_is_no_panic() {
    let folder = folder_with_tree(30);
    let mut child =
        command(folder.path(), &["inspect", "tree.glb"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_what_was_there() {
    let folder = TempDir::new().unwrap();
    assert!(run(&folder, &["grow", "english-oak", "-o", "tree.glb"]).status.success());
    fs::write(folder.path().join("a.vds"), "what was there").unwrap();
    let arguments = ["simplify", "tree.glb", "-o", "a.vds", "--raster", "cpu", "--resolution", "512"];
    let child = command(folder.path(), &arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(1));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "error: interrupted; every file is whole or as it was\n");
    assert_eq!(names(&folder), ["a.vds", "tree.glb"]);
    assert_eq!(fs::read_to_string(folder.path().join("a.vds")).unwrap(), "what was there");
}

#[test]
fn without_arguments_the_oak_is_grown_simplified_and_drawn() {
    let folder = TempDir::new().unwrap();
    let output = run(&folder, &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(stdout(&output).contains("english-oak: 20,146 leaves"), "{}", stdout(&output));
    let mut files: Vec<_> = fs::read_dir(folder.path().join("foliage-lod-out")).unwrap().collect();
    files.sort_by_key(|entry| entry.as_ref().unwrap().file_name());
    let files: Vec<_> = files.into_iter().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(files, ["english-oak.vds", "far.png", "mid.png", "near.png"]);
    let model = foliage_lod::model::FoliageModel::read(folder.path().join("foliage-lod-out/english-oak.vds")).unwrap();
    assert_eq!(model.leaves.len(), 20_146);
}

#[test]
fn every_preset_names_itself_in_the_model_and_a_target_reports_its_leaves() {
    let folder = folder_with_tree(60);
    for (preset, criterion, resolution) in
        [("paper", "vmi", 256), ("fast", "image", 128), ("balanced", "image", 256), ("best", "image", 512)]
    {
        let arguments = ["simplify", "tree.glb", "-o", "a.vds", "--preset", preset, "--raster", "cpu", "--json"];
        let simplified = json(&run(&folder, &[&arguments[..], &["--target", "xor=0.3@32"]].concat()));
        assert_eq!([&simplified["preset"], &simplified["criterion"]], [preset, criterion]);
        assert_eq!(simplified["resolution"], resolution);
        assert!((1..=60).contains(&simplified["target_leaves"].as_u64().unwrap()), "{simplified}");
    }
    let refused = run(&folder, &["simplify", "tree.glb", "-o", "b.vds", "--target", "psnr=30@64"]);
    assert!(error_line(&refused, 2).contains("such as ssim=0.9@200"));
    assert_eq!(names(&folder), ["a.vds", "tree.glb"]);
}

const SCENE: &str = r#"
[[models]]
name = "birch"
species = "betula-populifolia"
leaves = 300
height = 10

[[models]]
name = "oak"
species = "english-oak"
leaves = 200

[[scatter]]
models = ["birch", "oak"]
count = 30
area = [60, 60]
spacing = 5

[camera]
eye = [0, 6, 45]
target = [0, 4, 0]

[ground]

[effects]
wind = true
contrast = true
sky = true
shadow = { distance = 60 }
"#;

#[test]
fn a_scene_is_inspected_and_drawn_with_the_effects_that_it_enables() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("grove.toml"), SCENE).unwrap();
    let inspected = json(&run(&folder, &["inspect", "grove.toml", "--json"]));
    assert_eq!((&inspected["kind"], &inspected["plants"]), (&"scene".into(), &30.into()));
    assert_eq!(inspected["leaves"], 15 * 300 + 15 * 200);
    assert_eq!(inspected["effects"], serde_json::json!(["contrast", "wind", "shadow", "sky"]));
    let arguments = ["render", "grove.toml", "-o", "a.png", "--size", "160x90", "--raster", "cpu", "--json"];
    let drawn = json(&run(&folder, &arguments));
    let instances = drawn["instances"].as_u64().unwrap();
    assert!((10..=30).contains(&instances), "{drawn}");
    assert_eq!(drawn["effects"]["wind"]["simulated"], instances);
    assert_eq!(drawn["effects"]["shadow"]["simulated"], 0, "the CPU casts no shadows");
    let full = json(&run(&folder, &[&arguments[..], &["--method", "full"]].concat()));
    assert!(full["leaves_drawn"].as_u64() > drawn["leaves_drawn"].as_u64());
    let text = stdout(&run(&folder, &["render", "grove.toml", "-o", "a.png", "--size", "160x90", "--raster", "cpu"]));
    assert!(text.contains("30 plants") && text.contains("effect    wind: simulated for"), "{text}");
}

#[test]
fn plants_of_a_patch_stand_around_the_camera_where_the_map_is_white() {
    let folder = TempDir::new().unwrap();
    let patch = r#"
[[models]]
name = "grass"
species = "meadow-grass"

[[patch]]
area = [40, 40]
cells = 8

[[patch.kinds]]
model = "grass"
spacing = 1
height = [0.4, 0.8]
map = "half.png"
reach = 100

[camera]
eye = [0, 3, 24]
target = [0, 0, 0]

[ground]
"#;
    fs::write(folder.path().join("meadow.toml"), patch).unwrap();
    let arguments = ["render", "meadow.toml", "-o", "a.png", "--size", "160x90", "--raster", "cpu", "--json"];
    assert!(error_line(&run(&folder, &arguments), 1).contains("half.png"), "maps are missed before anything is grown");
    let texels = [0_u8, 255].map(|texel| [texel; 32]).concat();
    let map = image::GrayImage::from_raw(64, 1, texels).unwrap();
    map.save(folder.path().join("half.png")).unwrap();
    let drawn = json(&run(&folder, &arguments));
    // The right half, less where the map passes from black to white.
    let instances = drawn["instances"].as_u64().unwrap();
    assert!((600..=820).contains(&instances), "{drawn}");
    let picture = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    let ground = |x: u32| picture.get_pixel(x, 80)[0];
    let row = |columns: std::ops::Range<u32>| columns.map(ground).collect::<std::collections::HashSet<_>>().len();
    assert!(
        row(100..150) > 5 && row(10..60) < 4,
        "{} colours on the right, {} on the left",
        row(100..150),
        row(10..60)
    );
    // Away from the area nothing is left.
    fs::write(folder.path().join("meadow.toml"), patch.replace("eye = [0, 3, 24]", "eye = [0, 3, 900]")).unwrap();
    assert_eq!(json(&run(&folder, &arguments))["instances"], 0);
}

#[test]
fn a_scene_has_hills_that_plants_and_walkers_stand_on() {
    let folder = TempDir::new().unwrap();
    let hills = r#"
[[models]]
name = "grass"
species = "meadow-grass"

[[plants]]
model = "grass"
at = [15, 0, 0]
scale = 4

[ground]
heights = "hill.png"
relief = 30
colors = "red.png"
area = [64, 64]

[camera]
eye = [-25, 2, 0]
target = [15, 2, 0]
above_ground = true
"#;
    fs::write(folder.path().join("hills.toml"), hills).unwrap();
    let arguments = ["render", "hills.toml", "-o", "a.png", "--size", "160x90", "--raster", "cpu", "--json"];
    assert!(error_line(&run(&folder, &arguments), 1).contains("hill.png"), "maps are missed before anything is grown");
    // A ramp that rises with x.
    let texels = (0..16_u16).map(|x| x * 4096).collect();
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(16, 1, texels)
        .map(|map: image::ImageBuffer<_, Vec<u16>>| map.save(folder.path().join("hill.png")))
        .unwrap()
        .unwrap();
    assert!(error_line(&run(&folder, &arguments), 1).contains("red.png"));
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 20, 20])).save(folder.path().join("red.png")).unwrap();
    let drawn = json(&run(&folder, &arguments));
    assert!(drawn["instances"] == 1 && drawn["ground_triangles"].as_u64() > Some(1), "{drawn}");
    let picture = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    let is_red = |pixel: &image::Rgb<u8>| u32::from(pixel[0]) > 2 * u32::from(pixel[1]);
    // The camera looks along the slope, which fills the lower half; the tuft stands in its middle.
    assert!(is_red(picture.get_pixel(20, 60)) && !is_red(picture.get_pixel(20, 5)));
    let is_green = |pixel: &image::Rgb<u8>| pixel[1] > pixel[0] && pixel[1] > pixel[2];
    assert!(
        (30..50).any(|y| is_green(picture.get_pixel(80, y))) && !(50..89).any(|y| is_green(picture.get_pixel(80, y)))
    );
}

#[test]
fn options_that_a_scene_sets_are_refused_and_so_are_missing_models_and_crowded_scatters() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("grove.toml"), SCENE).unwrap();
    for option in [["--lod", "0.5"], ["--ring", "3"], ["--method", "stochastic"]] {
        let refused = run(&folder, &[&["render", "grove.toml", "-o", "a.png"][..], &option[..]].concat());
        assert!(error_line(&refused, 2).contains("a scene is drawn as its file says"), "{option:?}");
    }
    fs::write(
        folder.path().join("lost.toml"),
        SCENE.replace("species = \"english-oak\"\nleaves = 200", "file = \"oak.vds\""),
    )
    .unwrap();
    assert!(error_line(&run(&folder, &["render", "lost.toml", "-o", "a.png"]), 1).contains("oak.vds"));
    fs::write(folder.path().join("wrong.toml"), SCENE.replace("count = 30", "count = 3000")).unwrap();
    assert!(error_line(&run(&folder, &["inspect", "wrong.toml"]), 2).contains("fit"));
    assert_eq!(names(&folder), ["grove.toml", "lost.toml", "wrong.toml"]);
}

#[test]
fn stochastic_pictures_depend_on_seed_area_and_fade() {
    let folder = folder_with_model();
    let draw = |options: &[&str]| {
        let common = ["render", "a.vds", "-o", "a.png", "--size", "96x96", "--raster", "cpu", "--method", "stochastic"];
        let rendered = json(&run(&folder, &[&common[..], &["--lod", "0.3", "--json"], options].concat()));
        (fs::read(folder.path().join("a.png")).unwrap(), rendered)
    };
    let (plain, unfaded) = draw(&[]);
    assert_eq!(draw(&["--seed", "1"]).0, plain, "the default seed is 1");
    for options in [
        &["--seed", "2"][..],
        &["--area", "linear"],
        &["--area", "none"],
        &["--fade", "relative"],
        &["--fade", "smoothstep", "--fade-by", "alpha"],
        &["--contrast"],
        &["--crown-normals"],
        &["--wind", "--seconds", "3"],
    ] {
        assert_ne!(draw(options).0, plain, "{options:?}");
    }
    let (_, faded) = draw(&["--fade", "window"]);
    assert!(faded["leaves_drawn"].as_u64() > unfaded["leaves_drawn"].as_u64());
    assert!(faded["effects"]["fade"]["simulated"].as_u64() > Some(0));
}

#[test]
fn more_memory_than_allowed_is_refused_with_one_line_that_says_how_much() {
    let folder = folder_with_tree(60);
    let arguments = ["simplify", "tree.glb", "-o", "a.vds", "--raster", "cpu", "--resolution", "256", "--max-memory"];
    let views = "20 views of 256 x 256, in MB, is ";
    for (limit, needs, fix) in
        [("3", "triangles, including instances, is ", "split the file"), ("40", views, "lower --resolution")]
    {
        // The refusal is printed once, whichever rasteriser captures the fragments.
        let refused = run(&folder, &[&arguments[..], &[limit]].concat());
        let by_any = run(&folder, &[&arguments[..4], &arguments[6..], &[limit]].concat());
        // Some drivers write to stderr themselves.
        let stderr = String::from_utf8(by_any.stderr).unwrap();
        assert_eq!(stderr.lines().filter(|line| line.contains("--max-memory")).count(), 1, "{stderr}");
        let line = String::from_utf8(refused.stderr).unwrap();
        assert_eq!((refused.status.code(), line.lines().count()), (Some(1), 1), "{line}");
        let is_explained = line.contains(needs) && line.contains(&format!("above the limit of {limit}; {fix}"));
        assert!(is_explained && line.contains("--max-memory"), "{line}");
    }
    assert_eq!(names(&folder), ["tree.glb"]);
    assert!(run(&folder, &[&arguments[..], &["3000"]].concat()).status.success());
}

#[test]
fn an_output_that_is_not_named_like_a_model_is_refused_before_the_work() {
    let folder = TempDir::new().unwrap();
    for (output, says) in [
        ("oak.glb", "foliage-lod export oak.vds -o oak.glb"),
        ("oak.GLTF", "oak.vds"),
        ("oak.png", "foliage-lod render oak.vds -o oak.png"),
        ("oak.vds.gz", ".vds"),
    ] {
        let line = error_line(&run(&folder, &["simplify", "none.glb", "-o", output]), 2);
        assert!(line.contains("--output is") && line.contains(says), "{line}");
    }
    assert!(names(&folder).is_empty());
}

/// OBJ text of `count` groups, each a card of its own.
fn groups(count: usize) -> String {
    let card = |i: usize| format!("g card.{i}\nv {i} 0 0\nv {i} 1 0\nv {i} 1 1\nv {i} 0 1\nf -4 -3 -2 -1\n");
    (0..count).map(card).collect()
}

#[test]
fn inspect_prints_a_screenful_of_many_parts_unless_all_are_asked_for() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("many.obj"), groups(2000)).unwrap();
    let short = stdout(&run(&folder, &["inspect", "many.obj"]));
    assert!(short.lines().count() <= 40 && short.contains("leaf: 2000 parts like \"card.0\""), "{short}");
    let long = stdout(&run(&folder, &["inspect", "many.obj", "--all"]));
    assert!(long.lines().filter(|line| line.starts_with("leaf: \"card.")).count() == 2000);
}

#[test]
fn foliage_is_named_by_repeated_flags_commas_and_patterns() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("few.obj"), groups(12)).unwrap();
    let leaves = |names: &[&str]| {
        let named: Vec<&str> = names.iter().flat_map(|name| ["--leaves", name]).collect();
        json(&run(&folder, &[&["inspect", "few.obj", "--json"], &named[..]].concat()))["leaves"].clone()
    };
    assert_eq!([leaves(&["card.1", "card.2"]), leaves(&["card.1,card.2"]), leaves(&["card.1*"])], [2, 2, 3]);
    let line = error_line(&run(&folder, &["inspect", "few.obj", "--leaves", "crad.1"]), 2);
    assert!(line.contains("--leaves is \"crad.1\"") && line.contains("the closest of 12"), "{line}");
}
