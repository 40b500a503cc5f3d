//! Pages of an impostor's frames ready for sampling: what no surface covers is filled with the
//! colours and normals beside it, and mip levels weight them by coverage.

use super::mips::{SrgbTable, srgb_from_linear};
use crate::model::Impostor;

/// Levels of both pages of some frames, all frames of a level one after another.
#[derive(Debug)]
pub(crate) struct Pages {
    pub(crate) levels: Vec<PageLevel>,
}

/// One mip level of an impostor's pages, all frames one after another, four bytes a texel.
#[derive(Debug)]
pub struct PageLevel {
    /// Side of a frame in texels.
    pub side: u32,
    /// Colour (sRGB, not multiplied by coverage) and coverage.
    pub color: Vec<u8>,
    /// See [`Impostor::surface`].
    pub surface: Vec<u8>,
}

/// The pages of an impostor with all mip levels, the frames' own first, down to one texel a frame.
/// O(texels).
pub fn impostor_levels(impostor: &Impostor) -> Vec<PageLevel> {
    Pages::new(impostor).levels
}

/// Linear colour, mean normal, depth and what of a texel is leaves, each times its coverage, and
/// the coverage.
#[derive(Clone, Copy, Default)]
struct Sum {
    color: [f32; 3],
    /// To the right, up, towards the viewer.
    normal: [f32; 3],
    depth: f32,
    leaf: f32,
    coverage: f32,
}

impl Pages {
    /// Builds all levels of all frames of an impostor.
    pub(crate) fn new(impostor: &Impostor) -> Self {
        let texels = impostor.color.as_chunks::<4>().0.iter().zip(impostor.surface.as_chunks::<4>().0);
        Self::of_frames(impostor.frame_px, texels)
    }

    /// Builds all levels, from the frames' own down to one texel a frame. The texels of both pages
    /// are those of whole frames.
    pub(crate) fn of_frames<'a>(frame_px: u32, texels: impl Iterator<Item = (&'a [u8; 4], &'a [u8; 4])>) -> Self {
        let srgb = SrgbTable::new();
        let mut sums: Vec<Vec<Sum>> = vec![texels.map(|(color, surface)| Sum::of(color, surface, &srgb)).collect()];
        let mut sides = vec![frame_px];
        while let (Some(last), Some(&side)) = (sums.last(), sides.last())
            && side > 1
        {
            let halved = halved(last, side);
            sums.push(halved);
            sides.push(side / 2);
        }
        // From the coarsest level up, what is not covered shows what covers the texel above it.
        let mut filled: Vec<Vec<Sum>> = Vec::with_capacity(sums.len());
        for (level, &side) in sums.iter().zip(&sides).rev() {
            let of_level = match filled.last() {
                None => level.clone(),
                Some(above) => level.iter().enumerate().map(|(at, sum)| sum.or(&above[parent(at, side)])).collect(),
            };
            filled.push(of_level);
        }
        let levels = filled.iter().rev().zip(&sums).zip(sides).map(|((filled, own), side)| {
            let texels = filled.iter().zip(own).map(|(filled, own)| filled.texel(own.coverage));
            let (color, surface): (Vec<[u8; 4]>, Vec<[u8; 4]>) = texels.unzip();
            PageLevel { side, color: color.into_flattened(), surface: surface.into_flattened() }
        });
        Self { levels: levels.collect() }
    }
}

/// Index in the next level, of half the side, of the texel above texel `at`.
fn parent(at: usize, side: u32) -> usize {
    let (side, half) = (side as usize, (side / 2) as usize);
    let (frame, row, column) = (at / (side * side), at / side % side, at % side);
    (frame * half + (row / 2).min(half - 1)) * half + (column / 2).min(half - 1)
}

/// The level of half the side: each texel the mean of the four below it, or more at the end of an
/// odd side.
fn halved(level: &[Sum], side: u32) -> Vec<Sum> {
    let half = (side / 2) as usize;
    let frames = level.len() / (side * side) as usize;
    let mut sums = vec![(Sum::default(), 0_u32); frames * half * half];
    for (at, texel) in level.iter().enumerate() {
        let (sum, count) = &mut sums[parent(at, side)];
        sum.add(texel);
        *count += 1;
    }
    sums.into_iter().map(|(sum, count)| sum.times(1.0 / count as f32)).collect()
}

impl Sum {
    fn of(color: &[u8; 4], surface: &[u8; 4], srgb: &SrgbTable) -> Self {
        let coverage = f32::from(color[3]) / 255.0;
        let [right, up, depth, code] = surface.map(|byte| f32::from(byte) / 255.0);
        let is_leaf = code >= 0.5;
        let towards = (2.0 * code - 1.0).abs();
        let sum = Self {
            color: srgb.color([color[0], color[1], color[2]]).to_array(),
            normal: [2.0 * right - 1.0, 2.0 * up - 1.0, towards],
            depth,
            leaf: f32::from(u8::from(is_leaf)),
            coverage: 1.0,
        };
        sum.times(coverage)
    }

