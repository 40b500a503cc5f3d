//! Capture of the fragments of all views: triangles are projected on the CPU, covered by a
//! rasteriser and sorted by depth.

use super::{
    depth::DepthPlane,
    fragments::{AlphaTest, Coverage, FragmentSource, NO_MASK, ViewTriangles},
    layers::{Layers, NO_WOOD, fronts},
    raster::bounds,
    shapes::Shapes,
    views::ViewSet,
};
use crate::{Error, Result, plant::Tiling};
use rayon::prelude::*;

/// Projected triangles of one view, with their alpha tests, depth planes and rows.
struct Prepared {
    screen: Vec<[[i32; 2]; 3]>,
    alpha: Vec<AlphaTest>,
    /// Empty if no leaf grows by tiling.
    tiling: Vec<Option<Tiling>>,
    depth: Vec<DepthPlane>,
    /// Leaf of each triangle or, for the wood, the row after the background's.
    rows: Vec<u32>,
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

/// What shows of a plant.
pub struct Shown {
    /// For each view, the frontmost polygon of each pixel.
    pub fronts: Vec<Vec<u32>>,
    /// For each view, the depth of the nearest wood in each pixel.
    pub wood_depths: Vec<Vec<u32>>,
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
    let no_wood = |_| vec![NO_WOOD; views.pixels()];
    captured(&Capture { shapes, views, has_wood: true, tiles: false, scale: |_| Some(1.0) }, no_wood, source, advance)
}

/// Same as [`capture`], but each leaf at its own scale, without those for which `scale` returns
/// `None`, by tiling if `tiles` says so, and with the wood that was captured before.
///
/// # Errors
/// Same as [`capture`].
pub fn capture_leaves(
    shapes: &Shapes,
    views: &ViewSet,
    scale: impl Fn(usize) -> Option<f32> + Sync,
    tiles: bool,
    wood_depths: &[Vec<u32>],
    source: &mut dyn FragmentSource,
) -> Result<Captured> {
    let wood = |view: usize| wood_depths[view].clone();
    captured(&Capture { shapes, views, has_wood: false, tiles, scale }, wood, source, |_| true)
}

/// Same as [`capture`], but finds only what shows, with each leaf at its own scale, without those
/// for which `scale` returns `None`, and by tiling if `tiles` says so.
///
/// # Errors
/// Same as [`capture`].
pub fn capture_shown(
    shapes: &Shapes,
    views: &ViewSet,
    scale: impl Fn(usize) -> Option<f32> + Sync,
    tiles: bool,
    source: &mut dyn FragmentSource,
    advance: impl FnMut(u64) -> bool,
) -> Result<Shown> {
    let leaves = shapes.shapes.len() as u32 - 1;
    let capture = Capture { shapes, views, has_wood: true, tiles, scale };
    let fronts = |_: usize, view: &Prepared, coverage: &[Coverage]| {
        let fragment = |entry: &Coverage| (entry.pixel, view.depth(views, *entry), view.rows[entry.triangle as usize]);
        let [fronts, wood_depths] = fronts(views.pixels(), coverage.iter().map(fragment), leaves);
        (fronts, wood_depths, coverage.len() as u64)
    };
    let mut shown = Shown { fronts: Vec::new(), wood_depths: Vec::new(), fragments: 0 };
    for (fronts, wood_depths, fragments) in capture.each_view(source, fronts, advance)? {
        shown.fronts.push(fronts);
        shown.wood_depths.push(wood_depths);
        shown.fragments += fragments;
    }
    Ok(shown)
}

fn captured<S: Fn(usize) -> Option<f32> + Sync>(
    capture: &Capture<'_, S>,
    wood_depth: impl Fn(usize) -> Vec<u32> + Sync,
    source: &mut dyn FragmentSource,
    advance: impl FnMut(u64) -> bool,
) -> Result<Captured> {
    let leaves = capture.shapes.shapes.len() - 1;
    let sort = |at: usize, view: &Prepared, coverage: &[Coverage]| {
        let mut covered = vec![0; leaves];
        let depth = |entry| view.depth(capture.views, entry);
        let row = |triangle: u32| view.rows[triangle as usize];
        let layers = Layers::new(&wood_depth(at), coverage, depth, row, &mut covered);
        (layers, covered, coverage.len() as u64)
    };
    let mut captured = Captured { layers: Vec::new(), covered: vec![0; leaves], fragments: 0 };
    for (layers, covered, fragments) in capture.each_view(source, sort, advance)? {
        captured.layers.push(layers);
        captured.covered.iter_mut().zip(covered).for_each(|(sum, pixels)| *sum += pixels);
        captured.fragments += fragments;
    }
    Ok(captured)
}

/// What is captured.
struct Capture<'a, S> {
    shapes: &'a Shapes,
    views: &'a ViewSet,
    has_wood: bool,
    /// Whether leaves that can grow by tiling do.
    tiles: bool,
    /// Scale of each leaf, or `None` to leave it out.
    scale: S,
}

