//! Frame and extraction times.

use super::method::Reduced;
use foliage_lod::{
    FoliageModel, FoliageRenderer, Instance, Look, LookAt, Result, Swap,
    draw::ModelId,
    gpu::{GpuDevice, Offscreen, TARGET},
    stochastic::shuffled,
};
use glam::DAffine3;
use std::time::Instant;

/// Number of repetitions of an extraction; the median is reported.
const EXTRACTIONS: usize = 21;

/// Measures frame times on one device.
pub struct FrameTimes<'a> {
    gpu: &'a GpuDevice,
    target: Offscreen,
    foliage: FoliageRenderer,
    /// Address and id of the model that was added last: prefixes of one model share its buffers.
    added: Option<(*const FoliageModel, ModelId)>,
}

impl<'a> FrameTimes<'a> {
    /// Measures square frames, `side` pixels wide.
    ///
    /// # Errors
    /// Errors from [`Offscreen::new`] and [`FoliageRenderer::new`].
    pub fn new(gpu: &'a GpuDevice, side: u32) -> Result<Self> {
        let target = Offscreen::new(gpu, [side; 2])?;
        Ok(Self { gpu, target, foliage: FoliageRenderer::new(gpu.device(), TARGET, Look::default())?, added: None })
    }

    /// Median time of a frame over the cameras, in seconds, after one warm-up frame; NaN for a
    /// plant without leaves.
    ///
    /// # Errors
    /// Errors from the device, and [`Error::TooLarge`](foliage_lod::Error::TooLarge) for a model
    /// that does not fit on it.
    pub fn median(&mut self, reduced: &Reduced<'_>, cameras: &[LookAt]) -> Result<f64> {
        let (model, active) = match reduced {
            Reduced::Whole(plant) if plant.leaves.is_empty() => return Ok(f64::NAN),
            Reduced::Prefix(model, count) => (self.add(model)?, *count),
            Reduced::Whole(plant) => (self.add_new(&shuffled(plant, 0)?)?, plant.leaves.len() as u32),
        };
        let instance = Instance::new(model, DAffine3::IDENTITY, active as f32);
        let mut times = Vec::new();
        for camera in cameras.iter().take(1).chain(cameras) {
            let started = Instant::now();
            self.foliage.prepare(
                self.gpu.device(),
                self.gpu.queue(),
                camera.camera(self.target.size()[1]),
                &[instance],
            )?;
            self.target.draw(&self.foliage)?;
            times.push(started.elapsed().as_secs_f64());
        }
        Ok(median(&mut times[1..]))
    }

    fn add(&mut self, model: &FoliageModel) -> Result<ModelId> {
        match self.added {
            Some((added, id)) if std::ptr::eq(added, model) => Ok(id),
            _ => {
                let id = self.add_new(model)?;
                self.added = Some((model, id));
                Ok(id)
            }
        }
    }

    fn add_new(&mut self, model: &FoliageModel) -> Result<ModelId> {
        self.foliage = FoliageRenderer::new(self.gpu.device(), TARGET, Look::default())?;
        self.added = None;
        self.foliage.add_model(self.gpu.device(), self.gpu.queue(), model)
    }
}

/// Median time of swapping from all leaves to `count`, in seconds.
pub fn extraction_seconds(model: &FoliageModel, count: u32) -> f64 {
    let mut swap = Swap::new(model);
    let mut times = [0.0; EXTRACTIONS];
    for time in &mut times {
        swap.set_active(model.leaves.len() as u32);
        let started = Instant::now();
        swap.set_active(count);
        *time = started.elapsed().as_secs_f64();
    }
    median(&mut times)
}

/// Median of `times`; NaN if there are none.
pub(super) fn median(times: &mut [f64]) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
