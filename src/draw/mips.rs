//! Textures ready for sampling: a mip chain in which alpha is coverage.
//!
//! The full texture keeps its alpha, which the alpha test compares with the cutoff. At every other
//! level, alpha is the fraction of the area under the texel that passes the test once the full
//! texture is filtered bilinearly, and colour is the mean of that area in linear light. A surface
//! that minifies its texture therefore covers, on average, as much of a pixel as the full texture
//! would, however sparse they are; thresholding averaged alpha instead (with or without rescaling
//! it, as in I. Castano, "Computing Alpha Mipmaps", 2010) makes sparse textures solid or empty once
//! a level has few texels.
//!
//! Levels are computed in `f32` and rounded once. A side that is not a power of two is filtered
//! with the fractional weights of the texels under each texel.

use super::records::LEVELS_ACROSS;
use crate::{
    material::{Material, Pixels, Wrap},
    srgb::{encoded, linear_bytes},
};

/// Linear values of the 256 sRGB bytes.
pub(crate) struct SrgbTable([f32; 256]);

impl SrgbTable {
    pub(crate) fn new() -> Self {
        Self(linear_bytes())
    }

    fn linear(&self, byte: u8) -> f32 {
        self.0[byte as usize]
    }

    pub(crate) fn color(&self, rgb: [u8; 3]) -> glam::Vec3 {
        glam::Vec3::from(rgb.map(|byte| self.linear(byte)))
    }
}

/// The sRGB byte of a linear value; values outside 0..1 are clamped.
pub(crate) fn srgb_from_linear(linear: f32) -> u8 {
    (encoded(linear) * 255.0 + 0.5) as u8
}

/// Mip chain of one material's texture: the full size first, each level half as large as the
/// previous one, down to 1 x 1.
pub(crate) struct Mips {
    levels: Vec<Pixels>,
    wrap: [Wrap; 2],
}

/// The mip levels of a texture for a material, the full size first, each half as large as the one
/// before, down to 1 x 1: sRGB colour, and alpha that is coverage from the second level on. Wholly
/// transparent texels have the colour of what is around them. For engines that test alpha, see
/// `cutout_coverage` in [`engine_parts`](super::shaders::engine_parts). Empty for a texture without
/// texels. O(texels).
pub fn mip_levels(full: Pixels, material: &Material) -> Vec<Pixels> {
    let Some(mut mips) = Mips::new(full, material.wrap, material.texture_cutoff(), &SrgbTable::new()) else {
        return Vec::new();
    };
    mips.bleed();
    mips.levels
}

