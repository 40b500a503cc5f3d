//! Choice of the remaining leaf that grows for a pruned one, and of its scale.
//!
//! `nearest`, after C. Gasch et al., "Multiresolution Foliage Rendering", section 4.1: the closest
//! leaf is scaled "based on the error introduced when it is eliminated and on the size of the
//! removed leaf". The paper gives no formula. Here, distance is measured between centroids, the
//! scale is a linear factor about the target's pivot, and the target's surface area grows by the
//! pruned leaf's *current* (already enlarged) area times its **visible share**, the number of
//! pixels over all views in which it is visible divided by the number it covers:
//!
//! ```text
//! area(target) + area(leaf) * visible(leaf) / covered(leaf)
//! ```
//!
//! A leaf that is visible in no view therefore adds nothing, and one that is partly hidden adds
//! only the area that will be missed. Adding its whole area instead inflates plants whose leaves
//! hide each other (outline +76 % with 15 % of `CommonTree_1`'s leaves; +6 % with the share), and
//! is slower, since leaves grow larger than needed.
//!
//! `silhouette` and `image` (ours) let the views decide. Each of the 8 nearest leaves is tried with
//! the pruned leaf's whole current area added; the best is the one that brings the views closest to
//! the full plant's, as [`appearance`](super::appearance) compares them and [`price`](super::price)
//! values coverage. For `image`, that leaf is also tried with a quarter, half, twice and four times
//! the area. The best growth of all is applied, or none if none has a gain. (Trying every size of
//! every candidate takes more than twice the time for the same result: RMSE within 1 % on the
//! English oak.)
//!
//! Whatever the rule, no leaf grows out of the box around the plant's leaves by more than a tenth
//! of its diagonal. Where views decide, leaves stay within the crown's
//! [`outline`](super::outline): without its price, five of the 35 sprays of `Pine_1` cover 16 % of
//! the crown's area beyond it.
//!
//! Limits: with `nearest`, a target that is itself hidden shows only part of its growth, so dense
//! crowns thin out a little. Growth adds up along chains of targets, up to `max_scale` and the box;
//! area beyond that is lost.

use super::{neighbours::Neighbours, options::Compensate};
use crate::{bounds::Aabb, leaf::LeafGeometry, plant::Plant};
use glam::{DVec3, Vec3};

/// Distance that leaves may grow out of the box around all leaves at full detail, as a fraction of
/// its diagonal. Without a margin, small plants side by side in one low file disappear completely;
/// with a larger one, the last few leaves of a small plant take over.
const MARGIN: f64 = 0.1;

/// Number of nearest remaining leaves that may grow for a pruned one.
const CANDIDATES: usize = 8;
/// Other growths that are tried for the best target, as multiples of the lost area.
const OTHER_GROWTHS: [f64; 4] = [0.25, 0.5, 2.0, 4.0];

/// Growth of a target when a leaf is pruned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// Leaf that is enlarged.
    pub target: u32,
    /// Scale before.
    pub from: f32,
    /// Scale after; equal to `from` if nothing is added.
    pub to: f32,
}

/// Compensation for a pruned leaf.
#[derive(Debug, Clone, PartialEq)]
pub enum Plan {
    /// Apply this growth without judging it.
    Grow(Growth),
    /// Apply the growth with the highest score, the first of equal ones: one of these, another
    /// growth of the best target, or none if none has a gain.
    Judge {
        /// Surface area of the pruned leaf at its current scale.
        lost_area: f64,
        /// Growth of each candidate by the lost area, nearest first.
        growths: Vec<Growth>,
    },
}

/// Current scales of all leaves, and the rule that enlarges them.
pub struct Enlarger {
    rule: Compensate,
    nearest: Vec<u32>,
    /// Largest scale of each leaf.
    caps: Vec<f64>,
    /// Current linear scale of each leaf.
    pub scales: Vec<f32>,
    /// Whether each leaf is pruned.
    pub dead: Vec<bool>,
    /// For each leaf, the number of pixels over all views that it covers at its current scale,
    /// visible or not.
    pub covered: Vec<u32>,
    /// Surface area of each leaf at scale 1.
    areas: Vec<f64>,
    neighbours: Neighbours,
}

