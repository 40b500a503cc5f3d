//! How much stems are widened to cover as much as they do without levels.
//!
//! A tube of n sides on a circle is n sin(pi / n) / pi as wide as the circle on average, 17 % less
//! with three; a chord is shorter than its arc; and of the stems thinner than the error only some
//! are drawn. So for each stem, what it covers is measured at several errors, and it is widened
//! until that is what it covers in full, times what those that are left must cover more. What all
//! of them cover together is then measured too, and thin ones are widened more or less by it.

use super::{
    boost::{Factors, extent},
    level::WoodLevels,
    mesh::Lists,
    order::{LEAST_SWELL, NO_SWELL, SWELL_STEPS, SWELLS, Swell, WoodOrder, widened},
    ribbon::{boost, facing},
    slide::{SLIDE, Slides, vanishing},
    union::Union,
};
use crate::plant::Wood;
use glam::Vec3;
use rayon::prelude::*;

/// Steps of the search for one swell.
const STEPS: u32 = 3;
/// Times that all of the wood is measured.
const PASSES: u32 = 3;
/// Range of a correction for all of the wood in one pass.
const CORRECTIONS: [f32; 2] = [0.5, 2.0];
/// Directions that wood is seen from: along the axes and the diagonals of a cube.
const DIRECTIONS: [Vec3; 7] = {
    const D: f32 = 0.577_350_26;
    [Vec3::X, Vec3::Y, Vec3::Z, Vec3::splat(D), Vec3::new(-D, D, D), Vec3::new(D, -D, D), Vec3::new(D, D, -D)]
};

impl WoodOrder {
    /// Sets `swells` of stems of these widths that go at `ends`.
    pub(super) fn balance(&mut self, wood: &Wood, widths: &[f32], ends: &[f32]) {
        let vanish = vanishing(wood, self);
        let triangles = Lists::new(self.stems.len(), self.triangle_stems.iter().copied().zip(0..));
        let slides = Slides::new(&wood.vertices, self);
        let stem = |stem: usize| Seen {
            wood,
            slides,
            vanish: &vanish,
            triangles: triangles.of(stem as u32),
            width: widths[stem],
            end: ends[stem],
        };
        let stems: Vec<Seen<'_>> = (0..self.stems.len()).map(stem).collect();
        let mut more = More::new(wood, &stems);
        let mut swells: Vec<Swell> = stems.par_iter().map(|stem| stem.swell(&more, None)).collect();
        for _ in 0..PASSES {
            more.correct(&stems, &swells);
            swells = stems.par_iter().zip(&swells).map(|(stem, before)| stem.swell(&more, Some(before))).collect();
        }
        more.factors = Factors::new(2.0 * more.ball.1);
        self.swells = swells;
        self.boosts = Some(more.factors.boosts());
        let mut levels = WoodLevels::with_ribbons(wood, self);
        for _ in 0..PASSES {
            more.correct_ribbons(&levels);
            levels.boost(self, &more.factors);
        }
        self.boosts = Some(more.factors.boosts());
    }
}

/// How much more the stems that are left must cover at some errors.
struct More {
    factors: Factors,
    /// Middle of the wood and radius of a ball around it.
    ball: (Vec3, f32),
    /// What all of it covers.
    full: f32,
}

