//! One tile of the picture: which triangle each sample sees, then one colour a pixel.
//!
//! Sixteen samples a pixel. Triangles come nearest first, so that a pixel whose samples are all taken by something nearer
//! is skipped at once; a masked texture is looked up for each sample that is still open. Colour is computed once for each
//! triangle that a pixel sees, at the middle of the samples it has there.

use super::{
    Tone,
    project::{Projected, STEPS_PER_PIXEL, ScreenTriangle, twice_area},
};
use crate::{
    material::Material,
    render::{
        light::Light,
        mips::{Mips, SrgbTable},
    },
    stochastic::contrast::toned,
};
use glam::Vec3;

/// Pixels on a side of a tile: its samples fit a core's second-level cache.
pub(super) const TILE_PX: u32 = 32;
/// Samples in a pixel.
pub(super) const SAMPLES: usize = 16;
/// Sample `s` lies in column `s` and row `SAMPLE_ROWS[s]` of a 16 x 16 grid: each column and each row holds one, so that
/// nearly vertical and nearly horizontal edges get sixteen steps too (bit reversal, as in Hammersley's point set).
const SAMPLE_ROWS: [i64; SAMPLES] = [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15];
const NO_OWNER: u32 = u32::MAX;

/// All that tiles read.
pub(super) struct Scene<'a> {
    pub(super) projected: &'a Projected,
    pub(super) materials: &'a [Material],
    pub(super) mips: &'a [Option<Mips>],
    pub(super) srgb: &'a SrgbTable,
    /// One for each plant.
    pub(super) lights: &'a [Light],
    pub(super) tones: &'a [Option<Tone>],
}

/// What the samples of one tile see.
pub(super) struct Tile {
    /// First pixel.
    origin: [i64; 2],
    inverse_w: Vec<[f32; SAMPLES]>,
    owner: Vec<[u32; SAMPLES]>,
    /// Least `inverse_w` of each pixel.
    farthest: Vec<f32>,
}

/// A quantity that is affine on the screen, relative to the tile's first pixel.
#[derive(Clone, Copy)]
struct Plane {
    at_origin: f64,
    per_px: [f64; 2],
}

impl Plane {
    fn at(&self, x_px: f64, y_px: f64) -> f32 {
        (self.at_origin + self.per_px[0] * x_px + self.per_px[1] * y_px) as f32
    }
}

/// The signed distance (times length) from one edge: not negative inside.
struct Edge {
    at_origin: i64,
    per_px: [i64; 2],
    per_sample: [i64; SAMPLES],
}

impl Tile {
    /// An empty tile at pixel `origin`.
    pub(super) fn new(origin: [u32; 2]) -> Self {
        let pixels = (TILE_PX * TILE_PX) as usize;
        Self {
            origin: origin.map(i64::from),
            inverse_w: vec![[0.0; SAMPLES]; pixels],
            owner: vec![[NO_OWNER; SAMPLES]; pixels],
            farthest: vec![0.0; pixels],
        }
    }

    /// Enters triangle `index` wherever it is nearest so far.
    pub(super) fn add(&mut self, index: u32, scene: &Scene<'_>) {
        let triangle = &scene.projected.triangles[index as usize];
        let Some([x_range, y_range]) = self.bounds(triangle, scene) else { return };
        let edges = self.edges(triangle, scene);
        let depth = self.plane(triangle, scene, |corner| corner.inverse_w as f64);
        let mask = self.alpha_test(triangle, scene);
        for y in y_range {
            for x in x_range.clone() {
                let pixel = (y * TILE_PX as i64 + x) as usize;
                if triangle.nearest <= self.farthest[pixel] {
                    continue;
                }
                let mut covered = coverage(&edges, x, y) & triangle.samples;
                if covered != 0 {
                    covered = self.closer(pixel, covered, &depth, triangle.nearest, [x, y]);
                    let kept = mask.as_ref().map_or(covered, |mask| mask.passing(covered, &depth, [x, y]));
                    self.write(pixel, kept, index, &depth, triangle.nearest, [x, y]);
                }
            }
        }
    }

    /// The tile's pixels that the triangle's box touches, counted from the tile's origin.
    fn bounds(&self, triangle: &ScreenTriangle, scene: &Scene<'_>) -> Option<[std::ops::Range<i64>; 2]> {
        let corners = triangle.corners.map(|corner| scene.projected.corners[corner as usize].at);
        let range = |axis: usize| {
            let values = corners.map(|corner| corner[axis]);
            let [min, max] = [values.into_iter().min().unwrap_or(0), values.into_iter().max().unwrap_or(0)];
            let first = min.div_euclid(STEPS_PER_PIXEL) - self.origin[axis];
            let last = max.div_euclid(STEPS_PER_PIXEL) - self.origin[axis];
            first.max(0)..(last + 1).min(TILE_PX as i64)
        };
        let ranges = [range(0), range(1)];
        ranges.iter().all(|range| !range.is_empty()).then_some(ranges)
    }