impl Enlarger {
    /// Starts with all leaves of `plant` at scale 1. `covered` is the initial value of the field.
    pub fn new(plant: &Plant, covered: Vec<u32>, rule: Compensate, max_scale: f32) -> Self {
        let (areas, centroids): (Vec<f64>, Vec<Vec3>) =
            (0..plant.leaves.len()).map(|leaf| area_and_centroid(plant, leaf)).unzip();
        Self {
            rule,
            nearest: Vec::new(),
            caps: caps(plant, f64::from(max_scale)),
            scales: vec![1.0; plant.leaves.len()],
            dead: vec![false; plant.leaves.len()],
            covered,
            areas,
            neighbours: Neighbours::new(&centroids),
        }
    }

    /// Removes a leaf and returns its compensation, or `None` if it was the last. `visible` is the
    /// number of pixels over all views in which the leaf is frontmost.
    pub fn prune(&mut self, leaf: u32, visible: u32) -> Option<Plan> {
        self.neighbours.remove(leaf);
        self.dead[leaf as usize] = true;
        let is_judged = matches!(self.rule, Compensate::Silhouette | Compensate::Image) && visible > 0;
        let count = if is_judged { CANDIDATES } else { 1 };
        self.neighbours.nearest(leaf, count, &mut self.nearest);
        let &nearest = self.nearest.first()?;
        if is_judged {
            let lost_area = self.area(leaf);
            let growths = self.nearest.iter().map(|&target| self.growth(target, lost_area)).collect();
            return Some(Plan::Judge { lost_area, growths });
        }
        let seen = match self.rule {
            Compensate::Nearest => f64::from(visible) / f64::from(self.covered[leaf as usize].max(1)),
            _ => 0.0,
        };
        Some(Plan::Grow(self.growth(nearest, self.area(leaf) * seen)))
    }

    /// Returns the other growths to try for the target that was best with the whole lost area.
    pub fn other_growths(&self, target: u32, lost_area: f64) -> Vec<Growth> {
        match self.rule {
            Compensate::Image => OTHER_GROWTHS.iter().map(|share| self.growth(target, lost_area * share)).collect(),
            _ => Vec::new(),
        }
    }

    fn growth(&self, target: u32, area: f64) -> Growth {
        Growth { target, from: self.scales[target as usize], to: self.with_area(target, area) }
    }

    /// Enlarges the target. `covered` is the number of pixels over all views that it covers
    /// afterwards, visible or not.
    pub fn grow(&mut self, growth: Growth, covered: u32) {
        self.scales[growth.target as usize] = growth.to;
        self.covered[growth.target as usize] = covered;
    }

    /// Scale of a leaf, or `None` if it is pruned.
    pub fn scale(&self, leaf: usize) -> Option<f32> {
        (!self.dead[leaf]).then_some(self.scales[leaf])
    }

    /// Surface area of a leaf at its current scale.
    fn area(&self, leaf: u32) -> f64 {
        let scale = f64::from(self.scales[leaf as usize]);
        self.areas[leaf as usize] * (scale * scale)
    }

    /// Scale of the target with `area` added to its own, capped but never less than the current
    /// scale.
    fn with_area(&self, target: u32, area: f64) -> f32 {
        let current = self.scales[target as usize];
        let rest = self.areas[target as usize];
        if rest == 0.0 || area == 0.0 {
            return current;
        }
        let grown = ((self.area(target) + area) / rest).sqrt().min(self.caps[target as usize]);
        (grown as f32).max(current)
    }
}

/// Scale at which each leaf would first be [`MARGIN`] out of the box around all leaves: at least 1,
/// at most `max_scale`.
fn caps(plant: &Plant, max_scale: f64) -> Vec<f64> {
    let all = Aabb::of_points(plant.vertices.iter().map(|vertex| vertex.position));
    let [low, high] = [all.min, all.max].map(|corner| Vec3::from(corner).as_dvec3());
    let margin = DVec3::splat((high - low).length() * MARGIN);
    let [low, high] = [low - margin, high + margin];
    let cap = |leaf: &LeafGeometry| {
        let pivot = Vec3::from(leaf.pivot).as_dvec3();
        let rooms = plant.vertices[leaf.vertex_range()].iter().flat_map(|vertex| {
            let offset = Vec3::from(vertex.position).as_dvec3() - pivot;
            [0, 1, 2].map(|axis| match offset[axis] {
                0.0 => f64::INFINITY,
                outwards @ 0.0.. => (high[axis] - pivot[axis]) / outwards,
                outwards => (low[axis] - pivot[axis]) / outwards,
            })
        });
        rooms.fold(max_scale, f64::min).max(1.0)
    };
    plant.leaves.iter().map(cap).collect()
}