impl More {
    fn new(wood: &Wood, stems: &[Seen<'_>]) -> Self {
        let (middle, size) = extent(wood);
        let full: Vec<[Vec3; 3]> = stems.iter().flat_map(|stem| moved(&stem.at(0.0), 0.0)).collect();
        let full = Union::new(middle, 0.5 * size).with(|_| full.iter().copied()) as f32;
        Self { factors: Factors::new(size), ball: (middle, 0.5 * size), full }
    }

    /// Multiplies the factors so that stems with these swells would cover as much as in full.
    fn correct(&mut self, stems: &[Seen<'_>], swells: &[Swell]) {
        let triangles = |error: f32, is_thin: bool| -> Vec<[Vec3; 3]> {
            let drawn = stems.iter().zip(swells).filter(|(stem, _)| stem.is_thinned(error) == is_thin);
            drawn.flat_map(|(stem, swell)| moved(&stem.at(error), widened(swell, stem.width, error))).collect()
        };
        let times = |&error: &f32| {
            let [wide, thin] = [false, true].map(|is_thin| triangles(error, is_thin));
            self.times(|_| wide.iter().copied(), |_| thin.iter().copied())
        };
        let times: Vec<f32> = self.factors.errors.par_iter().map(times).collect();
        self.multiply(&times);
    }

    /// Multiplies the factors so that ribbons with these levels would cover as much as in full.
    fn correct_ribbons(&mut self, levels: &WoodLevels) {
        let times = |&error: &f32| {
            let level = levels.at(error);
            let is_thin = |triangle: &[u32; 3]| {
                let vertex = level.numbers[triangle[0] as usize];
                let width = levels.widths[levels.vertex_stems[vertex as usize] as usize];
                levels.half(vertex).is_some() && boost(error / width) > 1.0
            };
            let (thin, wide): (Vec<_>, Vec<_>) =
                level.triangles.iter().map(|(triangle, _)| *triangle).partition(is_thin);
            let seen = |triangles: Vec<[u32; 3]>| {
                let level = &level;
                move |direction: Vec3| {
                    let corner = |at: u32| {
                        let position = Vec3::from(level.vertices[at as usize].position);
                        position + facing(level.across[at as usize], direction).0
                    };
                    triangles.iter().map(|triangle| triangle.map(corner)).collect::<Vec<_>>().into_iter()
                }
            };
            self.times(seen(wide), seen(thin))
        };
        let times: Vec<f32> = self.factors.errors.par_iter().map(times).collect();
        self.multiply(&times);
    }

    /// How much more thin triangles must cover for all to cover as much as in full, given what is
    /// seen from a direction.
    fn times<W: Iterator<Item = [Vec3; 3]>, T: Iterator<Item = [Vec3; 3]>>(
        &self,
        wide: impl Fn(Vec3) -> W,
        thin: impl Fn(Vec3) -> T,
    ) -> f32 {
        let mut union = Union::new(self.ball.0, self.ball.1);
        let wide = union.with(wide);
        let all = union.with(thin);
        (self.full - wide as f32) / (all - wide) as f32
    }

    fn multiply(&mut self, times: &[f32]) {
        for (factor, times) in self.factors.factors.iter_mut().zip(times).filter(|(_, times)| times.is_finite()) {
            *factor *= times.clamp(CORRECTIONS[0], CORRECTIONS[1]);
        }
    }
}

/// One stem.
struct Seen<'a> {
    wood: &'a Wood,
    slides: Slides<'a>,
    vanish: &'a [f32],
    triangles: &'a [u32],
    width: f32,
    /// Error at which it goes.
    end: f32,
}

/// Position and normal of each corner of a triangle.
type Corners = [(Vec3, Vec3); 3];

impl Seen<'_> {
    /// Whether stems like this one are drawn in part only.
    fn is_thinned(&self, error: f32) -> bool {
        self.end < f32::INFINITY && boost(error / self.width) > 1.0
    }

    /// The swell of the stem; of what was found `before`, what does not depend on `more` is kept.
    fn swell(&self, more: &More, before: Option<&Swell>) -> Swell {
        let full = covered(&self.at(0.0), 0.0);
        let mut swell = [NO_SWELL; SWELLS];
        let mut last = 0.0;
        for (i, steps) in swell.iter_mut().enumerate() {
            let ratio = f32::from_bits(LEAST_SWELL.to_bits() + ((i as u32) << 22));
            let error = ratio * self.width;
            if let Some(before) = before.filter(|_| !self.is_thinned(error)) {
                *steps = before[i];
                last = (f32::from(before[i]) - f32::from(NO_SWELL)) / SWELL_STEPS;
                continue;
            }
            // Once it goes, it shrinks.
            if error < (1.0 - SLIDE) * self.end {
                let times = if self.is_thinned(error) { boost(ratio) * more.factors.at(error) } else { 1.0 };
                last = widening(&self.at(error), full * times, [last, self.width]) / error;
            }
            let found = (last * SWELL_STEPS).round() + f32::from(NO_SWELL);
            *steps = if found.is_finite() { found.clamp(0.0, 255.0) as u8 } else { NO_SWELL };
        }
        swell
    }

