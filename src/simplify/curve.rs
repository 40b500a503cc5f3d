//! Measurement of a model's error curve: what views of fewer leaves show is compared with what
//! those of all leaves show.
//!
//! The views are not those of the simplification: four cameras around the plant, level and from
//! above, at vertices of another solid. Each is a picture of few pixels, each pixel the mean of
//! some samples, since few leaves are drawn for a plant that is far away. The difference of a pixel
//! is that of the criterion `image`, of means: squares of the differences of colour, of the normal
//! and of coverage. From the same samples, pictures of a quarter of the size show how the error
//! grows with the size.
//!
//! All sums are of integers.
//!
//! Limits: each leaf has a single colour (see [`appearance`](super::appearance)); tone is left out;
//! at other sizes the error is that of a power law through the two.

use super::{
    appearance::{Appearance, COVERAGE, Look, ViewLook},
    capture::capture_shown,
    fragments::FragmentSource,
    masks::Masks,
    raster::CpuFragments,
    shapes::Shapes,
    views::{MAX_RESOLUTION, ViewSet},
    work::Fronts,
};
use crate::{
    Error, Result,
    error::check_range,
    model::{ErrorCurve, FoliageModel, Timeline},
};
use rayon::prelude::*;

/// Views by number of vertices of their solid, of which none is among those of another: level and
/// 32 degrees above of an icosahedron's, and those above of a cube's for a model that was made with
/// an icosahedron's.
const VIEWS: [(u32, [usize; 4]); 2] = [(12, [0, 2, 3, 5]), (8, [0, 1, 4, 5])];
/// How much smaller the small pictures are.
const SMALLER: u32 = 4;
/// Part of the leaves down to which the counts are close together.
const SMALL_STEPS: f64 = 1.0 / 64.0;

/// How an error curve is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CurveOptions {
    /// Side of the pictures in pixels, in which the plant's bounding sphere is as wide: a multiple
    /// of 4 from 8 to 512.
    pub side_px: u32,
    /// Samples along each side of a pixel: 1 to 8, as long as `side_px` times it is at most 2048.
    pub samples: u32,
    /// Counts in an octave, from all leaves down to one in 64; below there are half as many. 1 to
    /// 64.
    pub steps: u32,
}

impl CurveOptions {
    /// Pictures of 64 pixels and two counts in an octave, with samples that cost about a tenth of
    /// the simplification that made the model: 4, 9 or 16 for views of up to 128, 256 and more
    /// pixels.
    pub fn for_model(model: &FoliageModel) -> Self {
        Self { side_px: 64, samples: (3 * model.recipe.resolution / 256).clamp(2, 4), steps: 2 }
    }

    /// Checks both numbers.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for the first out of its range.
    pub fn check(&self) -> Result<()> {
        check_range("side_px", self.side_px, 8..=512)?;
        check_range("samples", self.samples, 1..=8)?;
        check_range("steps", self.steps, 1..=64)?;
        if !self.side_px.is_multiple_of(SMALLER) {
            return Err(Error::invalid("side_px", self.side_px, "a multiple of 4"));
        }
        check_range("side_px", self.side_px * self.samples, 1..=MAX_RESOLUTION)
    }
}

/// Measures the error curve of a model. The curve is the same for any number of threads and on any
/// machine. `advance` receives the number of counts done, of [`curve_steps`], and returns whether
/// to continue.
///
/// # Errors
/// [`Error::InvalidModel`], [`Error::InvalidOption`], [`Unreadable`](Error::Unreadable) if a
/// texture cannot be decoded, and [`Error::Interrupted`] if `advance` returns false.
pub fn error_curve(
    model: &FoliageModel,
    options: &CurveOptions,
    advance: &mut dyn FnMut(u64) -> bool,
) -> Result<ErrorCurve> {
    model.validate()?;
    options.check()?;
    let plant = model.to_plant();
    let (count, chosen) = VIEWS[usize::from(model.recipe.views == VIEWS[0].0)];
    let views = ViewSet::new(plant.sphere(), options.side_px * options.samples, count)?.chosen(&chosen);
    let masks = Masks::new(&plant)?;
    let shapes = Shapes::new(&plant, &views, &masks, model.max_scale);
    let looks = Appearance::image(&plant, &views)?;
    let mut source = CpuFragments::new();
    source.prepare(&masks.masks)?;
    let timeline = Timeline::new(model);
    let mut shown = |count: u32| -> Result<Fronts> {
        let scale = |leaf: usize| (leaf < count as usize).then(|| timeline.scale(leaf as u32, count));
        Ok(capture_shown(&shapes, &views, scale, model.growth.tiles, &mut source, |_| true)?.fronts)
    };
    let leaves = model.leaves.len() as u32;
    let full = Pictures::new(&looks, &shown(leaves)?, *options, None);
    let mut points = vec![(leaves, [0.0; 2])];
    for count in counts(leaves, options.steps) {
        let fewer = Pictures::new(&looks, &shown(count)?, *options, Some(&full.means));
        points.push((count, full.errors(&fewer)));
        if !advance(points.len() as u64) {
            return Err(Error::Interrupted);
        }
    }
    points.reverse();
    let power = size_power(&points);
    Ok(ErrorCurve::hull(
        options.side_px as f32,
        power,
        points.into_iter().map(|(count, [error, _])| (count, error as f32)),
    ))
}

