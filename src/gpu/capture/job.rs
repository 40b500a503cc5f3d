//! Jobs: parts of a view that fit the buffers. Triangles that reach beyond the view are left to the
//! CPU.

use super::MAX_FRAGMENTS_PER_JOB;
use crate::{
    Error, Result,
    edge::SUBPIXEL,
    simplify::{
        fragments::{AlphaMask, Coverage, ViewTriangles},
        raster::rasterise,
    },
};
use std::ops::Range;

/// Maximum number of triangles in one job: 72 MiB of corners and alpha tests.
const MAX_TRIANGLES_PER_JOB: usize = 1 << 20;
/// Headroom over the number of fragments estimated from the triangles' areas: a factor, and a
/// constant for jobs with few triangles.
const ROOM_SHARE: f64 = 1.02;
const ROOM_COUNT: f64 = 1024.0;

/// Triangles of one view that are drawn in one pass.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Job {
    /// Index of the view in the batch.
    pub(super) view: usize,
    pub(super) triangles: Range<usize>,
    /// Maximum number of fragments.
    pub(super) capacity: u32,
}

impl Job {
    /// Plans the jobs that together draw each triangle of a view once; none for a view without
    /// pixels.
    pub(super) fn plan(view_index: usize, view: &ViewTriangles<'_>) -> Vec<Self> {
        let mut jobs = Vec::new();
        let (mut first, mut area) = (0, 0.0);
        let count = if view.resolution == 0 { 0 } else { view.screen.len().min(view.alpha.len()) };
        let job = |triangles: Range<usize>, area: f64| Self { view: view_index, triangles, capacity: room_for(area) };
        for (i, corners) in view.screen[..count].iter().enumerate() {
            let own_area = area_px(corners, view);
            let is_full = area + own_area > MAX_FRAGMENTS_PER_JOB as f64 / ROOM_SHARE - ROOM_COUNT;
            if i > first && (is_full || i - first == MAX_TRIANGLES_PER_JOB) {
                jobs.push(job(first..i, area));
                (first, area) = (i, 0.0);
            }
            area += own_area;
        }
        if first < count {
            jobs.push(job(first..count, area));
        }
        jobs
    }

    /// Returns the jobs to run in place of a job that found `found` fragments, more than its
    /// capacity: the same job with that capacity, or its two halves.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if a single triangle covers more than [`MAX_FRAGMENTS_PER_JOB`] pixels.
    pub(super) fn again(self, found: u32) -> Result<Vec<Self>> {
        if found <= MAX_FRAGMENTS_PER_JOB {
            return Ok(vec![Self { capacity: found, ..self }]);
        }
        let Range { start, end } = self.triangles;
        if end - start < 2 {
            return Err(Error::TooLarge {
                what: format!("number of pixels covered by triangle {start}"),
                value: found as u64,
                limit: MAX_FRAGMENTS_PER_JOB as u64,
                fix: "lower `resolution` or use `CpuFragments`".into(),
            });
        }
        let middle = start + (end - start) / 2;
        let half = |triangles| Self { view: self.view, triangles, capacity: MAX_FRAGMENTS_PER_JOB };
        Ok(vec![half(start..middle), half(middle..end)])
    }
}

fn room_for(area_px: f64) -> u32 {
    ((area_px * ROOM_SHARE + ROOM_COUNT) as u32).min(MAX_FRAGMENTS_PER_JOB)
}

/// Area of a triangle in pixels, an estimate of its fragments; 0 if the triangle is left to the
/// CPU.
fn area_px(corners: &[[i32; 2]; 3], view: &ViewTriangles<'_>) -> f64 {
    if !lies_inside(corners, view.resolution) {
        return 0.0;
    }
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let doubled = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    doubled.abs() * 0.5 / (SUBPIXEL * SUBPIXEL) as f64
}

/// Whether the triangle lies within the view, so that no adapter clips it.
fn lies_inside(corners: &[[i32; 2]; 3], resolution: u32) -> bool {
    let first = -SUBPIXEL / 2;
    let last = i64::from(resolution) * SUBPIXEL + first;
    corners.as_flattened().iter().all(|&position| (first..=last).contains(&i64::from(position)))
}

/// Whether the GPU covers a triangle: not if it reaches beyond the view or repeats its texture.
pub(super) fn is_for_gpu(view: &ViewTriangles<'_>, triangle: usize) -> bool {
    lies_inside(&view.screen[triangle], view.resolution) && view.tiling(triangle).is_none()
}

/// Appends the fragments of the other triangles, rasterised by the CPU.
pub(super) fn cover_outside(view: &ViewTriangles<'_>, masks: &[AlphaMask], out: &mut Vec<Coverage>) {
    rasterise(masks, *view, |triangle| !is_for_gpu(view, triangle), out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simplify::fragments::AlphaTest;

    #[test]
    fn jobs_hold_every_triangle_once_and_none_promises_more_than_fits() {
        let whole = [[-128, -128], [2048 * 256 - 128, -128], [-128, 2048 * 256 - 128]];
        let small = [[0, 0], [256, 0], [0, 256]];
        let screen: Vec<_> = (0..40).map(|i| if i % 3 == 0 { whole } else { small }).collect();
        let alpha = vec![AlphaTest::NONE; screen.len()];
        let jobs = Job::plan(0, &ViewTriangles { resolution: 2048, screen: &screen, alpha: &alpha, tiling: &[] });
        assert!(jobs.len() > 10);
        let drawn: Vec<usize> = jobs.iter().flat_map(|job| job.triangles.clone()).collect();
        assert_eq!(drawn, (0..40).collect::<Vec<_>>());
        assert!(jobs.iter().all(|job| job.capacity <= MAX_FRAGMENTS_PER_JOB));
    }

    #[test]
    fn a_job_that_did_not_fit_comes_again_with_room_or_in_halves() {
        let job = Job { view: 3, triangles: 10..13, capacity: 5 };
        assert_eq!(job.clone().again(9).unwrap(), [Job { view: 3, triangles: 10..13, capacity: 9 }]);
        let halves = job.again(u32::MAX).unwrap();
        assert_eq!(halves.iter().map(|half| half.triangles.clone()).collect::<Vec<_>>(), [10..11, 11..13]);
        assert!(halves[0].clone().again(u32::MAX).is_err());
    }
}
