//! Tests of the command with a failing driver: a Vulkan layer between the command and a working
//! driver makes calls fail as they do when memory runs out or the device is lost.
#![cfg(target_os = "linux")]

#[path = "common/command.rs"]
mod command;
#[path = "../../../tests/common/gpu.rs"]
mod gpu;

use command::{command, ended, error_line, names, run, succeeds};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::LazyLock,
};
use tempfile::TempDir;

const OUT_OF_DEVICE_MEMORY: i32 = -2;
const DEVICE_LOST: i32 = -4;
/// Driver functions that are made to fail, and the `VkResult` that they return.
const FAILURES: [(&str, i32); 17] = [
    ("vkCreateDevice", OUT_OF_DEVICE_MEMORY),
    ("vkAllocateMemory", OUT_OF_DEVICE_MEMORY),
    ("vkMapMemory", OUT_OF_DEVICE_MEMORY),
    ("vkCreateBuffer", OUT_OF_DEVICE_MEMORY),
    ("vkCreateImage", OUT_OF_DEVICE_MEMORY),
    ("vkCreateImageView", OUT_OF_DEVICE_MEMORY),
    ("vkCreateShaderModule", OUT_OF_DEVICE_MEMORY),
    ("vkCreateGraphicsPipelines", OUT_OF_DEVICE_MEMORY),
    ("vkCreateGraphicsPipelines", DEVICE_LOST),
    ("vkCreateCommandPool", OUT_OF_DEVICE_MEMORY),
    ("vkAllocateCommandBuffers", OUT_OF_DEVICE_MEMORY),
    ("vkBeginCommandBuffer", OUT_OF_DEVICE_MEMORY),
    ("vkEndCommandBuffer", OUT_OF_DEVICE_MEMORY),
    ("vkEndCommandBuffer", DEVICE_LOST),
    ("vkQueueSubmit", DEVICE_LOST),
    ("vkWaitSemaphores", DEVICE_LOST),
    ("vkGetSemaphoreCounterValue", DEVICE_LOST),
];
/// Number of the first call of the function that fails; all later calls fail too.
const CALLS: [u32; 4] = [1, 2, 5, 12];

/// The folder of the compiled layer; `None`, with a note printed, if there is no compiler, header
/// or adapter.
static LAYER: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    gpu::gpu()?;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("failing_layer");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vulkan");
    fs::create_dir_all(&folder).unwrap();
    fs::copy(source.join("failing_layer.json"), folder.join("failing_layer.json")).unwrap();
    // Renamed once it is complete, because tests may run in separate processes.
    let made = folder.join(format!("failing_layer.{}", std::process::id()));
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&made);
    let built = compiler.arg(source.join("failing_layer.c")).output();
    if built.as_ref().is_ok_and(|built| built.status.success()) {
        fs::rename(made, folder.join("failing_layer.so")).unwrap();
        return Some(folder);
    }
    assert!(std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none(), "the layer is not built: {built:?}");
    println!("skipped: the layer is not built because a C compiler or Vulkan's headers are missing");
    None
});

/// Name of the adapter without the layer.
static ADAPTER: LazyLock<String> = LazyLock::new(|| {
    let name = gpu::gpu().map_or_else(String::new, |gpu| gpu.adapter_name());
    name.rsplit_once(", ").map_or(name.clone(), |(name, _)| name.to_owned())
});

/// Creates a temporary folder with `tree.glb`, a birch, and `tree.vds`, its model; `None` if the
/// layer is missing.
fn folder() -> Option<TempDir> {
    LAYER.as_ref()?;
    let folder = TempDir::new().unwrap();
    succeeds(&run(&folder, &["grow", "betula-populifolia", "-o", "tree.glb", "--leaves", "300"]));
    let simplify =
        ["simplify", "tree.glb", "-o", "tree.vds", "--preset", "paper", "--resolution", "32", "--raster", "cpu"];
    succeeds(&run(&folder, &simplify));
    Some(folder)
}

