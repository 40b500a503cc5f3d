//! Gain of growths in one view: where a leaf would show at another scale, and what it would show
//! instead of.
//!
//! Leaves of which no square of pixels shows anything are found from a sphere around them, without
//! projecting their corners. Squares whose frontmost fragments are all nearer than a triangle are
//! skipped. In the others eight depths at a time are compared with the frontmost ones; only pixels
//! that pass take the alpha test.

use super::{
    appearance::ViewLook,
    areas::set_bits,
    change::Gain,
    depth::{DepthPlane, StoredDepth},
    enlarge::Growth,
    fragments::AlphaTest,
    layers::Layers,
    occlusion::{Fronts, Occlusion, SIDE},
    order::PixelOrder,
    raster::{Area, Bounds, bounds, cover},
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
    /// Planes of the leaf at the scale being judged, where they are known.
    planes: Vec<Option<DepthPlane>>,
    projected: Vec<Option<ScreenPoint>>,
    /// Squares that do not hide the current triangle, as (column, row).
    open: Vec<[i64; 2]>,
    /// First and last pixel of the current triangle in each row.
    spans: Vec<[i64; 2]>,
}

/// A triangle of a leaf in a view.
#[derive(Debug, Clone, Copy)]
struct ScreenTriangle {
    area: Area,
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
        PixelOrder::new(self.resolution()).index(x as u32, y as u32)
    }

    /// Frontmost polygon of a pixel, with its depth.
    fn front(&self, x: i64, y: i64) -> (u32, StoredDepth) {
        let (column, lane) = (x as usize / SIDE, x as usize % SIDE);
        let Fronts { depths, polygons } = self.occlusion.fronts(column, y as usize);
        (polygons[lane], depths[lane])
    }

    /// Calls `visit` with each square, as (column, row), of a rectangle of pixels that does not
    /// hide a plane, until it returns false. Returns whether it never did.
    fn each_open(&self, [low, high]: Bounds, depth: &DepthPlane, mut visit: impl FnMut([i64; 2]) -> bool) -> bool {
        let side = SIDE as i64;
        if low[0] > high[0] || low[1] > high[1] {
            return true;
        }
        for row in low[1] / side..=high[1] / side {
            let [top, bottom] = [low[1].max(row * side), high[1].min(row * side + side - 1)];
            for column in low[0] / side..=high[0] / side {
                let [left, right] = [low[0].max(column * side), high[0].min(column * side + side - 1)];
                let nearest = depth.nearest([left, top], [right, bottom]);
                if !self.occlusion.hides([column, row].map(|at| at as usize), nearest) && !visit([column, row]) {
                    return false;
                }
            }
        }
        true
    }

    /// Gain of a pixel when one polygon replaces another.
    fn gain(&self, pixel: u32, before: u32, after: u32) -> Gain {
        self.look.gain(before, after, self.layers.reference(pixel))
    }
}

