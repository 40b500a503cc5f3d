//! Image metrics between pictures of a reduced plant and of the full one.
//!
//! - **rmse**: root of the mean squared difference of all sRGB bytes, against a pale sky; 0 to 255.
//! - **ssim**: structural similarity of the luma (Z. Wang et al., *Image Quality Assessment*,
//!   2004), from the crate `image-compare`; 1 for equal pictures.
//! - **flip**: mean of FLIP (P. Andersson et al., 2020), from NVIDIA's own code; 0 for equal
//!   pictures. Only with the feature `flip`, which compiles it.
//! - **coverage**: covered area divided by the full plant's, minus 1.
//! - **xor**: area that only one of the two covers, divided by the full plant's area. Partly
//!   covered pixels count in part.
//! - **grain**: mean absolute gradient of the luma, against the same sky, divided by that of the
//!   full plant's picture; 1 if the picture is as fine, less for few large leaves in the place of
//!   many small ones. The gradient of a pixel is how much its luma differs from that of its
//!   neighbours to the right and below: the *absolute gradient* of F. Groen, I. Young and
//!   G. Ligthart, *A comparison of different focus functions for use in autofocus algorithms*
//!   (1985).
//!
//! Pictures carry their coverage as alpha
//! ([`Background::Transparent`](crate::software::Background::Transparent)).
//!
//! Limits: still pictures only; for motion see [`largest_change`]. Strong edges of large leaves
//! raise the grain as well as many small leaves do, so it tells little where leaves contrast with
//! each other.

use crate::{Error, Result, software::Image};
use image_compare::Algorithm;

/// Background colour behind the plants, sRGB.
const SKY: [u8; 3] = [220, 230, 240];
/// Weights of red, green and blue in the luma (ITU-R BT.709).
const LUMA: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Minimum side of pictures for SSIM: the side of its window.
const LEAST_SIDE: u32 = 8;

/// Mean metrics over several pairs of pictures of equal size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// 0 to 255.
    pub rmse: f64,
    /// At most 1; NaN for pictures below 8 pixels on a side.
    pub ssim: f64,
    /// 0 to 1; NaN without the feature `flip`.
    pub flip: f64,
    /// -1 for an empty picture, 0 for the coverage of the full plant.
    pub coverage: f64,
    /// 0 for equal silhouettes.
    pub xor: f64,
    /// 0 for an empty picture, 1 for one as fine as the full plant's; NaN if the latter is empty.
    pub grain: f64,
}

/// Sums over pairs of pictures.
#[derive(Debug, Clone, Copy, Default)]
pub struct Comparison {
    pairs: f64,
    squares: f64,
    bytes: f64,
    ssim: f64,
    flip: f64,
    covered: f64,
    covered_full: f64,
    xor: f64,
    gradient: f64,
    gradient_full: f64,
}

impl Comparison {
    /// Compares one pair.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for pictures of different size.
    pub fn of(full: &Image, reduced: &Image) -> Result<Self> {
        if (full.width, full.height) != (reduced.width, reduced.height) || full.rgba.len() != reduced.rgba.len() {
            let value = format!("{} x {}", reduced.width, reduced.height);
            let allowed = format!("{} x {}, like the picture it is compared with", full.width, full.height);
            return Err(Error::invalid("picture size", value, allowed));
        }
        let mut sums = Self { pairs: 1.0, ..Self::default() };
        for (full, reduced) in full.rgba.chunks_exact(4).zip(reduced.rgba.chunks_exact(4)) {
            let [a, b] = [full, reduced].map(before_sky);
            sums.squares += (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2)).sum::<f64>();
            let [a, b] = [full, reduced].map(|pixel| f64::from(pixel[3]) / 255.0);
            sums.covered_full += a;
            sums.covered += b;
            sums.xor += (a - b).abs();
        }
        sums.bytes = 3.0 * f64::from(full.width) * f64::from(full.height);
        [sums.gradient_full, sums.gradient] = [full, reduced].map(gradient);
        sums.ssim = ssim(full, reduced);
        sums.flip = flip(full, reduced);
        Ok(sums)
    }

    /// Adds the sums of two comparisons.
    pub fn plus(self, other: Self) -> Self {
        Self {
            pairs: self.pairs + other.pairs,
            squares: self.squares + other.squares,
            bytes: self.bytes + other.bytes,
            ssim: self.ssim + other.ssim,
            flip: self.flip + other.flip,
            covered: self.covered + other.covered,
            covered_full: self.covered_full + other.covered_full,
            xor: self.xor + other.xor,
            gradient: self.gradient + other.gradient,
            gradient_full: self.gradient_full + other.gradient_full,
        }
    }

    /// Means over all pairs; NaN if nothing was compared or the full plant covers nothing.
    pub fn quality(&self) -> Quality {
        Quality {
            rmse: (self.squares / self.bytes).sqrt(),
            ssim: self.ssim / self.pairs,
            flip: self.flip / self.pairs,
            coverage: self.covered / self.covered_full - 1.0,
            xor: self.xor / self.covered_full,
            grain: self.gradient / self.gradient_full,
        }
    }
}

