//! The examples run as a newcomer would run them. `cargo test` builds them beside the tests.
#![cfg(feature = "simplify")]

use std::{path::Path, process::Command};

fn run(example: &str, folder: &Path) -> Result<String, String> {
    let test = std::env::current_exe().unwrap();
    let built = test.parent().and_then(Path::parent).unwrap().join("examples").join(example);
    let built = built.with_extension(std::env::consts::EXE_EXTENSION);
    assert!(built.exists(), "{} is not built: run `cargo build --examples` first", built.display());
    let output = Command::new(built).current_dir(folder).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    if output.status.success() { Ok(out) } else { Err(error) }
}

#[test]
fn extract_tells_fewer_leaves_with_every_step_away() {
    let told = run("extract", tempfile::tempdir().unwrap().path()).unwrap();
    let active = |line: &str| line.split_whitespace().nth(2).unwrap().parse::<u32>().unwrap();
    let counts: Vec<u32> = told.lines().map(active).collect();
    assert_eq!((counts.len(), counts[0], counts[1]), (7, 800, counts[2]), "a trembling camera changes nothing: {told}");
    assert!(counts.windows(2).all(|pair| pair[1] <= pair[0]) && counts[6] < 100, "{told}");
}

#[cfg(feature = "render")]
#[test]
fn render_to_png_draws_three_trees() {
    let folder = tempfile::tempdir().unwrap();
    match run("render_to_png", folder.path()) {
        Ok(told) => {
            assert!(told.contains("of 3 trees in 2 draws"), "{told}");
            assert_eq!(image::image_dimensions(folder.path().join("render_to_png.png")).unwrap(), (1024, 512));
        }
        Err(error) => {
            assert!(std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none() && error.contains("Gpu"), "{error}");
            println!("skipped: {error}");
        }
    }
}