/// Those of pixels `first..=last` of a row that lie in a column of squares, one bit for each.
fn lanes(column: i64, first: i64, last: i64) -> u32 {
    let side = SIDE as i64;
    let [first, end] = [first, last + 1].map(|x| (x - column * side).clamp(0, side));
    (1 << end) - (1 << first)
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
            planes: Vec::new(),
            projected: Vec::new(),
            open: Vec::new(),
            spans: Vec::new(),
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
                let side = SIDE as i64;
                for column in first / side..=last / side {
                    let fronts = on.occlusion.fronts(column as usize, y as usize);
                    for lane in set_bits(fronts.lanes_of(target) & lanes(column, first, last)) {
                        let x = column * side + lane as i64;
                        if Self::stamps_first(&mut self.stamps, self.stamp, on.pixel(x, y)) {
                            self.shown.push([x as u32, y as u32]);
                        }
                    }
                }
            });
        }
    }

    /// Gain of a growth whose target's shown pixels are listed.
    fn gain(&mut self, on: ViewOf<'_>, Growth { target, to, .. }: Growth) -> Gain {
        self.begin_stamping();
        self.triangles.clear();
        self.planes.clear();
        let (shapes, views, shape) = (on.scene.shapes, on.scene.views, on.shape(target));
        if self.shown.is_empty() && self.is_hidden(on, shape, to) {
            return Gain::default();
        }
        shapes.project(views, on.camera(), shape, to, &mut self.projected);
        self.tiling = on.scene.tiling(shape, to);
        let mut gain = Gain::default();
        for triangle in shape.triangles[0]..shape.triangles[1] {
            let Some(corners) = shapes.corners(shape, triangle, &self.projected) else { continue };
            let on_screen = corners.map(|corner| [corner.x, corner.y]);
            let Some(bounds) = bounds(on.resolution(), on_screen) else { continue };
            let depth = self.depth_plane(on, shape, triangle, to);
            self.open.clear();
            on.each_open(bounds, &depth, |square| {
                self.open.push(square);
                true
            });
            if !self.open.is_empty() || !self.shown.is_empty() {
                let Some(area) = Area::new(bounds, on_screen) else { continue };
                let alpha = shapes.alpha_test(shape, triangle, &corners);
                let triangle = ScreenTriangle { area, depth, alpha };
                gain = gain.plus(self.newly_shown(on, target, &triangle));
                self.triangles.push(triangle);
            }
        }
        gain.plus(self.no_longer_shown(on, target))
    }

    /// Depth plane of a triangle of the leaf at the scale being judged.
    fn depth_plane(&mut self, on: ViewOf<'_>, shape: &Shape, triangle: u32, scale: f32) -> DepthPlane {
        let Scene { shapes, views, .. } = on.scene;
        let place = shapes.plane(triangle) - shapes.plane(shape.triangles[0]);
        if self.planes.len() <= place as usize {
            self.planes.resize(place as usize + 1, None);
        }
        let new = || shapes.depth_plane(views, on.camera(), shape, triangle, scale);
        *self.planes[place as usize].get_or_insert_with(new)
    }

    /// Whether the squares around a leaf are known to hide it at a scale.
    fn is_hidden(&mut self, on: ViewOf<'_>, shape: &Shape, scale: f32) -> bool {
        let Scene { shapes, views, .. } = on.scene;
        let Some(around) = shapes.around(views, on.camera(), shape, scale) else { return false };
        let mut tested = None;
        (shape.triangles[0]..shape.triangles[1]).all(|triangle| {
            let is_tested = tested.replace(shapes.plane(triangle)) == Some(shapes.plane(triangle));
            is_tested || on.each_open(around, &self.depth_plane(on, shape, triangle, scale), |_| false)
        })
    }

    /// Gain of the pixels in open squares in which a triangle shows and the target does not show
    /// yet.
    fn newly_shown(&mut self, on: ViewOf<'_>, target: u32, triangle: &ScreenTriangle) -> Gain {
        let Self { stamps, stamp, open, spans, tiling, .. } = self;
        let &ScreenTriangle { area, depth, alpha } = triangle;
        let mut gain = Gain::default();
        let [Some([_, top]), Some([_, bottom])] = [open.first(), open.last()] else { return gain };
        let side = SIDE as i64;
        let [low, high] = area.bounds;
        let [top, bottom] = [low[1].max(top * side), high[1].min(bottom * side + side - 1)];
        spans.clear();
        spans.resize((bottom - top + 1) as usize, [0, -1]);
        area.cover([[low[0], top], [high[0], bottom]], |y, first, last| spans[(y - top) as usize] = [first, last]);
        for &[column, row] in &*open {
            let [left, above] = [column, row].map(|at| at * side);
            let (mut nearer, mut as_near) = (0_u64, 0_u64);
            for y in above.max(top)..=(above + side - 1).min(bottom) {
                let [first, last] = spans[(y - top) as usize];
                let lanes = lanes(column, first, last);
                if lanes != 0 {
                    let fronts = on.occlusion.fronts(column as usize, y as usize);
                    let of_row = depth.nearer(left, y, &fronts.depths);
                    nearer |= u64::from(of_row[0] & lanes) << ((y - above) * side);
                    as_near |= u64::from(of_row[1] & lanes) << ((y - above) * side);
                }
            }
            for bit in set_bits(as_near) {
                let (lane, y) = (bit % SIDE, above + (bit / SIDE) as i64);
                let (x, front) = (left + lane as i64, on.occlusion.fronts(column as usize, y as usize).polygons[lane]);
                // Of equally near leaves the one with the lower index is in front.
                let is_behind = target > front && nearer >> bit & 1 == 0;
                let is_clear = || alpha.row(on.scene.masks, tiling.as_ref(), y).is_some_and(|alpha| !alpha.covers(x));
                if front == target || is_behind || is_clear() {
                    continue;
                }
                let pixel = on.pixel(x, y);
                if Self::stamps_first(stamps, *stamp, pixel) {
                    gain = gain.plus(on.gain(pixel, front, target));
                }
            }
        }
        gain
    }

    /// Gain of the pixels in which the target shows now and will not show any more.
    fn no_longer_shown(&self, on: ViewOf<'_>, target: u32) -> Gain {
        let mut gain = Gain::default();
        for [x, y] in self.shown.iter().map(|at| at.map(i64::from)) {
            let pixel = on.pixel(x, y);
            let stays_front = |depth: u32| {
                StoredDepth::new(depth) <= on.front(x, y).1 || on.layers.is_before(pixel, 1, depth, target)
            };
            let shows = self.triangles.iter().any(|triangle| {
                triangle.area.covers(x, y)
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
