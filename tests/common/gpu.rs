//! The GPU device that tests run on, and the difference between pictures.

use foliage_lod::gpu::{GpuDevice, GpuOptions};

/// Opens the GPU device. Without an adapter it prints a note and returns `None`, or panics if
/// `FOLIAGE_REQUIRE_ADAPTER` is set.
pub fn gpu() -> Option<GpuDevice> {
    match GpuDevice::new(&GpuOptions::from_env()) {
        Ok(gpu) => Some(gpu),
        Err(error) if std::env::var_os("FOLIAGE_REQUIRE_ADAPTER").is_some() => panic!("{error}"),
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}

/// Mean difference over all channels, and 95th percentile of the largest difference per pixel.
#[allow(dead_code)]
pub fn difference(a: &foliage_lod::software::Image, b: &foliage_lod::software::Image) -> (f64, u8) {
    let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
    let mut differences: Vec<u8> =
        pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap()).collect();
    let sum: u64 = a.rgba.iter().zip(&b.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    differences.sort_unstable();
    (sum as f64 / a.rgba.len() as f64, differences[differences.len() * 95 / 100])
}