    fn edges(&self, triangle: &ScreenTriangle, scene: &Scene<'_>) -> [Edge; 3] {
        let corners = triangle.corners.map(|corner| scene.projected.corners[corner as usize].at);
        let origin = self.origin.map(|px| px * STEPS_PER_PIXEL);
        std::array::from_fn(|i| Edge::new(corners[i], corners[(i + 1) % 3], origin))
    }

    fn plane(
        &self,
        triangle: &ScreenTriangle,
        scene: &Scene<'_>,
        value: impl Fn(&super::project::Corner) -> f64,
    ) -> Plane {
        let corners = triangle.corners.map(|corner| &scene.projected.corners[corner as usize]);
        let [a, b, c] = corners.map(|corner| {
            [0, 1].map(|axis| (corner.at[axis] - self.origin[axis] * STEPS_PER_PIXEL) as f64 / STEPS_PER_PIXEL as f64)
        });
        let [va, vb, vc] = corners.map(value);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let dx = ((vb - va) * (c[1] - a[1]) - (vc - va) * (b[1] - a[1])) / area;
        let dy = ((vc - va) * (b[0] - a[0]) - (vb - va) * (c[0] - a[0])) / area;
        Plane { at_origin: va - dx * a[0] - dy * a[1], per_px: [dx, dy] }
    }

    fn alpha_test<'a>(&self, triangle: &ScreenTriangle, scene: &Scene<'a>) -> Option<AlphaTest<'a>> {
        let material = scene.materials.get(triangle.material as usize)?;
        let cutoff = material.cutoff()?;
        let mips = scene.mips.get(triangle.material as usize)?.as_ref()?;
        Some(AlphaTest {
            mips,
            level: triangle.level[0],
            cutoff: cutoff / material.base_color[3].max(f32::MIN_POSITIVE),
            u: self.plane(triangle, scene, |corner| corner.uv[0] as f64 * corner.inverse_w as f64),
            v: self.plane(triangle, scene, |corner| corner.uv[1] as f64 * corner.inverse_w as f64),
        })
    }

    /// Of the samples `covered`, those where the triangle is nearer than what they see.
    fn closer(&self, pixel: usize, covered: u32, depth: &Plane, nearest: f32, at: [i64; 2]) -> u32 {
        let seen = &self.inverse_w[pixel];
        samples(covered).filter(|&s| depth_at(depth, nearest, at, s) > seen[s]).fold(0, |closer, s| closer | 1 << s)
    }

    fn write(&mut self, pixel: usize, kept: u32, index: u32, depth: &Plane, nearest: f32, at: [i64; 2]) {
        if kept == 0 {
            return;
        }
        let seen = &mut self.inverse_w[pixel];
        for s in samples(kept) {
            seen[s] = depth_at(depth, nearest, at, s);
            self.owner[pixel][s] = index;
        }
        self.farthest[pixel] = seen.iter().copied().fold(f32::INFINITY, f32::min);
    }

    /// Linear colour and covered share of pixel (x, y) of the tile; the colour is already weighted by the share.
    pub(super) fn resolve(&self, x: u32, y: u32, scene: &Scene<'_>) -> (Vec3, f32) {
        let owners = &self.owner[(y * TILE_PX + x) as usize];
        let mut open: u32 = (0..SAMPLES).filter(|&s| owners[s] != NO_OWNER).fold(0, |open, s| open | 1 << s);
        let share = open.count_ones() as f32 / SAMPLES as f32;
        let mut color = Vec3::ZERO;
        while open != 0 {
            let owner = owners[open.trailing_zeros() as usize];
            let same = samples(open).filter(|&s| owners[s] == owner).fold(0, |same, s| same | 1 << s);
            color += self.shade(owner, same, [x as i64, y as i64], scene) * same.count_ones() as f32;
            open &= !same;
        }
        (color / SAMPLES as f32, share)
    }

    fn shade(&self, owner: u32, at_samples: u32, at: [i64; 2], scene: &Scene<'_>) -> Vec3 {
        let triangle = &scene.projected.triangles[owner as usize];
        let corners = triangle.corners.map(|corner| &scene.projected.corners[corner as usize]);
        let [a, b, c] = corners.map(|corner| corner.at);
        let middle = [0, 1].map(|axis| {
            let sum: i64 = samples(at_samples).map(|s| sample_steps(s)[axis]).sum();
            (self.origin[axis] + at[axis]) * STEPS_PER_PIXEL + sum / at_samples.count_ones() as i64
        });
        let opposite = [twice_area(b, c, middle), twice_area(c, a, middle), twice_area(a, b, middle)];
        let weights: [f32; 3] = std::array::from_fn(|i| opposite[i].max(0) as f32 * corners[i].inverse_w);
        let total = weights.iter().sum::<f32>().max(f32::MIN_POSITIVE);
        let weights = weights.map(|weight| weight / total);
        let mix = |value: &dyn Fn(usize) -> Vec3| (0..3).map(|i| value(i) * weights[i]).sum::<Vec3>();
        let uv = mix(&|i| Vec3::new(corners[i].uv[0], corners[i].uv[1], 0.0));
        let factor = mix(&|i| Vec3::from(corners[i].color));
        let texel = scene.mips.get(triangle.material as usize).and_then(Option::as_ref);
        let texel = texel.map_or(Vec3::ONE, |mips| mips.color(triangle.level[1], [uv.x, uv.y], scene.srgb).into());
        let material = scene.materials.get(triangle.material as usize);
        let base = material.map_or(Vec3::ONE, |m| Vec3::new(m.base_color[0], m.base_color[1], m.base_color[2]));
        let two_sided = triangle.is_leaf || material.is_some_and(|material| material.double_sided);
        let normal = mix(&|i| corners[i].normal);
        let light = &scene.lights[triangle.plant as usize];
        let from_eye = mix(&|i| corners[i].from_eye);
        let color = light.reflected(base * texel * factor, normal, from_eye, triangle.is_leaf, two_sided);
        match scene.tones[triangle.plant as usize] {
            Some(tone) if triangle.is_leaf => toned(color.into(), tone.mean, tone.kept).into(),
            _ => color,
        }
    }
}