impl Mips {
    /// Builds the mip chain. `cutoff` is the least alpha of an opaque texel, or `None` if all are
    /// opaque; alpha then counts as 1. Returns `None` for a texture without texels.
    pub(crate) fn new(mut full: Pixels, wrap: [Wrap; 2], cutoff: Option<f32>, srgb: &SrgbTable) -> Option<Self> {
        if full.width == 0 || full.height == 0 {
            return None;
        }
        if cutoff.is_none() {
            full.rgba.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = 255);
        }
        let cutoff = cutoff.unwrap_or(0.0);
        let size = [full.width, full.height];
        let of_full = |x, y| Sum::of_full([x, y], &full, wrap, cutoff, srgb);
        let mut next = (size != [1, 1]).then(|| Sums::halved(size, of_full));
        let mut levels = vec![];
        while let Some(sums) = next {
            levels.push(sums.pixels());
            next = (sums.size != [1, 1]).then(|| Sums::halved(sums.size, |x, y| sums.at(x, y)));
        }
        levels.insert(0, full);
        Some(Self { levels, wrap })
    }

    /// All levels, the full size first, with linear colour multiplied by alpha before it is encoded
    /// as sRGB: filtering then weights colours by their coverage.
    #[cfg(feature = "render")]
    pub(crate) fn premultiplied(&self, srgb: &SrgbTable) -> impl Iterator<Item = Pixels> {
        self.levels.iter().map(|level| {
            let texel = |&[r, g, b, alpha]: &[u8; 4]| {
                let [r, g, b] = [r, g, b].map(|byte| srgb_from_linear(srgb.linear(byte) * alpha as f32 / 255.0));
                [r, g, b, alpha]
            };
            let rgba = level.rgba.as_chunks().0.iter().flat_map(texel).collect();
            Pixels { width: level.width, height: level.height, rgba }
        })
    }

    /// The finest level with no side above `side` texels.
    #[cfg(feature = "simplify")]
    pub(crate) fn within(&self, side: u32) -> Option<&Pixels> {
        self.levels.iter().find(|level| level.width.max(level.height) <= side)
    }

    /// Number of levels.
    pub(crate) fn count(&self) -> usize {
        self.levels.len()
    }

    /// Gives wholly transparent texels the colour of the finest coarser level that covers them, so
    /// that filtering brings no other colour to the edge of a cut-out.
    fn bleed(&mut self) {
        for level in (1..self.levels.len()).rev() {
            let (finer, coarser) = self.levels.split_at_mut(level);
            let (fine, coarse) = (&mut finer[level - 1], &coarser[0]);
            let (width, height) = (fine.width, fine.height);
            for (i, of) in (0..).zip(fine.rgba.as_chunks_mut::<4>().0) {
                if of[3] == 0 {
                    let x = (i % width * coarse.width / width).min(coarse.width - 1);
                    let y = (i / width * coarse.height / height).min(coarse.height - 1);
                    of[..3].copy_from_slice(&texel(coarse, x, y)[..3]);
                }
            }
        }
    }

    /// Width and height of the full texture in texels.
    pub(crate) fn full_size(&self) -> [f32; 2] {
        [self.levels[0].width as f32, self.levels[0].height as f32]
    }

    /// Mip level at which `texels_per_sample` texels of the full texture (an area) become about
    /// one, for a surface that shows `across` texels along its shorter side.
    pub(crate) fn level_for(&self, texels_per_sample: f32, across: f32) -> u8 {
        let coarsest = (across.max(1.0).log2() - LEVELS_ACROSS).max(0.0);
        let level = (0.5 * texels_per_sample.max(1.0).log2()).min(coarsest) + 0.5;
        (level as usize).min(self.levels.len() - 1) as u8
    }

    /// Bilinearly filtered alpha at (u, v), 0 to 1.
    pub(crate) fn alpha(&self, level: u8, uv: [f32; 2]) -> f32 {
        let corners = self.corners(level, uv);
        corners.iter().map(|(weight, texel)| weight * texel[3] as f32).sum::<f32>() / 255.0
    }

    /// Bilinearly filtered linear colour at (u, v), weighted by alpha.
    pub(crate) fn color(&self, level: u8, uv: [f32; 2], srgb: &SrgbTable) -> [f32; 3] {
        let corners = self.corners(level, uv);
        let mut sum = [0.0; 3];
        let mut total = 0.0;
        for (weight, texel) in corners {
            // Never zero, so that a wholly transparent neighbourhood still has a colour.
            let weight = weight * (texel[3] as f32 + 1e-3);
            total += weight;
            (0..3).for_each(|channel| sum[channel] += weight * srgb.linear(texel[channel]));
        }
        sum.map(|channel| channel / total)
    }

    fn corners(&self, level: u8, uv: [f32; 2]) -> [(f32, [u8; 4]); 4] {
        let pixels = &self.levels[level as usize];
        let (x, fx) = split(uv[0], pixels.width, self.wrap[0]);
        let (y, fy) = split(uv[1], pixels.height, self.wrap[1]);
        [
            ((1.0 - fx) * (1.0 - fy), texel(pixels, x[0], y[0])),
            (fx * (1.0 - fy), texel(pixels, x[1], y[0])),
            ((1.0 - fx) * fy, texel(pixels, x[0], y[1])),
            (fx * fy, texel(pixels, x[1], y[1])),
        ]
    }
}

/// The two texels around a texture coordinate, and its position between them: 0 at the first, 1 at
/// the second.
fn split(coordinate: f32, size: u32, wrap: Wrap) -> ([u32; 2], f32) {
    let at = coordinate * size as f32 - 0.5;
    let first = at.floor();
    let fraction = (at - first).clamp(0.0, 1.0);
    let index = first.clamp(-1e9, 1e9) as i64;
    ([wrap.inside(index, size), wrap.inside(index + 1, size)], fraction)
}

fn texel(pixels: &Pixels, x: u32, y: u32) -> [u8; 4] {
    let at = 4 * (y as usize * pixels.width as usize + x as usize);
    [pixels.rgba[at], pixels.rgba[at + 1], pixels.rgba[at + 2], pixels.rgba[at + 3]]
}

fn is_opaque(alpha: f32, cutoff: f32) -> bool {
    alpha / 255.0 >= cutoff
}

/// Linear colour of opaque texels times their coverage, and their coverage plus [`FAINT`].
#[derive(Debug, Clone, Copy)]
struct Sum([f32; 4]);

/// Weight of the colour of a texel that is not opaque: enough for a wholly transparent area to have
/// a colour, too little to tint opaque texels.
const FAINT: f32 = 1e-5;

