//! Finds the outlines of a plant's cards from the alpha of their textures.
//!
//! The outline of a picture is the convex hull of its covering texels, each grown by what bilinear
//! filtering reaches, cut down to a few corners. Texels of coarser mip levels reach farther, so a
//! picture has several outlines, each for a level and those below it; levels whose outline is
//! hardly smaller than that of the next one have none of their own. A picture whose outline saves
//! little has none at all.

use super::{
    Plant,
    cards::{Rect, cards},
    convex::{Point, area, clipped, cut, hull, turn},
    outline::{MAX_OUTLINES, OUTLINE_CORNERS, Outline, Outlines, picture, rounded_hull},
};
use crate::{
    Error, Result,
    leaf::LeafGeometry,
    material::{Material, Pixels},
};
use std::collections::{BTreeSet, HashMap, hash_map::Entry};

mod masks;
use masks::Levels;

/// Corners of an outline unless others are asked for. With 6, outlines of the three species take 2
/// to 9 % of the rectangle more.
pub const TRIM_CORNERS: u32 = 8;

/// Margin in texels of the full texture for rounded positions and texture coordinates: a step of
/// quantised ones is as much at the largest texture.
const SNAP: f64 = 0.25;
/// Largest share of a picture that an outline may take: below it, more corners cost more than they
/// save.
const LARGEST_SHARE: f64 = 0.95;
/// Least share of a picture that an outline must save over that of the next coarser level.
const LEAST_GAIN: f64 = 0.01;
/// Most texels that are looked at for all outlines of a plant.
const MAX_TEXELS: f64 = 1e9;

/// What cards show: the part of a rectangle that their triangles span.
struct Picture {
    material: u32,
    rect: Rect,
    /// Texture coordinates, without repetitions.
    triangles: Vec<[[f32; 2]; 3]>,
}

impl Plant {
    /// Finds outlines of at most `corners` corners for each distinct picture that leaves of cut-out
    /// materials show, and replaces [`outlines`](Self::outlines) by them. Leaves, pivots and areas
    /// stay as they are. A picture whose outline would save less than 5 % of the area has none; of
    /// more than [`MAX_OUTLINES`] outlines, those of the most common pictures are kept. Cost:
    /// decodes each texture once.
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
        let mut masks: HashMap<u32, Levels<'_>> = HashMap::new();
        let mut outlines = Vec::new();
        let mut texels = 0.0;
        for shown in self.pictures() {
            let surface = &self.materials[shown.material as usize];
            let Some(texture) = surface.texture else { continue };
            if let Entry::Vacant(free) = textures.entry(texture) {
                free.insert(self.textures[texture as usize].decode()?);
            }
            let masks = masks.entry(shown.material).or_insert_with(|| Levels::new(&textures[&texture], surface));
            texels += masks.texels(shown.rect);
            let found = shown.outlines(masks, corners as usize);
            if texels > MAX_TEXELS || outlines.len() + found.len() > MAX_OUTLINES {
                break;
            }
            outlines.extend(found);
        }
        self.outlines = outlines;
        Ok(())
    }

    /// Share of the area of all leaves that is left to draw within the tightest outlines; 1 without
    /// any.
    pub fn trimmed_share(&self) -> f64 {
        let outlines = Outlines::new(&self.outlines);
        let (mut left, mut total) = (0.0, 0.0);
        for leaf in &self.leaves {
            let triangles = self.indices[leaf.index_range()].as_chunks::<3>().0;
            let found = outlines.of_leaf(leaf, &self.vertices, &self.indices[leaf.index_range()]);
            for (i, &triangle) in triangles.iter().enumerate() {
                let outline = found.as_ref().and_then(|found| found[i].first());
                let uvs = triangle.map(|index| self.vertices[index as usize].uv);
                let area = self.triangle_area(triangle);
                left += area * outline.map_or(1.0, |outline| share(&outline.points(), &[uvs]));
                total += area;
            }
        }
        if total > 0.0 { left / total } else { 1.0 }
    }

    /// What all cards of cut-out materials show, the most common first.
    fn pictures(&self) -> Vec<Picture> {
        let mut found: HashMap<_, (u32, BTreeSet<[[u32; 2]; 3]>)> = HashMap::new();
        let is_cut_out = |leaf: &&LeafGeometry| {
            let material = &self.materials[leaf.material as usize];
            material.texture.is_some() && material.cutoff().is_some()
        };
        for leaf in self.leaves.iter().filter(is_cut_out) {
            let triangles = self.indices[leaf.index_range()].as_chunks::<3>().0;
            let vertex = |index: u32| &self.vertices[index as usize];
            let cards = cards(triangles, |index| (vertex(index).position, vertex(index).uv));
            for (card, triangle) in cards.iter().flatten().zip(triangles) {
                let (count, shown) = found.entry(picture(leaf.material, card.rect)).or_default();
                *count += 1;
                shown.insert(triangle.map(|index| vertex(index).uv.map(f32::to_bits)));
            }
        }
        let mut pictures: Vec<_> = found.into_iter().collect();
        pictures.sort_unstable_by_key(|&(picture, (count, _))| (std::cmp::Reverse(count), picture));
        let in_uv = |shown: BTreeSet<[[u32; 2]; 3]>| {
            shown.into_iter().map(|triangle| triangle.map(|uv| uv.map(f32::from_bits))).collect()
        };
        let pictures = pictures.into_iter().map(|((material, bits), (_, shown))| Picture {
            material,
            rect: bytemuck::cast(bits),
            triangles: in_uv(shown),
        });
        pictures.filter(|Picture { rect: [low, high], .. }| low[0] < high[0] && low[1] < high[1]).collect()
    }

    fn triangle_area(&self, triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|index| glam::Vec3::from(self.vertices[index as usize].position).as_dvec3());
        0.5 * (b - a).cross(c - a).length_squared().sqrt()
    }
}

