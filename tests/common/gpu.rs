//! The adapter that GPU tests run on.

use foliage_lod::render::device::{GpuDevice, GpuOptions};

/// The device, or `None` after saying so where there is no adapter; with `FOLIAGE_REQUIRE_ADAPTER=1` that is a failure.
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
