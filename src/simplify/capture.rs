//! Capture of the fragments of all views: triangles are projected on the CPU, covered by a
//! rasteriser and sorted by depth.

use super::{
    depth::DepthPlane,
    fragments::{AlphaTest, Coverage, FragmentSource, NO_MASK, ViewTriangles},
    layers::Layers,
    shapes::Shapes,
    views::ViewSet,
};
use crate::{Error, Result};
use rayon::prelude::*;

/// Projected triangles of one view, with their alpha tests and depth planes.
struct Prepared {
    screen: Vec<[[i32; 2]; 3]>,
    alpha: Vec<AlphaTest>,
    depth: Vec<DepthPlane>,
}

/// Captured views of a plant.
pub struct Captured {
    /// One per view.
    pub layers: Vec<Layers>,
    /// For each leaf, the number of pixels over all views that it covers, visible or not.
    pub covered: Vec<u32>,
    /// Number of fragments in all views: each leaf counts once per pixel and triangle.
    pub fragments: u64,
}

/// Captures every view of `shapes` through `source`, with every leaf at scale 1. `advance` receives
/// the number of views done and returns whether to continue.
///
/// # Errors
/// The errors of the source; [`Error::Interrupted`] if `advance` returns false.
pub fn capture(
    shapes: &Shapes,
    views: &ViewSet,
    source: &mut dyn FragmentSource,
    advance: impl FnMut(u64) -> bool,
) -> Result<Captured> {
    capture_at(shapes, views, |_| Some(1.0), source, advance)
}

/// Same as [`capture`], but with each leaf at its own scale. Leaves for which `scale` returns
/// `None` are left out.
///
/// # Errors
/// Same as [`capture`].
pub fn capture_at(
    shapes: &Shapes,
    views: &ViewSet,
    scale: impl Fn(usize) -> Option<f32> + Sync,
    source: &mut dyn FragmentSource,
    mut advance: impl FnMut(u64) -> bool,
) -> Result<Captured> {
    let leaves = shapes.shapes.len() - 1;
    let owners = owners(shapes);
    let batch = rayon::current_num_threads().max(1);
    let mut coverage = vec![Vec::new(); batch];
    let mut captured =
        Captured { layers: Vec::with_capacity(views.views.len()), covered: vec![0; leaves], fragments: 0 };
    for first in (0..views.views.len()).step_by(batch) {
        let last = views.views.len().min(first + batch);
        let prepare = |view| prepare(shapes, views, view, &scale);
        let prepared: Vec<Prepared> = (first..last).into_par_iter().map(prepare).collect();
        let triangles: Vec<ViewTriangles<'_>> = prepared.iter().map(|view| view.triangles(views.resolution)).collect();
        let coverage = &mut coverage[..last - first];
        coverage.iter_mut().for_each(Vec::clear);
        source.capture_batch(&triangles, coverage)?;
        let sorted = prepared.par_iter().zip(&*coverage).map(|(view, coverage)| {
            let width = i64::from(views.resolution);
            let depth = |entry: Coverage| {
                let pixel = i64::from(entry.pixel);
                view.depth[entry.triangle as usize].depth(pixel % width, pixel / width)
            };
            let mut covered = vec![0; leaves];
            (Layers::new(views.pixels(), coverage, depth, |triangle| owners[triangle as usize], &mut covered), covered)
        });
        for (layers, covered) in sorted.collect::<Vec<_>>() {
            captured.layers.push(layers);
            captured.covered.iter_mut().zip(covered).for_each(|(sum, pixels)| *sum += pixels);
        }
        captured.fragments += coverage.iter().map(|view| view.len() as u64).sum::<u64>();
        if !advance(last as u64) {
            return Err(Error::Interrupted);
        }
    }
    Ok(captured)
}

/// Rasterises every view without sorting and returns the number of fragments.
///
/// # Errors
/// The errors of the source.
pub fn cover_views(shapes: &Shapes, views: &ViewSet, source: &mut dyn FragmentSource) -> Result<u64> {
    let mut fragments = 0;
    let mut coverage = Vec::new();
    for view in 0..views.views.len() {
        coverage.clear();
        source.capture(prepare(shapes, views, view, &|_| Some(1.0)).triangles(views.resolution), &mut coverage)?;
        fragments += coverage.len() as u64;
    }
    Ok(fragments)
}

/// Row of each triangle: its leaf or, for the wood, the row after the background's.
fn owners(shapes: &Shapes) -> Vec<u32> {
    let leaves = shapes.shapes.len() - 1;
    let mut owners = Vec::with_capacity(shapes.triangles.len());
    for (index, shape) in shapes.shapes.iter().enumerate() {
        let row = if index == leaves { leaves + 1 } else { index };
        owners.resize(shape.triangles[1] as usize, row as u32);
    }
    owners
}

/// Projects the triangles of one view. Triangles of leaves without a scale become degenerate; the
/// wood is always included.
fn prepare(shapes: &Shapes, views: &ViewSet, view: usize, scale: &impl Fn(usize) -> Option<f32>) -> Prepared {
    let camera = &views.views[view];
    let count = shapes.triangles.len();
    let mut out = Prepared {
        screen: Vec::with_capacity(count),
        alpha: Vec::with_capacity(count),
        depth: Vec::with_capacity(count),
    };
    let mut projected = Vec::new();
    let wood = shapes.shapes.len() - 1;
    for (index, shape) in shapes.shapes.iter().enumerate() {
        let scale = if index == wood { Some(1.0) } else { scale(index) };
        shapes.project(views, camera, shape, scale.unwrap_or(1.0), &mut projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let corners = scale.and_then(|_| shapes.corners(shape, triangle, &projected));
            out.screen.push(corners.map_or([[0; 2]; 3], |corners| corners.map(|p| [p.x as i32, p.y as i32])));
            out.alpha.push(corners.map_or(AlphaTest::NONE, |corners| shapes.alpha_test(shape, triangle, &corners)));
            out.depth.push(shapes.depth_plane(views, camera, shape, triangle, scale.unwrap_or(1.0)));
        }
    }
    out
}

impl Prepared {
    fn triangles(&self, resolution: u32) -> ViewTriangles<'_> {
        debug_assert!(self.alpha.iter().all(|alpha| alpha.mask == NO_MASK || alpha.q.iter().all(|q| q.is_finite())));
        ViewTriangles { resolution, screen: &self.screen, alpha: &self.alpha }
    }
}
