//! Tests of the command in an environment that fails: it prints one line on stderr, and every file
//! is either complete or unchanged.
#![cfg(unix)]

#[path = "common/command.rs"]
mod command;
#[path = "../../../tests/common/plants.rs"]
#[allow(dead_code)] // The library's tests use the rest.
mod plants;

use command::{COMMAND, command, ended, error_line, names, run, succeeds};
use plants::Random;
use std::{
    fs::{self, File},
    os::unix::{
        fs::{FileTypeExt, PermissionsExt, symlink},
        process::ExitStatusExt,
    },
    path::Path,
    process::{Command, Output, Stdio},
    time::Instant,
};
use tempfile::TempDir;

/// Arguments that simplify a small model on the CPU.
const SIMPLIFY: [&str; 6] = ["simplify", "tree.glb", "--raster", "cpu", "--resolution", "32"];

/// Like [`run`], in a shell that first executes `before`.
fn run_after(folder: &TempDir, before: &str, arguments: &[&str]) -> Output {
    let script = format!("{before}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path()).args(["-c", &script, COMMAND]).args(arguments);
    ended(shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap(), arguments)
}

/// Creates a temporary folder with `tree.glb`, a birch, and `old.vds`, its model.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    succeeds(&run(&folder, &["grow", "betula-populifolia", "-o", "tree.glb", "--leaves", "300"]));
    succeeds(&run(&folder, &[&SIMPLIFY[..], &["-o", "old.vds"]].concat()));
    folder
}

/// Arguments of every subcommand that writes a file, without the output option.
const WRITERS: [&[&str]; 3] =
    [&SIMPLIFY, &["grow", "betula-populifolia", "--leaves", "300"], &["render", "old.vds", "--raster", "cpu"]];

fn makes_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    assert!(fs::metadata(path).unwrap().file_type().is_fifo());
}

#[test]
fn a_folder_that_takes_no_file_is_named() {
    let folder = folder();
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::write(locked.join("old.vds"), "old").unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    let mut targets = vec!["tree.glb/new", "none/new"];
    if cfg!(target_os = "linux") {
        targets.push("/proc/new");
    }
    if File::create(locked.join("probe")).is_ok() {
        // Root can write to every folder.
        fs::remove_file(locked.join("probe")).unwrap();
    } else {
        targets.extend(["locked/new", "locked/old.vds"]);
    }
    for (target, writer) in targets.iter().flat_map(|target| WRITERS.map(|writer| (target, writer))) {
        let line = error_line(&run(&folder, &[writer, &["-o", target]].concat()), 1);
        assert!(line.contains(target.split('/').find(|part| !part.is_empty()).unwrap()), "{line}");
    }
    assert_eq!(fs::read_dir(&locked).unwrap().count(), 1);
    assert_eq!(names(&folder), ["locked", "old.vds", "tree.glb"]);
}

#[test]
fn a_target_that_is_no_regular_file_is_refused_and_left_alone() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder")).unwrap();
    makes_pipe(&folder.path().join("pipe"));
    symlink("/dev/full", folder.path().join("full")).unwrap();
    for (target, writer) in ["folder", "pipe", "full", "/dev/null"].iter().flat_map(|t| WRITERS.map(|w| (t, w))) {
        let line = error_line(&run(&folder, &[writer, &["-o", target]].concat()), 1);
        assert!(line.contains(target), "{line}");
    }
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    assert_eq!(names(&folder), ["folder", "full", "old.vds", "pipe", "tree.glb"]);
}

#[test]
fn a_target_that_is_read_or_read_only_is_refused_and_left_alone() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("locked"), "old").unwrap();
    fs::set_permissions(path("locked"), fs::Permissions::from_mode(0o444)).unwrap();
    symlink("tree.glb", path("link")).unwrap();
    fs::write(path("birch.toml"), include_str!("../../../data/species/betula-populifolia.toml")).unwrap();
    let scene = "[[models]]\nname = \"birch\"\nfile = \"old.vds\"\n[[plants]]\nmodel = \"birch\"\n";
    fs::write(path("scene.toml"), scene).unwrap();
    let contents = || names(&folder).iter().map(|name| fs::read(path(name)).unwrap()).collect::<Vec<_>>();
    let before = contents();
    for writer in WRITERS {
        let line = error_line(&run(&folder, &[writer, &["-o", "locked"]].concat()), 1);
        assert!(line.contains("locked: ") && line.contains("read-only"), "{line}");
    }
    let inputs: [&[&str]; 6] = [
        &["simplify", "tree.glb", "-o", "./tree.glb"],
        &["simplify", "link", "-o", "tree.glb"],
        &["render", "old.vds", "-o", "old.vds"],
        &["render", "scene.toml", "-o", "scene.toml"],
        &["render", "scene.toml", "-o", "old.vds", "--size", "32x32"],
        &["grow", "birch.toml", "-o", "birch.toml"],
    ];
    for arguments in inputs {
        let line = error_line(&run(&folder, arguments), 1);
        assert!(line.contains("is also an input"), "{line}");
    }
    assert!(contents() == before);
    // An embedded species is not a file, so the output may have its name.
    let grow = ["grow", "betula-populifolia", "-o", "betula-populifolia", "--leaves", "60"];
    (0..2).for_each(|_| succeeds(&run(&folder, &grow)));
}