impl Sum {
    /// Sum over the area of texel `at` of the full texture as the drawers filter it.
    fn of_full(at: [u32; 2], full: &Pixels, wrap: [Wrap; 2], cutoff: f32, srgb: &SrgbTable) -> Self {
        let around = [-1, 0, 1].map(|by| {
            let near = |axis: usize, size: u32| wrap[axis].inside(i64::from(at[axis]) + by, size);
            [near(0, full.width), near(1, full.height)]
        });
        let texels = around.map(|[_, y]| around.map(|[x, _]| texel(full, x, y)));
        let opaque = texels.as_flattened().iter().filter(|texel| is_opaque(texel[3] as f32, cutoff)).count();
        if opaque == 0 || opaque == 9 {
            return Self::of_texel(texels[1][1], cutoff, srgb);
        }
        let quarter = |sum: Self, i: usize| sum.plus(Self::filtered(&texels, [i % 2, i / 2], cutoff, srgb), 0.25);
        (0..4).fold(Self([0.0; 4]), quarter)
    }

    /// Bilinearly filtered colour and alpha in the middle of a quarter of the middle texel.
    fn filtered(texels: &[[[u8; 4]; 3]; 3], [right, low]: [usize; 2], cutoff: f32, srgb: &SrgbTable) -> Self {
        let weights = [[0.25, 0.75], [0.75, 0.25]];
        let (mut color, mut alpha) = ([0.0; 3], 0.0);
        for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let texel = texels[low + j][right + i];
            let weight = weights[low][j] * weights[right][i] * (texel[3] as f32 + FAINT);
            alpha += weight;
            (0..3).for_each(|c| color[c] += srgb.linear(texel[c]) * weight);
        }
        let coverage = if is_opaque(alpha, cutoff) { 1.0 + FAINT } else { FAINT };
        let [r, g, b] = color.map(|sum| sum / alpha * coverage);
        Self([r, g, b, coverage])
    }

    fn of_texel([r, g, b, alpha]: [u8; 4], cutoff: f32, srgb: &SrgbTable) -> Self {
        let weight = if is_opaque(alpha as f32, cutoff) { 1.0 + FAINT } else { FAINT };
        let [r, g, b] = [r, g, b].map(|byte| srgb.linear(byte) * weight);
        Self([r, g, b, weight])
    }

    fn plus(self, other: Self, weight: f32) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i] * weight))
    }

    fn texel(self) -> [u8; 4] {
        let [r, g, b, weight] = self.0;
        let [r, g, b] = [r, g, b].map(|channel| srgb_from_linear(channel / weight));
        [r, g, b, ((weight - FAINT) * 255.0 + 0.5) as u8]
    }
}

/// One level before it is rounded.
struct Sums {
    size: [u32; 2],
    sums: Vec<Sum>,
}

impl Sums {
    /// The level below one of `from` texels; each of its texels is the mean of those under it.
    fn halved(from: [u32; 2], at: impl Fn(u32, u32) -> Sum) -> Self {
        let size = from.map(|side| (side / 2).max(1));
        let [columns, rows] = [0, 1].map(|axis| taps(from[axis], size[axis]));
        let mut sums = Vec::with_capacity(size[0] as usize * size[1] as usize);
        for row in &rows {
            for column in &columns {
                let mut sum = Sum([0.0; 4]);
                for &(y, weight_y) in row {
                    sum = column.iter().fold(sum, |sum, &(x, weight_x)| sum.plus(at(x, y), weight_x * weight_y));
                }
                sums.push(sum);
            }
        }
        Self { size, sums }
    }

    fn at(&self, x: u32, y: u32) -> Sum {
        self.sums[y as usize * self.size[0] as usize + x as usize]
    }

    fn pixels(&self) -> Pixels {
        let rgba = self.sums.iter().flat_map(|sum| sum.texel()).collect();
        Pixels { width: self.size[0], height: self.size[1], rgba }
    }
}

