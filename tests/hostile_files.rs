//! Randomly damaged files of every format that is read: each produces a one-line error or a valid
//! result, within a second and within memory bounded by its size.
//!
//! `FOLIAGE_FUZZ_CASES` is the number of files of each kind. Case `k` is the same on every run.
//! With `--nocapture` each test prints the number of cases per outcome, the total time and the peak
//! memory of any case.
#![cfg(feature = "simplify")]

mod common;
#[path = "hostile_files/continuous.rs"]
mod continuous;
#[path = "common/glb.rs"]
mod glb;
#[path = "hostile_files/gltf.rs"]
mod gltf;
#[path = "common/memory.rs"]
mod memory;
#[path = "hostile_files/models.rs"]
mod models;
#[path = "common/mutate.rs"]
mod mutate;
#[path = "hostile_files/obj.rs"]
mod obj;
#[path = "hostile_files/text.rs"]
mod text;

use foliage_lod::{Error, Result, import::Imported};
use memory::within_bounds;
use mutate::{Random, survive};
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

/// Creates a file with `make` for each case and reads it with `read`.
fn survive_reading(
    kind: &str,
    expected: &[&str],
    make: impl Fn(&mut Random) -> Vec<u8> + Send + 'static,
    read: impl Fn(&[u8]) -> Result<()> + Send + 'static,
) {
    let most = Arc::new(AtomicU64::new(0));
    let of_all = most.clone();
    survive(kind, expected, move |random| {
        let file = make(random);
        let (read, bytes) = within_bounds(file.len() as u64, || read(&file));
        of_all.fetch_max(bytes, Ordering::Relaxed);
        outcome(read)
    });
    println!("{kind}: at most {:.2} MB held", most.load(Ordering::Relaxed) as f64 / 1e6);
}

/// The outcome of reading a file, as a short name.
fn outcome(read: Result<()>) -> &'static str {
    let Err(error) = read else { return "accepted" };
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "not a plain line: {message:?}");
    match error {
        Error::Unreadable { .. } => "unreadable",
        Error::Unsupported { .. } => "unsupported",
        Error::InvalidModel { .. } => "unsound",
        Error::NoLeaves { .. } => "leafless",
        Error::InvalidOption { field, .. } if field == "leaves" => "unknown name",
        Error::TooLarge { .. } => "too large",
        Error::Io { .. } => "missing file",
        other => panic!("a reader must not return this error: {other:?}"),
    }
}

/// Checks that an imported plant is valid and its warnings are plain lines.
fn check(imported: Result<Imported>) -> Result<()> {
    let Imported { plant, warnings, .. } = imported?;
    plant.validate().expect("an imported plant is valid");
    assert!(!warnings.iter().any(|warning| warning.to_string().contains(char::is_control)), "{warnings:?}");
    Ok(())
}
