//! Number of fragments that the leaves of a picture take: what a GPU shades, or tests and discards,
//! grows with it, while the number of leaves says nothing about their size.

use super::{
    list::{DrawList, Placed},
    options::DrawOptions,
    painter::check_size,
    project::{Projected, ScreenTriangle, project},
};
use crate::{
    Camera, Result,
    edge::{Edge, SUBPIXEL},
};
use glam::DAffine3;

/// Counts the fragments of all leaves of `list` in a picture of `size` (width and height in
/// pixels): pairs of a leaf's triangle and a pixel whose centre it covers, whether or not the
/// fragment is hidden or transparent. O(triangles and the rows that each covers).
///
/// Limits: leaves count with their whole triangles, not with the outlines within which large cards
/// are drawn; one sample per pixel.
///
/// # Errors
/// [`Error::InvalidOption`](crate::Error::InvalidOption) for a size out of range, and if
/// [`Camera::check`] fails.
pub fn leaf_fragments(list: &DrawList<'_>, camera: &Camera, size: [u32; 2]) -> Result<u64> {
    check_size(size)?;
    camera.check()?;
    let placed = [Placed::new(list, DAffine3::IDENTITY)];
    let projected = project(&placed, &[], &[], camera, size, &bare());
    Ok(projected.triangles.iter().map(|triangle| pixels(&projected, triangle, size.map(i64::from))).sum())
}

/// Leaves alone.
fn bare() -> DrawOptions {
    DrawOptions { wood: false, full_textures: true, ..DrawOptions::default() }
}

/// Number of pixels whose centre is in a triangle.
fn pixels(projected: &Projected<'_>, triangle: &ScreenTriangle<'_>, [width, height]: [i64; 2]) -> u64 {
    // Whole numbers of pixels are at centres.
    let corners = triangle.corners.map(|corner| projected.corners[corner as usize].at.map(|at| at - SUBPIXEL / 2));
    let [a, b, c] = corners;
    let edges = [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)];
    let rows = corners.map(|corner| corner[1]);
    let [top, bottom] = [rows[0].min(rows[1]).min(rows[2]), rows[0].max(rows[1]).max(rows[2])];
    let [first, end] = [top.div_euclid(SUBPIXEL).max(0), (bottom.div_euclid(SUBPIXEL) + 1).min(height)];
    (first..end).map(|y| row_pixels(&edges, y, width)).sum()
}

/// Number of whole x from 0 to below `width` at which no edge function is negative in row `y`.
fn row_pixels(edges: &[Edge; 3], y: i64, width: i64) -> u64 {
    let (mut first, mut last) = (0, width - 1);
    for edge in edges {
        let at_0 = edge.at(0, y);
        match edge.per_px[0] {
            0 if at_0 < 0 => return 0,
            0 => {}
            rise if rise > 0 => first = first.max(-at_0.div_euclid(rise)),
            fall => last = last.min(at_0.div_euclid(-fall)),
        }
    }
    (last - first + 1).max(0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        LookAt, Plant,
        leaf::Vertex,
        material::Material,
        software::{Background, DrawOptions, Painter},
    };
    use glam::DVec3;

    /// Squares across the view, each of one leaf: their centres and sides.
    fn squares(squares: &[([f32; 3], f32)]) -> Plant {
        let mut plant = Plant { materials: vec![Material::default()], ..Plant::default() };
        for &(center, side) in squares {
            let corner = |x: f32, y: f32| {
                let position = [center[0] + x * side, center[1] + y * side, center[2]];
                Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2], color: [1.0; 4] }
            };
            let corners = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
            plant.push_leaf(&corners, &[0, 1, 2, 0, 2, 3], center, 0);
        }
        plant
    }

    fn look() -> LookAt {
        LookAt { eye: DVec3::Z * 10.0, target: DVec3::ZERO, up: DVec3::Y, fov_y_radians: 0.6, aspect: 1.0, near: 0.1 }
    }

    fn fragments(plant: &Plant, side: u32) -> u64 {
        leaf_fragments(&DrawList::of_plant(plant), &look().camera(side), [side; 2]).unwrap()
    }

    #[test]
    fn each_pixel_of_a_square_counts_once_and_hidden_squares_count_too() {
        // Pixels per unit of length in the middle of the picture.
        let scale = |side: u32| f64::from(side) / (2.0 * 10.0 * 0.3_f64.tan());
        let one = squares(&[([0.0; 3], 2.0)]);
        for side in [31, 64, 200] {
            let pixels = 2.0 * scale(side);
            let found = fragments(&one, side) as f64;
            assert!((found.sqrt() - pixels).abs() < 1.0, "{found} of {pixels} squared");
        }
        let behind = squares(&[([0.0; 3], 2.0), ([0.0; 3], 2.0)]);
        assert_eq!(fragments(&behind, 64), 2 * fragments(&one, 64));
        let beside = squares(&[([50.0, 0.0, 0.0], 2.0), ([0.0, 0.0, 20.0], 2.0)]);
        assert_eq!(fragments(&beside, 64), 0, "outside the picture, and behind the eye");
    }

    #[test]
    fn leaves_that_do_not_overlap_have_as_many_fragments_as_pixels_are_covered() {
        let grid: Vec<([f32; 3], f32)> =
            (0..36).map(|i| ([(i % 6) as f32 - 2.7, (i / 6) as f32 - 2.4, 0.3 * (i % 5) as f32], 0.71)).collect();
        let plant = squares(&grid);
        let side = 300;
        let painter = Painter::new(&plant.materials, &plant.textures).unwrap();
        let options = DrawOptions { background: Background::Transparent, ..DrawOptions::default() };
        let image = painter.draw(&DrawList::of_plant(&plant), &look().camera(side), [side; 2], &options).unwrap();
        let covered: f64 = image.rgba.chunks_exact(4).map(|pixel| f64::from(pixel[3]) / 255.0).sum();
        let found = fragments(&plant, side) as f64;
        assert!((found / covered - 1.0).abs() < 0.01, "{found} fragments of {covered} covered pixels");
    }

    #[test]
    fn a_triangle_has_the_pixels_whose_centres_are_inside() {
        let mut plant = squares(&[([0.3, -0.2, 0.0], 3.0)]);
        plant.indices.truncate(3);
        plant.leaves[0].indices = [0, 3];
        let size = [40, 40];
        let list = DrawList::of_plant(&plant);
        let projected = project(&[Placed::new(&list, DAffine3::IDENTITY)], &[], &[], &look().camera(40), size, &bare());
        let [a, b, c] = projected.triangles[0].corners.map(|corner| projected.corners[corner as usize].at);
        let side = |from: [i64; 2], to: [i64; 2], p: [i64; 2]| {
            (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0])
        };
        let is_inside = |p: [i64; 2]| [side(a, b, p), side(b, c, p), side(c, a, p)].iter().all(|&area| area > 0);
        let centers = (0..40).flat_map(|y| (0..40).map(move |x| [x * SUBPIXEL + 128, y * SUBPIXEL + 128]));
        let expected = centers.filter(|&center| is_inside(center)).count() as u64;
        assert_eq!(leaf_fragments(&list, &look().camera(40), size).unwrap(), expected);
        assert!(expected > 50);
    }
}
