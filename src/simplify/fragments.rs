//! The seam between rasterisers and the simplifier: triangles of one view in, (pixel, triangle) pairs out.
//!
//! A rasteriser only decides *which pixels a triangle covers*: the sample rule (pixel centres, top-left, positions snapped
//! to 1/256 pixel) and the alpha test. Depth, hidden-surface order and everything after are computed by the simplifier
//! from the same numbers whichever rasteriser answered, so two rasterisers that cover the same pixels give the same model.

use crate::{Result, material::Wrap};

/// `mask` of a triangle that needs no alpha test.
pub const NO_MASK: u32 = u32::MAX;

/// One triangle covering one pixel of a view.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Coverage {
    /// `y * resolution + x`, row 0 at the top.
    pub pixel: u32,
    /// Index of the triangle.
    pub triangle: u32,
}

/// The alpha test of one triangle in one view; all zero except `mask` where there is none.
///
/// With `p = (x + 0.5 - anchor.x, y + 0.5 - anchor.y)` for pixel (x, y), and `plane(c) = c[0] * p.x + c[1] * p.y + c[2]`
/// evaluated in `f32` in that order, the texture coordinates are `(plane(u) / plane(q), plane(v) / plane(q))`: perspective
/// correct, each quantity being affine on the screen once divided by w.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct AlphaTest {
    /// u/w as a plane over the screen.
    pub u: [f32; 3],
    /// v/w as a plane over the screen.
    pub v: [f32; 3],
    /// 1/w as a plane over the screen.
    pub q: [f32; 3],
    /// Whole pixel near the triangle, from which the planes count.
    pub anchor: [f32; 2],
    /// Index into the masks, or [`NO_MASK`].
    pub mask: u32,
}

/// Which texels of a material's texture cover: alpha tested once, one bit each.
///
/// Texel (i, j) is bit `k % 32` of word `k / 32`, `k = j * width + i`. Texture coordinate u falls into texel
/// `floor(u * width)`, brought into `0..width` by the wrap mode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlphaMask {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// One bit a texel.
    pub bits: Vec<u32>,
}

/// One view's triangles as a rasteriser takes them. Every vertex has `0 < z < w`; none is clipped by near or far.
#[derive(Debug, Clone, Copy)]
pub struct ViewTriangles<'a> {
    /// Width and height in pixels.
    pub resolution: u32,
    /// Clip positions, three per triangle: x right, y up, z 0 to w (wgpu's convention).
    pub clip: &'a [[f32; 4]],
    /// One per triangle.
    pub alpha: &'a [AlphaTest],
}

/// A rasteriser of fragments. Implemented by the CPU rasteriser and by the wgpu pass.
pub trait FragmentSource {
    /// What answered, for the model's metadata: the adapter's name, or `None` for the CPU.
    fn adapter(&self) -> Option<String>;

    /// Takes the plant's alpha masks, once before the first view.
    ///
    /// # Errors
    /// [`Gpu`](crate::Error::Gpu) or [`TooLarge`](crate::Error::TooLarge) when they do not fit.
    fn prepare(&mut self, masks: &[AlphaMask]) -> Result<()>;

    /// Appends every (pixel, triangle) that `view` covers to `out`, in any order, each once; all triangles are two-sided
    /// and nothing hides anything.
    ///
    /// # Errors
    /// [`Gpu`](crate::Error::Gpu) when the device fails.
    fn capture(&mut self, view: ViewTriangles<'_>, out: &mut Vec<Coverage>) -> Result<()>;
}