/// Largest mean difference between consecutive pictures, in sRGB bytes: the popping along a path. 0
/// for fewer than two pictures.
///
/// # Errors
/// [`Error::InvalidOption`] for pictures of different size.
pub fn largest_change(pictures: &[Image]) -> Result<f64> {
    pictures.windows(2).try_fold(0.0, |largest: f64, pair| {
        Comparison::of(&pair[0], &pair[1])?;
        let bytes = |image: &Image| image.rgba.chunks_exact(4).flat_map(before_sky).collect::<Vec<u8>>();
        let [a, b] = [bytes(&pair[0]), bytes(&pair[1])];
        let change: f64 = a.iter().zip(&b).map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
        Ok(largest.max(change / a.len().max(1) as f64))
    })
}

/// Composites a pixel over the sky.
fn before_sky(pixel: &[u8]) -> [u8; 3] {
    let alpha = u32::from(pixel[3]);
    [0, 1, 2].map(|i| ((u32::from(pixel[i]) * alpha + u32::from(SKY[i]) * (255 - alpha) + 127) / 255) as u8)
}

/// Sum of the absolute differences in luma between pixels beside and above each other.
fn gradient(image: &Image) -> f64 {
    let width = image.width.max(1) as usize;
    let luma = |pixel: &[u8]| before_sky(pixel).iter().zip(LUMA).map(|(&byte, weight)| f64::from(byte) * weight).sum();
    let lumas: Vec<f64> = image.rgba.chunks_exact(4).map(luma).collect();
    let differences = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>();
    let rows = || lumas.chunks_exact(width);
    let across: f64 = rows().map(|row| differences(row, &row[1..])).sum();
    let down: f64 = rows().zip(rows().skip(1)).map(|(row, below)| differences(row, below)).sum();
    across + down
}

fn rgb(image: &Image) -> image::RgbImage {
    let bytes = image.rgba.chunks_exact(4).flat_map(before_sky).collect();
    image::RgbImage::from_raw(image.width, image.height, bytes).unwrap_or_default()
}

fn ssim(full: &Image, reduced: &Image) -> f64 {
    if full.width.min(full.height) < LEAST_SIDE {
        return f64::NAN;
    }
    let [a, b] = [full, reduced].map(|image| image::DynamicImage::ImageRgb8(rgb(image)).into_luma8());
    image_compare::gray_similarity_structure(&Algorithm::MSSIMSimple, &a, &b).map_or(f64::NAN, |result| result.score)
}

#[cfg(feature = "flip")]
fn flip(full: &Image, reduced: &Image) -> f64 {
    use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};
    let [a, b] = [full, reduced].map(|image| FlipImageRgb8::with_data(image.width, image.height, &rgb(image)));
    FlipPool::from_image(&flip(a, b, DEFAULT_PIXELS_PER_DEGREE)).mean().into()
}