/// Surface area of a leaf and its centroid (the mean vertex if there is no area).
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

    /// Squares of side 1 in a row along x, followed by one of side 4.
    fn row() -> Plant {
        let mut plant = Plant::default();
        for (x, side) in [(0.0, 1.0), (1.5, 1.0), (3.5, 1.0), (10.0, 4.0)] {
            plant.push_leaf(&square(x, side), &[0, 1, 2, 0, 2, 3], [x, 0.0, 0.0], 0);
        }
        plant
    }

    /// An enlarger in which every leaf covers 10 pixels.
    fn enlarger(rule: Compensate, max_scale: f32) -> Enlarger {
        Enlarger::new(&row(), vec![10; 4], rule, max_scale)
    }

    /// Prunes by a rule that does not use the views.
    fn prune(enlarger: &mut Enlarger, leaf: u32, visible: u32) -> Option<Growth> {
        match enlarger.prune(leaf, visible)? {
            Plan::Grow(growth) => {
                enlarger.grow(growth, 10);
                Some(growth)
            }
            Plan::Judge { .. } => panic!("nothing to judge"),
        }
    }

    #[test]
    fn the_nearest_leaf_takes_the_seen_share_of_the_current_area_of_the_pruned_one() {
        let mut enlarger = enlarger(Compensate::Nearest, 8.0);
        assert_eq!(prune(&mut enlarger, 0, 5), Some(Growth { target: 1, from: 1.0, to: 1.5_f32.sqrt() }));
        let to = (1.0 + f64::from(1.5_f32.sqrt()).powi(2)).sqrt() as f32;
        assert_eq!(prune(&mut enlarger, 1, 10), Some(Growth { target: 2, from: 1.0, to }));
    }

    #[test]
    fn a_leaf_that_no_view_saw_adds_nothing_and_neither_does_the_rule_none() {
        for rule in [Compensate::Nearest, Compensate::Silhouette, Compensate::Image, Compensate::None] {
            let visible = if rule == Compensate::None { 10 } else { 0 };
            let growth = prune(&mut enlarger(rule, 8.0), 0, visible);
            assert_eq!(growth, Some(Growth { target: 1, from: 1.0, to: 1.0 }));
        }
    }

    #[test]
    fn every_near_leaf_may_grow_by_the_lost_area_and_the_best_by_parts_of_it() {
        let mut enlarger = enlarger(Compensate::Image, 8.0);
        let Some(Plan::Judge { lost_area, growths }) = enlarger.prune(0, 3) else { panic!("views decide") };
        assert_eq!(lost_area, 1.0);
        assert_eq!(growths.iter().map(|growth| growth.target).collect::<Vec<_>>(), [1, 2, 3]);
        assert_eq!(growths.iter().map(|growth| growth.to).collect::<Vec<_>>()[..2], [2.0_f32.sqrt(); 2]);
        let others = enlarger.other_growths(2, lost_area);
        assert_eq!(others.iter().map(|growth| growth.to).collect::<Vec<_>>(), [1.25, 1.5, 3.0, 5.0].map(f32::sqrt));
    }

    #[test]
    fn growth_stops_at_max_scale_and_a_tenth_of_the_diagonal_out_of_the_box_around_the_leaves() {
        assert_eq!(prune(&mut enlarger(Compensate::Nearest, 1.25), 0, 10).unwrap().to, 1.25);
        let margin = (14.0_f64.powi(2) + 4.0_f64.powi(2)).sqrt() * 0.1;
        let caps = caps(&row(), 8.0);
        let to_the_top = 4.0 + margin;
        let expected = [to_the_top, to_the_top, to_the_top, 1.0 + margin / 4.0];
        assert!(caps.iter().zip(expected).all(|(cap, room)| (cap - room).abs() < 1e-12), "{caps:?}, {expected:?}");
    }

    #[test]
    fn the_last_leaf_has_no_target() {
        for rule in [Compensate::Nearest, Compensate::Image] {
            let mut enlarger = enlarger(rule, 8.0);
            (0..3).for_each(|leaf| assert!(enlarger.prune(leaf, 10).is_some()));
            assert_eq!(enlarger.prune(3, 10), None);
        }
    }
}
