//! How much memory a simplification takes, told from the plant's surface before anything is allocated.
//!
//! A triangle that looks in any direction shows half its area on average (Cauchy's surface area formula), so half the
//! plant's surface in square pixels is the number of fragments of a view. On top come every pixel's record, what is kept for
//! each leaf and view, and the triangles of the views that are captured at once.
//!
//! Error: told over taken is 0.9 to 1.5 for the embedded species and 0.9 to 1.8 for four trees from elsewhere, with two
//! threads on Linux, presets paper and balanced, 64 to 512 pixels.
//!
//! Limits: transparent texels count as covering, so that sparse leaf pictures are told too high; what the GPU holds is not
//! counted, and neither is the plant itself.

use super::{
    options::{Criterion, SimplifyOptions},
    views::ViewSet,
};
pub use crate::memory::available_bytes;
use crate::{
    Error, Plant, Result,
    leaf::Vertex,
    memory::{MEGABYTE, limit_mb},
};
use glam::Vec3;

/// Bytes of a pixel's record, and of the triangle, as the captured views keep them.
const PIXEL_BYTES: f64 = 32.0;
/// Bytes of a pixel's polygon at full detail, kept when pictures judge.
const REFERENCE_BYTES: f64 = 4.0;
/// Bytes of a fragment: 8 on its stack, the rest for leaves that grow. Measured.
const FRAGMENT_BYTES: f64 = 12.0;
/// Bytes of a fragment while its view is captured.
const COVERAGE_BYTES: f64 = 16.0;
/// Bytes of a triangle: once (measured), and while a view is captured.
const TRIANGLE_BYTES: [f64; 2] = [240.0, 104.0];
/// Bytes that a leaf takes once, and in every view. Measured.
const LEAF_BYTES: [f64; 2] = [500.0, 40.0];

/// Fails when [`estimated_bytes`] are more than [`SimplifyOptions::max_memory_mb`] allows.
///
/// # Errors
/// [`Error::TooLarge`] in megabytes, and [`Error::InvalidOption`].
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

/// Bytes that [`simplify`](super::simplify()) will hold at most at once for a plant, beyond the plant itself; see above for the error.
/// Takes time in proportion to the plant's triangles.
///
/// # Errors
/// [`Error::InvalidOption`] for views or a resolution outside their ranges.
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
    let reference = if options.criterion == Criterion::Image { REFERENCE_BYTES } else { 0.0 };
    let of_views = count * (views.pixels() as f64 * (PIXEL_BYTES + reference) + fragments * FRAGMENT_BYTES);
    let of_capture = captured * (fragments * COVERAGE_BYTES + triangles * TRIANGLE_BYTES[1]);
    let of_leaves = plant.leaves.len() as f64 * (LEAF_BYTES[0] + count * LEAF_BYTES[1]);
    Ok((of_views + of_capture + of_leaves + triangles * TRIANGLE_BYTES[0]) as u64)
}

/// Half the plant's surface in square pixels at its middle's distance.
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
