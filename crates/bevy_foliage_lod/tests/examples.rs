//! The examples, as they are run: each writes a picture without a window, like the one that was
//! looked at. `FOLIAGE_BLESS=1` replaces those.

mod common;

use bevy_foliage_lod::foliage_lod::material::{Pixels, Texture, TextureFormat};
use common::folder;
use std::{path::Path, process::Command};

fn read(path: &Path) -> Pixels {
    let bytes = std::fs::read(path).unwrap();
    Texture { name: path.display().to_string(), format: TextureFormat::Png, bytes }.decode().unwrap()
}

/// Mean difference of two pictures, of 255.
fn difference(a: &Pixels, b: &Pixels) -> f64 {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    let sum: u64 = a.rgba.iter().zip(&b.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.rgba.len() as f64
}

fn check(example: &str, options: &[&str]) {
    let test = std::env::current_exe().unwrap();
    let program = test.ancestors().nth(2).unwrap().join("examples").join(example);
    let written = folder("examples").join(format!("{example}.png"));
    let _ = std::fs::remove_file(&written);
    let output = Command::new(program).args(options).args(["--size", "320x180", "--picture"]).arg(&written).output();
    let output = output.unwrap();
    let log = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !log.contains("panicked"), "{example}: {log}");
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{example}.png"));
    if std::env::var_os("FOLIAGE_BLESS").is_some() {
        std::fs::copy(&written, &golden).unwrap();
    }
    let difference = difference(&read(&written), &read(&golden));
    println!("{example} differs by {difference:.3} of 255");
    assert!(difference < 2.0, "{example}: {difference}, {}", written.display());
}

#[test]
fn a_tree() {
    check("tree", &["--grow", "1000", "--share", "0.3"]);
}

#[test]
fn a_forest() {
    check("forest", &["--grow", "600", "--plants", "60"]);
}

#[test]
fn a_walk_within_a_budget() {
    check("walk", &["--grow", "600", "--plants", "40", "--budget", "4000"]);
}

#[test]
fn wrong_options_end_with_one_line() {
    let test = std::env::current_exe().unwrap();
    let program = test.ancestors().nth(2).unwrap().join("examples/tree");
    for (options, expected) in [
        (&["none.vds", "--picture", "none.png"][..], "none.vds"),
        (&["--grow", "many", "--picture", "none.png"], "--grow \"many\" is not a value"),
        (&["--grow", "60", "--picture", "none.png", "--size", "wide"], "--size takes WIDTHxHEIGHT"),
    ] {
        let output = Command::new(&program).args(options).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        let line = told.lines().find(|line| line.starts_with("error: ") && !line.contains("XDG"));
        assert!(line.is_some_and(|line| line.contains(expected)), "{options:?}: {told}");
        assert_eq!(output.status.code(), Some(2));
    }
}
