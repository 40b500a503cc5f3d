//! Random seed of a leaf, by which its partial coverage is spread over samples.

use crate::{bounds::Aabb, crown::inverse_half_size, effects::wind::HASH_MULTIPLIER, leaf::Vertex};
use glam::{DVec3, Vec3};

/// Cells of the crown's box along each axis, over which the seeds of leaves differ: finer than
/// leaves, and coarse enough that rounding hardly ever moves one to another cell.
const CELLS: f64 = 256.0;

/// Seed of the leaf whose first triangle has these corners. It depends on the leaf's place in the
/// crown and not on its number, so that a plant looks the same in whatever order its leaves are
/// stored.
pub(crate) fn seed(corners: [&Vertex; 3], crown: &Aabb) -> u32 {
    let middle = corners.map(|corner| Vec3::from(corner.position).as_dvec3()).iter().sum::<DVec3>() / 3.0;
    let in_crown = (middle - crown.center()) * inverse_half_size(crown).as_dvec3();
    let cell = (in_crown * (0.5 * CELLS)).floor().as_ivec3();
    cell.to_array()
        .into_iter()
        .fold(0, |seed: u32, axis| (seed ^ seed >> 15 ^ axis as u32).wrapping_mul(HASH_MULTIPLIER))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_differ_between_leaves_and_not_with_the_scale_or_the_place_of_the_plant() {
        let seeds = |scale: f32, shift: f32| -> Vec<u32> {
            let at = |x: f32| [scale * x + shift, scale * x * 0.3 + shift, shift];
            let vertex = |x: f32| Vertex { position: at(x), ..bytemuck::Zeroable::zeroed() };
            let crown = Aabb::of_points([at(0.0), at(20.0)]);
            (0..200).map(|i| f32::from(i as u8) * 0.1 + 0.033).map(|x| seed([&vertex(x); 3], &crown)).collect()
        };
        let here = seeds(1.0, 0.0);
        let mut distinct = here.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert!(distinct.len() > 150, "{}", distinct.len());
        assert_eq!(here, seeds(1024.0, 0.0));
        let moved = seeds(1.0, 64.0).into_iter().zip(&here).filter(|(there, here)| there != *here).count();
        assert!(moved <= 2, "{moved}");
    }
}