#[cfg(not(feature = "flip"))]
fn flip(_: &Image, _: &Image) -> f64 {
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A black square of `side` pixels with its corner at (x, 8) on a transparent background.
    fn square(x: u32, side: u32) -> Image {
        let mut image = Image::filled(64, 64, [0; 4]);
        image.paste(&Image::filled(side, side, [0, 0, 0, 255]), x, 8);
        image
    }

    fn quality(full: &Image, reduced: &Image) -> Quality {
        Comparison::of(full, reduced).unwrap().quality()
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let Quality { rmse, ssim, flip, coverage, xor, grain } = quality(&square(8, 16), &square(8, 16));
        assert_eq!([rmse, ssim, coverage, xor, grain], [0.0, 1.0, 0.0, 0.0, 1.0]);
        assert!(if cfg!(feature = "flip") { flip == 0.0 } else { flip.is_nan() });
    }

    #[test]
    fn a_square_that_moved_by_half_its_side_differs_by_its_area() {
        let found = quality(&square(8, 16), &square(16, 16));
        assert_eq!([found.coverage, found.xor], [0.0, 1.0]);
        let squares = SKY.map(|c| f64::from(c).powi(2)).iter().sum::<f64>() * 256.0;
        assert!((found.rmse - (squares / (3.0 * 4096.0)).sqrt()).abs() < 1e-9);
        assert!(found.ssim < 0.95, "{}", found.ssim);
    }

    #[test]
    fn a_smaller_square_lacks_coverage_and_pixels_covered_in_part_count_in_part() {
        let found = quality(&square(8, 16), &square(8, 8));
        assert_eq!([found.coverage, found.xor], [-0.75, 0.75]);
        let half = Image { rgba: square(8, 16).rgba.iter().map(|byte| byte / 5).collect(), ..square(8, 16) };
        let found = quality(&square(8, 16), &half);
        assert!((found.coverage + 0.8).abs() < 1e-9 && (found.xor - 0.8).abs() < 1e-9);
    }

    #[test]
    fn means_are_of_pixels_and_of_area() {
        let both = Comparison::of(&square(8, 16), &square(8, 16))
            .unwrap()
            .plus(Comparison::of(&square(8, 16), &square(8, 8)).unwrap());
        let single = quality(&square(8, 16), &square(8, 8));
        let mean = both.quality();
        assert!((mean.rmse - single.rmse / 2.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!([mean.coverage, mean.xor], [-0.375, 0.375]);
        assert_eq!(mean.ssim, (1.0 + single.ssim) / 2.0);
    }

    #[test]
    fn grain_is_the_length_of_edges_times_their_contrast() {
        let grain = |reduced: &Image| quality(&square(8, 16), reduced).grain;
        assert_eq!(grain(&square(20, 16)), 1.0, "wherever it is");
        assert!((grain(&square(8, 8)) - 0.5).abs() < 1e-12, "half as much edge");
        let mut four = Image::filled(64, 64, [0; 4]);
        for corner in [[0, 0], [16, 0], [0, 16], [16, 16]] {
            four.paste(&Image::filled(8, 8, [0, 0, 0, 255]), 8 + corner[0], 8 + corner[1]);
        }
        assert!((grain(&four) - 2.0).abs() < 1e-12, "four squares of the same area have twice the edge");
        let sky = SKY.iter().zip(LUMA).map(|(&byte, weight)| f64::from(byte) * weight).sum::<f64>();
        let grey = Image { rgba: square(8, 16).rgba.chunks(4).flat_map(|p| [100, 100, 100, p[3]]).collect(), ..four };
        assert!((grain(&grey) - (sky - 100.0) / sky).abs() < 1e-12, "less contrast");
        assert_eq!(grain(&Image::filled(64, 64, [0; 4])), 0.0);
        let empty = Image::filled(64, 64, [0; 4]);
        assert!(quality(&empty, &empty).grain.is_nan());
    }

    #[test]
    fn the_largest_change_is_the_largest_step_of_a_path() {
        let path = [8, 9, 9, 17, 18].map(|x| square(x, 16));
        let pair = |a: &Image, b: &Image| largest_change(&[a.clone(), b.clone()]).unwrap();
        assert_eq!(largest_change(&path).unwrap(), pair(&path[2], &path[3]));
        let bytes = SKY.map(f64::from).iter().sum::<f64>() * 2.0 * 16.0;
        assert!((pair(&path[0], &path[1]) - bytes / (3.0 * 4096.0)).abs() < 1e-9);
        assert_eq!(largest_change(&path[..1]).unwrap(), 0.0);
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        assert!(Comparison::of(&square(8, 16), &Image::filled(64, 63, [0; 4])).is_err());
        assert!(quality(&Image::filled(4, 4, [9; 4]), &Image::filled(4, 4, [9; 4])).ssim.is_nan());
    }
}
