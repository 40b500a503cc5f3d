//! Triangle coverage: [edge functions](crate::edge), sampled at pixel centres.
//!
//! Positions are already snapped to 1/256 pixel, so the covered pixels are those of a GPU with the
//! same snapped positions. The spans of wide rows are solved from the edge functions instead of
//! testing pixel by pixel.

use super::fragments::{AlphaMask, AlphaTest, Coverage, FragmentSource, NO_MASK, ViewTriangles};
use crate::{
    Result,
    edge::{Edge, SUBPIXEL, twice_area},
    material::Wrap,
    plant::Tiling,
};
use rayon::prelude::*;
use wide::i32x8;

/// Calls `row(y, first, last)` for every row in which the triangle covers pixels `first..=last` of
/// an image of `resolution` x `resolution` pixels. `corners` are (x, y) in 1/256 pixel from the
/// centre of pixel (0, 0), in either winding order.
///
/// A triangle without area covers nothing.
pub fn cover(resolution: u32, corners: [[i64; 2]; 3], row: impl FnMut(i64, i64, i64)) {
    let area = bounds(resolution, corners).and_then(|bounds| Area::new(bounds, corners));
    if let Some(area) = area {
        area.cover(area.bounds, row);
    }
}

/// First and last pixel of a rectangle, as (x, y).
pub type Bounds = [[i64; 2]; 2];

/// A triangle's area on the screen.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// The triangle lies inside all of them.
    edges: [Edge; 3],
    is_narrow: bool,
    /// Rectangle that holds all pixel centres in the triangle.
    pub bounds: Bounds,
}

impl Area {
    /// Creates the area of a triangle as [`cover`] takes it, with its [`bounds`]; `None` if it has
    /// none.
    pub fn new(bounds: Bounds, corners: [[i64; 2]; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let twice_area = twice_area(a, b, c);
        let [b, c] = if twice_area < 0 { [c, b] } else { [b, c] };
        let [width, height] = [0, 1].map(|axis| {
            let at = corners.map(|corner| corner[axis]);
            at[0].max(at[1]).max(at[2]) - at[0].min(at[1]).min(at[2])
        });
        (twice_area != 0).then(|| Self {
            edges: [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)],
            is_narrow: width < LANES * SUBPIXEL && height < MAX_LANE_ROWS * SUBPIXEL,
            bounds,
        })
    }

    /// Calls `row(y, first, last)` for every row of a rectangle, itself within the bounds, in which
    /// the triangle covers pixels `first..=last`.
    pub fn cover(&self, [low, high]: Bounds, mut row: impl FnMut(i64, i64, i64)) {
        if self.is_narrow {
            cover_narrow(&self.edges, low, high, row);
        } else {
            for y in low[1]..=high[1] {
                if let Some((first, last)) = solve(&self.edges, y, low[0], high[0]) {
                    row(y, first, last);
                }
            }
        }
    }

    /// Whether the triangle covers pixel (x, y).
    pub fn covers(&self, x: i64, y: i64) -> bool {
        self.edges.iter().all(|edge| edge.at(x, y) >= 0)
    }
}

/// First and last pixel, as (x, y), of the smallest rectangle that holds all pixel centres within a
/// triangle's bounds; `None` if there are none in the view.
pub fn bounds(resolution: u32, [a, b, c]: [[i64; 2]; 3]) -> Option<Bounds> {
    let last_pixel = i64::from(resolution) - 1;
    let low = [0, 1].map(|axis| ceil_pixel(a[axis].min(b[axis]).min(c[axis])).max(0));
    let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]).div_euclid(SUBPIXEL).min(last_pixel));
    (low[0] <= high[0] && low[1] <= high[1]).then_some([low, high])
}

/// Width of triangles whose rows are tested all pixels at once, which costs less than the divisions
/// needed to solve a row.
const LANES: i64 = 8;
/// Height of such triangles in pixels, which keeps their edge functions within `i32`.
const MAX_LANE_ROWS: i64 = 64;

