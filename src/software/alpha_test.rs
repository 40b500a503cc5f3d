//! Alpha test of a triangle, sample by sample, and the outline of its picture on the screen.

use super::{
    list::Picture,
    samples::{SAMPLES, indices, sample_px},
};
use crate::{
    draw::mips::Mips,
    plant::{OUTLINE_CORNERS, Outline, Tiling},
};

/// A quantity that is affine on the screen, with its origin at the tile's top left corner.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    pub(super) at_origin: f64,
    pub(super) per_px: [f64; 2],
}

impl Plane {
    pub(super) fn at(&self, x_px: f64, y_px: f64) -> f32 {
        (self.at_origin + self.per_px[0] * x_px + self.per_px[1] * y_px) as f32
    }
}

/// Texture coordinates after repetition.
pub(super) fn shown(uv: [f32; 2], tiling: Option<Tiling>) -> [f32; 2] {
    tiling.map_or(uv, |tiling| tiling.shown(uv))
}

/// Step between the thresholds of neighbouring samples, in sixteenths: coprime to sixteen, and
/// spreads the samples that pass over the pixel.
const THRESHOLD_STEP: u32 = 7;

/// The alpha test of one triangle. At the full texture, a sample passes if its alpha reaches the
/// cutoff. At other levels alpha is coverage, and of the sixteen samples as many pass: each has a
/// threshold of its own, in an order that differs between leaves, so that what one leaf leaves
/// open is not what the leaf behind it leaves open.
pub(super) struct AlphaTest<'a> {
    pub(super) cutout: Cutout<'a>,
    pub(super) is_orthographic: bool,
    pub(super) u: Plane,
    pub(super) v: Plane,
}

/// What a triangle is cut out by.
#[derive(Clone, Copy)]
pub(super) enum Cutout<'a> {
    /// The alpha of a texture.
    Texture {
        mips: &'a Mips,
        level: u8,
        cutoff: f32,
        /// Threshold of sample 0 in sixteenths, rounded down.
        first_threshold: u32,
        tiling: Option<Tiling>,
    },
    /// The picture of a cluster. A texel shows or does not, so that samples alone keep coverage.
    Picture(Picture<'a>),
}

impl AlphaTest<'_> {
    pub(super) fn passing(&self, covered: u32, depth: &Plane, at: [i64; 2]) -> u32 {
        indices(covered).filter(|&s| self.passes(depth, at, s)).fold(0, |passing, s| passing | 1 << s)
    }

    pub(super) fn passes(&self, depth: &Plane, at: [i64; 2], sample: usize) -> bool {
        let [x, y] = sample_px(at, sample);
        let w = if self.is_orthographic { 1.0 } else { 1.0 / depth.at(x, y) };
        let uv = [self.u.at(x, y) * w, self.v.at(x, y) * w];
        match self.cutout {
            Cutout::Texture { mips, level, cutoff, first_threshold, tiling } => {
                let threshold = if level == 0 { cutoff } else { threshold(first_threshold, sample) };
                mips.alpha(level, shown(uv, tiling)) >= threshold
            }
            Cutout::Picture(picture) => picture.covers(uv),
        }
    }

    /// The outline of the triangle's texture, on the screen.
    pub(super) fn trim(&self, outline: &Outline, depth: &Plane) -> Trim {
        let one_over_w = if self.is_orthographic { Plane { at_origin: 1.0, per_px: [0.0; 2] } } else { *depth };
        let mut trim = Trim { edges: [one_over_w; MAX_EDGES], count: outline.corners.len().min(MAX_EDGES) };
        for (i, edge) in trim.edges.iter_mut().enumerate().take(trim.count) {
            let [a, b] = [i, i + 1].map(|i| outline.corners[i % trim.count].map(f64::from));
            let (of_u, of_v) = (a[1] - b[1], b[0] - a[0]);
            let of_one = -(of_u * a[0] + of_v * a[1]);
            let sum = |u: f64, v: f64, one: f64| of_u * u + of_v * v + of_one * one;
            *edge = Plane {
                at_origin: sum(self.u.at_origin, self.v.at_origin, one_over_w.at_origin),
                per_px: [0, 1].map(|axis| sum(self.u.per_px[axis], self.v.per_px[axis], one_over_w.per_px[axis])),
            };
        }
        trim
    }
}

fn threshold(first: u32, sample: usize) -> f32 {
    let rank = (first + THRESHOLD_STEP * sample as u32) % SAMPLES as u32;
    (rank as f32 + 0.5) / SAMPLES as f32
}

/// Most edges of an outline.
const MAX_EDGES: usize = OUTLINE_CORNERS[1] as usize;

/// An outline on the screen: functions that are affine there and negative outside an edge, since
/// u/w, v/w and 1/w are affine.
pub(super) struct Trim {
    edges: [Plane; MAX_EDGES],
    count: usize,
}

impl Trim {
    /// Whether all of a pixel is outside the outline.
    pub(super) fn misses(&self, [x, y]: [i64; 2]) -> bool {
        self.edges[..self.count].iter().any(|edge| {
            let [right, down] = edge.per_px;
            edge.at_origin + right * x as f64 + down * y as f64 + right.max(0.0) + down.max(0.0) < 0.0
        })
    }
}