impl<S: Fn(usize) -> Option<f32> + Sync> Capture<'_, S> {
    /// Returns what `finish` makes of each view's index, triangles and coverage.
    fn each_view<T: Send>(
        &self,
        source: &mut dyn FragmentSource,
        finish: impl Fn(usize, &Prepared, &[Coverage]) -> T + Sync,
        mut advance: impl FnMut(u64) -> bool,
    ) -> Result<Vec<T>> {
        let count = self.views.views.len();
        let batch = rayon::current_num_threads().max(1);
        let mut coverage = vec![Vec::new(); batch];
        let mut finished = Vec::with_capacity(count);
        for first in (0..count).step_by(batch) {
            let last = count.min(first + batch);
            let prepared: Vec<Prepared> = (first..last).into_par_iter().map(|view| self.prepare(view)).collect();
            let resolution = self.views.resolution;
            let triangles: Vec<ViewTriangles<'_>> = prepared.iter().map(|view| view.triangles(resolution)).collect();
            let coverage = &mut coverage[..last - first];
            coverage.iter_mut().for_each(Vec::clear);
            source.capture_batch(&triangles, coverage)?;
            let views = (first..last).into_par_iter().zip(&prepared).zip(&*coverage);
            finished.par_extend(views.map(|((view, prepared), coverage)| finish(view, prepared, coverage)));
            if !advance(last as u64) {
                return Err(Error::Interrupted);
            }
        }
        Ok(finished)
    }

    /// Projects the triangles of one view that may cover a pixel.
    fn prepare(&self, view: usize) -> Prepared {
        let Self { shapes, views, has_wood, tiles, .. } = *self;
        let camera = &views.views[view];
        let wood = shapes.shapes.len() - 1;
        let [of_leaves, of_all] = shapes.shapes[wood].triangles;
        let mut out = Prepared::with_capacity(if has_wood { of_all } else { of_leaves } as usize);
        let mut projected = Vec::new();
        for (index, shape) in shapes.shapes.iter().enumerate() {
            let scale = if index == wood { has_wood.then_some(1.0) } else { (self.scale)(index) };
            let Some(scale) = scale else { continue };
            let row = if index == wood { wood + 1 } else { index };
            shapes.project(views, camera, shape, scale, &mut projected);
            for triangle in shape.triangles[0]..shape.triangles[1] {
                let Some(corners) = shapes.corners(shape, triangle, &projected) else { continue };
                if bounds(views.resolution, corners.map(|p| [p.x, p.y])).is_none() {
                    continue;
                }
                out.screen.push(corners.map(|p| [p.x as i32, p.y as i32]));
                out.alpha.push(shapes.alpha_test(shape, triangle, &corners));
                out.tiling.extend(tiles.then(|| shape.tiling(scale)));
                out.depth.push(shapes.depth_plane(views, camera, shape, triangle, scale));
                out.rows.push(row as u32);
            }
        }
        out
    }
}

/// Rasterises every view without sorting and returns the number of fragments.
///
/// # Errors
/// The errors of the source.
pub fn cover_views(shapes: &Shapes, views: &ViewSet, source: &mut dyn FragmentSource) -> Result<u64> {
    let capture = Capture { shapes, views, has_wood: true, tiles: false, scale: |_| Some(1.0) };
    let mut fragments = 0;
    let mut coverage = Vec::new();
    for view in 0..views.views.len() {
        coverage.clear();
        source.capture(capture.prepare(view).triangles(views.resolution), &mut coverage)?;
        fragments += coverage.len() as u64;
    }
    Ok(fragments)
}

impl Prepared {
    fn with_capacity(triangles: usize) -> Self {
        Self {
            screen: Vec::with_capacity(triangles),
            alpha: Vec::with_capacity(triangles),
            tiling: Vec::new(),
            depth: Vec::with_capacity(triangles),
            rows: Vec::with_capacity(triangles),
        }
    }

    fn triangles(&self, resolution: u32) -> ViewTriangles<'_> {
        debug_assert!(self.alpha.iter().all(|alpha| alpha.mask == NO_MASK || alpha.q.iter().all(|q| q.is_finite())));
        ViewTriangles { resolution, screen: &self.screen, alpha: &self.alpha, tiling: &self.tiling }
    }

    /// Depth of an entry of the view's coverage.
    fn depth(&self, views: &ViewSet, entry: Coverage) -> u32 {
        let (width, pixel) = (i64::from(views.resolution), i64::from(entry.pixel));
        self.depth[entry.triangle as usize].depth(pixel % width, pixel / width)
    }
}