/// For each of `to` texels along an axis, the texels of `from` under it and the fraction of it that
/// each of them takes.
fn taps(from: u32, to: u32) -> Vec<Vec<(u32, f32)>> {
    let ratio = f64::from(from) / f64::from(to);
    let under = |texel: u32| {
        let [start, end] = [texel, texel + 1].map(|edge| f64::from(edge) * ratio);
        let inside = |i: u32| (f64::from(i) + 1.0).min(end) - f64::from(i).max(start);
        let covered = (start as u32)..(end.ceil() as u32).min(from);
        covered.map(|i| (i, (inside(i) / ratio) as f32)).filter(|&(_, weight)| weight > 0.0).collect()
    };
    (0..to).map(under).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(side: u32, radius: f32) -> Pixels {
        let center = side as f32 / 2.0;
        let mut rgba = Vec::new();
        for i in 0..side * side {
            let (x, y) = ((i % side) as f32 + 0.5 - center, (i / side) as f32 + 0.5 - center);
            let inside = x.hypot(y) < radius;
            rgba.extend_from_slice(if inside { &[40, 160, 40, 255] } else { &[255, 255, 255, 0] });
        }
        Pixels { width: side, height: side, rgba }
    }

    #[test]
    fn every_level_covers_the_share_of_the_full_texture() {
        let srgb = SrgbTable::new();
        for (side, radius) in [(128, 20.0), (100, 7.0), (97, 30.0), (64, 1.5)] {
            let mips = Mips::new(disc(side, radius), [Wrap::Clamp; 2], Some(0.5), &srgb).unwrap();
            let share = |level: &Pixels, value: fn(u8) -> f64| {
                let alphas = level.rgba.iter().skip(3).step_by(4);
                alphas.map(|&alpha| value(alpha)).sum::<f64>() / f64::from(level.width * level.height)
            };
            let full = share(&mips.levels[0], |alpha| f64::from(u8::from(alpha >= 128)));
            for level in &mips.levels[1..] {
                let share = share(level, |alpha| f64::from(alpha) / 255.0);
                assert!((share - full).abs() <= 0.51 / 255.0, "{side}, {} texels: {share}, {full}", level.width);
            }
            assert_eq!(mips.levels.last().map(|last| (last.width, last.height)), Some((1, 1)));
        }
    }

    #[test]
    fn a_texture_of_one_texel_has_one_level_and_soft_alpha_is_cut() {
        let srgb = SrgbTable::new();
        let levels = |width, height, rgba: &[u8]| {
            let pixels = Pixels { width, height, rgba: rgba.to_vec() };
            let mips = Mips::new(pixels, [Wrap::Clamp; 2], Some(0.5), &srgb).unwrap();
            mips.levels.into_iter().map(|level| level.rgba).collect::<Vec<_>>()
        };
        assert_eq!(levels(1, 1, &[10, 20, 30, 100]), [[10, 20, 30, 100]]);
        // Of two texels, one passes the test, at an alpha of 60 %; the filter mixes a little of the
        // other into its edge.
        let [red, _, _, coverage] = levels(2, 1, &[10, 20, 30, 153, 200, 200, 200, 100])[1][..] else { panic!() };
        assert_eq!(coverage, 128);
        assert!((11..100).contains(&red), "{red}");
    }

    #[test]
    fn colour_behind_the_outline_does_not_bleed_into_halved_levels() {
        let srgb = SrgbTable::new();
        let mips = Mips::new(disc(64, 20.0), [Wrap::Clamp; 2], Some(0.5), &srgb).unwrap();
        let [red, green, _] = mips.color(3, [0.5, 0.5], &srgb);
        assert!(red < 0.1 && green > 0.3, "{red} {green}");
    }

    #[test]
    fn clear_texels_have_the_colour_of_what_is_near_and_the_rest_stays() {
        let full = disc(64, 20.0);
        let material = Material { alpha_mode: crate::material::AlphaMode::Mask, ..Material::default() };
        let levels = mip_levels(full.clone(), &material);
        assert_eq!(levels.iter().map(|level| level.width).collect::<Vec<_>>(), [64, 32, 16, 8, 4, 2, 1]);
        for (before, after) in full.rgba.as_chunks::<4>().0.iter().zip(levels[0].rgba.as_chunks::<4>().0) {
            let is_clear = before[3] == 0;
            assert!(if is_clear { after[1].abs_diff(160) < 8 && after[3] == 0 } else { before == after }, "{after:?}");
        }
        assert!(mip_levels(Pixels { width: 0, height: 4, rgba: vec![] }, &material).is_empty());
    }

    #[test]
    fn wrap_modes_bring_any_index_inside() {
        let at = |wrap: Wrap| [-3, -1, 0, 3, 4, 7, 8].map(|i| wrap.inside(i, 4));
        assert_eq!(at(Wrap::Repeat), [1, 3, 0, 3, 0, 3, 0]);
        assert_eq!(at(Wrap::Clamp), [0, 0, 0, 3, 3, 3, 3]);
        assert_eq!(at(Wrap::Mirror), [2, 0, 0, 3, 3, 0, 0]);
        for coordinate in [f32::NAN, f32::INFINITY, -1e30, 1e30] {
            let ([a, b], fraction) = split(coordinate, 4, Wrap::Repeat);
            assert!(a < 4 && b < 4 && (fraction.is_nan() || fraction <= 1.0), "{coordinate}");
        }
    }

    #[test]
    fn srgb_bytes_survive_the_way_to_linear_and_back() {
        let srgb = SrgbTable::new();
        assert!((0..=255).all(|byte| srgb_from_linear(srgb.linear(byte)) == byte));
    }
}
