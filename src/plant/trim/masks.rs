//! Which texels of a texture cover anything, at each mip level.

use super::{Material, Pixels, Point, Rect};

/// Number of levels that outlines are found for.
const LEVELS: usize = 8;
/// Alpha, of 255, by which filtered values may be off.
const TOLERANCE: f64 = 0.01;

/// Covering texels of a texture at each level.
pub(super) struct Levels<'a> {
    material: &'a Material,
    levels: Vec<Mask>,
}

/// Covering texels of one level, row by row.
struct Mask {
    size: [u32; 2],
    covers: Vec<bool>,
}

impl<'a> Levels<'a> {
    pub(super) fn new(pixels: &Pixels, material: &'a Material) -> Self {
        let size = [pixels.width, pixels.height];
        let covers = pixels.rgba.iter().skip(3).step_by(4).map(|&alpha| material.covers(alpha)).collect();
        let mut levels = vec![Mask { size, covers }];
        if size.contains(&0) {
            levels.clear();
        }
        let is_last = |mask: &Mask| mask.size == [1, 1];
        let full = levels.first().filter(|full| !is_last(full));
        let mut next = full.map(|full| full.filtered(pixels, material).halved());
        while let Some(mask) = next {
            next = (levels.len() + 1 < LEVELS && !is_last(&mask)).then(|| mask.halved());
            levels.push(mask);
        }
        Self { material, levels }
    }

    /// Number of levels.
    pub(super) fn count(&self) -> u8 {
        self.levels.len() as u8
    }

    pub(super) fn size(&self, level: u8) -> Point {
        self.levels[usize::from(level)].size.map(f64::from)
    }

    /// Number of texels of the full texture in a rectangle.
    pub(super) fn texels(&self, rect: Rect) -> f64 {
        if self.levels.is_empty() {
            return 0.0;
        }
        let [low, high] = self.in_texels(rect, 0);
        (high[0] - low[0] + 1.0) * (high[1] - low[1] + 1.0)
    }

    pub(super) fn in_texels(&self, rect: Rect, level: u8) -> [Point; 2] {
        self.all_in_texels(rect, level)
    }

    pub(super) fn all_in_texels<const N: usize>(&self, points: [[f32; 2]; N], level: u8) -> [Point; N] {
        let size = self.size(level);
        points.map(|uv| [0, 1].map(|axis| f64::from(uv[axis]) * size[axis]))
    }

    /// Whether a texel covers anything.
    pub(super) fn covers(&self, level: u8, x: i64, y: i64) -> bool {
        self.levels[usize::from(level)].at(self.material, x, y)
    }
}

impl Mask {
    fn at(&self, material: &Material, x: i64, y: i64) -> bool {
        let [x, y] = self.inside(material, x, y);
        self.covers[y * self.size[0] as usize + x]
    }

    fn inside(&self, material: &Material, x: i64, y: i64) -> [usize; 2] {
        let [wrap_u, wrap_v] = material.wrap;
        [wrap_u.inside(x, self.size[0]) as usize, wrap_v.inside(y, self.size[1]) as usize]
    }

    /// Texels that cover anything once the texture is filtered bilinearly: mip levels look at the
    /// middle of each quarter of a texel.
    fn filtered(&self, pixels: &Pixels, material: &Material) -> Self {
        let [width, height] = self.size.map(i64::from);
        let least = material.texture_cutoff().map_or(0.0, |cutoff| f64::from(cutoff) * 255.0) - TOLERANCE;
        let alpha = |x: i64, y: i64| {
            let [x, y] = self.inside(material, x, y);
            f64::from(pixels.rgba[4 * (y * width as usize + x) + 3])
        };
        let around = |x: i64, y: i64| [-1, 0, 1].map(|down| [-1, 0, 1].map(|right| [x + right, y + down]));
        let covers = |x: i64, y: i64| {
            let near = around(x, y);
            if self.at(material, x, y) || !near.as_flattened().iter().any(|&[x, y]| self.at(material, x, y)) {
                return self.at(material, x, y);
            }
            let quarters = [[-1, -1], [1, -1], [-1, 1], [1, 1]];
            quarters.into_iter().any(|[right, down]| {
                let of_row = |y| 0.75 * alpha(x, y) + 0.25 * alpha(x + right, y);
                0.75 * of_row(y) + 0.25 * of_row(y + down) >= least
            })
        };
        let covers = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| covers(x, y)).collect();
        Self { size: self.size, covers }
    }

    /// The next level, half as large: a texel covers anything if one under it does.
    fn halved(&self) -> Self {
        let size = self.size.map(|side| (side / 2).max(1));
        let under = |axis: usize, i: u32| {
            let [from, to] = [self.size[axis], size[axis]].map(u64::from);
            let i = u64::from(i);
            (i * from / to) as usize..((i + 1) * from).div_ceil(to) as usize
        };
        let row = |y: usize| &self.covers[y * self.size[0] as usize..][..self.size[0] as usize];
        let covers = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        let covers = covers.map(|(x, y)| under(1, y).any(|y| row(y)[under(0, x)].contains(&true)));
        Self { size, covers: covers.collect() }
    }
}
