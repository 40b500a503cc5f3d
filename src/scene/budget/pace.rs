//! A budget of leaves that keeps the time of a frame near a target.

use std::collections::VecDeque;

/// Number of parts of a time: a constant one, and those of a [`Load`].
const PARTS: usize = 5;
/// Units of the parts, so that a time is about as much of each.
const UNITS: [f64; PARTS] = [1.0, 1e5, 1e5, 1e6, 1e4];
/// Share of its time that each part is taken to have before anything is known.
const PRIOR: [f64; PARTS] = [0.1, 1.0, 0.5, 0.5, 0.2];
/// Weight of a reading over that of the next one: half is left after 34.
const FORGETTING: f64 = 0.98;
/// Variance of a part before anything is known.
const UNKNOWN: f64 = 10.0;
/// Least share of a reading in how fast the GPU is found to be: after a change, readings are
/// averaged.
const SHARE: f64 = 0.08;
/// Logarithm of a change that noise does not explain.
const CHANGE: f64 = 0.25;
/// Most that the logarithm of the budget falls and rises in a frame.
const STEPS: [f64; 2] = [-0.15, 0.02];
/// How far the expected time may be from the target, over it, while the budget stays, and how near
/// it comes before the budget stays again.
const DEAD_BAND: [f64; 2] = [0.05, 0.01];
/// Readings after a change from which on the budget may stay: before, the expected time still
/// moves, and would leave it at the edge of the dead band.
const SURE: f64 = 2.0 / SHARE;
/// Most frames that a reading may be late.
const LATEST: usize = 32;
/// Longest time that counts, in milliseconds.
const MOST_MS: f64 = 1e5;
/// Share of a frame's time from which on the CPU is what it waits for.
const CPU_BOUND: f64 = 0.9;

/// What a frame drew.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Number of leaves.
    pub leaves: f64,
    /// Number of triangles of wood.
    pub wood_triangles: f64,
    /// Pixels that impostors cover.
    pub impostor_px: f64,
    /// Number of plants.
    pub plants: f64,
}

/// How long a frame took, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Times {
    /// From one frame to the next.
    pub frame_ms: f64,
    /// Of the GPU, if it is known: then nothing else counts.
    pub gpu_ms: Option<f64>,
    /// Of the CPU, if it is known: where the GPU's is not, frames that wait for the CPU cost no
    /// leaves.
    pub cpu_ms: Option<f64>,
}

/// Finds the leaves for a time.
///
/// The time of a frame is taken to be linear in its [`Load`], by coefficients that recursive
/// least squares follow (L. Ljung, *System Identification*), times how fast the GPU is at the
/// moment. The budget is what that model has left for leaves, so it answers to what a frame is
/// going to draw before it is measured (predictive, as in T. Funkhouser and C. Séquin 1993), and a
/// reading is held against the load of its own frame: late ones do no harm. It falls by at most
/// 14 % and rises by at most 2 % a frame, and stays while the expected time is within 5 % of the
/// target, 25 readings after the GPU has changed or later.
///
/// ```
/// use foliage_lod::scene::budget::{Load, Pace, Times};
///
/// let mut pace = Pace::new(4.0, 100_000.0);
/// for frame in 0..200 {
///     let load = Load { leaves: pace.leaves(), ..Load::default() };
///     pace.drew(frame, load);
///     // A GPU that takes 1 ms and 10 ns a leaf.
///     pace.took(frame, Times { gpu_ms: Some(1.0 + 1e-5 * load.leaves), ..Times::default() });
/// }
/// assert!((pace.leaves() / 300_000.0 - 1.0).abs() < 0.06);
/// ```
///
/// Limits: without a GPU time, frames must not wait for the display (no vertical synchronisation),
/// and those that wait for the CPU cost leaves unless its time is told.
#[derive(Debug, Clone)]
pub struct Pace {
    /// Time to keep to, in milliseconds; above 0.
    pub target_ms: f64,
    /// Fewest and most leaves, at least 1 each.
    pub range: [f64; 2],
    leaves: f64,
    model: Model,
    /// Logarithm of how much slower the GPU is than the model.
    slowness: f64,
    /// The last differences from it.
    last: [f64; 2],
    /// Number of readings since the GPU was found to have changed.
    readings: f64,
    /// Loads of frames whose time is not known yet.
    pending: VecDeque<(u64, Load)>,
    latest: Load,
    is_settled: bool,
    has_cut: bool,
    is_known: bool,
}

impl Pace {
    /// Keeps to `target_ms`, and begins with so many leaves.
    pub fn new(target_ms: f64, leaves: f64) -> Self {
        Self {
            target_ms,
            range: [1.0, 1e9],
            leaves: if leaves > 1.0 { leaves.min(1e9) } else { 1.0 },
            model: Model::new(),
            slowness: 0.0,
            last: [0.0; 2],
            readings: 0.0,
            pending: VecDeque::new(),
            latest: Load::default(),
            is_settled: false,
            has_cut: false,
            is_known: false,
        }
    }

    /// Number of leaves for the next frame.
    pub fn leaves(&self) -> f64 {
        let [least, most] = self.bounds();
        self.leaves.clamp(least, most)
    }

    /// Time that a frame with this load is expected to take, in milliseconds.
    pub fn expected_ms(&self, load: &Load) -> f64 {
        self.model.time(&parts(load)) * libm::exp(self.slowness)
    }

