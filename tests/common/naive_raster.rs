//! Rasterisation for the naive method: the pixels that a triangle covers, straight from the rules.

use foliage_lod::{
    Plant,
    material::{Material, Wrap},
};
use glam::DVec2;

/// Width, height, and whether each texel is opaque.
pub type Mask = (usize, usize, Vec<bool>);

/// A mask, its wrap modes, the texture coordinates of a triangle's corners and, if its leaf repeats
/// its picture, the pivot's texture coordinates and the leaf's scale.
pub type Masked<'m> = (&'m Mask, [Wrap; 2], [[f32; 2]; 3], Option<([f32; 2], f32)>);

/// Whether `sample` is strictly inside the triangle, or on a top or left edge.
pub fn inside(mut corners: [(i64, i64); 3], sample: (i64, i64)) -> bool {
    let side = |a: (i64, i64), b: (i64, i64), p: (i64, i64)| (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
    let area = side(corners[0], corners[1], corners[2]);
    if area < 0 {
        corners.reverse();
    }
    area != 0
        && (0..3).all(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let top_or_left = b.1 < a.1 || (a.1 == b.1 && b.0 > a.0);
            let side = side(a, b, sample);
            side > 0 || (side == 0 && top_or_left)
        })
}

/// Whether the texel under a pixel is opaque, from the `f32` screen-space planes that the library
/// documents.
pub fn alpha_covers(
    ((width, height, covers), wrap, uv, tiling): Masked<'_>,
    corners: [(i64, i64); 3],
    w: [f64; 3],
    (x, y): (usize, usize),
) -> bool {
    let [a, b, c] = corners.map(|(x, y)| DVec2::new(x as f64 / 256.0, y as f64 / 256.0));
    let anchor = a.floor();
    let area = (b - a).perp_dot(c - a);
    let at = (x as f32 - anchor.x as f32, y as f32 - anchor.y as f32);
    let plane = |values: [f64; 3]| {
        let (to_b, to_c) = (values[1] - values[0], values[2] - values[0]);
        let per_x = (to_b * (c - a).y - to_c * (b - a).y) / area;
        let per_y = (to_c * (b - a).x - to_b * (c - a).x) / area;
        let origin = values[0] + per_x * (anchor.x - a.x) + per_y * (anchor.y - a.y);
        per_x as f32 * at.0 + (per_y as f32 * at.1 + origin as f32)
    };
    let w_here = 1.0 / plane(w.map(|w| 1.0 / w));
    let coordinate = |axis: usize| plane([0, 1, 2].map(|i| f64::from(uv[i][axis]) / w[i])) * w_here;
    let mut at = [coordinate(0), coordinate(1)];
    if let Some((pivot, scale)) = tiling {
        let (u, column) = tiled(at[0], pivot[0], scale, 0.0);
        // Odd columns are shifted by half a picture.
        at = [u, tiled(at[1], pivot[1], scale, if column.rem_euclid(2.0) == 1.0 { 0.5 } else { 0.0 }).0];
    }
    let texel = |axis: usize, size: usize| {
        assert_eq!(wrap[axis], Wrap::Repeat, "the other modes are tested next to the rasteriser");
        (at[axis] * size as f32).floor().rem_euclid(size as f32) as usize
    };
    covers[texel(1, *height) * width + texel(0, *width)]
}

/// Where in its picture, from 0 to 1, a card of linear scale `scale` shows what it has at
/// `coordinate`, from 0 to 1: it has a row of pictures as large as the unscaled card's, those at
/// its ends squeezed into what it has of them, and every second one mirrored. Also the picture's
/// number.
fn tiled(coordinate: f32, pivot: f32, scale: f32, shift: f32) -> (f32, f32) {
    let from = pivot - scale * pivot + shift;
    let to = from + scale;
    let at = from + coordinate * scale;
    let picture = (from.floor() + (at - from.floor()).trunc().max(0.0)).min(to.ceil() - 1.0);
    let [start, end] = [picture.max(from), (picture + 1.0).min(to)];
    let inside = if end - start == 1.0 { at - start } else { (at - start) * (1.0 / (end - start)) };
    let inside = inside.clamp(0.0, 1.0);
    (if picture.rem_euclid(2.0) == 1.0 { 1.0 - inside } else { inside }, picture)
}

/// The mask of a material's texture; `None` without a texture.
pub fn mask(plant: &Plant, material: &Material) -> Option<Mask> {
    let image = image::load_from_memory(&plant.textures[material.texture? as usize].bytes).unwrap().into_rgba8();
    let covers =
        image.pixels().map(|texel| f64::from(texel.0[3]) / 255.0 >= f64::from(material.cutoff().unwrap())).collect();
    Some((image.width() as usize, image.height() as usize, covers))
}

/// Closes the gaps of a square view's silhouette that are at most 1/32 of the view wide: a pixel is
/// within the outline if every square of that width that contains it also contains a covered one.
pub fn outline(covered: Vec<bool>) -> Vec<bool> {
    let side = covered.len().isqrt() as i64;
    let reach = (side as f64 / 64.0).ceil() as i64;
    let around = |[x, y]: [i64; 2]| (-reach..=reach).flat_map(move |v| (-reach..=reach).map(move |u| [x + u, y + v]));
    let is_covered =
        |[x, y]: [i64; 2]| (0..side).contains(&x) && (0..side).contains(&y) && covered[(y * side + x) as usize];
    let pixels = (0..side).flat_map(|y| (0..side).map(move |x| [x, y]));
    pixels.map(|pixel| around(pixel).all(|middle| around(middle).any(is_covered))).collect()
}
