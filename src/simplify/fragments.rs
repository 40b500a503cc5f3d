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
/// With `p = (x - anchor.x, y - anchor.y)` for pixel (x, y) counted in whole pixels, `plane(c) = c[0] * p.x + (c[1] * p.y +
/// c[2])` and `w = 1 / plane(q)`, all in `f32`, the texture coordinates are `(plane(u) * w, plane(v) * w)`: perspective
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

/// One view's triangles as a rasteriser takes them: snapped to 1/256 pixel already, so that coverage is a matter of
/// integers. None is clipped by near or far.
#[derive(Debug, Clone, Copy)]
pub struct ViewTriangles<'a> {
    /// Width and height in pixels.
    pub resolution: u32,
    /// Corners of each triangle as (x right, y down) in 1/256 pixel from the centre of the top left pixel. A triangle that
    /// no rasteriser may draw has three equal corners.
    pub screen: &'a [[[i32; 2]; 3]],
    /// One per triangle.
    pub alpha: &'a [AlphaTest],
}

impl ViewTriangles<'_> {
    /// A corner as a clip position with w = 1 for wgpu (x right, y up, both -1 to 1): the viewport transform gives back the
    /// snapped position exactly where the resolution is a power of two, and to far less than half a step otherwise.
    pub fn clip_from_screen(&self, corner: [i32; 2]) -> [f32; 4] {
        let half = f64::from(self.resolution) * 0.5;
        let ndc = |snapped: i32| ((f64::from(snapped) / 256.0 + 0.5) / half - 1.0) as f32;
        [ndc(corner[0]), -ndc(corner[1]), 0.5, 1.0]
    }
}

/// A rasteriser of fragments. Implemented by [`CpuFragments`](super::raster::CpuFragments) and by the wgpu pass.
pub trait FragmentSource: Send {
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

    /// [`capture`](Self::capture) for several views, `out[i]` for `views[i]`; a source that can work on several at once
    /// overrides it.
    ///
    /// # Errors
    /// As [`capture`](Self::capture).
    fn capture_batch(&mut self, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Result<()> {
        views.iter().zip(out).try_for_each(|(&view, out)| self.capture(view, out))
    }
}
