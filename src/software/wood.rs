//! Wood of a model at the errors that a picture needs.

use super::{
    list::Part,
    riders::{Rider, Riders},
};
use crate::{
    draw::{
        eye::Eye,
        facts::reach,
        instance::Instance,
        wood::{order_of, stepped},
    },
    leaf::Vertex,
    model::FoliageModel,
    wood::{WoodLevel, WoodLevels},
};
use glam::{DVec3, Vec3};

/// Wood of a model whose vertices slide.
pub(super) struct SlidingWood {
    levels: WoodLevels,
    center: DVec3,
    reach: f32,
}

/// Wood at one error.
pub(super) struct WoodAt {
    vertices: Vec<Vertex>,
    widened: Vec<Vec3>,
    across: Vec<Vec3>,
    /// Materials, each with the indices of its triangles.
    parts: Vec<(u32, Vec<u32>)>,
    /// What the vertices ride on; empty unless asked for.
    pub(super) riders: Riders,
}

impl SlidingWood {
    /// The wood of a valid model; `None` if it has no order to draw it by.
    pub(super) fn new(model: &FoliageModel) -> Option<Self> {
        let order = order_of(model)?;
        let (center, reach) = reach(model);
        Some(Self { levels: WoodLevels::with_ribbons(&model.wood, order), center, reach })
    }

    /// Number of the step of the error that a plant is drawn at, and that error.
    pub(super) fn step(&self, eye: &Eye, plant: &Instance, error_px: f32) -> (u32, f32) {
        stepped((f64::from(error_px) / self.pixels_per_unit(eye, plant)) as f32)
    }

    /// Number of triangles that are drawn at an error.
    pub(super) fn triangles(&self, error: f32) -> u64 {
        self.levels.drawn.at(error).len() as u64
    }

    /// The wood at an error, with what its vertices ride on if limbs move. O(wood).
    pub(super) fn at(&self, error: f32, has_limbs: bool) -> WoodAt {
        let WoodLevel { vertices, numbers, widened, across, triangles } = self.levels.at(error);
        let mut parts: Vec<(u32, Vec<u32>)> = Vec::new();
        for (corners, material) in triangles {
            let part = parts.iter().position(|part| part.0 == material).unwrap_or_else(|| {
                parts.push((material, Vec::new()));
                parts.len() - 1
            });
            parts[part].1.extend(corners);
        }
        let riders = if has_limbs { self.riders(&numbers, error) } else { Riders::default() };
        WoodAt { vertices, widened, across, parts, riders }
    }

    fn riders(&self, numbers: &[u32], error: f32) -> Riders {
        let slides = self.levels.slides();
        let mut riders = Riders::default();
        for &number in numbers {
            riders.all.extend(slides.way(number, error).map(|(vertex, weight)| {
                let Vertex { position, normal, .. } = self.levels.vertices[vertex as usize];
                let (widened, across, normal) = match slides.half(vertex, error) {
                    Some(half) => (Vec3::ZERO, half * Vec3::from(normal), Vec3::ZERO),
                    None => (slides.widened(vertex, error), Vec3::ZERO, normal.into()),
                };
                Rider {
                    weight,
                    stem: self.levels.vertex_stems[vertex as usize],
                    position: position.into(),
                    widened,
                    across,
                    normal,
                }
            }));
            riders.ends.push(riders.all.len() as u32);
        }
        riders
    }

    /// Number of pixels that a length of 1 covers where a plant is nearest to the camera.
    pub(super) fn pixels_per_unit(&self, eye: &Eye, plant: &Instance) -> f64 {
        eye.pixels_per_unit(self.center, self.reach, &plant.world_from_plant)
    }
}

impl WoodAt {
    /// Parts to draw, with materials from `first_material` on.
    pub(super) fn parts(&self, first_material: u32) -> Vec<Part<'_>> {
        let parts = self.parts.iter().map(|(material, indices)| (first_material + material, indices));
        let part = |material, indices| Part::of_wood(&self.vertices, indices, material);
        let Self { widened, across, .. } = self;
        parts.map(|(material, indices)| Part { widened, across, ..part(material, indices) }).collect()
    }
}
