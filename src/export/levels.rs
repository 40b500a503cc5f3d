//! Discrete levels of a model as plants of their own, for engines that know nothing else.

use super::{
    clusters::{push_cards, scales},
    tiled::tiled,
};
use crate::{
    FoliageModel, Plant, Result,
    bounds::Aabb,
    extract::{CookLambda, LodPolicy, Sight, sight::REFERENCE_FOV_Y},
    leaf::Vertex,
    plant::{Wood, WoodPart},
    wood::WoodLevels,
};
use glam::Vec3;

/// Rows of the screen that sizes refer to.
const ROWS: f32 = 1080.0;
/// Error of the wood in pixels, at the largest size that a level is shown at.
const WOOD_ERROR_PX: f32 = 0.5;
/// Least size of a leaf's picture in pixels, at that size, where enlarged leaves repeat it, and the
/// least scale at which they do.
const PICTURE_PX: f32 = 6.0;
const LEAST_REPEATED: f32 = 1.25;
/// Steps of the search for that size.
const STEPS: u32 = 40;
/// Least and most distances that it is looked for at, in radii.
const DISTANCES: [f32; 2] = [1.0, 4096.0];

/// One level of detail.
#[derive(Debug, Clone)]
pub struct Level {
    /// The plant with these leaves, enlarged as they are drawn, and with its wood.
    pub plant: Plant,
    /// Number of leaves.
    pub leaves: u32,
    /// Diameter in pixels on a screen of 1080 rows from which on down it is shown; infinite with
    /// all leaves.
    pub size_px: f32,
    /// Number of enlarged leaves that are cut into triangles since they show several pictures.
    pub tiled: u32,
    /// Number of leaves whose place a card with a picture of those that they stand for takes.
    pub cards: u32,
}

impl Level {
    /// The level of a valid model that has the share `lod` of its leaves, and at least one, shown
    /// from where Cook's policy asks for as many leaves.
    ///
    /// # Errors
    /// As [`of_leaves`](Self::of_leaves).
    pub fn new(model: &FoliageModel, lod: f64) -> Result<Self> {
        let all = model.leaves.len() as u32;
        let leaves = ((lod * f64::from(all)).ceil() as u32).clamp(1.min(all), all);
        Self::of_leaves(model, leaves, size_px(leaves as f32 / all.max(1) as f32))
    }

    /// The level of a valid model that has its first `leaves`, or all if it has fewer, and that is
    /// shown from a diameter on.
    ///
    /// # Errors
    /// [`TooLarge`](crate::Error::TooLarge) for more pictures of clusters than a texture holds.
    pub fn of_leaves(model: &FoliageModel, leaves: u32, size_px: f32) -> Result<Self> {
        let all = model.leaves.len() as u32;
        let leaves = leaves.min(all);
        let size_px = if leaves < all { size_px } else { f32::INFINITY };
        let (scales, cards) = scales(model, leaves);
        let wood = wood(model, 2.0 * model.sphere().radius as f32 * WOOD_ERROR_PX / size_px);
        let mut materials = model.materials.clone();
        if leaves < all {
            // Thin stems are flat triangles, which have a back.
            wood.parts.iter().for_each(|part| materials[part.material as usize].double_sided = true);
        }
        let mut plant =
            Plant { name: model.name.clone(), wood, materials, textures: model.textures.clone(), ..Plant::default() };
        let mut cut = 0;
        let px = size_px / (2.0 * model.sphere().radius as f32);
        for (leaf, scale) in model.leaves.iter().zip(scales).filter(|(_, scale)| *scale > 0.0) {
            let pivot = Vec3::from(leaf.pivot);
            let scaled = |vertex: &Vertex| {
                let position = pivot + scale * (Vec3::from(vertex.position) - pivot);
                Vertex { position: position.to_array(), ..*vertex }
            };
            let mut vertices: Vec<Vertex> = model.vertices[leaf.geometry().vertex_range()].iter().map(scaled).collect();
            let own = &model.indices[leaf.geometry().index_range()];
            let mut indices: Vec<u32> = own.iter().map(|index| index - leaf.vertices[0]).collect();
            // Of pictures that are too small to be seen as such, fewer and larger ones do.
            let repeated = scale * (size(&vertices) / scale * px / PICTURE_PX).min(1.0);
            let tiles = model.tiles(leaf).filter(|_| repeated >= LEAST_REPEATED);
            if let Some(tiling) = tiles.and_then(|tiles| tiles.at(repeated)) {
                (vertices, indices) = tiled(&vertices, &indices, &tiling);
                cut += 1;
            }
            plant.push_leaf(&vertices, &indices, leaf.pivot, leaf.material);
        }
        if !cards.is_empty() {
            push_cards(&mut plant, model, &cards)?;
        }
        Ok(Self { plant, leaves, size_px, tiled: cut, cards: cards.len() as u32 })
    }
}

/// Size of a card: what its corners span, over the diagonal of a square.
fn size(vertices: &[Vertex]) -> f32 {
    let all = Aabb::of_points(vertices.iter().map(|vertex| vertex.position));
    Vec3::from(all.max).distance(all.min.into()) * std::f32::consts::FRAC_1_SQRT_2
}

/// Diameter in pixels at which Cook's policy asks for a share of the leaves.
fn size_px(lod: f32) -> f32 {
    let sight = |distance: f32| Sight { distance, radius: 1.0, fov_y: REFERENCE_FOV_Y, height_px: ROWS };
    let [mut near, mut far] = DISTANCES;
    for _ in 0..STEPS {
        let middle = (near * far).sqrt();
        if CookLambda::default().lod(&sight(middle)) > lod { near = middle } else { far = middle }
    }
    2.0 * sight(far).radius_px().min(ROWS)
}

/// The wood within an error; in full at 0, and without an order.
fn wood(model: &FoliageModel, error: f32) -> Wood {
    let Some(order) = model.wood_order.as_ref().filter(|_| error > 0.0) else { return model.wood.clone() };
    let level = WoodLevels::new(&model.wood, order).at(error);
    let mut wood = Wood { vertices: level.vertices, ..Wood::default() };
    let mut triangles = level.triangles;
    triangles.sort_by_key(|triangle| triangle.1);
    for part in triangles.chunk_by(|a, b| a.1 == b.1) {
        let first = wood.indices.len() as u32;
        wood.indices.extend(part.iter().flat_map(|(corners, _)| *corners));
        wood.parts.push(WoodPart { indices: [first, wood.indices.len() as u32], material: part[0].1 });
    }
    for vertex in &mut wood.vertices {
        vertex.normal = Vec3::from(vertex.normal).normalize_or(Vec3::Y).to_array();
    }
    wood
}