/// Like [`run`], with `function` failing with `result` from call number `call` on.
fn run_failing(folder: &TempDir, arguments: &[&str], (function, result): (&str, i32), call: u32) -> Output {
    let mut command = command(folder.path(), arguments);
    command.env("VK_LAYER_PATH", LAYER.as_ref().unwrap()).env("VK_INSTANCE_LAYERS", "VK_LAYER_FOLIAGE_LOD_failing");
    command.env("FOLIAGE_LOD_TEST_FAILURE", format!("{function} {call} {result}"));
    // `--raster auto` takes a software adapter only if the environment names it.
    command.env("WGPU_ADAPTER_NAME", ADAPTER.as_str());
    ended(command.spawn().unwrap(), arguments)
}

/// Makes each function fail. With `--raster gpu` the command prints one line and leaves the old
/// file, or is not affected; with `--raster auto` it falls back and writes the CPU's result.
fn survives(arguments: &[&str], output: &str) {
    let Some(folder) = folder() else { return };
    let by = |raster: &'static str| [arguments, &["-o", output, "--raster", raster]].concat();
    let out = folder.path().join(output);
    let [on_cpu, on_gpu] = ["cpu", "gpu"].map(|raster| {
        succeeds(&run(&folder, &by(raster)));
        fs::read(&out).unwrap()
    });
    let [mut refused, mut warned, mut unaffected] = [0; 3];
    for (failure, call) in FAILURES.iter().flat_map(|&failure| CALLS.map(|call| (failure, call))) {
        fs::write(&out, "old").unwrap();
        let alone = run_failing(&folder, &by("gpu"), failure, call);
        if alone.status.success() {
            assert!(call > 1, "{failure:?} is never called");
            assert!(fs::read(&out).unwrap() == on_gpu, "{failure:?} from call {call} on");
            unaffected += 1;
            continue;
        }
        refused += 1;
        let line = error_line(&alone, 1);
        assert!(line.starts_with("error: GPU: ") && line.contains("--raster cpu"), "{failure:?}, call {call}: {line}");
        assert_eq!(fs::read(&out).unwrap(), b"old", "{failure:?} from call {call} on");
        let fallen_back = run_failing(&folder, &by("auto"), failure, call);
        succeeds(&fallen_back);
        let warning = String::from_utf8(fallen_back.stderr).unwrap();
        let has_warned = warning.starts_with("warning: the CPU takes over: GPU: ") && warning.lines().count() == 1;
        assert!(has_warned || warning.is_empty(), "{failure:?}, call {call}: {warning}");
        warned += usize::from(has_warned);
        // The number of polls for completion varies between runs, so the GPU may succeed here.
        let by_cpu = String::from_utf8_lossy(&fallen_back.stdout).contains("the CPU");
        assert!(by_cpu || call > 1, "{failure:?} from call {call} on");
        let expected = if by_cpu { &on_cpu } else { &on_gpu };
        assert!(fs::read(&out).unwrap() == *expected, "{failure:?} from call {call} on");
    }
    assert_eq!(names(&folder), [output, "tree.glb", "tree.vds"]);
    println!(
        "{refused} runs failed on the GPU, {warned} of them fell back with a warning, {unaffected} were not affected"
    );
    assert!(warned > 0);
}

#[test]
fn a_model_is_made_on_the_cpu_wherever_the_driver_fails() {
    survives(&["simplify", "tree.glb", "--preset", "paper", "--resolution", "32"], "out.vds");
}

#[test]
fn a_picture_is_drawn_on_the_cpu_wherever_the_driver_fails() {
    survives(&["render", "tree.vds", "--size", "64x64"], "out.png");
}

#[test]
fn a_report_goes_on_without_frame_times_when_the_device_is_lost() {
    let Some(folder) = folder() else { return };
    let report = ["report", "tree.glb", "-o", "report", "--brief", "--pixels", "64", "--levels", "0.5"];
    let output = run_failing(&folder, &report, ("vkQueueSubmit", DEVICE_LOST), 20);
    succeeds(&output);
    let warning = String::from_utf8(output.stderr).unwrap();
    assert!(warning.starts_with("warning: some frame times are missing") && warning.lines().count() == 1, "{warning}");
    let rows: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("report/report.json")).unwrap()).unwrap();
    let timed = |row: &&serde_json::Value| row["frame_seconds"].is_number();
    let rows = rows["rows"].as_array().unwrap();
    assert!((1..rows.len()).contains(&rows.iter().filter(timed).count()), "{rows:?}");
    assert!(rows.iter().all(|row| row["rmse"].is_number()));
}
