//! Gain of growths in one view: where a leaf would show at another scale, and what it would show
//! instead of.
//!
//! Squares of pixels whose frontmost fragments are all nearer than a triangle of the leaf are
//! skipped. In the others eight depths at a time are compared with the frontmost ones; only pixels
//! that pass take the alpha test.

use super::{
    appearance::ViewLook,
    change::Gain,
    depth::{DepthPlane, StoredDepth},
    enlarge::Growth,
    fragments::AlphaTest,
    layers::Layers,
    occlusion::{Fronts, Occlusion, SIDE},
    raster::{bounds, cover, covers_pixel},
    scene::Scene,
    shapes::Shape,
    views::{ScreenPoint, View},
};
use crate::plant::Tiling;

/// Judges growths, one view at a time. Reuses its memory.
#[derive(Debug)]
pub struct Judge {
    /// For each pixel, the last growth that was found to show there.
    stamps: Vec<u32>,
    stamp: u32,
    /// Tiling of the growth being judged.
    tiling: Option<Tiling>,
    /// Pixels in which the target shows now, as (x, y).
    shown: Vec<[u32; 2]>,
    triangles: Vec<ScreenTriangle>,
    projected: Vec<Option<ScreenPoint>>,
    /// Squares in the current row of squares that do not hide the triangle, from its first column.
    open: Vec<bool>,
}

/// A triangle of a leaf in a view.
#[derive(Debug, Clone, Copy)]
struct ScreenTriangle {
    corners: [[i64; 2]; 3],
    depth: DepthPlane,
    alpha: AlphaTest,
}

/// One view.
#[derive(Clone, Copy)]
pub struct ViewOf<'a> {
    /// What stays constant.
    pub scene: Scene<'a>,
    /// Index of the view.
    pub view: usize,
    /// Its fragments.
    pub layers: &'a Layers,
    /// Its frontmost fragments.
    pub occlusion: &'a Occlusion,
    /// Looks of the polygons in it.
    pub look: ViewLook<'a>,
}

impl ViewOf<'_> {
    fn camera(&self) -> &View {
        &self.scene.views.views[self.view]
    }

    fn shape(&self, leaf: u32) -> &Shape {
        &self.scene.shapes.shapes[leaf as usize]
    }

    fn resolution(&self) -> u32 {
        self.scene.views.resolution
    }

    fn pixel(&self, x: i64, y: i64) -> u32 {
        (y * i64::from(self.resolution()) + x) as u32
    }

    /// Frontmost polygon of a pixel, with its depth.
    fn front(&self, x: i64, y: i64) -> (u32, StoredDepth) {
        let (column, lane) = (x as usize / SIDE, x as usize % SIDE);
        let Fronts { depths, polygons } = self.occlusion.fronts(column, y as usize);
        (polygons[lane], depths[lane])
    }

    /// Gain of a pixel when one polygon replaces another.
    fn gain(&self, pixel: u32, before: u32, after: u32) -> Gain {
        self.look.gain(before, after, self.layers.reference(pixel))
    }
}

