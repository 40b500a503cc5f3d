//! Pictures of drawn ground, with mip levels: its colours, and its slopes, which light it however
//! coarse its triangles are.

use super::{
    landscape::FADES_OVER,
    mips::{Mips, SrgbTable},
};
use crate::{material::Wrap, terrain::Terrain};
use glam::{Vec2, Vec3};

/// Colours and slopes of a terrain.
pub(crate) struct GroundPages {
    /// Colours; `None` for ground of one colour.
    pub(crate) colors: Option<Mips>,
    /// Components of the unit normals along x and z, the full size first.
    pub(crate) slopes: Vec<Slopes>,
}

/// One level of the slopes.
pub(crate) struct Slopes {
    /// Width and height in texels.
    pub(crate) size: [u32; 2],
    /// Row by row.
    pub(crate) texels: Vec<Vec2>,
}

impl GroundPages {
    /// The pages of a terrain. O(texels).
    pub(crate) fn new(terrain: &Terrain) -> Self {
        let colors = terrain.colors().cloned();
        let mips = |colors| Mips::new(colors, [Wrap::Clamp; 2], None, &SrgbTable::new());
        let mut slopes = vec![Slopes::full(terrain)];
        while let Some(next) = slopes.last().and_then(Slopes::halved) {
            slopes.push(next);
        }
        Self { colors: colors.and_then(mips), slopes }
    }

    /// Normal at (u, v), where a pixel is `per_px` of the sides wide and high; not of unit length.
    pub(crate) fn normal(&self, uv: [f32; 2], per_px: [Vec2; 2]) -> Vec3 {
        let [low, high, share] = around(level(self.slopes[0].size, per_px), self.slopes.len());
        let of = |level: f32| self.slopes[level as usize].at(uv);
        let slope = of(low).lerp(of(high), share);
        Vec3::new(slope.x, (1.0 - slope.length_squared()).max(0.0).sqrt(), slope.y)
    }

    /// Linear colour at (u, v), likewise; `plain` beyond the area, and without colours.
    pub(crate) fn color(&self, uv: [f32; 2], per_px: [Vec2; 2], plain: Vec3, srgb: &SrgbTable) -> Vec3 {
        let Some(mips) = &self.colors else { return plain };
        let [low, high, share] = around(level(mips.full_size().map(|side| side as u32), per_px), mips.count());
        let of = |level: f32| Vec3::from(mips.color(level as u8, uv, srgb));
        let outside = uv.map(|at| (at - at.clamp(0.0, 1.0)).abs());
        let fade = crate::crown::smoothstep(0.0, FADES_OVER, outside[0].max(outside[1]));
        of(low).lerp(of(high), share).lerp(plain, fade)
    }
}

/// Level of a picture at which a pixel is about as large as a texel.
fn level(size: [u32; 2], per_px: [Vec2; 2]) -> f32 {
    let size = Vec2::new(size[0] as f32, size[1] as f32);
    let texels = per_px.map(|step| (step * size).length());
    texels[0].max(texels[1]).max(1.0).log2()
}

/// The two levels around a level, and the share of the second.
fn around(level: f32, count: usize) -> [f32; 3] {
    let last = (count - 1) as f32;
    let low = level.floor().clamp(0.0, last);
    [low, (low + 1.0).min(last), (level - low).clamp(0.0, 1.0)]
}

impl Slopes {
    fn full(terrain: &Terrain) -> Self {
        let heights = terrain.heights();
        let (size, corner) = (heights.map().size(), heights.low_corner());
        let place = |at: [u32; 2]| {
            let share = |axis: usize| (f64::from(at[axis]) + 0.5) / f64::from(size[axis]);
            [0, 1].map(|axis| corner[axis] + heights.size()[axis] * share(axis))
        };
        let slope = |at: [u32; 2]| {
            let [x, z] = heights.gradient(place(at)).map(|rise| rise as f32);
            let normal = Vec3::new(-x, 1.0, -z).normalize();
            Vec2::new(normal.x, normal.z)
        };
        let texels = (0..size[1]).flat_map(|z| (0..size[0]).map(move |x| slope([x, z])));
        Self { size, texels: texels.collect() }
    }

    /// The next level; each texel is the mean of those under it. `None` after a single texel.
    fn halved(&self) -> Option<Self> {
        let size = self.size.map(|side| (side / 2).max(1));
        let under = |at: u32, axis: usize| {
            let [start, end] = [at, at + 1].map(|edge| edge * self.size[axis] / size[axis]);
            start..end.max(start + 1)
        };
        let texel = |x: u32, z: u32| {
            let places = under(z, 1).flat_map(|z| under(x, 0).map(move |x| (x, z)));
            let (sum, count) = places.fold((Vec2::ZERO, 0.0), |(sum, n), (x, z)| (sum + self.texel(x, z), n + 1.0));
            sum / count
        };
        let texels = (0..size[1]).flat_map(|z| (0..size[0]).map(move |x| texel(x, z)));
        (self.size != [1, 1]).then(|| Self { size, texels: texels.collect() })
    }

    fn texel(&self, x: u32, z: u32) -> Vec2 {
        self.texels[z as usize * self.size[0] as usize + x as usize]
    }

    /// Bilinear between texels; the edge continues beyond the area.
    fn at(&self, uv: [f32; 2]) -> Vec2 {
        let [(x0, x1, x), (z0, z1, z)] = [0, 1].map(|axis| {
            let last = (self.size[axis] - 1) as f32;
            let at = (uv[axis] * self.size[axis] as f32 - 0.5).clamp(0.0, last);
            (at as u32, (at as u32 + 1).min(last as u32), at.fract())
        });
        let row = |z: u32| self.texel(x0, z).lerp(self.texel(x1, z), x);
        row(z0).lerp(row(z1), z)
    }
}
