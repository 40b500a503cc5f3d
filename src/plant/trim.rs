//! Finds the outlines of a plant's cards from the alpha of their textures.
//!
//! The outline of a picture is the convex hull of its covering texels, each grown by a margin, cut
//! down to a few corners: as long as there are too many, the edge goes whose removal adds least
//! area. A picture whose outline saves little has none.
//!
//! The margin is what bilinear filtering reaches: half a texel at the full texture, and one and a
//! half texels of a mip level, whose alpha is not 0 if its texel touches a covering one. It holds
//! for the coarsest level at which it stays within [`MARGIN`], plus [`SNAP`] for rounded positions.

use super::{
    Plant,
    outline::{MAX_OUTLINES, OUTLINE_CORNERS, Outline, Outlines, area, hull, picture, rect, rounded_hull, turn},
};
use crate::{
    Error, Result,
    leaf::LeafGeometry,
    material::{Material, Pixels},
};
use std::collections::HashMap;

/// Corners of an outline unless others are asked for. With 6, outlines of the three species take 2
/// to 9 % of the rectangle more.
pub const TRIM_CORNERS: u32 = 8;

/// Largest margin, as a share of a picture's shorter side: twice as much would cost 2 to 5 % of the
/// area.
const MARGIN: f64 = 1.0 / 64.0;
/// Margin in texels for positions that are rounded to a fraction of a pixel.
const SNAP: f64 = 0.5;
/// Largest share of the rectangle that an outline may take: below it, more corners cost more than
/// they save.
const LARGEST_SHARE: f64 = 0.95;
/// Most texels that are looked at for all outlines of a plant.
const MAX_TEXELS: f64 = 1e9;

impl Plant {
    /// Finds an outline of at most `corners` corners for each distinct picture that leaves of
    /// cut-out materials show, and replaces [`outlines`](Self::outlines) by them. Leaves, pivots
    /// and areas stay as they are. A picture whose outline would save less than 5 % of the area has
    /// none; of more than [`MAX_OUTLINES`] pictures, the most common have one. Cost: decodes each
    /// texture once.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for fewer than 4 or more than 8 corners, [`Error::Unreadable`] for
    /// a damaged texture.
    pub fn trim(&mut self, corners: u32) -> Result<()> {
        let [least, most] = OUTLINE_CORNERS;
        if !(least..=most).contains(&corners) {
            return Err(Error::invalid("corners", corners, format!("{least} to {most}")));
        }
        let mut textures: HashMap<u32, Pixels> = HashMap::new();
        let mut outlines = Vec::new();
        let mut texels = 0.0;
        for (material, rect) in self.pictures() {
            let surface = &self.materials[material as usize];
            let Some(texture) = surface.texture.filter(|_| surface.cutoff().is_some()) else { continue };
            if let std::collections::hash_map::Entry::Vacant(free) = textures.entry(texture) {
                free.insert(self.textures[texture as usize].decode()?);
            }
            let mask = Mask { pixels: &textures[&texture], material: surface };
            texels += mask.texels(rect);
            if texels > MAX_TEXELS {
                break;
            }
            outlines.extend(mask.outline(rect, corners as usize).map(|(corners, level)| Outline {
                material,
                rect,
                corners,
                level,
            }));
        }
        self.outlines = outlines;
        Ok(())
    }

    /// Share of the area of all leaves that is left to draw within the outlines; 1 without any.
    pub fn trimmed_share(&self) -> f64 {
        let outlines = Outlines::new(&self.outlines);
        let (mut left, mut total) = (0.0, 0.0);
        for leaf in &self.leaves {
            let area = self.leaf_area(leaf);
            let outline = outlines.find(leaf.material, self.uvs(leaf));
            left += area * outline.map_or(1.0, Outline::share);
            total += area;
        }
        if total > 0.0 { left / total } else { 1.0 }
    }

