//! Runs the examples as a newcomer would. `cargo test` builds them along with the tests.
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
fn extract_prints_fewer_leaves_with_every_step_away() {
    let printed = run("extract", tempfile::tempdir().unwrap().path()).unwrap();
    let active = |line: &str| line.split_whitespace().nth(2).unwrap().parse::<u32>().unwrap();
    let counts: Vec<u32> = printed.lines().map(active).collect();
    assert_eq!(
        (counts.len(), counts[0], counts[1]),
        (7, 800, counts[2]),
        "a tiny camera movement changes nothing: {printed}"
    );
    assert!(counts.windows(2).all(|pair| pair[1] <= pair[0]) && counts[6] < 100, "{printed}");
}

#[cfg(feature = "render")]
#[test]
fn render_to_png_draws_three_trees() {
    let folder = tempfile::tempdir().unwrap();
    match run("render_to_png", folder.path()) {
        Ok(printed) => {
            assert!(printed.contains("of 3 trees in 2 draws"), "{printed}");
            assert_eq!(image::image_dimensions(folder.path().join("render_to_png.png")).unwrap(), (1024, 512));
        }
        Err(error) => {
            assert!(std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none() && error.contains("Gpu"), "{error}");
            println!("skipped: {error}");
        }
    }
}

#[cfg(feature = "render")]
#[test]
fn in_your_pass_draws_half_of_the_leaves() {
    match run("in_your_pass", tempfile::tempdir().unwrap().path()) {
        Ok(printed) => assert!(printed.starts_with("6070 leaves in "), "{printed}"),
        Err(error) => {
            assert!(std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_none(), "{error}");
            println!("skipped: {error}");
        }
    }
}

#[test]
fn the_snippet_in_the_readme_is_the_example() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [readme, example] =
        ["README.md", "examples/in_your_pass.rs"].map(|file| std::fs::read_to_string(root.join(file)).unwrap());
    assert!(example.lines().count() <= 50);
    let code = example.split_once("\n\n").unwrap().1;
    assert!(readme.contains(&format!("```rust,no_run\n{code}```")), "README.md has another version");
}