/// Number of counts at which the curve of a model of so many leaves is measured.
pub fn curve_steps(leaves: u32, options: &CurveOptions) -> u64 {
    1 + counts(leaves, options.steps).len() as u64
}

/// Counts below all leaves, decreasing to 0.
fn counts(leaves: u32, steps: u32) -> Vec<u32> {
    let factors = [1.0, 2.0].map(|times| libm::exp2(-times / f64::from(steps.max(1))));
    let mut counts = Vec::new();
    let (mut at, mut last) = (f64::from(leaves), leaves);
    while last > 0 {
        at *= factors[usize::from(at <= SMALL_STEPS * f64::from(leaves))];
        last = (at.round() as u32).min(last - 1);
        counts.push(last);
    }
    counts
}

/// Power of the diameter that errors grow with: the mean over all counts whose error shows at both
/// sizes.
fn size_power(points: &[(u32, [f64; 2])]) -> f32 {
    let ratios: Vec<f64> =
        points.iter().map(|(_, [error, small])| error / small).filter(|r| r.is_finite() && *r > 0.0).collect();
    if ratios.is_empty() {
        return 2.0;
    }
    let octaves = ratios.iter().map(|&ratio| libm::log2(ratio)).sum::<f64>() / ratios.len() as f64;
    (octaves / libm::log2(f64::from(SMALLER))).clamp(0.0, 4.0) as f32
}

/// Channels of a look that are in use.
const CHANNELS: usize = 6;
/// Unit of the differences: coverage by all samples of a pixel.
type Sum = [i32; CHANNELS + 1];

/// What all views show, at both sizes: sums over the samples of a pixel of the looks, less the mean
/// look of the full plant, and of the coverage.
struct Pictures {
    of_size: [Vec<Sum>; 2],
    /// Mean look of each view.
    means: Vec<[i32; CHANNELS]>,
    options: CurveOptions,
}

impl Pictures {
    /// `means` are the mean looks; those of the fronts themselves if they are of the full plant.
    fn new(looks: &Appearance, fronts: &Fronts, options: CurveOptions, means: Option<&[[i32; CHANNELS]]>) -> Self {
        let of_view = |(view, fronts): (usize, &Vec<u32>)| {
            let look = looks.view(view);
            let mean = means.map_or_else(|| mean_look(&look, fronts), |means| means[view]);
            let large = picture(&look, fronts, &options, &mean);
            let small = smaller(&large, options.side_px as usize);
            (mean, [large, small])
        };
        let found: Vec<_> = fronts.par_iter().enumerate().map(|(view, fronts)| of_view((view, fronts))).collect();
        let (means, pictures): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let of_size = [0, 1].map(|size| pictures.iter().flat_map(|both| both[size].iter().copied()).collect());
        Self { of_size, means, options }
    }

    /// Mean error of a view in pixels, at both sizes.
    fn errors(&self, fewer: &Self) -> [f64; 2] {
        let samples = [1, SMALLER].map(|times| f64::from((times * self.options.samples).pow(2)));
        let views = self.means.len() as f64;
        [0, 1].map(|size| {
            let sum: u64 = self.of_size[size].iter().zip(&fewer.of_size[size]).map(|(a, b)| difference(a, b)).sum();
            sum as f64 / (COVERAGE as f64 * samples[size] * samples[size] * views)
        })
    }
}

/// Difference of two pixels, in [`COVERAGE`] and squared samples.
fn difference(a: &Sum, b: &Sum) -> u64 {
    let square = |i: usize| u64::from(a[i].abs_diff(b[i])).pow(2);
    COVERAGE as u64 * square(CHANNELS) + (0..CHANNELS).map(square).sum::<u64>()
}

fn mean_look(looks: &ViewLook<'_>, fronts: &[u32]) -> [i32; CHANNELS] {
    let (mut sums, mut count) = ([0_i64; CHANNELS], 0);
    for &front in fronts.iter().filter(|&&front| !looks.is_background(front)) {
        let look: Look = looks.before_sky(front);
        (0..CHANNELS).for_each(|i| sums[i] += i64::from(look[i]));
        count += 1;
    }
    sums.map(|sum| (sum / count.max(1)) as i32)
}

fn picture(looks: &ViewLook<'_>, fronts: &[u32], options: &CurveOptions, mean: &[i32; CHANNELS]) -> Vec<Sum> {
    let [width, samples] = [options.side_px as usize, options.samples as usize];
    let mut pixels = vec![Sum::default(); width * width];
    for (y, row) in fronts.chunks_exact(width * samples).enumerate() {
        for (x, &front) in row.iter().enumerate().filter(|(_, front)| !looks.is_background(**front)) {
            let pixel = &mut pixels[y / samples * width + x / samples];
            let look: Look = looks.before_sky(front);
            (0..CHANNELS).for_each(|i| pixel[i] += i32::from(look[i]) - mean[i]);
            pixel[CHANNELS] += 1;
        }
    }
    pixels
}

/// The small picture of a picture of a width.
fn smaller(pixels: &[Sum], width: usize) -> Vec<Sum> {
    let times = SMALLER as usize;
    let small = width / times;
    let mut sums = vec![Sum::default(); small * small];
    for (y, row) in pixels.chunks_exact(width).enumerate() {
        for (x, pixel) in row.iter().enumerate() {
            let sum = &mut sums[y / times * small + x / times];
            (0..=CHANNELS).for_each(|i| sum[i] += pixel[i]);
        }
    }
    sums
}
