//! Which remaining leaf is enlarged for a pruned one, and to what scale.
//!
//! `nearest`, after C. Gasch et al., "Multiresolution Foliage Rendering", section 4.1: "the closest leaf is searched for and
//! scaled". The paper prints no law. Here, as its consequences demand: distance is between centroids; the target takes the
//! pruned leaf's *current* (already enlarged) surface area; a leaf that no view saw adds nothing; scale is a linear factor
//! about the target's pivot.
//!
//! Whatever the rule, no leaf grows out of the box around the plant's leaves at full detail: leaves that hide each other
//! hand on more area than is seen, which would blow up the outline of plants with few, large leaves. So bounds at full
//! detail hold at every level, up to the rounding of a scale to `f32`.
//!
//! Limits: growth adds up along chains of targets, up to `max_scale` and the box; what lies beyond is lost. In a low, wide
//! file of several small plants the box leaves little room, and whole plants have been seen to go before half of the leaves.

use super::{neighbours::Neighbours, options::Compensate};
use crate::{bounds::Aabb, leaf::LeafGeometry, plant::Plant};
use glam::{DVec3, Vec3};

/// What a pruning does to its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// The leaf that is enlarged.
    pub target: u32,
    /// Its scale before.
    pub from: f32,
    /// Its scale after; equal where nothing is added.
    pub to: f32,
}

/// Current scales of all leaves, and the rule that enlarges them.
pub struct Enlarger {
    rule: Compensate,
    /// Largest scale each leaf may reach.
    caps: Vec<f64>,
    /// Current linear scale of each leaf.
    pub scales: Vec<f32>,
    /// Surface area at scale 1.
    areas: Vec<f64>,
    neighbours: Neighbours,
}

impl Enlarger {
    /// All leaves of `plant` at scale 1.
    pub fn new(plant: &Plant, rule: Compensate, max_scale: f32) -> Self {
        let (areas, centroids): (Vec<f64>, Vec<Vec3>) =
            (0..plant.leaves.len()).map(|leaf| area_and_centroid(plant, leaf)).unzip();
        Self {
            rule,
            caps: caps(plant, f64::from(max_scale)),
            scales: vec![1.0; plant.leaves.len()],
            areas,
            neighbours: Neighbours::new(&centroids),
        }
    }

    /// Takes a leaf out and enlarges its target; `None` when it was the last. `seen`: some view saw the leaf.
    pub fn prune(&mut self, leaf: u32, seen: bool) -> Option<Growth> {
        self.neighbours.remove(leaf);
        let target = self.neighbours.nearest(leaf)?;
        let from = self.scales[target as usize];
        let to = if seen && self.rule == Compensate::Nearest { self.with_area_of(target, leaf) } else { from };
        self.scales[target as usize] = to;
        Some(Growth { target, from, to })
    }

    /// The target's scale with the leaf's current area added to its own, capped; never less than it is.
    fn with_area_of(&self, target: u32, leaf: u32) -> f32 {
        let area = |leaf: u32| self.areas[leaf as usize] * f64::from(self.scales[leaf as usize]).powi(2);
        let current = self.scales[target as usize];
        let rest = self.areas[target as usize];
        if rest == 0.0 {
            return current;
        }
        let grown = ((area(target) + area(leaf)) / rest).sqrt().min(self.caps[target as usize]);
        (grown as f32).max(current)
    }
}

/// The scale at which each leaf would first touch the box around all leaves: at least 1, at most `max_scale`.
fn caps(plant: &Plant, max_scale: f64) -> Vec<f64> {
    let all = Aabb::of_points(plant.vertices.iter().map(|vertex| vertex.position));
    let room = |pivot: f32, position: f32, low: f32, high: f32| {
        let offset = f64::from(position) - f64::from(pivot);
        let wall = if offset > 0.0 { high } else { low };
        if offset == 0.0 { f64::INFINITY } else { (f64::from(wall) - f64::from(pivot)) / offset }
    };
    let cap = |leaf: &LeafGeometry| {
        let vertices = &plant.vertices[leaf.vertex_range()];
        let rooms = vertices.iter().flat_map(|vertex| {
            [0, 1, 2].map(|axis| room(leaf.pivot[axis], vertex.position[axis], all.min[axis], all.max[axis]))
        });
        rooms.fold(max_scale, f64::min).max(1.0)
    };
    plant.leaves.iter().map(cap).collect()
}

