//! Which rasteriser captures the fragments.

use crate::{args::Raster, output, progress::Bars};
use foliage_lod::{
    Error, Plant, Result,
    render::{
        device::{GpuDevice, GpuOptions},
        fragment_pass::GpuFragments,
        guard::guarded,
    },
    simplify::{Simplified, SimplifyOptions, fragments::FragmentSource, raster::CpuFragments, simplify},
};

/// Makes the model of `plant` by the rasteriser that was asked for, and says what a step line calls it.
///
/// # Errors
/// Those of [`simplify()`]. Those of the GPU only when nothing else would do: otherwise the CPU begins anew.
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
            Ok(gpu) => match on_gpu(gpu) {
                Err(error @ (Error::Gpu { .. } | Error::TooLarge { .. })) if raster == Raster::Auto => {
                    tell_fallback(&error);
                    ""
                }
                made => return made,
            },
            Err(error) if raster == Raster::Gpu => return Err(error),
            Err(_) => ", as no GPU adapter answers",
        },
    };
    Ok((by(&mut CpuFragments::new())?, format!("the CPU{why_cpu}")))
}

/// Says why the CPU does what a GPU was meant to. What is no failure of the GPU the CPU tells itself, if it is one there too.
pub fn tell_fallback(error: &Error) {
    if let Error::Gpu { .. } = error {
        output::complaint(format_args!("warning: the CPU takes over: {}", crate::failure::spelled(error)));
    }
}

/// What is made stays made when the device fails while it is closed.
fn close(handle: impl Sized) {
    let _ = guarded(|| {
        drop(handle);
        Ok(())
    });
}

/// The device that the environment asks for.
///
/// # Errors
/// [`Error::Gpu`] where no adapter answers.
pub fn open() -> Result<GpuDevice> {
    GpuDevice::new(&GpuOptions::from_env())
}
