//! Interface between rasterisers and the simplifier: triangles of one view in, (pixel, triangle)
//! pairs out.
//!
//! A rasteriser only decides *which pixels a triangle covers*: the sample rule (pixel centres,
//! top-left, positions snapped to 1/256 pixel) and the alpha test. The simplifier computes depth,
//! visibility and everything after that from the same numbers for every rasteriser, so two
//! rasterisers that cover the same pixels give the same model.

use crate::{Result, material::Wrap, plant::Tiling};

/// Value of `mask` for a triangle that needs no alpha test.
pub const NO_MASK: u32 = u32::MAX;

/// A triangle that covers a pixel of a view.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Coverage {
    /// `y * resolution + x`, row 0 at the top.
    pub pixel: u32,
    /// Index of the triangle.
    pub triangle: u32,
}

/// Alpha test of one triangle in one view; all zero except `mask` if there is none.
///
/// With `p = (x - anchor.x, y - anchor.y)` for pixel (x, y) in whole pixels,
/// `plane(c) = c[0] * p.x + (c[1] * p.y + c[2])` and `w = 1 / plane(q)`, all in `f32`, the texture
/// coordinates are `(plane(u) * w, plane(v) * w)`. This is perspective-correct, since each quantity
/// divided by w is affine in screen space.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct AlphaTest {
    /// u/w as a plane in screen space.
    pub u: [f32; 3],
    /// v/w as a plane in screen space.
    pub v: [f32; 3],
    /// 1/w as a plane in screen space.
    pub q: [f32; 3],
    /// Whole pixel near the triangle that is the origin of the planes.
    pub anchor: [f32; 2],
    /// Index into the masks; `u32::MAX` for none.
    pub mask: u32,
}

/// Opaque texels of a material's texture: the result of the alpha test, one bit per texel.
///
/// Texel (i, j) is bit `k % 32` of word `k / 32`, where `k = j * width + i`. Texture coordinate u
/// falls into texel `floor(u * width)`, mapped to `0..width` by the wrap mode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlphaMask {
    /// Number of texels in a row, at least 1.
    pub width: u32,
    /// Number of rows, at least 1.
    pub height: u32,
    /// Wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// One bit per texel.
    pub bits: Vec<u32>,
}

/// Triangles of one view, as a rasteriser receives them. Positions are already snapped to 1/256
/// pixel, so that coverage takes only integers. Triangles are not clipped to the near and far
/// planes.
#[derive(Debug, Clone, Copy)]
pub struct ViewTriangles<'a> {
    /// Width and height in pixels.
    pub resolution: u32,
    /// Corners of each triangle as (x right, y down) in 1/256 pixel from the centre of the top left
    /// pixel. A triangle that must not be drawn has three equal corners.
    pub screen: &'a [[[i32; 2]; 3]],
    /// One per triangle.
    pub alpha: &'a [AlphaTest],
    /// One per triangle, `None` where its leaf shows one picture; empty if all do.
    pub tiling: &'a [Option<Tiling>],
}

impl ViewTriangles<'_> {
    /// Tiling of a triangle, if its leaf shows several pictures.
    pub fn tiling(&self, triangle: usize) -> Option<&Tiling> {
        self.tiling.get(triangle)?.as_ref()
    }

    /// Converts a corner to a clip-space position with w = 1 for wgpu (x right, y up, both -1 to
    /// 1). The viewport transform restores the snapped position exactly if the resolution is a
    /// power of two, and to far less than half a step otherwise.
    pub fn clip_from_screen(&self, corner: [i32; 2]) -> [f32; 4] {
        let half = f64::from(self.resolution) * 0.5;
        let ndc = |snapped: i32| ((f64::from(snapped) / 256.0 + 0.5) / half - 1.0) as f32;
        [ndc(corner[0]), -ndc(corner[1]), 0.5, 1.0]
    }
}

/// A rasteriser of fragments, implemented by [`CpuFragments`](super::raster::CpuFragments) and by
/// the wgpu pass.
pub trait FragmentSource: Send {
    /// Name of the adapter, for the model's metadata, or `None` for the CPU.
    fn adapter(&self) -> Option<String>;

    /// Receives the plant's alpha masks, once before the first view.
    ///
    /// # Errors
    /// [`Gpu`](crate::Error::Gpu) or [`TooLarge`](crate::Error::TooLarge) if they do not fit.
    fn prepare(&mut self, masks: &[AlphaMask]) -> Result<()>;

    /// Appends every (pixel, triangle) pair that `view` covers to `out`, each once and in any
    /// order. All triangles are two-sided, and none hides another.
    ///
    /// # Errors
    /// [`Gpu`](crate::Error::Gpu) if the device fails.
    fn capture(&mut self, view: ViewTriangles<'_>, out: &mut Vec<Coverage>) -> Result<()>;

    /// Same as [`capture`](Self::capture) for several views: `out[i]` receives the pairs of
    /// `views[i]`. A source that can process several views at once overrides it.
    ///
    /// # Errors
    /// Same as [`capture`](Self::capture).
    fn capture_batch(&mut self, views: &[ViewTriangles<'_>], out: &mut [Vec<Coverage>]) -> Result<()> {
        views.iter().zip(out).try_for_each(|(&view, out)| self.capture(view, out))
    }
}
