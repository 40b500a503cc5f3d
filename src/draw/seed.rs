//! Seeds of leaves, by which their partial coverage is spread over samples.

use crate::{bounds::Aabb, crown::inverse_half_size, hash::HASH_MULTIPLIER, leaf::Vertex};
use glam::{DVec3, Vec3};

/// Cells of the crown's box along each axis: finer than leaves, and coarse enough that rounding
/// hardly ever moves one to another cell.
const CELLS: f64 = 256.0;

/// Seeds of the leaves whose triangles have the corners `indices[range]`.
///
/// As fractions of 2^32 they are multiples of the golden ratio, modulo 1, in the order of the
/// leaves' places along a Z-order curve (G. M. Morton, 1966): they are evenly distributed in any
/// part of the crown, so that of leaves smaller than a pixel the right share is drawn. They do not
/// depend on numbers, so that a plant looks the same in whatever order its leaves are stored.
pub(crate) fn seeds(vertices: &[Vertex], indices: &[u32], leaves: impl Iterator<Item = [u32; 2]>) -> Vec<u32> {
    let crown = Aabb::of_points(vertices.iter().map(|vertex| vertex.position));
    let place = |[first, end]: [u32; 2]| {
        let corners = indices.get(first as usize..end as usize).unwrap_or_default();
        let corners = corners.iter().filter_map(|&index| vertices.get(index as usize));
        let positions = corners.map(|corner| Vec3::from(corner.position).as_dvec3());
        let middle = positions.sum::<DVec3>() / f64::from(end.saturating_sub(first).max(1));
        let in_crown = (middle - crown.center()) * inverse_half_size(&crown).as_dvec3();
        z_order(((in_crown * 0.5 + 0.5) * CELLS).to_array().map(|cell| cell as u8))
    };
    let places: Vec<u32> = leaves.map(place).collect();
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    order.sort_by_key(|&leaf| places[leaf as usize]);
    let mut seeds = vec![0; places.len()];
    (0_u32..).zip(order).for_each(|(rank, leaf)| seeds[leaf as usize] = rank.wrapping_mul(HASH_MULTIPLIER));
    seeds
}

/// Interleaves the bits of a cell's coordinates.
fn z_order(cell: [u8; 3]) -> u32 {
    (0..24).fold(0, |code, bit| code | (u32::from(cell[bit % 3]) >> (bit / 3) & 1) << bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f32) -> Vertex {
        Vertex { position: [x, 0.3 * x, 0.0], ..bytemuck::Zeroable::zeroed() }
    }

    #[test]
    fn seeds_go_with_the_places_of_leaves_and_are_spread_evenly_over_every_part_of_the_crown() {
        let places: Vec<f32> = (0..200).map(|i| (i * 77 % 200) as f32 * 0.1).collect();
        let of = |places: &[f32]| {
            let vertices: Vec<Vertex> = places.iter().copied().map(corner).collect();
            seeds(&vertices, &(0..200).collect::<Vec<u32>>(), (0..200).map(|leaf| [leaf, leaf + 1]))
        };
        let seeds = of(&places);
        let reversed = of(&places.iter().rev().copied().collect::<Vec<f32>>());
        assert!(seeds.iter().eq(reversed.iter().rev()), "the order of leaves has no effect");
        for part in [0.0..5.0, 7.3..9.4, 12.0..20.0] {
            let inside = || places.iter().zip(&seeds).filter(|(place, _)| part.contains(*place));
            let low = inside().filter(|(_, seed)| f64::from(**seed) < 0.3 * 2_f64.powi(32)).count() as f64;
            assert!((low - 0.3 * inside().count() as f64).abs() < 2.0, "{low} of {}", inside().count());
        }
    }

    #[test]
    fn a_z_order_compares_the_coarsest_halves_of_all_axes_first() {
        assert_eq!(z_order([255, 255, 255]), (1 << 24) - 1);
        assert_eq!([z_order([1, 0, 0]), z_order([0, 1, 0]), z_order([0, 0, 128])], [1, 2, 1 << 23]);
    }
}