/// Simulates a full disk with the shell's limit on file size: with SIGXFSZ ignored, writes fail in
/// the same way.
#[test]
fn a_disk_that_fills_up_leaves_what_was_there() {
    let folder = folder();
    fs::write(folder.path().join("out"), "old").unwrap();
    for writer in WRITERS {
        let output = run_after(&folder, "trap '' XFSZ; ulimit -f 4", &[writer, &["-o", "out"][..]].concat());
        let line = error_line(&output, 1);
        assert!(line.contains("out: ") && line.contains("make room") && !line.contains(".part"), "{line}");
        assert_eq!(fs::read(folder.path().join("out")).unwrap(), b"old");
        assert_eq!(names(&folder), ["old.vds", "out", "tree.glb"]);
    }
}

#[test]
fn an_input_that_is_gone_a_folder_empty_or_a_pipe_is_named_at_once() {
    let folder = folder();
    fs::write(
        folder.path().join("half.gltf"),
        r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":9,"uri":"gone.bin"}]}"#,
    )
    .unwrap();
    for extension in ["glb", "obj", "vds", "toml"] {
        let path = |stem: &str| folder.path().join(stem).with_extension(extension);
        fs::create_dir(path("folder")).unwrap();
        fs::write(path("empty"), "").unwrap();
        makes_pipe(&path("pipe"));
    }
    let before = names(&folder);
    let readers: [(&str, &[&str]); 6] = [
        ("simplify", &["glb", "obj"]),
        ("inspect", &["glb", "vds"]),
        ("render", &["vds", "toml"]),
        ("grow", &["toml"]),
        ("report", &["glb"]),
        ("simplify", &["vds"]),
    ];
    for (reader, extensions) in readers {
        for (stem, extension) in
            ["gone", "folder", "empty", "pipe"].iter().flat_map(|s| extensions.iter().map(move |e| (s, e)))
        {
            let input = format!("{stem}.{extension}");
            let output: &[&str] = match reader {
                "inspect" => &[],
                "report" => &["-o", "."],
                _ => &["-o", "out"],
            };
            let line = error_line(&run(&folder, &[&[reader, &input][..], output].concat()), 1);
            assert!(line.contains(&input), "{line}");
        }
    }
    let line = error_line(&run(&folder, &["simplify", "half.gltf", "-o", "out"]), 1);
    assert!(line.contains("gone.bin"), "{line}");
    assert_eq!(names(&folder), before);
}

#[test]
fn an_interruption_at_any_moment_leaves_the_old_file_or_a_whole_new_one() {
    let folder = folder();
    let simplify = ["simplify", "tree.glb", "--raster", "cpu", "--resolution", "64", "-o", "out"];
    let started = Instant::now();
    succeeds(&run(&folder, &simplify));
    let longest = started.elapsed();
    let new = fs::read(folder.path().join("out")).unwrap();
    let mut random = Random(31);
    let [mut too_early, mut stopped, mut finished] = [0; 3];
    for _ in 0..20 {
        fs::write(folder.path().join("out"), "old").unwrap();
        let child = command(folder.path(), &simplify).spawn().unwrap();
        std::thread::sleep(longest.mul_f64((random.next() % 1000) as f64 / 1000.0));
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let output = ended(child, &simplify);
        let out = fs::read(folder.path().join("out")).unwrap();
        let is_new = out == new;
        assert!(is_new || out == b"old", "{} bytes of {}", out.len(), new.len());
        match output.status.code() {
            // The signal arrived before the command installed its handler.
            None if output.status.signal() == Some(2) && output.stdout.is_empty() => too_early += 1,
            Some(0) if is_new => finished += 1,
            _ => {
                assert!(error_line(&output, 130).contains("interrupted"));
                stopped += 1;
            }
        }
        assert_eq!(names(&folder), ["old.vds", "out", "tree.glb"]);
    }
    println!("{too_early} before the signal handler, {stopped} stopped, {finished} finished");
    assert!(stopped > 0);
}