    fn add(&mut self, other: &Self) {
        (0..3).for_each(|i| self.color[i] += other.color[i]);
        (0..3).for_each(|i| self.normal[i] += other.normal[i]);
        self.depth += other.depth;
        self.leaf += other.leaf;
        self.coverage += other.coverage;
    }

    fn times(self, factor: f32) -> Self {
        Self {
            color: self.color.map(|value| value * factor),
            normal: self.normal.map(|value| value * factor),
            depth: self.depth * factor,
            leaf: self.leaf * factor,
            coverage: self.coverage * factor,
        }
    }

    /// This one, or `other` where nothing is covered.
    fn or(&self, other: &Self) -> Self {
        if self.coverage > 0.0 { *self } else { *other }
    }

    /// The bytes of both pages.
    fn texel(&self, coverage: f32) -> ([u8; 4], [u8; 4]) {
        let byte = |value: f32| (value * 255.0 + 0.5) as u8;
        if self.coverage <= 0.0 {
            return ([0; 4], [128, 128, 128, 255]);
        }
        let mean = self.times(1.0 / self.coverage);
        let [r, g, b] = mean.color.map(srgb_from_linear);
        let [right, up, towards] = mean.normal;
        ([r, g, b, byte(coverage)], surface_texel([right, up, towards], mean.depth, mean.leaf >= 0.5))
    }
}

/// The bytes of a surface: its mean normal (to the right, up, towards the viewer), its depth from 0
/// to 1, and whether it is mostly leaves.
pub(crate) fn surface_texel([right, up, towards]: [f32; 3], depth: f32, is_leaf: bool) -> [u8; 4] {
    let byte = |value: f32| (value * 255.0 + 0.5) as u8;
    let code = if is_leaf { 0.5 + 0.5 * towards } else { 0.5 - 0.5 * towards };
    // A code of exactly one half counts as leaves.
    let code = if is_leaf { byte(code).max(128) } else { byte(code).min(127) };
    [byte(right * 0.5 + 0.5), byte(up * 0.5 + 0.5), byte(depth), code]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Lattice;

    fn impostor(frame_px: u32) -> Impostor {
        let lattice = Lattice { across: 2, is_whole_sphere: false };
        let texels = (4 * frame_px * frame_px) as usize;
        let mut impostor = Impostor {
            lattice,
            frame_px,
            center: [0.0; 3],
            half_side: 1.0,
            color: vec![0; 4 * texels],
            surface: vec![0; 4 * texels],
        };
        for at in 0..texels {
            let (x, y) = (at as u32 % frame_px, at as u32 / frame_px % frame_px);
            if x + 2 * y < frame_px {
                impostor.color[4 * at..4 * at + 4].copy_from_slice(&[40, 120, 30, (100 + x) as u8]);
                impostor.surface[4 * at..4 * at + 4].copy_from_slice(&surface_texel([0.5, -0.2, 0.6], 0.7, y > 2));
            }
        }
        impostor
    }

    #[test]
    fn every_level_covers_as_much_and_nothing_stays_without_a_colour() {
        for frame_px in [8, 12, 64] {
            let impostor = impostor(frame_px);
            let pages = Pages::new(&impostor);
            let mean = |level: &PageLevel| {
                let alphas = level.color.iter().skip(3).step_by(4);
                alphas.map(|&alpha| f64::from(alpha)).sum::<f64>() / (level.color.len() / 4) as f64
            };
            assert_eq!(pages.levels.last().map(|level| level.side), Some(1));
            for level in &pages.levels {
                assert_eq!(level.color.len(), 4 * 4 * (level.side * level.side) as usize);
                // Odd sides give the texels at their end more weight.
                let bound = if frame_px == 12 { 6.0 } else { 0.51 };
                assert!((mean(level) - mean(&pages.levels[0])).abs() < bound, "{frame_px}: {}", level.side);
                assert!(level.color.as_chunks::<4>().0.iter().all(|texel| texel[..3] == [40, 120, 30]));
                let flat = level.surface.as_chunks::<4>().0;
                assert!(flat.iter().all(|texel| texel[0].abs_diff(191) <= 1 && texel[2].abs_diff(179) <= 1));
            }
        }
    }

    #[test]
    fn an_empty_frame_is_clear_at_every_level() {
        let mut impostor = impostor(8);
        impostor.color.fill(0);
        for level in Pages::new(&impostor).levels {
            assert!(level.color.iter().all(|&byte| byte == 0));
        }
    }
}