/// Finds the covered pixels of each row of a triangle less than [`LANES`] wide and
/// [`MAX_LANE_ROWS`] high.
fn cover_narrow(
    edges: &[Edge; 3],
    [left, top]: [i64; 2],
    [right, bottom]: [i64; 2],
    mut row: impl FnMut(i64, i64, i64),
) {
    let mut values = edges.each_ref().map(|edge| {
        let (first, step) = (edge.at(left, top) as i32, edge.per_px[0] as i32);
        i32x8::new(std::array::from_fn(|x| first + step * x as i32))
    });
    let steps = edges.each_ref().map(|edge| i32x8::splat(edge.per_px[1] as i32));
    let within = (1 << (right - left + 1)) - 1;
    for y in top..=bottom {
        let outside = (values[0] | values[1] | values[2]).move_mask();
        let inside = !outside & within;
        if inside != 0 {
            row(y, left + i64::from(inside.trailing_zeros()), left + i64::from(inside.ilog2()));
        }
        (0..3).for_each(|i| values[i] += steps[i]);
    }
}

/// Finds the covered pixels of a row from the sign changes of the edge functions.
fn solve(edges: &[Edge; 3], y: i64, left: i64, right: i64) -> Option<(i64, i64)> {
    let (mut first, mut last) = (left, right);
    for edge in edges {
        narrow(edge, y, &mut first, &mut last);
    }
    (first <= last).then_some((first, last))
}

/// First whole pixel at or to the right of (below) a position.
fn ceil_pixel(position: i64) -> i64 {
    (position + SUBPIXEL - 1).div_euclid(SUBPIXEL)
}

/// Clips `first..=last` of row `y` to the inside of an edge.
fn narrow(edge: &Edge, y: i64, first: &mut i64, last: &mut i64) {
    let at_row = edge.at(0, y);
    match edge.per_px[0] {
        0 if at_row < 0 => *last = *first - 1,
        0 => {}
        rising @ 1.. => *first = (*first).max(-at_row.div_euclid(rising)),
        falling => *last = (*last).min(at_row.div_euclid(-falling)),
    }
}

impl AlphaTest {
    /// Alpha test of a triangle that needs none.
    pub const NONE: Self = Self { u: [0.0; 3], v: [0.0; 3], q: [0.0; 3], anchor: [0.0; 2], mask: NO_MASK };

    /// Returns the test along row `y`, or `None` if every pixel passes.
    pub fn row<'m>(&self, masks: &'m [AlphaMask], tiling: Option<&'m Tiling>, y: i64) -> Option<AlphaRow<'m>> {
        let mask = masks.get(self.mask as usize)?;
        let from_anchor = y as f32 - self.anchor[1];
        let along = |c: [f32; 3]| [c[0], c[1] * from_anchor + c[2]];
        let [u, v, q] = [self.u, self.v, self.q].map(along);
        Some(AlphaRow { mask, tiling, u, v, q, anchor: self.anchor[0] })
    }
}

/// Alpha test along one row of pixels: u/w, v/w and 1/w as (change per pixel, value at the anchor's
/// column).
#[derive(Debug, Clone, Copy)]
pub struct AlphaRow<'m> {
    mask: &'m AlphaMask,
    tiling: Option<&'m Tiling>,
    u: [f32; 2],
    v: [f32; 2],
    q: [f32; 2],
    anchor: f32,
}

impl AlphaRow<'_> {
    /// Whether pixel `x` passes the test.
    #[inline(always)]
    pub fn covers(&self, x: i64) -> bool {
        let from_anchor = x as f32 - self.anchor;
        let at = |c: [f32; 2]| c[0] * from_anchor + c[1];
        let w = 1.0 / at(self.q);
        let uv = [at(self.u) * w, at(self.v) * w];
        let [u, v] = self.tiling.map_or(uv, |tiling| tiling.shown(uv));
        self.mask.covers(u, v)
    }
}

impl AlphaMask {
    /// Whether the texel at texture coordinates (u, v) is opaque.
    #[inline(always)]
    pub fn covers(&self, u: f32, v: f32) -> bool {
        let texel = texel(v, self.height, self.wrap[1]) * self.width + texel(u, self.width, self.wrap[0]);
        self.bits[texel as usize / 32] >> (texel % 32) & 1 == 1
    }
}

