//! Selection of the rasteriser, with the CPU as the fallback for a GPU that fails.

use crate::{
    args::Raster,
    failure::{complain, spelled},
    progress::Bars,
};
use foliage_lod::{
    Error, Plant, Result,
    gpu::{GpuDevice, GpuFragments, GpuOptions, guarded},
    simplify::{CpuFragments, FragmentSource, Simplified, SimplifyOptions, simplify},
};

/// Simplifies `plant` with the requested rasteriser; also returns its name for step lines.
///
/// # Errors
/// Same as [`simplify()`]. With [`Raster::Auto`], GPU errors are not returned: the simplification
/// starts over on the CPU.
pub fn simplified(raster: Raster, plant: &Plant, options: &SimplifyOptions) -> Result<(Simplified, String)> {
    let by = |source: &mut dyn FragmentSource| simplify(plant, options, source, &mut Bars::new());
    let on_gpu = |gpu: GpuDevice| {
        let made = GpuFragments::new(&gpu).and_then(|mut source| {
            let made = by(&mut source);
            close(source);
            made
        });
        let name = gpu.adapter_name();
        close(gpu);
        Ok((made?, name))
    };
    let why_cpu = match raster {
        Raster::Cpu => "",
        _ => match open() {
            // Software adapters take several times as long as the CPU rasteriser, for the same
            // model. An adapter that the environment names is used anyway.
            Ok(gpu) if raster == Raster::Auto && gpu.is_software() && GpuOptions::from_env().adapter.is_none() => {
                ", since the GPU adapter is a software one"
            }
            Ok(gpu) => match on_gpu(gpu) {
                Err(error @ (Error::Gpu { .. } | Error::TooLarge { .. })) if raster == Raster::Auto => {
                    tell_fallback(&error);
                    ""
                }
                made => return made,
            },
            Err(error) if raster == Raster::Gpu => return Err(error),
            Err(_) => ", since there is no GPU adapter",
        },
    };
    Ok((by(&mut CpuFragments::new())?, format!("the CPU{why_cpu}")))
}

/// Warns that the CPU replaces the GPU, and why. Other errors are not reported here: the CPU path
/// hits and reports them itself.
pub fn tell_fallback(error: &Error) {
    if let Error::Gpu { .. } = error {
        complain(format_args!("warning: the CPU takes over: {}", spelled(error)));
    }
}

/// Drops a GPU handle, ignoring a device failure during the drop: results are already complete.
fn close(handle: impl Sized) {
    let _ = guarded(|| {
        drop(handle);
        Ok(())
    });
}

/// Opens the GPU device that the environment selects.
///
/// # Errors
/// [`Error::Gpu`] if there is no adapter.
pub fn open() -> Result<GpuDevice> {
    GpuDevice::new(&GpuOptions::from_env())
}