/// Share of the area of triangles that is within a convex polygon; 1 for triangles without area.
fn share(corners: &[Point], triangles: &[[[f32; 2]; 3]]) -> f64 {
    let (mut left, mut total) = (0.0, 0.0);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|uv| uv.map(f64::from));
        let window = if turn(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] };
        left += area(&clipped(corners, &window));
        total += area(&window);
    }
    if total > 0.0 { left / total } else { 1.0 }
}

impl Picture {
    /// Outlines from the finest level to the coarsest one.
    fn outlines(&self, masks: &Levels<'_>, corners: usize) -> Vec<Outline> {
        let found: Vec<_> = (0..masks.count()).map_while(|level| self.outline(masks, level, corners)).collect();
        let mut kept: Vec<(Outline, f64)> = Vec::new();
        for (outline, share) in found.into_iter().rev() {
            if kept.last().is_none_or(|(_, coarser)| coarser - share >= LEAST_GAIN) {
                kept.push((outline, share));
            }
        }
        kept.into_iter().rev().map(|(outline, _)| outline).collect()
    }

    /// The outline that suffices for a level, and the share of the picture that it takes.
    fn outline(&self, masks: &Levels<'_>, level: u8, most: usize) -> Option<(Outline, f64)> {
        let [low, high] = masks.in_texels(self.rect, level);
        let clamped = |point: Point| [0, 1].map(|axis| point[axis].clamp(low[axis], high[axis]));
        // Up to the rounding of coordinates in texels.
        let inside = |point: Point| {
            let inside = clamped(point);
            (0..2).all(|axis| (inside[axis] - point[axis]).abs() < 1e-6).then_some(inside)
        };
        let points = self.reached(masks, level).into_iter().map(clamped).collect();
        let size = masks.size(level);
        let in_uv = |at: Point| {
            let [low, high] = self.rect;
            [0, 1].map(|axis| ((at[axis] / size[axis]) as f32).max(low[axis]).min(high[axis]))
        };
        let corners = rounded_hull(cut(hull(points), most, inside)?.into_iter().map(in_uv))?;
        let outline = Outline { material: self.material, rect: self.rect, corners, level };
        let share = share(&outline.points(), &self.triangles);
        (share <= LARGEST_SHARE).then_some((outline, share))
    }