/// Index along one axis of the texel at a texture coordinate, computed in `f32` as in a shader.
#[inline(always)]
fn texel(coordinate: f32, size: u32, wrap: Wrap) -> u32 {
    let position = coordinate * size as f32;
    // Inside the texture all wrap modes agree, and truncation rounds down.
    if position >= 0.0 && position < size as f32 { position as u32 } else { wrapped_texel(position, size as f32, wrap) }
}

fn wrapped_texel(position: f32, size: f32, wrap: Wrap) -> u32 {
    let cell = position.floor();
    let wrapped = match wrap {
        Wrap::Clamp => cell,
        Wrap::Repeat => cell - (cell / size).floor() * size,
        Wrap::Mirror => {
            let period = 2.0 * size;
            let phase = cell - (cell / period).floor() * period;
            if phase >= size { period - 1.0 - phase } else { phase }
        }
    };
    wrapped.max(0.0).min(size - 1.0) as u32
}

/// CPU rasteriser. Works on any machine, with one view per thread, and is the oracle for the wgpu
/// pass.
#[derive(Debug, Default)]
pub struct CpuFragments {
    masks: Vec<AlphaMask>,
}

impl CpuFragments {
    /// Creates a rasteriser without masks.
    pub fn new() -> Self {
        Self::default()
    }
}

impl FragmentSource for CpuFragments {
    fn adapter(&self) -> Option<String> {
        None
    }

    fn prepare(&mut self, masks: &[AlphaMask]) -> Result<()> {
        self.masks = masks.to_vec();
        Ok(())
    }

    fn capture(&mut self, view: ViewTriangles<'_>, out: &mut Vec<Coverage>) -> Result<()> {
        rasterise(&self.masks, view, |_| true, out);
        Ok(())
    }