    /// Materials and rectangles of all cards, the most common first.
    fn pictures(&self) -> Vec<(u32, [[f32; 2]; 2])> {
        let mut counts = HashMap::new();
        for leaf in self.leaves.iter().filter(|leaf| self.is_card(leaf)) {
            *counts.entry(picture(leaf.material, rect(self.uvs(leaf)))).or_insert(0_u32) += 1;
        }
        let mut pictures: Vec<_> = counts.into_iter().collect();
        pictures.sort_unstable_by_key(|&(picture, count)| (std::cmp::Reverse(count), picture));
        pictures.truncate(MAX_OUTLINES);
        pictures.into_iter().map(|((material, bits), _)| (material, bytemuck::cast(bits))).collect()
    }

    /// Whether every vertex of a leaf is at a corner of its rectangle.
    fn is_card(&self, leaf: &LeafGeometry) -> bool {
        let [low, high] = rect(self.uvs(leaf));
        let is_corner = |uv: [f32; 2]| (0..2).all(|axis| uv[axis] == low[axis] || uv[axis] == high[axis]);
        leaf.triangles() >= 2 && low[0] < high[0] && low[1] < high[1] && self.uvs(leaf).all(is_corner)
    }

    fn uvs(&self, leaf: &LeafGeometry) -> impl Iterator<Item = [f32; 2]> {
        self.vertices[leaf.vertex_range()].iter().map(|vertex| vertex.uv)
    }

    fn leaf_area(&self, leaf: &LeafGeometry) -> f64 {
        let at = |index: u32| glam::Vec3::from(self.vertices[index as usize].position).as_dvec3();
        let triangles = self.indices[leaf.index_range()].chunks_exact(3);
        triangles.map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length_squared().sqrt()).sum()
    }
}

/// Which texels of a texture cover anything.
struct Mask<'a> {
    pixels: &'a Pixels,
    material: &'a Material,
}

impl Mask<'_> {
    /// Number of texels of a rectangle.
    fn texels(&self, rect: [[f32; 2]; 2]) -> f64 {
        let sides = self.in_texels(rect);
        (sides[1][0] - sides[0][0] + 1.0) * (sides[1][1] - sides[0][1] + 1.0)
    }

    fn in_texels(&self, rect: [[f32; 2]; 2]) -> [[f64; 2]; 2] {
        let size = [self.pixels.width, self.pixels.height].map(f64::from);
        rect.map(|corner| [0, 1].map(|axis| f64::from(corner[axis]) * size[axis]))
    }

    fn covers(&self, x: i64, y: i64) -> bool {
        let Pixels { width, height, rgba } = self.pixels;
        let [wrap_u, wrap_v] = self.material.wrap;
        let [x, y] = [wrap_u.inside(x, *width), wrap_v.inside(y, *height)];
        self.material.covers(rgba[4 * (y as usize * *width as usize + x as usize) + 3])
    }

    /// Corners and level of the outline of a rectangle.
    fn outline(&self, rect: [[f32; 2]; 2], corners: usize) -> Option<(Vec<[f32; 2]>, u8)> {
        let [low, high] = self.in_texels(rect);
        let (margin, level) = margin((high[0] - low[0]).min(high[1] - low[1]));
        let inside = |point: [f64; 2]| [0, 1].map(|axis| point[axis].clamp(low[axis], high[axis]));
        let mut points = Vec::new();
        // Texels beside the rectangle reach into it too.
        let [columns, rows] =
            [0, 1].map(|axis| (low[axis] - margin).floor() as i64..(high[axis] + margin).ceil() as i64);
        for y in rows {
            let Some(first) = columns.clone().find(|&x| self.covers(x, y)) else { continue };
            let last = columns.clone().rev().find(|&x| self.covers(x, y)).unwrap_or(first);
            let [left, right] = [first as f64 - margin, last as f64 + 1.0 + margin];
            let [top, bottom] = [y as f64 - margin, y as f64 + 1.0 + margin];
            points.extend([[left, top], [right, top], [left, bottom], [right, bottom]].map(inside));
        }
        let kept = cut(hull(points), corners, [low, high])?;
        let largest = LARGEST_SHARE * (high[0] - low[0]) * (high[1] - low[1]);
        if area(&kept) > largest {
            return None;
        }
        let size = [self.pixels.width, self.pixels.height].map(f64::from);
        let in_uv =
            |at: [f64; 2]| [0, 1].map(|axis| ((at[axis] / size[axis]) as f32).max(rect[0][axis]).min(rect[1][axis]));
        Some((rounded_hull(kept.into_iter().map(in_uv))?, level))
    }
}

