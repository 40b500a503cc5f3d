//! The memory for a simplification is estimated before it is allocated.
#![cfg(feature = "simplify")]

mod common;

use common::plants;
use foliage_lod::{
    Error, Plant, Result,
    grow::{GrowOptions, Species, grow},
    simplify::{
        AlphaMask, Coverage, CpuFragments, FragmentSource, Quiet, SimplifyOptions, ViewTriangles, available_bytes,
        estimated_bytes, simplify,
    },
};
use std::sync::Mutex;

/// Lets one test run at a time, because they measure the whole process.
static ALONE: Mutex<()> = Mutex::new(());

/// A rasteriser that must not be called.
struct Untouched;

impl FragmentSource for Untouched {
    fn adapter(&self) -> Option<String> {
        None
    }

    fn prepare(&mut self, _: &[AlphaMask]) -> Result<()> {
        panic!("the work started")
    }

    fn capture(&mut self, _: ViewTriangles<'_>, _: &mut Vec<Coverage>) -> Result<()> {
        panic!("the work started")
    }
}

fn megabytes(plant: &Plant, options: &SimplifyOptions) -> u64 {
    estimated_bytes(plant, options).unwrap().div_ceil(1_000_000)
}

#[test]
fn an_estimate_above_the_limit_is_refused_before_the_work() {
    let _alone = ALONE.lock();
    let plant = plants::quads(100, 1.0, 3);
    let options = SimplifyOptions { resolution: 128, ..SimplifyOptions::paper() };
    let expected = megabytes(&plant, &options);
    let limited = |limit| SimplifyOptions { max_memory_mb: Some(limit), ..options.clone() };
    match simplify(&plant, &limited(expected - 1), &mut Untouched, &mut Quiet) {
        Err(Error::TooLarge { value, limit, fix, .. }) => {
            assert_eq!([value, limit], [expected, expected - 1]);
            assert!(fix.contains("`resolution` or `views`"), "{fix}");
        }
        other => panic!("{other:?}"),
    }
    let allowed = simplify(&plant, &limited(expected), &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    let unlimited = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
    assert!(allowed == unlimited);
}

/// 20 views of 2048 x 2048 with 5,000 cards over each pixel would take 7 TB.
#[cfg(target_os = "linux")]
#[test]
fn without_a_limit_the_available_memory_is_the_limit() {
    let _alone = ALONE.lock();
    let mut plant = plants::bare("stack");
    for i in 0..20_000 {
        let base = glam::Vec3::new(-1.0, -1.0, i as f32 * 1e-5);
        plants::push_card(&mut plant, base, glam::Vec3::X * 2.0, glam::Vec3::Y * 2.0, base);
    }
    let options = SimplifyOptions { resolution: 2048, ..SimplifyOptions::paper() };
    assert!(estimated_bytes(&plant, &options).unwrap() > available_bytes().unwrap());
    let refused = simplify(&plant, &options, &mut Untouched, &mut Quiet);
    assert!(matches!(refused, Err(Error::TooLarge { .. })), "{refused:?}");
}

/// The value of `key` in `/proc/self/status`, in bytes.
#[cfg(target_os = "linux")]
fn status(key: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap();
    1024.0 * line.trim().trim_end_matches(" kB").parse::<f64>().unwrap()
}

/// Memory freed by one run is reused by the next, so all runs are measured from before the first
/// one, in order of increasing size.
#[cfg(target_os = "linux")]
#[test]
fn the_estimate_is_near_the_measured_peak() {
    let _alone = ALONE.lock();
    let grown = |name| {
        grow(&Species::embedded(name).unwrap(), &GrowOptions { leaves: Some(4000), ..GrowOptions::default() }).unwrap()
    };
    let [birch, oak] = ["betula-populifolia", "english-oak"].map(grown);
    let balanced = SimplifyOptions { resolution: 128, threads: 2, ..SimplifyOptions::balanced() };
    let paper = SimplifyOptions { threads: 2, ..SimplifyOptions::paper() };
    let before = status("VmRSS:");
    for (plant, options) in [(&birch, &balanced), (&oak, &balanced), (&birch, &paper), (&oak, &paper)] {
        if std::fs::write("/proc/self/clear_refs", "5").is_err() {
            return println!("skipped: the system does not reset peak memory");
        }
        simplify(plant, options, &mut CpuFragments::new(), &mut Quiet).unwrap();
        let measured = status("VmHWM:") - before;
        let estimated = estimated_bytes(plant, options).unwrap() as f64;
        println!(
            "{} by {}: {:.1} MB measured, {:.1} MB estimated",
            plant.name,
            options.preset,
            measured / 1e6,
            estimated / 1e6
        );
        assert!(
            (0.6..2.0).contains(&(estimated / measured)),
            "{} by {}: {estimated} estimated, {measured} measured",
            plant.name,
            options.preset
        );
    }
}
