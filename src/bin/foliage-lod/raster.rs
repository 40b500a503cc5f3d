//! Which rasteriser captures the fragments.

use crate::args::Raster;
use foliage_lod::{
    Result,
    render::{
        device::{GpuDevice, GpuOptions},
        fragment_pass::GpuFragments,
    },
    simplify::{fragments::FragmentSource, raster::CpuFragments},
};

/// The rasteriser that was asked for, and what a step line calls it.
///
/// # Errors
/// [`foliage_lod::Error::Gpu`] when only a GPU would do and none answers.
pub fn source(raster: Raster) -> Result<(Box<dyn FragmentSource>, String)> {
    if raster == Raster::Cpu {
        return Ok((Box::new(CpuFragments::new()), "the CPU".into()));
    }
    match GpuDevice::new(&GpuOptions::from_env()).and_then(|device| GpuFragments::new(&device)) {
        Ok(gpu) => {
            let name = gpu.adapter().unwrap_or_else(|| "the GPU".into());
            Ok((Box::new(gpu), name))
        }
        Err(error) if raster == Raster::Gpu => Err(error),
        Err(_) => Ok((Box::new(CpuFragments::new()), "the CPU, as no GPU adapter answers".into())),
    }
}
