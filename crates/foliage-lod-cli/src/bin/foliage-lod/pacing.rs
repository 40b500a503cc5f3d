//! Finds the leaves that a picture of a scene has time for.

use crate::{
    args::{self, Raster},
    drawing::Drawer,
    failure::{Failure, complain},
    interrupt,
    output::Steps,
    progress::spinning,
    raster::open,
    scene::Opened,
};
use foliage_lod::{
    Error, Result,
    gpu::{FrameTimer, GpuDevice, guarded},
    scene::budget::{Pace, Spent, Times},
};
use indicatif::HumanCount;
use std::time::{Duration, Instant};

/// Frames after which the leaves are taken as they are.
const MOST_FRAMES: u64 = 300;
/// Time after which they are.
const LONGEST: Duration = Duration::from_secs(60);
/// First frames, whose leaves go to where they are expected to at once.
const FREE: u64 = 12;
/// Frames over which leaves must have stayed within [`STEADY`] of each other; their median time is
/// told.
const JUDGED: usize = 12;
/// See [`JUDGED`].
const STEADY: f64 = 0.02;
/// Part by which a time may be missed without a word.
const NEAR: f64 = 0.1;

/// A budget of time, and what it came to.
pub struct Settled {
    /// Time asked for, in milliseconds.
    pub asked_ms: f64,
    /// Median time of the last frames.
    pub ms: f64,
    /// What has drawn them.
    pub drawer: Drawer,
}

/// Draws frames of the scene until they take so many milliseconds: by the GPU's own time where it
/// tells it, else from the first command to the finished picture. The scene keeps the leaves.
///
/// # Errors
/// [`Error::InvalidOption`] with the CPU's drawer; [`Error::Gpu`] without an adapter or if it
/// fails.
pub fn settle(
    args: &args::Render,
    opened: &mut Opened,
    asked_ms: f64,
    steps: &mut Steps,
) -> std::result::Result<Settled, Failure> {
    if args.raster == Raster::Cpu {
        let allowed = "leaves=N or triangles=N: frames are timed on the GPU alone";
        return Err(Error::invalid("the budget", "in milliseconds, with --raster cpu", allowed).into());
    }
    let gpu = open().map_err(|error| match error {
        Error::Gpu { reason, .. } => {
            let fix = "install a Vulkan driver (software: Mesa's lavapipe), or use --budget leaves=N".into();
            Error::Gpu { reason: format!("a budget of milliseconds times frames: {reason}"), fix }
        }
        other => other,
    })?;
    let name = gpu.adapter_name();
    let found = spinning("timing frames", || guarded(|| frames(gpu, args, opened, asked_ms)))?;
    let Frames { drawer, count, leaves, ms, is_all, is_gpu_time } = found;
    let whose = if is_gpu_time { "of the GPU" } else { "a frame" };
    let of = format!("{} leaves: {ms:.1} ms {whose} after {count} frames on {name}", HumanCount(leaves as u64));
    steps.done("time", of)?;
    let is_short = ms < (1.0 - NEAR) * asked_ms && !is_all;
    if ms > (1.0 + NEAR) * asked_ms || is_short {
        let what = if leaves < 2.0 {
            "wood, ground and effects alone take that long: ask for more, or leave effects out"
        } else {
            "the times did not settle: try again while nothing else runs, or draw a smaller picture"
        };
        complain(format_args!("warning: frames take {ms:.1} ms instead of {asked_ms}, since {what}"));
    } else if is_all {
        steps.done("time", "enough for all leaves")?;
    }
    Ok(Settled { asked_ms, ms, drawer })
}

/// What was found.
struct Frames {
    drawer: Drawer,
    count: u64,
    leaves: f64,
    ms: f64,
    /// Whether there was time for all leaves.
    is_all: bool,
    is_gpu_time: bool,
}

fn frames(gpu: GpuDevice, args: &args::Render, opened: &mut Opened, asked_ms: f64) -> Result<Frames> {
    let mut timer = FrameTimer::new(gpu.device(), gpu.queue());
    let mut is_gpu_time = false;
    let mut drawer = Drawer::new(gpu, &opened.staging(args.seconds, args.size, false)?, args.size)?;
    let mut pace = Pace::new(asked_ms, opened.shared().map_or(0.0, |shared| shared.amount));
    let (mut times, mut counts) = (Vec::new(), Vec::new());
    let (started, mut count, mut is_all) = (Instant::now(), 0, false);
    while count < MOST_FRAMES && started.elapsed() < LONGEST {
        interrupt::check()?;
        let leaves = pace.leaves();
        opened.shared().into_iter().for_each(|shared| shared.amount = leaves);
        let staging = opened.staging(args.seconds, args.size, false)?;
        let begun = Instant::now();
        let prepared = drawer.prepare(&staging)?;
        is_all = matches!(staging.budget, Some((Spent { mu, .. }, _)) if mu == 0.0);
        drawer.draw(timer.as_mut(), count)?;
        let frame_ms = 1e3 * begun.elapsed().as_secs_f64();
        let load = opened.shared().map(|shared| shared.load(prepared.wood_triangles)).unwrap_or_default();
        if count < FREE {
            pace.cut();
        }
        pace.drew(count, load);
        // Drawing waits, so the time is known; a driver may tell 0.
        let gpu_ms = timer.as_mut().and_then(|timer| Some(timer.read().last()?.1)).filter(|&ms| ms > 0.0);
        is_gpu_time = gpu_ms.is_some();
        pace.took(count, Times { frame_ms, gpu_ms, cpu_ms: None });
        times.push(gpu_ms.unwrap_or(frame_ms));
        counts.push(leaves);
        count += 1;
        let last = &counts[counts.len().saturating_sub(JUDGED)..];
        let [least, most] = [f64::min, f64::max].map(|of| last.iter().copied().reduce(of).unwrap_or_default());
        let is_steady = most <= (1.0 + STEADY) * least || is_all && least > 0.5 * most;
        if last.len() == JUDGED && is_steady {
            break;
        }
    }
    let leaves = pace.leaves();
    let last = times.len().saturating_sub(JUDGED);
    times[last..].sort_by(f64::total_cmp);
    let ms = times.get(last + (times.len() - last) / 2).copied().unwrap_or(f64::NAN);
    Ok(Frames { drawer, count, leaves, ms, is_all, is_gpu_time })
}
