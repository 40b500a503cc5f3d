//! The crown of a model as an ellipsoid that takes a share of the light.

use super::parts::{Part, parts};
use crate::{
    bounds::{Aabb, Sphere},
    material::AlphaMode,
    model::FoliageModel,
};
use glam::{DVec3, Vec3};

/// Cells across the crown that leaves are counted in.
const CELLS: usize = 24;
/// Share of a masked card that its leaf covers.
const FILLED: f32 = 0.6;

/// The crown of a model: an ellipsoid with an upright axis through the middle of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct CrownShape {
    /// Height of its centre above that of the model's bounding sphere, in radii of that sphere.
    pub height: f32,
    /// Half of its width and of its height, in the same unit.
    pub half: [f32; 2],
    /// Share of light from behind that it takes, from 0 to 1, on average over its outline seen from
    /// beside.
    pub opacity: f32,
    /// Small ellipsoids of leaves and of wood where these are.
    pub parts: Vec<Part>,
}

impl CrownShape {
    /// Measures a valid model. Leaves in one place are taken to hide each other by chance (the law
    /// of Beer and Lambert: what passes is the exponential of minus their area), counted in cells,
    /// so that gaps between branches let light through. O(vertices).
    pub fn new(model: &FoliageModel) -> Self {
        let Sphere { radius, .. } = model.sphere();
        let crown = Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position));
        if model.vertices.is_empty() || radius <= 0.0 {
            return Self { height: 0.0, half: [0.0; 2], opacity: 0.0, parts: Vec::new() };
        }
        let size = crown.size();
        let half = [0.25 * (size.x + size.z), 0.5 * size.y].map(|half| f64::from(half).max(1e-6 * radius));
        let views = [0, 2].map(|along| opacity(model, crown.center(), half, along));
        Self {
            height: ((crown.center().y - model.sphere().center().y) / radius) as f32,
            half: half.map(|half| (half / radius) as f32),
            opacity: 0.5 * (views[0] + views[1]),
            parts: parts(model),
        }
    }
}

/// Share of light along an axis that the crown takes.
fn opacity(model: &FoliageModel, center: DVec3, [wide, high]: [f64; 2], along: usize) -> f32 {
    let across = 2 - along;
    let mut areas = vec![0.0_f32; CELLS * CELLS];
    let cell =
        |place: f64, half: f64| ((0.5 + 0.5 * place / half) * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0) as usize;
    for leaf in &model.leaves {
        let is_masked =
            model.materials.get(leaf.material as usize).is_some_and(|of| of.alpha_mode != AlphaMode::Opaque);
        let filled = if is_masked { FILLED } else { 1.0 };
        for of in model.indices[leaf.indices[0] as usize..leaf.indices[1] as usize].chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(model.vertices[of[i] as usize].position));
            let area = 0.5 * (b - a).cross(c - a)[along].abs();
            let middle = ((a + b + c) / 3.0).as_dvec3() - center;
            areas[cell(middle.y, high) * CELLS + cell(middle[across], wide)] += filled * area;
        }
    }
    let cell_area = (4.0 * wide * high) as f32 / (CELLS * CELLS) as f32;
    let place = |at: usize| (at as f32 + 0.5) / CELLS as f32 * 2.0 - 1.0;
    let is_inside = |at: usize| place(at / CELLS).powi(2) + place(at % CELLS).powi(2) <= 1.0;
    let inside: Vec<f32> = (0..areas.len()).filter(|&at| is_inside(at)).map(|at| areas[at]).collect();
    inside.iter().map(|area| 1.0 - libm::expf(-area / cell_area)).sum::<f32>() / inside.len() as f32
}
