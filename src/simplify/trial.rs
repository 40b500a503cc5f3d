//! Trial of how leaves grow: the plant is simplified twice, coarsely, by scale and by tiling, and
//! what the views then show is compared with the full plant.
//!
//! The two ways lead to different orders and scales, so drawing one order in both ways would favour
//! the way that it was made for. Four views at half the resolution suffice. With a quarter of it,
//! leaflets of a pecan fall between pixels, and its tiles seem worse than they are.
//!
//! The views are compared at a quarter of the resolution, each pixel the mean of 16 samples, since
//! few leaves are drawn for a plant that is far away: at 256 pixels, a plant with 5 % of its leaves
//! is seen as large as it is in a view of 57.
//!
//! Limits: each leaf has a single colour (see [`appearance`](super::appearance)), so textures do
//! not count in the grain; tone is left out.

use super::{
    appearance::{Appearance, Look, ViewLook},
    capture::capture_shown,
    enlarge::Enlarger,
    fragments::FragmentSource,
    options::SimplifyOptions,
    progress::Observer,
    views::ViewSet,
    work::{Done, Fronts, Work},
};
use crate::Result;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of the leaves at which the resolution is halved, as in a cascade, and the share with which
/// the two ways are compared.
const SHARES: [f64; 2] = [0.15, 0.05];
/// Views of the trial: of a dodecahedron's and of a cube's vertices, those of a tetrahedron.
const VIEWS: [usize; 4] = [0, 3, 5, 6];
/// Fewest views of which only some take part.
const MANY_VIEWS: usize = 8;
/// Samples along each side of a pixel that is compared.
const SAMPLES: usize = 4;
/// Least side in pixels of the views that are compared.
const LEAST_PX: u32 = 8;
/// Fewest leaves behind each other, on average, with which tiling is tried: tiles of sparser crowns
/// read as a grid with sky between.
const LEAST_LAYERS: f64 = 2.0;

/// What a coarse trial showed of a plant with 5 % of its leaves, which grow by scale or by tiling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Leaves grow by scale.
    pub scale: Tried,
    /// Leaves grow by tiling.
    pub tile: Tried,
}

/// Differences between views of a plant with some of its leaves and of the full plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Root of the mean squared difference of colour and light, 0 to 255.
    pub rmse: f64,
    /// Area that only one of the two covers, over the area that the full plant covers.
    pub xor: f64,
    /// Differences between adjacent pixels, over those of the full plant: 1 if the view is as fine.
    pub grain: f64,
}

/// Tries both ways. `views` are those of the simplification. Returns `None` for a sparse crown,
/// which is not tried.
///
/// # Errors
/// The errors of `source`; [`Interrupted`](crate::Error::Interrupted) if the observer returns
/// false.
pub fn run(
    work: &Work<'_>,
    views: &ViewSet,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Option<Trial>> {
    let chosen: Vec<usize> = match views.views.len() {
        MANY_VIEWS.. => VIEWS.to_vec(),
        few => (0..few).collect(),
    };
    let views = views.chosen(&chosen);
    let of_chosen = |looks: Option<Arc<Appearance>>| looks.map(|looks| Arc::new(looks.of_views(&chosen)));
    let work = &Work { appearances: work.appearances.clone().map(of_chosen), ..work.clone() };
    let leaves = work.plant.leaves.len() as u64;
    observer.phase("growth", 2 * leaves);
    let side = (views.resolution / SAMPLES as u32).max(LEAST_PX);
    let compared = views.of_resolution(side * SAMPLES as u32);
    let full = capture_shown(work.shapes, &compared, |_| Some(1.0), false, source, |_| true)?.fronts;
    let mut shown = |tiles: bool| {
        let observer = &mut Within { outer: observer, before: if tiles { leaves } else { 0 }, at: 0, counts: false };
        let done = pruned(work, &views, tiles, source, observer)?;
        let scale = |leaf: usize| done.enlarger.as_ref().and_then(|enlarger: &Enlarger| enlarger.scale(leaf));
        let fronts = capture_shown(work.shapes, &compared, scale, tiles, source, |_| true)?.fronts;
        Ok((compare(work, [&full, &fronts], compared.resolution as usize), done.leaf_layers))
    };
    let (scale, layers) = shown(false)?;
    if layers < LEAST_LAYERS {
        return Ok(None);
    }
    Ok(Some(Trial { scale, tile: shown(true)?.0 }))
}

/// Prunes leaves coarsely.
fn pruned(
    work: &Work<'_>,
    views: &ViewSet,
    tiles: bool,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Done> {
    let half = (views.resolution / 2).max(1);
    let options = SimplifyOptions { resolution: half, ..work.options.clone() };
    let coarse = Work { options: &options, ..work.clone() };
    let mut done = Done { tiles, ..Done::default() };
    for (share, resolution) in SHARES.into_iter().zip([half, (half / 2).max(1)]) {
        let left = ((work.plant.leaves.len() as f64 * share) as usize).max(1);
        coarse.part(&views.of_resolution(resolution), left, &mut done, source, observer)?;
    }
    Ok(done)
}

/// Sums over pixels, exact in any order.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    squares: u64,
    only_one: u64,
    /// Samples that the full plant covers.
    covered: u64,
    /// Of the full plant and of the one with fewer leaves.
    gradients: [u64; 2],
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            only_one: self.only_one + other.only_one,
            covered: self.covered + other.covered,
            gradients: [0, 1].map(|i| self.gradients[i] + other.gradients[i]),
        }
    }
}