    /// Tells what the frame with this number drew, and takes a step.
    pub fn drew(&mut self, frame: u64, load: Load) {
        self.pending.push_back((frame, load));
        if self.pending.len() > LATEST {
            self.pending.pop_front();
        }
        self.latest = load;
        self.step();
    }

    /// Tells how long a frame took, in any later frame, or never. Times of unknown frames, and such
    /// as cannot be, are passed over.
    pub fn took(&mut self, frame: u64, times: Times) {
        let Some(at) = self.pending.iter().position(|(number, _)| *number == frame) else { return };
        let (_, load) = self.pending[at];
        self.pending.drain(..=at);
        let is_cpu_bound = times.cpu_ms.is_some_and(|cpu| cpu >= CPU_BOUND * times.frame_ms);
        let ms = match times.gpu_ms {
            Some(ms) => ms,
            None if is_cpu_bound => return,
            None => times.frame_ms,
        };
        if !(f64::MIN_POSITIVE..=MOST_MS).contains(&ms) {
            return;
        }
        let parts = parts(&load);
        if !self.is_known {
            self.model.scale(ms / self.model.time(&parts));
            self.is_known = true;
        }
        let off = libm::log(ms / self.model.time(&parts)) - self.slowness;
        // One frame alone may be a hitch.
        let has_changed = self.last.into_iter().chain([off]).all(|off| off > CHANGE)
            || self.last.into_iter().chain([off]).all(|off| off < -CHANGE);
        self.last = [self.last[1], off];
        self.readings = if has_changed { 1.0 } else { self.readings + 1.0 };
        let off_by = if has_changed { off } else { off.clamp(-CHANGE, CHANGE) };
        self.slowness += off_by * SHARE.max(1.0 / self.readings);
        if off.abs() < CHANGE {
            self.model.learn(&parts, ms * libm::exp(-self.slowness));
        }
    }

    /// Tells that the next frame has nothing to do with the last one, as after a cut of the camera:
    /// the budget then goes to where the model expects it at once.
    pub fn cut(&mut self) {
        self.has_cut = true;
    }

    /// The range, of numbers that are at least 1.
    fn bounds(&self) -> [f64; 2] {
        // `max` passes over NaN.
        let least = self.range[0].max(1.0);
        [least, self.range[1].max(least)]
    }

    fn step(&mut self) {
        if !self.is_known || self.target_ms.is_nan() || self.target_ms <= 0.0 {
            return;
        }
        let slowness = libm::exp(self.slowness);
        let mut parts = parts(&self.latest);
        parts[1] = 0.0;
        let left = self.target_ms / slowness - self.model.time(&parts);
        let [least, most] = self.bounds();
        let wanted = (left / self.model.of_part(1) * UNITS[1]).clamp(least, most);
        parts[1] = self.leaves() / UNITS[1];
        let off = (self.model.time(&parts) * slowness / self.target_ms - 1.0).abs();
        self.is_settled = self.readings >= SURE && off < DEAD_BAND[usize::from(!self.is_settled)];
        if std::mem::take(&mut self.has_cut) {
            self.leaves = wanted;
        } else if !self.is_settled {
            let step = libm::log(wanted / self.leaves()).clamp(STEPS[0], STEPS[1]);
            self.leaves = self.leaves() * libm::exp(step);
        }
    }
}

fn parts(load: &Load) -> [f64; PARTS] {
    let Load { leaves, wood_triangles, impostor_px, plants } = *load;
    let amounts = [1.0, leaves, wood_triangles, impostor_px, plants];
    std::array::from_fn(|i| if amounts[i] > 0.0 { amounts[i].min(1e12) / UNITS[i] } else { 0.0 })
}

/// Time by parts, by recursive least squares.
#[derive(Debug, Clone)]
struct Model {
    of_parts: [f64; PARTS],
    covariance: [[f64; PARTS]; PARTS],
}

impl Model {
    fn new() -> Self {
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { UNKNOWN } else { 0.0 }));
        Self { of_parts: PRIOR, covariance }
    }

    /// Milliseconds of a unit of a part, above 0.
    fn of_part(&self, part: usize) -> f64 {
        // No part is free: else any number of leaves might be asked for.
        self.of_parts[part].max(1e-3 * self.of_parts.iter().sum::<f64>()).max(1e-9)
    }

    fn time(&self, parts: &[f64; PARTS]) -> f64 {
        (0..PARTS).map(|part| self.of_part(part) * parts[part]).sum()
    }

    fn scale(&mut self, factor: f64) {
        self.of_parts.iter_mut().for_each(|part| *part *= factor);
        self.covariance.as_flattened_mut().iter_mut().for_each(|entry| *entry *= factor * factor);
    }

    fn learn(&mut self, parts: &[f64; PARTS], ms: f64) {
        let gain: [f64; PARTS] = self.covariance.map(|row| (0..PARTS).map(|i| row[i] * parts[i]).sum());
        let spread = FORGETTING * ms * ms + (0..PARTS).map(|i| gain[i] * parts[i]).sum::<f64>();
        let off = ms - self.time(parts);
        // What does not vary is not forgotten, or it would become any number.
        let most = self.covariance.iter().enumerate().map(|(i, row)| row[i]).fold(0.0, f64::max);
        let forgetting = if most < UNKNOWN * ms * ms { FORGETTING } else { 1.0 };
        for i in 0..PARTS {
            self.of_parts[i] = (self.of_parts[i] + gain[i] * off / spread).max(0.0);
            for j in 0..PARTS {
                self.covariance[i][j] = (self.covariance[i][j] - gain[i] * gain[j] / spread) / forgetting;
            }
        }
    }
}