/// The alpha test of one triangle.
struct AlphaTest<'a> {
    mips: &'a Mips,
    level: u8,
    cutoff: f32,
    u: Plane,
    v: Plane,
}

impl AlphaTest<'_> {
    fn passing(&self, covered: u32, depth: &Plane, at: [i64; 2]) -> u32 {
        samples(covered).filter(|&s| self.passes(depth, at, s)).fold(0, |passing, s| passing | 1 << s)
    }

    fn passes(&self, depth: &Plane, at: [i64; 2], sample: usize) -> bool {
        let [x, y] = sample_px(at, sample);
        let w = 1.0 / depth.at(x, y);
        self.mips.alpha(self.level, [self.u.at(x, y) * w, self.v.at(x, y) * w]) >= self.cutoff
    }
}

impl Edge {
    fn new(from: [i64; 2], to: [i64; 2], origin: [i64; 2]) -> Self {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // A sample exactly on an edge belongs to the triangle whose top or left edge it is, and to no other.
        let is_top_left = dy < 0 || (dy == 0 && dx > 0);
        Self {
            at_origin: twice_area(from, to, origin) - i64::from(!is_top_left),
            per_px: [-dy * STEPS_PER_PIXEL, dx * STEPS_PER_PIXEL],
            per_sample: std::array::from_fn(|s| dx * sample_steps(s)[1] - dy * sample_steps(s)[0]),
        }
    }

    fn at(&self, x: i64, y: i64) -> i64 {
        self.at_origin + self.per_px[0] * x + self.per_px[1] * y
    }
}

/// Bit `s` is set where sample `s` of pixel (x, y) lies inside all three edges.
fn coverage(edges: &[Edge; 3], x: i64, y: i64) -> u32 {
    let corner = [edges[0].at(x, y), edges[1].at(x, y), edges[2].at(x, y)];
    let mut covered = 0;
    for s in 0..SAMPLES {
        let distances = [0, 1, 2].map(|i| corner[i] + edges[i].per_sample[s]);
        let any_negative = distances[0] | distances[1] | distances[2];
        covered |= u32::from(any_negative >= 0) << s;
    }
    covered
}

fn depth_at(depth: &Plane, nearest: f32, at: [i64; 2], sample: usize) -> f32 {
    let [x, y] = sample_px(at, sample);
    depth.at(x, y).min(nearest)
}

fn sample_px(at: [i64; 2], sample: usize) -> [f64; 2] {
    let steps = sample_steps(sample);
    [0, 1].map(|axis| at[axis] as f64 + steps[axis] as f64 / STEPS_PER_PIXEL as f64)
}

/// Where a sample lies in its pixel.
fn sample_steps(sample: usize) -> [i64; 2] {
    let cell = STEPS_PER_PIXEL / SAMPLES as i64;
    [sample as i64 * cell + cell / 2, SAMPLE_ROWS[sample] * cell + cell / 2]
}

/// The numbers of the set bits.
fn samples(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let sample = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        sample
    })
}