/// Compares the frontmost polygons in each view of the full plant and of one with fewer leaves.
/// `side` is the number of samples along a side.
fn compare(work: &Work<'_>, [full, fewer]: [&Fronts; 2], side: usize) -> Tried {
    let Some(looks) = &work.appearances[2] else { return Tried { rmse: 0.0, xor: 0.0, grain: 1.0 } };
    let of_view = |view: usize| sums(&looks.view(view), [&full[view], &fewer[view]], side);
    let sums = (0..full.len()).into_par_iter().map(of_view).reduce(Sums::default, Sums::plus);
    let values = (full.len() * CHANNELS * (side / SAMPLES) * (side / SAMPLES)) as f64;
    let samples = (SAMPLES * SAMPLES) as f64;
    Tried {
        rmse: (sums.squares as f64 / values).sqrt() / samples,
        xor: sums.only_one as f64 / sums.covered.max(1) as f64,
        grain: sums.gradients[1] as f64 / sums.gradients[0].max(1) as f64,
    }
}

/// Channels of a look that are in use.
const CHANNELS: usize = 6;

/// Sums over the samples of a pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    channels: [u32; CHANNELS],
    covered: u32,
}

fn sums(looks: &ViewLook<'_>, fronts: [&Vec<u32>; 2], side: usize) -> Sums {
    let pictures = fronts.map(|fronts| picture(looks, fronts, side));
    let mut sums = Sums { gradients: [0, 1].map(|i| gradient(&pictures[i], side / SAMPLES)), ..Sums::default() };
    for (full, fewer) in pictures[0].iter().zip(&pictures[1]) {
        let square = |i: usize| u64::from(full.channels[i].abs_diff(fewer.channels[i])).pow(2);
        sums.squares += (0..CHANNELS).map(square).sum::<u64>();
        sums.covered += u64::from(full.covered);
        sums.only_one += u64::from(full.covered.abs_diff(fewer.covered));
    }
    sums
}

/// The picture that a view shows before a pale sky.
fn picture(looks: &ViewLook<'_>, fronts: &[u32], side: usize) -> Vec<Pixel> {
    let width = side / SAMPLES;
    let mut pixels = vec![Pixel::default(); width * width];
    for (y, row) in fronts.chunks_exact(side).enumerate() {
        for (x, &front) in row.iter().enumerate() {
            let pixel = &mut pixels[y / SAMPLES * width + x / SAMPLES];
            let look: Look = looks.before_sky(front);
            (0..CHANNELS).for_each(|i| pixel.channels[i] += u32::from(look[i]));
            pixel.covered += u32::from(!looks.is_background(front));
        }
    }
    pixels
}

/// Sum of the absolute differences between pixels beside and above each other.
fn gradient(pixels: &[Pixel], width: usize) -> u64 {
    let difference =
        |a: &Pixel, b: &Pixel| (0..CHANNELS).map(|i| u64::from(a.channels[i].abs_diff(b.channels[i]))).sum::<u64>();
    let differences = |a: &[Pixel], b: &[Pixel]| a.iter().zip(b).map(|(a, b)| difference(a, b)).sum::<u64>();
    let rows = || pixels.chunks_exact(width);
    let across: u64 = rows().map(|row| differences(row, &row[1..])).sum();
    let down: u64 = rows().zip(rows().skip(1)).map(|(row, below)| differences(row, below)).sum();
    across + down
}

/// Passes the number of pruned leaves on to the observer of the whole.
struct Within<'a> {
    outer: &'a mut dyn Observer,
    /// Number of leaves before those that this one counts.
    before: u64,
    /// Number of leaves pruned so far.
    at: u64,
    /// Whether the phase counts leaves.
    counts: bool,
}

impl Observer for Within<'_> {
    fn phase(&mut self, name: &str, _: u64) {
        self.counts = name == "prune";
    }

    fn advance(&mut self, done: u64) -> bool {
        if self.counts {
            self.at = done;
        }
        self.outer.advance(self.before + self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels whose samples all show one grey level.
    fn grey(levels: &[u8]) -> Vec<Pixel> {
        let of_level = |&level: &u8| Pixel { channels: [u32::from(level) * 16; CHANNELS], covered: 16 };
        levels.iter().map(of_level).collect()
    }

    #[test]
    fn the_gradient_counts_each_pair_of_neighbours_once() {
        let step = 16 * CHANNELS as u64;
        assert_eq!(gradient(&grey(&[0, 0, 0, 0]), 2), 0);
        assert_eq!(gradient(&grey(&[0, 3, 0, 3]), 2), 6 * step);
        assert_eq!(gradient(&grey(&[0, 3, 5, 4]), 2), (3 + 1 + 5 + 1) * step);
    }

    #[test]
    fn progress_never_goes_back_and_stops_when_told() {
        struct Seen(Vec<u64>);
        impl Observer for Seen {
            fn phase(&mut self, _: &str, _: u64) {}

            fn advance(&mut self, done: u64) -> bool {
                self.0.push(done);
                done < 130
            }
        }
        let mut seen = Seen(Vec::new());
        let mut within = Within { outer: &mut seen, before: 100, at: 0, counts: false };
        for (phase, steps) in [("fragments", [2, 4]), ("prune", [10, 20]), ("fragments", [2, 4]), ("prune", [25, 30])] {
            within.phase(phase, 30);
            assert!(within.advance(steps[0]));
            assert_eq!(within.advance(steps[1]), steps[1] != 30);
        }
        assert_eq!(seen.0, [100, 100, 110, 120, 120, 120, 125, 130]);
    }
}
