//! Textures ready for sampling: a mip chain in which the alpha test covers the same fraction of the
//! texture at every level.
//!
//! Colour is averaged in linear light and weighted by alpha, so that the colour painted behind a
//! leaf's outline does not bleed in. Averaged alpha alone would thin out a crown with distance,
//! because fewer texels reach the cutoff; the alpha of each level is therefore rescaled until the
//! same fraction of texels passes as in the full texture. After I. Castano, "Computing Alpha
//! Mipmaps" (2010), but with the scale read from a histogram instead of found by bisection.
//!
//! Limits: a texture whose side is not a power of two loses its last row or column at each odd
//! level.

use crate::{
    material::{Pixels, Wrap},
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

impl Mips {
    /// Builds the mip chain. `cutoff` is the material's alpha cutoff, or `None` if alpha is ignored
    /// (it then counts as 1). Returns `None` for a texture without texels.
    pub(crate) fn new(mut full: Pixels, wrap: [Wrap; 2], cutoff: Option<f32>, srgb: &SrgbTable) -> Option<Self> {
        if full.width == 0 || full.height == 0 {
            return None;
        }
        if cutoff.is_none() {
            full.rgba.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = 255);
        }
        let mut levels = vec![full];
        while let Some(last) = levels.last().filter(|last| last.width > 1 || last.height > 1) {
            let next = halved(last, srgb);
            levels.push(next);
        }
        if let Some(cutoff) = cutoff {
            let share = share_covered(&levels[0], cutoff);
            levels[1..].iter_mut().for_each(|level| rescale_alpha(level, cutoff, share));
        }
        Some(Self { levels, wrap })
    }

    /// All levels, the full size first.
    #[cfg(feature = "render")]
    pub(crate) fn levels(&self) -> &[Pixels] {
        &self.levels
    }

    /// Number of texels of the full texture.
    pub(crate) fn full_texels(&self) -> f32 {
        self.levels[0].width as f32 * self.levels[0].height as f32
    }

    /// Mip level at which `texels_per_sample` texels of the full texture (an area) become about
    /// one.
    pub(crate) fn level_for(&self, texels_per_sample: f32) -> u8 {
        let level = (0.5 * texels_per_sample.max(1.0).log2() + 0.5) as usize;
        level.min(self.levels.len() - 1) as u8
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
    ([wrapped(index, size, wrap), wrapped(index + 1, size, wrap)], fraction)
}

fn wrapped(index: i64, size: u32, wrap: Wrap) -> u32 {
    let size = size as i64;
    let inside = match wrap {
        _ if (0..size).contains(&index) => index,
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0, size - 1),
        Wrap::Mirror => {
            let twice = index.rem_euclid(2 * size);
            twice.min(2 * size - 1 - twice)
        }
    };
    inside as u32
}

fn texel(pixels: &Pixels, x: u32, y: u32) -> [u8; 4] {
    let at = 4 * (y as usize * pixels.width as usize + x as usize);
    [pixels.rgba[at], pixels.rgba[at + 1], pixels.rgba[at + 2], pixels.rgba[at + 3]]
}

fn halved(from: &Pixels, srgb: &SrgbTable) -> Pixels {
    let (width, height) = ((from.width / 2).max(1), (from.height / 2).max(1));
    let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let xs = [2 * x, (2 * x + 1).min(from.width - 1)];
            let ys = [2 * y, (2 * y + 1).min(from.height - 1)];
            let four = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| texel(from, xs[i], ys[j]));
            rgba.extend_from_slice(&average(four, srgb));
        }
    }
    Pixels { width, height, rgba }
}

fn average(texels: [[u8; 4]; 4], srgb: &SrgbTable) -> [u8; 4] {
    let alpha_sum: f32 = texels.iter().map(|texel| texel[3] as f32).sum();
    let weight = |texel: &[u8; 4]| if alpha_sum > 0.0 { texel[3] as f32 / alpha_sum } else { 0.25 };
    let channel = |c: usize| texels.iter().map(|texel| weight(texel) * srgb.linear(texel[c])).sum::<f32>();
    let [r, g, b] = [channel(0), channel(1), channel(2)].map(srgb_from_linear);
    [r, g, b, (alpha_sum / 4.0 + 0.5) as u8]
}

fn passes(alpha: u8, cutoff: f32) -> bool {
    alpha as f32 / 255.0 >= cutoff
}

fn share_covered(pixels: &Pixels, cutoff: f32) -> f64 {
    let covered = pixels.rgba.iter().skip(3).step_by(4).filter(|&&alpha| passes(alpha, cutoff)).count();
    covered as f64 / (pixels.rgba.len() / 4) as f64
}

/// Scales alpha so that a fraction `share` of all texels reaches the cutoff, as closely as 8 bits
/// allow.
fn rescale_alpha(pixels: &mut Pixels, cutoff: f32, share: f64) {
    let mut histogram = [0u32; 256];
    pixels.rgba.iter().skip(3).step_by(4).for_each(|&alpha| histogram[alpha as usize] += 1);
    if share == 0.0 {
        return;
    }
    let wanted = share * (pixels.rgba.len() / 4) as f64;
    let mut reached = 0.0;
    let mut threshold = None;
    for alpha in (1..256).rev().filter(|&alpha| histogram[alpha] > 0) {
        let count = histogram[alpha] as f64;
        // Stop if leaving these texels out comes closer to the share than including them.
        if threshold.is_some() && reached + 0.5 * count > wanted {
            break;
        }
        reached += count;
        threshold = Some(alpha);
    }
    let Some(threshold) = threshold else { return };
    let scale = (cutoff * 255.0).ceil() / threshold as f32;
    for alpha in pixels.rgba.iter_mut().skip(3).step_by(4) {
        *alpha = (*alpha as f32 * scale).round().min(255.0) as u8;
    }
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
    fn every_level_covers_about_the_share_of_the_full_texture() {
        let srgb = SrgbTable::new();
        let mips = Mips::new(disc(128, 20.0), [Wrap::Clamp; 2], Some(0.5), &srgb).unwrap();
        let full = share_covered(&mips.levels[0], 0.5);
        for level in &mips.levels[1..5] {
            let one_ring = 0.35 * full + 1.0 / (level.width * level.height) as f64;
            assert!((share_covered(level, 0.5) - full).abs() <= one_ring, "{} {full}", share_covered(level, 0.5));
        }
    }

    #[test]
    fn colour_behind_the_outline_does_not_bleed_into_halved_levels() {
        let srgb = SrgbTable::new();
        let mips = Mips::new(disc(64, 20.0), [Wrap::Clamp; 2], Some(0.5), &srgb).unwrap();
        let [red, green, _] = mips.color(3, [0.5, 0.5], &srgb);
        assert!(red < 0.1 && green > 0.3, "{red} {green}");
    }

    #[test]
    fn wrap_modes_bring_any_index_inside() {
        let at = |wrap| [-3, -1, 0, 3, 4, 7, 8].map(|i| wrapped(i, 4, wrap));
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