    /// Corners of what the covering texels of a level reach, in its texels.
    fn reached(&self, masks: &Levels<'_>, level: u8) -> Vec<Point> {
        let (size, full) = (masks.size(level), masks.size(0));
        let reach = [0, 1].map(|axis| 0.5 + SNAP * size[axis] / full[axis]);
        let triangles: Vec<_> = self.triangles.iter().map(|triangle| masks.all_in_texels(*triangle, level)).collect();
        let [low, high] = masks.in_texels(self.rect, level);
        let mut points = Vec::new();
        // Texels beside the triangles reach into them too.
        for y in (low[1] - reach[1]).floor() as i64..(high[1] + reach[1]).ceil() as i64 {
            let [top, bottom] = [y as f64 - reach[1], (y + 1) as f64 + reach[1]];
            let spans = triangles.iter().filter_map(|triangle| span(triangle, top, bottom));
            let Some([from, to]) = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else { continue };
            let mut columns = (from - reach[0]).floor() as i64..(to + reach[0]).ceil() as i64;
            let Some(first) = columns.clone().find(|&x| masks.covers(level, x, y)) else { continue };
            let last = columns.rfind(|&x| masks.covers(level, x, y)).unwrap_or(first);
            let [left, right] = [first as f64 - reach[0], (last + 1) as f64 + reach[0]];
            points.extend([[left, top], [right, top], [left, bottom], [right, bottom]]);
        }
        points
    }
}