/// Kills the command once its temporary file has content. SIGKILL cannot be handled, so the
/// temporary file is left behind.
#[test]
fn a_process_that_is_killed_at_any_moment_leaves_the_old_file_or_a_whole_new_one() {
    let folder = folder();
    let arguments = [&SIMPLIFY[..], &["-o", "out"]].concat();
    succeeds(&run(&folder, &arguments));
    let new = fs::read(folder.path().join("out")).unwrap();
    let is_writing = || {
        let mut entries = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap());
        entries.any(|entry| {
            let is_part = entry.file_name().to_string_lossy().starts_with(".foliage-lod-");
            is_part && entry.metadata().is_ok_and(|part| part.len() > 0)
        })
    };
    let mut cut_short = 0;
    for _ in 0..20 {
        fs::write(folder.path().join("out"), "old").unwrap();
        let mut child = command(folder.path(), &arguments).spawn().unwrap();
        while !is_writing() && child.try_wait().unwrap().is_none() {}
        let _ = child.kill();
        child.wait().unwrap();
        let out = fs::read(folder.path().join("out")).unwrap();
        assert!(out == new || out == b"old", "{} bytes of {}", out.len(), new.len());
        cut_short += usize::from(out == b"old");
        let parts = names(&folder).into_iter().filter(|name| name.starts_with(".foliage-lod-"));
        parts.for_each(|part| fs::remove_file(folder.path().join(part)).unwrap());
    }
    println!("{cut_short} of 20 cut short");
    assert!(cut_short > 0);
    let others: Vec<_> = names(&folder).into_iter().filter(|name| !name.starts_with(".foliage-lod-")).collect();
    assert_eq!(others, ["old.vds", "out", "tree.glb"]);
}

#[test]
fn two_writers_of_one_file_leave_one_whole_model_at_every_moment() {
    let folder = folder();
    let by_area = [&SIMPLIFY[..], &["--criterion", "area"]].concat();
    let by_vmi = [&SIMPLIFY[..], &["--criterion", "vmi"]].concat();
    let out = folder.path().join("out");
    let wholes = [&by_area, &by_vmi].map(|arguments| {
        succeeds(&run(&folder, &[&arguments[..], &["-o", "out"]].concat()));
        fs::read(&out).unwrap()
    });
    assert!(wholes[0] != wholes[1]);
    for _ in 0..5 {
        let mut children = [&by_area, &by_vmi]
            .map(|arguments| command(folder.path(), &[&arguments[..], &["-o", "out"]].concat()).spawn().unwrap());
        while children.iter_mut().any(|child| child.try_wait().unwrap().is_none()) {
            assert!(wholes.contains(&fs::read(&out).unwrap()), "a reader saw something other than a whole model");
        }
        children.into_iter().for_each(|child| succeeds(&child.wait_with_output().unwrap()));
        assert!(wholes.contains(&fs::read(&out).unwrap()));
        assert_eq!(names(&folder), ["old.vds", "out", "tree.glb"]);
    }
}

#[test]
fn without_a_driver_gpu_fails_and_auto_takes_the_cpu() {
    let folder = folder();
    let by = |arguments: &[&str], raster: &str| {
        let arguments = [arguments, &["-o", "out", "--raster", raster]].concat();
        let mut command = command(folder.path(), &arguments);
        command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        ended(command.spawn().unwrap(), &arguments)
    };
    for arguments in [&["simplify", "tree.glb", "--resolution", "32"][..], &["render", "old.vds"]] {
        let line = error_line(&by(arguments, "gpu"), 1);
        assert!(line.contains("GPU: ") && line.contains("--raster cpu"), "{line}");
        assert_eq!(names(&folder), ["old.vds", "tree.glb"]);
        let fallen_back = by(arguments, "auto");
        succeeds(&fallen_back);
        assert!(String::from_utf8_lossy(&fallen_back.stdout).contains("the CPU"));
        fs::remove_file(folder.path().join("out")).unwrap();
    }
}

#[test]
fn whoever_stops_reading_stdout_still_gets_the_file() {
    let folder = folder();
    for writer in WRITERS {
        let arguments = [writer, &["-o", "out"]].concat();
        let mut child = command(folder.path(), &arguments).spawn().unwrap();
        drop(child.stdout.take());
        let output = ended(child, &arguments);
        succeeds(&output);
        assert!(output.stderr.is_empty());
        succeeds(&run(&folder, &[writer, &["-o", "expected"]].concat()));
        assert!(fs::read(folder.path().join("out")).unwrap() == fs::read(folder.path().join("expected")).unwrap());
        fs::remove_file(folder.path().join("out")).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn output_streams_that_accept_nothing_are_reported_by_the_exit_code() {
    let folder = folder();
    let full = || File::options().write(true).open("/dev/full").unwrap();
    let inspect = ["inspect", "tree.glb"];
    for arguments in [&inspect[..], &[&SIMPLIFY[..], &["-o", "out"]].concat()] {
        let child = command(folder.path(), arguments).stdout(full()).spawn().unwrap();
        let line = error_line(&ended(child, arguments), 1);
        assert!(line.contains("stdout: ") && line.contains("make room"), "{line}");
    }
    for (arguments, code) in [(["inspect", "gone.glb"], 1), (["prune", "tree.glb"], 2)] {
        let child = command(folder.path(), &arguments).stderr(full()).spawn().unwrap();
        assert_eq!(ended(child, &arguments).status.code(), Some(code));
    }
    assert_eq!(names(&folder), ["old.vds", "tree.glb"]);
}