/// Surface area, and its centroid (the mean vertex where there is no area).
fn area_and_centroid(plant: &Plant, leaf: usize) -> (f64, Vec3) {
    let leaf = &plant.leaves[leaf];
    let (mut doubled_area, mut weighted) = (0.0, DVec3::ZERO);
    for corners in plant.indices[leaf.index_range()].chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(plant.vertices[corners[i] as usize].position).as_dvec3());
        let doubled = (b - a).cross(c - a).length_squared().sqrt();
        doubled_area += doubled;
        weighted += (a + b + c) * (doubled / 3.0);
    }
    let vertices = &plant.vertices[leaf.vertex_range()];
    let mean = || {
        let sum: DVec3 = vertices.iter().map(|v| Vec3::from(v.position).as_dvec3()).sum();
        sum / vertices.len() as f64
    };
    let centroid = if doubled_area > 0.0 { weighted / doubled_area } else { mean() };
    (doubled_area * 0.5, centroid.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Vertex;

    fn square(x: f32, side: f32) -> [Vertex; 4] {
        [[x, 0.0], [x + side, 0.0], [x + side, side], [x, side]].map(|[x, y]| Vertex {
            position: [x, y, 0.0],
            normal: [0.0, 0.0, 1.0],
            uv: [0.0; 2],
            color: [1.0; 4],
        })
    }

    /// Squares of side 1 in a row along x, a tall one last.
    fn row() -> Plant {
        let mut plant = Plant::default();
        for (x, side) in [(0.0, 1.0), (1.5, 1.0), (3.5, 1.0), (10.0, 4.0)] {
            plant.push_leaf(&square(x, side), &[0, 1, 2, 0, 2, 3], [x, 0.0, 0.0], 0);
        }
        plant
    }

    #[test]
    fn the_nearest_leaf_takes_the_current_area_of_the_pruned_one() {
        let mut enlarger = Enlarger::new(&row(), Compensate::Nearest, 8.0);
        assert_eq!(enlarger.prune(0, true), Some(Growth { target: 1, from: 1.0, to: 2.0_f32.sqrt() }));
        assert_eq!(enlarger.prune(1, true), Some(Growth { target: 2, from: 1.0, to: 3.0_f32.sqrt() }));
    }

    #[test]
    fn a_leaf_that_no_view_saw_adds_nothing_and_neither_does_the_rule_none() {
        for (rule, seen) in [(Compensate::Nearest, false), (Compensate::None, true)] {
            let growth = Enlarger::new(&row(), rule, 8.0).prune(0, seen);
            assert_eq!(growth, Some(Growth { target: 1, from: 1.0, to: 1.0 }));
        }
    }

    #[test]
    fn growth_stops_at_max_scale_and_at_the_box_around_the_leaves() {
        assert_eq!(Enlarger::new(&row(), Compensate::Nearest, 1.25).prune(0, true).unwrap().to, 1.25);
        let caps = caps(&row(), 8.0);
        assert_eq!(caps, [4.0, 4.0, 4.0, 1.0], "up to the height of the tall square; that one touches the box already");
    }

    #[test]
    fn the_last_leaf_has_no_target() {
        let mut enlarger = Enlarger::new(&row(), Compensate::Nearest, 8.0);
        (0..3).for_each(|leaf| assert!(enlarger.prune(leaf, true).is_some()));
        assert_eq!(enlarger.prune(3, true), None);
    }
}
