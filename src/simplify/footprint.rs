//! Pixels that a leaf covers in one view before and after it grows.

use super::{
    depth::DepthPlane,
    fragments::AlphaTest,
    order::PixelOrder,
    raster::{bounds, cover},
    scene::Scene,
    shapes::Shape,
    views::ScreenPoint,
};

/// Depth where a leaf covers nothing; no fragment is that far.
const UNCOVERED: u32 = u32::MAX;

/// A rectangle of pixels that holds a leaf at two scales, with its depths. Reuses its memory.
#[derive(Debug)]
pub struct Footprints {
    order: PixelOrder,
    /// First pixel of the rectangle, as (x, y).
    low: [i64; 2],
    columns: usize,
    /// For each scale, the depth of the leaf's nearest triangle in each pixel or [`UNCOVERED`], row
    /// by row. If the leaf is steady, all depths are 0.
    depths: [Vec<u32>; 2],
    /// Depths of a leaf that has the same ones at any scale.
    steady: Option<DepthPlane>,
    projected: Vec<Option<ScreenPoint>>,
    /// Triangles at the first scale, then those at the second.
    triangles: Vec<(u32, [ScreenPoint; 3])>,
}

/// One leaf in one view.
#[derive(Clone, Copy)]
struct InView<'a> {
    scene: Scene<'a>,
    view: usize,
    shape: &'a Shape,
}

impl<'a> InView<'a> {
    fn new(scene: Scene<'a>, view: usize, leaf: u32) -> Self {
        Self { scene, view, shape: &scene.shapes.shapes[leaf as usize] }
    }

    /// Appends the triangles at a scale.
    fn project(self, scale: f32, projected: &mut Vec<Option<ScreenPoint>>, out: &mut Vec<(u32, [ScreenPoint; 3])>) {
        let Scene { shapes, views, .. } = self.scene;
        shapes.project(views, &views.views[self.view], self.shape, scale, projected);
        let triangles = self.shape.triangles[0]..self.shape.triangles[1];
        out.extend(triangles.filter_map(|at| Some((at, shapes.corners(self.shape, at, projected)?))));
    }

    fn depth_plane(self, triangle: u32, scale: f32) -> DepthPlane {
        let Scene { shapes, views, .. } = self.scene;
        shapes.depth_plane(views, &views.views[self.view], self.shape, triangle, scale)
    }

    fn alpha_test(self, triangle: u32, corners: &[ScreenPoint; 3]) -> AlphaTest {
        self.scene.shapes.alpha_test(self.shape, triangle, corners)
    }
}

fn on_screen(corners: &[ScreenPoint; 3]) -> [[i64; 2]; 3] {
    corners.map(|corner| [corner.x, corner.y])
}

impl Footprints {
    /// Creates footprints in views of `resolution` x `resolution` pixels.
    pub fn new(resolution: u32) -> Self {
        Self {
            order: PixelOrder::new(resolution),
            low: [0; 2],
            columns: 0,
            depths: [Vec::new(), Vec::new()],
            steady: None,
            projected: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Rasterises leaf `leaf` in view `view` at two scales. Returns the number of pixels that it
    /// covers at the second one.
    pub fn rasterise(&mut self, scene: Scene<'_>, view: usize, leaf: u32, scales: [f32; 2]) -> usize {
        let of = InView::new(scene, view, leaf);
        self.triangles.clear();
        of.project(scales[0], &mut self.projected, &mut self.triangles);
        let first = self.triangles.len();
        of.project(scales[1], &mut self.projected, &mut self.triangles);
        self.place(scene.views.resolution);
        let steady = scene.shapes.is_steady(of.shape).then(|| of.depth_plane(of.shape.triangles[0], 1.0));
        self.steady = steady;
        let parts = [&self.triangles[..first], &self.triangles[first..]];
        for ((depths, triangles), scale) in self.depths.iter_mut().zip(parts).zip(scales) {
            let tiling = scene.tiling(of.shape, scale);
            for (triangle, corners) in triangles {
                let alpha = of.alpha_test(*triangle, corners);
                let plane = if steady.is_some() { None } else { Some(of.depth_plane(*triangle, scale)) };
                cover(scene.views.resolution, on_screen(corners), |y, first, last| {
                    let alpha = alpha.row(scene.masks, tiling.as_ref(), y);
                    let row = (y - self.low[1]) as usize * self.columns;
                    let [from, to] = [first, last].map(|x| row + (x - self.low[0]) as usize);
                    for (x, nearest) in (first..).zip(&mut depths[from..=to]) {
                        if alpha.is_none_or(|alpha| alpha.covers(x)) {
                            *nearest = plane.map_or(0, |plane| plane.depth(x, y)).min(*nearest);
                        }
                    }
                });
            }
        }
        self.depths[1].iter().filter(|depth| **depth != UNCOVERED).count()
    }

    /// Makes the rectangle hold all triangles, still uncovered.
    fn place(&mut self, resolution: u32) {
        let of_triangles = self.triangles.iter().filter_map(|(_, corners)| bounds(resolution, on_screen(corners)));
        let joined = of_triangles.reduce(|[low, high], [other_low, other_high]| {
            let each = |join: fn(i64, i64) -> i64, a: [i64; 2], b: [i64; 2]| [join(a[0], b[0]), join(a[1], b[1])];
            [each(i64::min, low, other_low), each(i64::max, high, other_high)]
        });
        let [low, high] = joined.unwrap_or([[0; 2], [-1; 2]]);
        let [columns, rows] = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as usize);
        (self.low, self.columns) = (low, columns);
        for depths in &mut self.depths {
            depths.clear();
            depths.resize(columns * rows, UNCOVERED);
        }
    }

    /// Calls `visit` with the index of each pixel in which the two scales differ, whether the leaf
    /// covers it at the first one, and the depth at the second one.
    pub fn for_each_difference(&self, mut visit: impl FnMut(u32, bool, Option<u32>)) {
        let [old, new] = self.depths.each_ref().map(|depths| depths.chunks_exact(self.columns.max(1)));
        for (y, (old, new)) in (self.low[1]..).zip(old.zip(new)) {
            for (x, (&old, &new)) in (self.low[0]..).zip(old.iter().zip(new)).filter(|(_, (old, new))| old != new) {
                let depth = |depth| self.steady.map_or(depth, |plane| plane.depth(x, y));
                let new = (new != UNCOVERED).then(|| depth(new));
                visit(self.order.index(x as u32, y as u32), old != UNCOVERED, new);
            }
        }
    }

    /// Calls `visit` with the index of each pixel inside the leaf's triangles, ignoring alpha. May
    /// visit a pixel twice.
    pub fn outline(&mut self, scene: Scene<'_>, view: usize, leaf: u32, scale: f32, mut visit: impl FnMut(u32)) {
        self.triangles.clear();
        InView::new(scene, view, leaf).project(scale, &mut self.projected, &mut self.triangles);
        for (_, corners) in &self.triangles {
            cover(scene.views.resolution, on_screen(corners), |y, first, last| {
                (first..=last).for_each(|x| visit(self.order.index(x as u32, y as u32)));
            });
        }
    }
}
