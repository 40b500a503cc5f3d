//! Which remaining leaf is enlarged for a pruned one, and to what scale.
//!
//! `nearest`, after C. Gasch et al., "Multiresolution Foliage Rendering", section 4.1: "the closest leaf is searched for and
//! scaled". The paper prints no law. Here, as its consequences demand: distance is between centroids; the target takes the
//! pruned leaf's *current* (already enlarged) surface area; a leaf that no view saw adds nothing; scale is a linear factor
//! about the target's pivot.
//!
//! Limits: growth adds up along chains of targets, up to `max_scale`; what lies beyond the cap is lost.

use super::{neighbours::Neighbours, options::Compensate};
use crate::plant::Plant;
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
    max_scale: f64,
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
            max_scale: f64::from(max_scale),
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
        let grown = ((area(target) + area(leaf)) / rest).sqrt().min(self.max_scale);
        (grown as f32).max(current)
    }
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