/// First and last x of the part of a triangle that lies between two heights.
fn span(triangle: &[Point; 3], top: f64, bottom: f64) -> Option<[f64; 2]> {
    let edges = [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|i| triangle[i]));
    let crossings = edges.into_iter().flat_map(|[a, b]| {
        [top, bottom].map(|height| {
            let t = (height - a[1]) / (b[1] - a[1]);
            ((0.0..=1.0).contains(&t)).then(|| a[0] + (b[0] - a[0]) * t)
        })
    });
    let within = triangle.iter().filter(|point| (top..=bottom).contains(&point[1])).map(|point| point[0]);
    let all = crossings.flatten().chain(within);
    all.map(|x| [x, x]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
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
        let (alpha_mode, texture) = (AlphaMode::Mask, Some(0));
        Material { alpha_mode, texture, wrap: [wrap; 2], ..Material::default() }
    }

    /// A quad that shows the whole rectangle.
    fn quad(rect: Rect) -> Picture {
        let [[u0, v0], [u1, v1]] = rect;
        let [a, b, c, d] = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]];
        Picture { material: 0, rect, triangles: vec![[a, b, c], [a, c, d]] }
    }

    fn holds(corners: &[Point], point: Point) -> bool {
        (0..corners.len()).all(|i| turn(corners[i], corners[(i + 1) % corners.len()], point) >= -1e-6)
    }

    proptest! {
        #[test]
        fn an_outline_is_convex_and_holds_what_every_covering_texel_reaches(
            size in (4..80_u32, 4..80_u32),
            spots in proptest::collection::vec((0.1..0.9_f64, 0.1..0.9_f64, 0.0..0.2_f64), 1..5),
            most in 4..=8_usize,
            part in (0.0..0.3_f32, 0.7..1.0_f32),
            slant in 0.0..0.2_f32,
        ) {
            let near = |x: u32, y: u32| {
                let at = [f64::from(x) / f64::from(size.0), f64::from(y) / f64::from(size.1)];
                spots.iter().any(|&(u, v, r)| (at[0] - u).abs() + 0.5 * (at[1] - v).abs() < r)
            };
            let (pixels, material) = (pixels(size.0, size.1, near), cut_out(Wrap::Clamp));
            let masks = Levels::new(&pixels, &material);
            let rect = [[part.0; 2], [part.1; 2]];
            let mut shown = quad(rect);
            // A trapezium.
            shown.triangles.iter_mut().flatten().filter(|uv| **uv == [part.1; 2]).for_each(|uv| uv[0] -= slant);
            let window = [[part.0; 2], [part.1, part.0], [part.1 - slant, part.1], [part.0, part.1]].map(|uv| uv.map(f64::from));
            let outlines = shown.outlines(&masks, most);
            prop_assert!(outlines.windows(2).all(|pair| pair[0].level < pair[1].level));
            for Outline { level, corners, .. } in &outlines {
                let points = corners.iter().map(|uv| uv.map(f64::from)).collect::<Vec<_>>();
                let outline = Outline { material: 0, rect, corners: corners.clone(), level: *level };
                prop_assert!(crate::plant::outline::check_all(std::slice::from_ref(&outline), 1).is_ok());
                prop_assert!(points.len() <= most && share(&points, &shown.triangles) <= LARGEST_SHARE);
                // Texels of the level that hold a covering one, each half a texel larger.
                let coarse = masks.size(*level);
                let full = [size.0, size.1].map(f64::from);
                for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).filter(|&(x, y)| near(x, y)) {
                    let [from, to] = [[x, y], [x + 1, y + 1]].map(|at| {
                        [0, 1].map(|axis| f64::from(at[axis]) * coarse[axis] / full[axis])
                    });
                    let low = from.map(|at| (at + 1e-9).floor() - 0.5);
                    let high = to.map(|at| (at - 1e-9).ceil() + 0.5);
                    let square = [low, [high[0], low[1]], high, [low[0], high[1]]].map(|at| [at[0] / coarse[0], at[1] / coarse[1]]);
                    for point in clipped(&square, &window) {
                        prop_assert!(holds(&points, point), "{:?} {:?}", outline, point);
                    }
                }
            }
        }
    }

    #[test]
    fn a_disc_keeps_little_more_than_its_area_and_a_full_card_has_no_outline() {
        let disc = |x: u32, y: u32| (f64::from(x) - 127.5).powi(2) + (f64::from(y) - 127.5).powi(2) < 100.0_f64.powi(2);
        let (pixels_of_disc, material) = (pixels(256, 256, disc), cut_out(Wrap::Repeat));
        let whole = quad([[0.0; 2], [1.0; 2]]);
        let masks = Levels::new(&pixels_of_disc, &material);
        let share_with = |corners| whole.outline(&masks, 0, corners).map_or(1.0, |(_, share)| share);
        let disc_share = std::f64::consts::PI * (100.0_f64 / 256.0).powi(2);
        assert!(share_with(8) < disc_share * 1.1, "{} of {disc_share}", share_with(8));
        assert!(share_with(8) <= share_with(6) && share_with(6) <= share_with(4));
        let levels: Vec<u8> = whole.outlines(&masks, 8).iter().map(|outline| outline.level).collect();
        assert!(levels.len() > 1 && levels.is_sorted() && levels[levels.len() - 1] >= 3, "{levels:?}");
        for covers in [true, false] {
            let pixels = pixels(16, 16, |_, _| covers);
            assert!(whole.outlines(&Levels::new(&pixels, &material), 6).is_empty(), "{covers}");
        }
    }

    #[test]
    fn what_lies_beside_the_rectangle_counts_as_far_as_it_reaches() {
        let pixels = pixels(64, 64, |x, y| (20..30).contains(&x) && (20..44).contains(&y) || x == 63 && y == 2);
        let lowest = |wrap| {
            let material = cut_out(wrap);
            let masks = Levels::new(&pixels, &material);
            let (outline, _) = quad([[0.0; 2], [0.5, 1.0]]).outline(&masks, 0, 8).unwrap();
            outline.corners.iter().map(|corner| corner[0]).fold(1.0, f32::min)
        };
        assert_eq!(lowest(Wrap::Repeat), 0.0, "the texel at the right edge repeats at the left");
        assert!(lowest(Wrap::Clamp) > 0.25);
    }

    #[test]
    fn what_lies_beside_the_triangles_does_not_count() {
        // A spot in the middle of a turned card, and one in a corner of its rectangle.
        let pixels = pixels(64, 64, |x, y| (28..36).contains(&x) && (28..36).contains(&y) || x < 4 && y < 4);
        let material = cut_out(Wrap::Clamp);
        let masks = Levels::new(&pixels, &material);
        let [a, b, c, d] = [[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]];
        let turned = Picture { material: 0, rect: [[0.0; 2], [1.0; 2]], triangles: vec![[a, b, c], [a, c, d]] };
        let (outline, share) = turned.outline(&masks, 0, 4).unwrap();
        assert!(outline.corners.as_flattened().iter().all(|x| (0.4..0.6).contains(x)), "{outline:?}");
        assert!((share - 2.0 * (9.5_f64 / 64.0).powi(2)).abs() < 1e-3, "{share}");
    }
}
