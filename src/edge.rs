//! Edge functions of triangles on a screen of whole 1/256 pixels, with the top-left rule.
//!
//! The rule is that of Vulkan, Metal and Direct3D 12: a sample on an edge belongs to the triangle
//! if the edge is a top or left edge. After J. Pineda, "A Parallel Algorithm for Polygon
//! Rasterization", SIGGRAPH 1988.
//!
//! Limits: coordinates must be below 2^30 in magnitude, so that products stay within `i64`.

/// Steps per pixel of screen positions: 8 bits, as Vulkan, Metal and Direct3D 12 adapters use.
pub const SUBPIXEL: i64 = 256;

/// Edge function `value = at_origin + x * per_px[0] + y * per_px[1]` with (x, y) in pixels; 0 or
/// greater inside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    /// Value at the origin.
    pub at_origin: i64,
    /// Change per pixel along x and y: whole multiples of [`SUBPIXEL`].
    pub per_px: [i64; 2],
}

impl Edge {
    /// Creates the edge from `from` to `to`, in 1/256 pixel, of a triangle that lies to its right
    /// on a screen with y pointing down.
    pub fn new(from: [i64; 2], to: [i64; 2]) -> Self {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // With this winding a left edge goes up and a top edge goes right. Samples exactly on other
        // edges are outside.
        let is_top_or_left = dy < 0 || (dy == 0 && dx > 0);
        let at_origin = dy * from[0] - dx * from[1] - i64::from(!is_top_or_left);
        Self { at_origin, per_px: [-dy * SUBPIXEL, dx * SUBPIXEL] }
    }

    /// Value at a whole pixel.
    pub fn at(&self, x: i64, y: i64) -> i64 {
        self.at_origin + self.per_px[0] * x + self.per_px[1] * y
    }
}

/// Twice the signed area of a triangle: positive if its corners run clockwise on a screen with y
/// pointing down.
pub(crate) fn twice_area(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