    fn capture_batch(&mut self, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Result<()> {
        views.par_iter().zip(out).for_each(|(&view, out)| rasterise(&self.masks, view, |_| true, out));
        Ok(())
    }
}

/// Appends the fragments of the triangles for which `wanted(triangle)` returns true.
pub fn rasterise(
    masks: &[AlphaMask],
    view: ViewTriangles<'_>,
    wanted: impl Fn(usize) -> bool,
    out: &mut Vec<Coverage>,
) {
    let resolution = i64::from(view.resolution);
    for (triangle, (corners, alpha)) in view.screen.iter().zip(view.alpha).enumerate() {
        if !wanted(triangle) {
            continue;
        }
        let corners = corners.map(|corner| corner.map(i64::from));
        cover(view.resolution, corners, |y, first, last| {
            let alpha = alpha.row(masks, view.tiling(triangle), y);
            let covered = (first..=last).filter(|&x| alpha.is_none_or(|alpha| alpha.covers(x)));
            out.extend(covered.map(|x| Coverage { pixel: (y * resolution + x) as u32, triangle: triangle as u32 }));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pixels(resolution: u32, corners: [(i64, i64); 3]) -> Vec<(i64, i64)> {
        let mut pixels = Vec::new();
        cover(resolution, corners.map(|(x, y)| [x, y]), |y, first, last| pixels.extend((first..=last).map(|x| (x, y))));
        pixels
    }

    fn cross(a: (i64, i64), b: (i64, i64), c: (i64, i64)) -> i64 {
        (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
    }

    /// The rule for one pixel: strictly inside, or on a top or left edge.
    fn covers_by_definition(corners: [(i64, i64); 3], x: i64, y: i64) -> bool {
        let sample = (x * SUBPIXEL, y * SUBPIXEL);
        let clockwise = cross(corners[0], corners[1], corners[2]);
        clockwise != 0
            && (0..3).all(|i| {
                let (mut a, mut b) = (corners[i], corners[(i + 1) % 3]);
                if clockwise < 0 {
                    std::mem::swap(&mut a, &mut b);
                }
                let side = cross(a, b, sample);
                let top = a.1 == b.1 && b.0 > a.0;
                let left = b.1 < a.1;
                side > 0 || (side == 0 && (top || left))
            })
    }

    fn corner() -> impl Strategy<Value = (i64, i64)> {
        // Half of all corners lie on quarter pixels, so that samples are often exactly on edges.
        prop_oneof![(-900..3000_i64, -900..3000_i64), (-4..12_i64, -4..12_i64).prop_map(|(x, y)| (x * 64, y * 256))]
    }

    proptest! {
        #[test]
        fn spans_equal_the_rule_applied_to_every_pixel(
            a in corner(), b in corner(), c in corner(), stretch in 1..4_i64, side in 8..32_u32,
        ) {
            let corners = [a, b, c].map(|(x, y)| (x * stretch, y));
            let expected: Vec<_> = (0..i64::from(side))
                .flat_map(|y| (0..i64::from(side)).map(move |x| (x, y)))
                .filter(|&(x, y)| covers_by_definition(corners, x, y))
                .collect();
            prop_assert_eq!(pixels(side, corners), expected);
        }

        #[test]
        fn a_rectangle_of_an_area_holds_what_it_covers_there(
            a in corner(), b in corner(), c in corner(), cut in prop::array::uniform4(0..3_i64),
        ) {
            let corners = [a, b, c].map(|(x, y)| [x, y]);
            let area = bounds(16, corners).and_then(|bounds| Area::new(bounds, corners));
            prop_assume!(area.is_some());
            let area = area.unwrap();
            let [low, high] = area.bounds;
            let (low, high) = ([low[0] + cut[0], low[1] + cut[1]], [high[0] - cut[2], high[1] - cut[3]]);
            prop_assume!(low[0] <= high[0] && low[1] <= high[1]);
            let mut found = Vec::new();
            area.cover([low, high], |y, first, last| found.extend((first..=last).map(|x| (x, y))));
            let is_within = |&(x, y): &(i64, i64)| (low[0]..=high[0]).contains(&x) && (low[1]..=high[1]).contains(&y);
            let expected: Vec<_> = pixels(16, [a, b, c]).into_iter().filter(is_within).collect();
            prop_assert!(expected.iter().all(|&(x, y)| area.covers(x, y)));
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn two_triangles_that_share_an_edge_cover_each_pixel_once(a in corner(), b in corner(), c in corner(), d in corner()) {
            let opposite = cross(a, b, c).signum() * cross(a, b, d).signum() < 0;
            prop_assume!(opposite);
            let both = pixels(8, [a, b, d]);
            prop_assert!(pixels(8, [a, b, c]).iter().all(|pixel| !both.contains(pixel)));
        }
    }

    #[test]
    fn a_triangle_without_area_covers_nothing() {
        assert!(pixels(8, [(0, 0), (512, 512), (1024, 1024)]).is_empty());
        assert!(pixels(8, [(256, 256); 3]).is_empty());
    }

    #[test]
    fn a_triangle_far_larger_than_the_view_covers_all_of_it() {
        let far = 1 << 29;
        assert_eq!(pixels(16, [(-far, -far), (far, -far), (0, far)]).len(), 256);
    }

    #[test]
    fn texels_outside_the_texture_follow_the_wrap_mode() {
        let cases = [
            (Wrap::Clamp, [-0.3, 0.1, 0.6, 1.2], [0, 0, 2, 3]),
            (Wrap::Repeat, [-0.3, 0.1, 0.6, 1.2], [2, 0, 2, 0]),
            (Wrap::Mirror, [-0.3, 0.1, 0.6, 1.2], [1, 0, 2, 3]),
        ];
        for (wrap, coordinates, texels) in cases {
            assert_eq!(coordinates.map(|coordinate| texel(coordinate, 4, wrap)), texels, "{wrap:?}");
        }
        for wrap in [Wrap::Clamp, Wrap::Repeat, Wrap::Mirror] {
            for coordinate in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
                assert!(texel(coordinate, 4, wrap) < 4);
            }
        }
    }
}