    /// The triangles at an error.
    fn at(&self, error: f32) -> Vec<Corners> {
        let left = self.triangles.iter().filter(|&&triangle| self.vanish[triangle as usize] > error);
        let corner = |index: usize| {
            let slid = self.slides.at(self.wood.indices[index], error);
            (slid.position, slid.normal)
        };
        left.map(|&triangle| [0, 1, 2].map(|i| corner(3 * triangle as usize + i))).collect()
    }
}

/// How far triangles must be widened to cover so much, found by secants from a guess.
fn widening(triangles: &[Corners], wanted: f32, [guess, width]: [f32; 2]) -> f32 {
    let mut last = (0.0, covered(triangles, 0.0));
    let mut at = if guess > 0.0 { guess * width } else { 0.1 * width };
    for _ in 0..STEPS {
        let now = covered(triangles, at);
        let slope = (now - last.1) / (at - last.0);
        let next = at + (wanted - now) / slope;
        if !(next.is_finite() && slope > 0.0) {
            break;
        }
        last = (at, now);
        at = next.clamp(-0.4 * width, 64.0 * width);
    }
    at
}

/// Triangles whose corners are moved so far along their normals.
fn moved(triangles: &[Corners], widened: f32) -> Vec<[Vec3; 3]> {
    let corner = |(position, normal): (Vec3, Vec3)| position + normal * widened;
    triangles.iter().map(|corners| corners.map(corner)).collect()
}

/// What triangles cover, widened so far, summed over the directions: the nearer side hides the
/// other.
fn covered(triangles: &[Corners], widened: f32) -> f32 {
    let mut sides = [[0.0_f32; 2]; DIRECTIONS.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|(position, normal)| position + normal * widened);
        let across = (b - a).cross(c - a);
        for (direction, [front, back]) in DIRECTIONS.iter().zip(&mut sides) {
            let seen = across.dot(*direction);
            *if seen > 0.0 { front } else { back } += seen.abs();
        }
    }
    sides.iter().map(|[front, back]| front.max(*back)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube of so many sides around a circle, without ends.
    fn tube(sides: u32) -> Vec<Corners> {
        let corner = |side: u32, height: f32| {
            let (sin, cos) = libm::sincosf(std::f32::consts::TAU * (side % sides) as f32 / sides as f32);
            let normal = Vec3::new(cos, 0.0, sin);
            (normal + Vec3::Y * height, normal)
        };
        let quad = |side: u32| {
            let [a, b] = [side, side + 1].map(|side| [corner(side, 0.0), corner(side, 20.0)]);
            [[a[0], b[0], b[1]], [a[0], b[1], a[1]]]
        };
        (0..sides).flat_map(quad).collect()
    }

    #[test]
    fn a_tube_of_three_sides_must_grow_by_what_it_lacks() {
        let [round, three] = [tube(64), tube(3)];
        let [full, bare] = [&round, &three].map(|tube| covered(tube, 0.0));
        // 3 sin(pi / 3) / pi.
        assert!((bare / full - 0.827).abs() < 0.02, "{}", bare / full);
        let widened = widening(&three, full, [0.0, 2.0]);
        assert!((widened - 0.209).abs() < 0.02, "{widened}");
        assert!((covered(&three, widened) / full - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_sheet_is_seen_from_both_sides() {
        let corner = |x: f32, y: f32| (Vec3::new(x, y, 0.0), Vec3::Z);
        let sheet = vec![[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)]];
        let turned = vec![sheet[0], [sheet[0][0], sheet[0][2], sheet[0][1]]];
        assert_eq!(covered(&sheet, 0.0), covered(&turned, 0.0));
    }
}
