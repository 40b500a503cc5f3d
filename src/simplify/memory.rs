//! Estimate of the memory that a simplification takes, computed from the plant's surface area
//! before anything is allocated.
//!
//! A triangle in a random orientation shows half its area on average (Cauchy's surface area
//! formula), so the number of fragments of a view is about half the plant's surface area in square
//! pixels. The estimate also includes a record for each pixel, the data of each leaf and view, and
//! the triangles of the views that are captured at once.
//!
//! Accuracy: the estimate is 1.5 to 2.2 times the measured memory for the English oak and 1.6 to
//! 3.0 times for two downloaded trees, with two threads on Linux, presets paper and balanced, 64 to
//! 512 pixels.
//!
//! Limits: transparent texels count as covering and sky as a record for each pixel, so the estimate
//! is too high for sparse leaf textures and for plants that fill little of their sphere. GPU memory
//! and the plant itself are not included.

use super::{
    options::{Compensate, Criterion, SimplifyOptions},
    views::ViewSet,
};
pub use crate::memory::available_bytes;
use crate::{
    Error, Plant, Result,
    leaf::Vertex,
    memory::{MEGABYTE, limit_mb},
};
use glam::Vec3;

/// Bytes per pixel for its record in the captured views.
const PIXEL_BYTES: f64 = 16.0;
/// Bytes per pixel for its frontmost polygon at full detail, where looks are compared with it, and
/// for its frontmost fragment once more.
const REFERENCE_BYTES: f64 = 12.0;
/// Bytes per fragment: 8 on its stack, the rest for leaves that grow.
const FRAGMENT_BYTES: f64 = 9.0;
/// Bytes per fragment while its view is captured.
const COVERAGE_BYTES: f64 = 16.0;
/// Bytes per triangle: once (measured), and while a view is captured.
const TRIANGLE_BYTES: [f64; 2] = [240.0, 104.0];
/// Bytes per leaf: once, and for every view. Measured.
const LEAF_BYTES: [f64; 2] = [500.0, 40.0];

/// Checks that [`estimated_bytes`] is no more than [`SimplifyOptions::max_memory_mb`] allows.
///
/// # Errors
/// [`Error::TooLarge`], in megabytes, and [`Error::InvalidOption`] as [`estimated_bytes`].
pub fn check(plant: &Plant, options: &SimplifyOptions) -> Result<()> {
    let value = estimated_bytes(plant, options)?.div_ceil(MEGABYTE);
    match limit_mb(options.max_memory_mb) {
        Some(limit) if value > limit => Err(Error::TooLarge {
            what: format!("the memory for {} views of {1} x {1}, in MB,", options.views, options.resolution),
            value,
            limit,
            fix: "lower `resolution` or `views`, or raise `max_memory_mb`".into(),
        }),
        _ => Ok(()),
    }
}

/// Estimates the peak memory of [`simplify`](super::simplify()) in bytes, in addition to the plant
/// itself: up to 3.0 times what was measured. Takes time proportional to the plant's
/// triangles.
///
/// # Errors
/// [`Error::InvalidOption`] if the views or the resolution are outside their ranges.
pub fn estimated_bytes(plant: &Plant, options: &SimplifyOptions) -> Result<u64> {
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let fragments = fragments_of_a_view(plant, &views);
    let threads = match options.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let count = f64::from(options.views);
    let captured = (threads as f64).min(count);
    let triangles = (plant.leaf_triangles() + plant.wood.triangles()) as f64;
    let compares = options.criterion == Criterion::Image
        || matches!(options.compensate, Compensate::Image | Compensate::Silhouette);
    let reference = if compares { REFERENCE_BYTES } else { 0.0 };
    let of_views = count * (views.pixels() as f64 * (PIXEL_BYTES + reference) + fragments * FRAGMENT_BYTES);
    let of_capture = captured * (fragments * COVERAGE_BYTES + triangles * TRIANGLE_BYTES[1]);
    let of_leaves = plant.leaves.len() as f64 * (LEAF_BYTES[0] + count * LEAF_BYTES[1]);
    Ok((of_views + of_capture + of_leaves + triangles * TRIANGLE_BYTES[0]) as u64)
}

/// Half the plant's surface area in square pixels, at the distance of its centre.
fn fragments_of_a_view(plant: &Plant, views: &ViewSet) -> f64 {
    let surface = area(&plant.vertices, &plant.indices) + area(&plant.wood.vertices, &plant.wood.indices);
    let pixels = views.pixels_of_length(1.0);
    0.5 * surface * (pixels * pixels)
}

fn area(vertices: &[Vertex], indices: &[u32]) -> f64 {
    let corner = |index: u32| Vec3::from(vertices[index as usize].position).as_dvec3();
    let triangles = indices.as_chunks::<3>().0.iter().map(|corners| corners.map(corner));
    triangles.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
}