/// Margin in texels for a picture whose shorter side has `side` texels, and the coarsest mip level
/// that it suffices for.
fn margin(side: f64) -> (f64, u8) {
    let reach = |level: u8| if level == 0 { 0.5 } else { 0.5 + 1.5 * f64::from(1_u32 << level) };
    let level = (1..=16).take_while(|&level| reach(level) + SNAP <= side * MARGIN).last().unwrap_or(0);
    (reach(level) + SNAP, level)
}

/// Removes edges of a convex polygon until it has at most `most` corners, never fewer than 4;
/// `None` if no edge can go without leaving the rectangle, or if the polygon has no area.
fn cut(mut corners: Vec<[f64; 2]>, most: usize, [low, high]: [[f64; 2]; 2]) -> Option<Vec<[f64; 2]>> {
    // Up to the rounding of coordinates in texels.
    let inside = |point: [f64; 2]| {
        let inside = [0, 1].map(|axis| point[axis].clamp(low[axis], high[axis]));
        (0..2).all(|axis| (inside[axis] - point[axis]).abs() < 1e-6).then_some(inside)
    };
    while corners.len() > most {
        let count = corners.len();
        let removed = (0..count).filter_map(|i| {
            let [before, a, b, after] = [count - 1, 0, 1, 2].map(|by| corners[(i + by) % count]);
            let meeting = meeting(before, a, b, after).and_then(inside)?;
            Some((turn(a, meeting, b), i, meeting))
        });
        let (_, i, meeting) = removed.min_by(|a, b| a.0.total_cmp(&b.0))?;
        corners[i] = meeting;
        corners.remove((i + 1) % count);
    }
    (corners.len() >= OUTLINE_CORNERS[0] as usize).then_some(corners)
}

