#![allow(missing_docs)]
mod common;
use foliage_lod::simplify::{raster::CpuFragments, *};
#[test]
fn perf() {
    let n: usize = std::env::var("N").ok().and_then(|s| s.parse().ok()).unwrap_or(20146);
    let r: u32 = std::env::var("R").ok().and_then(|s| s.parse().ok()).unwrap_or(256);
    let t: usize = std::env::var("T").ok().and_then(|s| s.parse().ok()).unwrap_or(2);
    let plant = common::plants::quads(n, 6.0, 1);
    let options = SimplifyOptions { resolution: r, threads: t, ..SimplifyOptions::paper() };
    let (p, f, s) = order(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap();
    let peak = std::fs::read_to_string("/proc/self/status")
        .unwrap()
        .lines()
        .find(|l| l.starts_with("VmHWM"))
        .unwrap()
        .to_string();
    let h = p
        .iter()
        .fold(0u64, |h, p| h.wrapping_mul(31).wrapping_add(p.leaf as u64 ^ (p.target_scale.to_bits() as u64) << 20));
    println!(
        "n={n} r={r} t={t} prunes {} fragments {f} {s:?} {peak} hash {h:x} max scale {}",
        p.len(),
        p.iter().map(|p| p.target_scale).fold(0.0, f32::max)
    );
}