impl Judge {
    /// Creates a judge for views of `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self {
            stamps: vec![0; pixels],
            stamp: 0,
            tiling: None,
            shown: Vec::new(),
            triangles: Vec::new(),
            projected: Vec::new(),
            open: Vec::new(),
        }
    }

    /// Writes the gain of each growth to `gains`.
    pub fn judge(&mut self, on: ViewOf<'_>, growths: &[Growth], gains: &mut [Gain]) {
        let mut listed = None;
        for (&growth, gain) in growths.iter().zip(gains) {
            if growth.from == growth.to {
                continue;
            }
            if listed.replace(growth.target) != Some(growth.target) {
                self.list_shown(on, growth);
            }
            *gain = self.gain(on, growth);
        }
    }

    /// Begins a new set of stamped pixels.
    fn begin_stamping(&mut self) {
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.stamps.fill(0);
            self.stamp = 1;
        }
    }

    /// Stamps a pixel. Returns whether it was not stamped yet.
    fn stamps_first(stamps: &mut [u32], stamp: u32, pixel: u32) -> bool {
        std::mem::replace(&mut stamps[pixel as usize], stamp) != stamp
    }

    /// Lists the pixels in which the target shows now.
    fn list_shown(&mut self, on: ViewOf<'_>, Growth { target, from, .. }: Growth) {
        self.shown.clear();
        if on.layers.seen(target)[0] == 0 {
            return;
        }
        self.begin_stamping();
        let (shapes, shape) = (on.scene.shapes, on.shape(target));
        shapes.project(on.scene.views, on.camera(), shape, from, &mut self.projected);
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &self.projected) else { continue };
            cover(on.resolution(), corners.map(|corner| [corner.x, corner.y]), |y, first, last| {
                for x in (first..=last).filter(|&x| on.front(x, y).0 == target) {
                    if Self::stamps_first(&mut self.stamps, self.stamp, on.pixel(x, y)) {
                        self.shown.push([x as u32, y as u32]);
                    }
                }
            });
        }
    }

    /// Gain of a growth whose target's shown pixels are listed.
    fn gain(&mut self, on: ViewOf<'_>, Growth { target, to, .. }: Growth) -> Gain {
        self.begin_stamping();
        self.triangles.clear();
        let (shapes, views, shape) = (on.scene.shapes, on.scene.views, on.shape(target));
        shapes.project(views, on.camera(), shape, to, &mut self.projected);
        self.tiling = on.scene.tiling(shape, to);
        let mut gain = Gain::default();
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &self.projected) else { continue };
            let depth = shapes.depth_plane(views, on.camera(), shape, triangle, to);
            let on_screen = corners.map(|corner| [corner.x, corner.y]);
            let is_open = self.find_open(on, on_screen, &depth);
            if is_open || !self.shown.is_empty() {
                let alpha = shapes.alpha_test(shape, triangle, &corners);
                let triangle = ScreenTriangle { corners: on_screen, depth, alpha };
                if is_open {
                    gain = gain.plus(self.newly_shown(on, target, &triangle));
                }
                self.triangles.push(triangle);
            }
        }
        gain.plus(self.no_longer_shown(on, target))
    }

    /// Finds the squares of the triangle's bounds that do not hide it. Returns false if all do.
    fn find_open(&mut self, on: ViewOf<'_>, corners: [[i64; 2]; 3], depth: &DepthPlane) -> bool {
        self.open.clear();
        let Some([low, high]) = bounds(on.resolution(), corners) else { return false };
        let side = SIDE as i64;
        let mut is_any_open = false;
        for row in low[1] / side..=high[1] / side {
            for column in low[0] / side..=high[0] / side {
                let square = [column, row];
                let first = [0, 1].map(|axis| low[axis].max(square[axis] * side));
                let last = [0, 1].map(|axis| high[axis].min(square[axis] * side + side - 1));
                let is_open = !on.occlusion.hides(square.map(|at| at as usize), depth.nearest(first, last));
                self.open.push(is_open);
                is_any_open |= is_open;
            }
        }
        is_any_open
    }

    /// Gain of the pixels in which a triangle shows and the target does not show yet.
    fn newly_shown(&mut self, on: ViewOf<'_>, target: u32, triangle: &ScreenTriangle) -> Gain {
        let Self { stamps, stamp, open, tiling, .. } = self;
        let &ScreenTriangle { corners, depth, alpha } = triangle;
        let Some([low, high]) = bounds(on.resolution(), corners) else { return Gain::default() };
        let side = SIDE as i64;
        let columns = high[0] / side - low[0] / side + 1;
        let mut gain = Gain::default();
        cover(on.resolution(), corners, |y, first, last| {
            let alpha = alpha.row(on.scene.masks, tiling.as_ref(), y);
            let open = &open[((y / side - low[1] / side) * columns) as usize..];
            for column in (first / side..=last / side).filter(|column| open[(column - low[0] / side) as usize]) {
                let left = column * side;
                let span = (2_u32 << (last - left).min(side - 1)) - (1 << (first - left).max(0));
                let Fronts { depths, polygons } = on.occlusion.fronts(column as usize, y as usize);
                let [nearer, as_near] = depth.nearer(left, y, depths);
                let mut passed = as_near & span;
                while passed != 0 {
                    let bit = passed.trailing_zeros();
                    passed &= passed - 1;
                    let x = left + i64::from(bit);
                    let front = polygons[bit as usize];
                    // Of equally near leaves the one with the lower index is in front.
                    let is_behind = target > front && nearer >> bit & 1 == 0;
                    if front == target || is_behind || alpha.is_some_and(|alpha| !alpha.covers(x)) {
                        continue;
                    }
                    let pixel = on.pixel(x, y);
                    if Self::stamps_first(stamps, *stamp, pixel) {
                        gain = gain.plus(on.gain(pixel, front, target));
                    }
                }
            }
        });
        gain
    }

    /// Gain of the pixels in which the target shows now and will not show any more.
    fn no_longer_shown(&self, on: ViewOf<'_>, target: u32) -> Gain {
        let mut gain = Gain::default();
        for [x, y] in self.shown.iter().map(|at| at.map(i64::from)) {
            let pixel = on.pixel(x, y);
            let stays_front =
                |depth: u32| StoredDepth::new(depth) <= on.front(x, y).1 || on.layers.stays_front(pixel, depth, target);
            let shows = self.triangles.iter().any(|triangle| {
                covers_pixel(triangle.corners, x, y)
                    && stays_front(triangle.depth.depth(x, y))
                    && triangle.alpha.row(on.scene.masks, self.tiling.as_ref(), y).is_none_or(|alpha| alpha.covers(x))
            });
            if !shows {
                gain = gain.plus(on.gain(pixel, target, on.layers.second(pixel)));
            }
        }
        gain
    }
}