/// Where the edges before and after the edge from `a` to `b` meet beyond it.
fn meeting(before: [f64; 2], a: [f64; 2], b: [f64; 2], after: [f64; 2]) -> Option<[f64; 2]> {
    let (along, back) = ([a[0] - before[0], a[1] - before[1]], [b[0] - after[0], b[1] - after[1]]);
    let across = along[0] * back[1] - along[1] * back[0];
    let t = ((b[0] - a[0]) * back[1] - (b[1] - a[1]) * back[0]) / across;
    let point = [a[0] + along[0] * t, a[1] + along[1] * t];
    (t.is_finite() && t > 0.0 && turn(a, point, b) > 0.0).then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{AlphaMode, Wrap};
    use proptest::prelude::*;

    fn pixels(width: u32, height: u32, covers: impl Fn(u32, u32) -> bool) -> Pixels {
        let alpha = |i: u32| if covers(i % width, i / width) { 255 } else { 0 };
        Pixels { width, height, rgba: (0..width * height).flat_map(|i| [0, 0, 0, alpha(i)]).collect() }
    }

    fn cut_out(wrap: Wrap) -> Material {
        Material { alpha_mode: AlphaMode::Mask, wrap: [wrap; 2], ..Material::default() }
    }

    fn holds(corners: &[[f32; 2]], point: [f64; 2]) -> bool {
        let at = |i: usize| corners[i % corners.len()].map(f64::from);
        (0..corners.len()).all(|i| turn(at(i), at(i + 1), point) >= -1e-6)
    }

    proptest! {
        #[test]
        fn an_outline_is_convex_and_holds_what_every_covering_texel_reaches(
            size in (4..80_u32, 4..80_u32),
            spots in proptest::collection::vec((0.1..0.9_f64, 0.1..0.9_f64, 0.0..0.2_f64), 1..5),
            most in 4..=8_usize,
            part in (0.0..0.3_f32, 0.7..1.0_f32),
        ) {
            let near = |x: u32, y: u32| {
                let at = [f64::from(x) / f64::from(size.0), f64::from(y) / f64::from(size.1)];
                spots.iter().any(|&(u, v, r)| (at[0] - u).abs() + 0.5 * (at[1] - v).abs() < r)
            };
            let (pixels, material) = (pixels(size.0, size.1, near), cut_out(Wrap::Clamp));
            let mask = Mask { pixels: &pixels, material: &material };
            let rect = [[part.0; 2], [part.1; 2]];
            let Some((corners, level)) = mask.outline(rect, most) else { return Ok(()) };
            let outline = Outline { material: 0, rect, corners, level };
            prop_assert!(crate::plant::outline::check_all(std::slice::from_ref(&outline), 1).is_ok());
            prop_assert!(outline.corners.len() <= most && outline.share() <= 0.951);
            let reach = if level == 0 { 0.5 } else { 0.5 + 1.5 * f64::from(1 << level) };
            let reaches = |texel: u32, size: u32| {
                let [low, high] = [f64::from(texel) - reach, f64::from(texel) + 1.0 + reach];
                high > f64::from(part.0) * f64::from(size) && low < f64::from(part.1) * f64::from(size)
            };
            let covering = |&(x, y): &(u32, u32)| near(x, y) && reaches(x, size.0) && reaches(y, size.1);
            for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).filter(covering) {
                for [along, up] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                    let at = [f64::from(x) + along + reach * (2.0 * along - 1.0), f64::from(y) + up + reach * (2.0 * up - 1.0)];
                    let uv = [at[0] / f64::from(size.0), at[1] / f64::from(size.1)];
                    let clamped = uv.map(|c| c.clamp(f64::from(part.0), f64::from(part.1)));
                    prop_assert!(holds(&outline.corners, clamped), "{:?} {:?}", outline, clamped);
                }
            }
        }
    }

    #[test]
    fn a_disc_keeps_little_more_than_its_area_and_a_full_card_has_no_outline() {
        let disc = |x: u32, y: u32| (f64::from(x) - 127.5).powi(2) + (f64::from(y) - 127.5).powi(2) < 100.0_f64.powi(2);
        let (pixels_of_disc, material) = (pixels(256, 256, disc), cut_out(Wrap::Repeat));
        let whole = [[0.0; 2], [1.0; 2]];
        let share = |corners| {
            let (corners, level) =
                Mask { pixels: &pixels_of_disc, material: &material }.outline(whole, corners).unwrap();
            assert_eq!(level, 1);
            Outline { material: 0, rect: whole, corners, level }.share()
        };
        let disc_share = std::f64::consts::PI * (100.0_f64 / 256.0).powi(2);
        assert!(share(8) < disc_share * 1.25, "{} of {disc_share}", share(8));
        assert!(share(8) <= share(6) && share(6) <= share(4));
        for covers in [true, false] {
            let pixels = pixels(16, 16, |_, _| covers);
            assert!(Mask { pixels: &pixels, material: &material }.outline(whole, 6).is_none(), "{covers}");
        }
    }

    #[test]
    fn what_lies_beside_the_rectangle_counts_as_far_as_it_reaches() {
        let pixels = pixels(64, 64, |x, y| (20..30).contains(&x) && (20..44).contains(&y) || x == 63 && y == 2);
        let lowest = |wrap| {
            let material = cut_out(wrap);
            let (corners, _) =
                Mask { pixels: &pixels, material: &material }.outline([[0.0; 2], [0.5, 1.0]], 8).unwrap();
            corners.iter().map(|corner| corner[0]).fold(1.0, f32::min)
        };
        assert_eq!(lowest(Wrap::Repeat), 0.0, "the texel at the right edge repeats at the left");
        assert!(lowest(Wrap::Clamp) > 0.25);
    }
}
