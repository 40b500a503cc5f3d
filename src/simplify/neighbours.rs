//! Exact nearest-neighbour queries over the remaining leaves, on a bounding volume hierarchy of
//! leaf centroids that supports removal.
//!
//! Built and maintained by obvhs (`Bvh2`), which has no nearest-neighbour query of its own: its
//! public nodes are traversed here, nearer child first. Leaves with exactly the same centroid share
//! one primitive, since many coincident points would make the hierarchy as deep as there are
//! leaves.

use glam::{DVec3, Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};
use std::{collections::BTreeMap, time::Duration};

/// Remaining leaves, indexed for nearest-neighbour queries.
pub struct Neighbours {
    bvh: Bvh2,
    /// Distinct centroids.
    points: Vec<Vec3>,
    /// Remaining leaves at each point, lowest index last.
    leaves: Vec<Vec<u32>>,
    /// Index into `points` for each leaf.
    point_of_leaf: Vec<u32>,
    stack: Vec<(f64, u32)>,
    /// Nearest leaves found so far, with their squared distances.
    best: Vec<(f64, u32)>,
}

impl Neighbours {
    /// Builds the hierarchy over all leaves. Centroids must be finite.
    pub fn new(centroids: &[Vec3]) -> Self {
        let mut points = Vec::new();
        let mut leaves: Vec<Vec<u32>> = Vec::new();
        let mut known = BTreeMap::new();
        let mut point_of_leaf = Vec::with_capacity(centroids.len());
        for (leaf, &centroid) in centroids.iter().enumerate() {
            // Adding zero turns -0.0 into 0.0.
            let bits = (centroid + Vec3::ZERO).to_array().map(f32::to_bits);
            let point = *known.entry(bits).or_insert_with(|| {
                points.push(centroid);
                leaves.push(Vec::new());
                points.len() as u32 - 1
            });
            leaves[point as usize].push(leaf as u32);
            point_of_leaf.push(point);
        }
        leaves.iter_mut().for_each(|leaves| leaves.reverse());
        let boxes: Vec<Aabb> = points.iter().map(|&point| Aabb::new(point.into(), point.into())).collect();
        let mut bvh = build_bvh2(&boxes, obvhs::BvhBuildParams::fast_build(), &mut Duration::default());
        bvh.init_parents_if_uninit();
        bvh.init_primitives_to_nodes_if_uninit();
        Self { bvh, points, leaves, point_of_leaf, stack: Vec::new(), best: Vec::new() }
    }

    /// Removes a leaf. Removing it again has no effect.
    pub fn remove(&mut self, leaf: u32) {
        let point = self.point_of_leaf[leaf as usize];
        let leaves = &mut self.leaves[point as usize];
        let Some(place) = leaves.iter().rposition(|&other| other == leaf) else { return };
        leaves.remove(place);
        if leaves.is_empty() {
            self.bvh.remove_primitive(point);
        }
    }

    /// Finds up to `count` remaining leaves whose centroids are nearest to that of `leaf`, which
    /// must have been removed before. They are sorted by distance, then by index, and replace the
    /// contents of `nearest`.
    pub fn nearest(&mut self, leaf: u32, count: usize, nearest: &mut Vec<u32>) {
        let from = self.points[self.point_of_leaf[leaf as usize] as usize].as_dvec3();
        self.best.clear();
        self.stack.clear();
        if !self.bvh.nodes.is_empty() && count > 0 {
            self.stack.push((0.0, 0));
        }
        while let Some((distance, node)) = self.stack.pop() {
            // An equally distant box may hold a leaf with a lower index.
            if self.best.len() == count && distance > self.best[count - 1].0 {
                continue;
            }
            let node = &self.bvh.nodes[node as usize];
            if node.is_leaf() {
                for slot in node.first_index..node.first_index + node.prim_count {
                    let point = self.bvh.primitive_indices[slot as usize] as usize;
                    let distance = (self.points[point].as_dvec3() - from).length_squared();
                    for &leaf in self.leaves[point].iter().rev().take(count) {
                        keep_least(&mut self.best, count, (distance, leaf));
                    }
                }
                continue;
            }
            let [left, right] = [node.first_index, node.first_index + 1].map(|child| {
                let aabb = &self.bvh.nodes[child as usize].aabb;
                (distance_squared(from, aabb.min, aabb.max), child)
            });
            let (near, far) = if left.0 <= right.0 { (left, right) } else { (right, left) };
            self.stack.extend([far, near]);
        }
        nearest.clear();
        nearest.extend(self.best.iter().map(|&(_, leaf)| leaf));
    }
}

/// Inserts an entry into the sorted list of the `count` least entries.
fn keep_least(least: &mut Vec<(f64, u32)>, count: usize, entry: (f64, u32)) {
    let place = least.partition_point(|other| *other < entry);
    if place < count {
        least.truncate(count - 1);
        least.insert(place, entry);
    }
}

/// Squared distance from a point to a box. It is rounded in the same way as the distance to a point
/// in the box, so it is never greater.
fn distance_squared(from: DVec3, min: Vec3A, max: Vec3A) -> f64 {
    let (min, max) = (Vec3::from(min).as_dvec3(), Vec3::from(max).as_dvec3());
    (from.clamp(min, max) - from).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn nearest_by_scan(centroids: &[Vec3], live: &[bool], leaf: usize, count: usize) -> Vec<u32> {
        let from = centroids[leaf].as_dvec3();
        let distance = |i: u32| (centroids[i as usize].as_dvec3() - from).length_squared();
        let mut all: Vec<u32> = (0..centroids.len() as u32).filter(|&i| live[i as usize]).collect();
        all.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        all.truncate(count);
        all
    }

    proptest! {
        #[test]
        fn the_nearest_equal_those_of_a_scan_while_all_leaves_are_removed(
            // Few distinct coordinates give many ties and coincident points.
            cells in prop::collection::vec((0..4_i8, 0..4_i8, -1..2_i8), 1..60),
            order in prop::collection::vec(any::<u32>(), 60),
            count in 0..9_usize,
        ) {
            let centroids: Vec<Vec3> =
                cells.iter().map(|&(x, y, z)| Vec3::new(x.into(), y.into(), z.into()) * 0.3).collect();
            let mut neighbours = Neighbours::new(&centroids);
            let mut live = vec![true; centroids.len()];
            let mut nearest = Vec::new();
            for random in order.into_iter().take(centroids.len()) {
                let candidates: Vec<usize> = (0..live.len()).filter(|&i| live[i]).collect();
                let leaf = candidates[random as usize % candidates.len()];
                live[leaf] = false;
                neighbours.remove(leaf as u32);
                neighbours.nearest(leaf as u32, count, &mut nearest);
                prop_assert_eq!(&nearest, &nearest_by_scan(&centroids, &live, leaf, count));
            }
        }
    }

    #[test]
    fn a_hundred_thousand_coincident_leaves_are_removed_in_index_order() {
        let mut neighbours = Neighbours::new(&vec![Vec3::ONE; 100_000]);
        let mut nearest = Vec::new();
        for leaf in 0..99_999 {
            neighbours.remove(leaf);
            neighbours.nearest(leaf, 1, &mut nearest);
            assert_eq!(nearest, [leaf + 1]);
        }
        neighbours.remove(99_999);
        neighbours.nearest(0, 1, &mut nearest);
        assert!(nearest.is_empty());
    }
}
