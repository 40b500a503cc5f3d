//! Parts of a plant: small ellipsoids of leaves and of wood where these are.

use crate::{
    bounds::{Aabb, Sphere},
    material::AlphaMode,
    model::FoliageModel,
};
use glam::{DVec3, Vec3};

/// Cells along each side of the box around the plant. What is in one is one part of leaves and one
/// of wood.
const CELLS: usize = 8;
/// Share of a masked card that its leaf covers.
const FILLED: f32 = 0.6;
/// Share of a leaf's area, and of the surface of wood, that is seen from a direction on average.
const SEEN: [f32; 2] = [0.5, 0.25];
/// Half axis of an even ellipsoid over the standard deviation along it.
const HALF: f32 = 2.236;
/// Least half axis, in radii of the plant's bounding sphere.
const LEAST_HALF: f32 = 1e-3;
/// Least share of the plant's area that counts as a part.
const LEAST_AREA: f32 = 1e-4;
/// Share of light that wood takes, which is gathered where it is.
const WOOD: f32 = 0.98;
/// Most pieces along a side of a triangle.
const MOST_PIECES: f32 = 16.0;

/// An ellipsoid with an upright axis, in radii of the plant's bounding sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Its centre, from that of the sphere.
    pub center: [f32; 3],
    /// Half of its width and of its height.
    pub half: [f32; 2],
    /// Share of light from behind that it takes, from 0 to 1.
    pub opacity: f32,
}

/// What is in a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    area: f32,
    sum: Vec3,
    squares: Vec3,
}

impl Cell {
    fn add(&mut self, at: Vec3, area: f32) {
        self.area += area;
        self.sum += at * area;
        self.squares += at * at * area;
    }

    fn part(&self, is_wood: bool) -> Part {
        let center = self.sum / self.area;
        let spread = (self.squares / self.area - center * center).max(Vec3::ZERO);
        let [wide, high] = [0.5 * (spread.x + spread.z), spread.y].map(|of| (HALF * of.sqrt()).max(LEAST_HALF));
        let outline = std::f32::consts::PI * wide * high;
        let (half, opacity) = if is_wood {
            // As wide as it covers.
            ([(wide * self.area / outline).max(LEAST_HALF), high], WOOD)
        } else {
            ([wide, high], 1.0 - libm::expf(-self.area / outline))
        };
        Part { center: center.to_array(), half, opacity }
    }
}

/// Parts of a valid model. O(triangles).
pub(super) fn parts(model: &FoliageModel) -> Vec<Part> {
    let Sphere { radius, .. } = model.sphere();
    if radius.is_nan() || radius <= 0.0 {
        return Vec::new();
    }
    let center = model.sphere().center();
    let placed = |at: [f32; 3]| ((Vec3::from(at).as_dvec3() - center) / radius).as_vec3();
    let mut grids = [Grid::new(model, &center, radius), Grid::new(model, &center, radius)];
    for leaf in &model.leaves {
        let is_masked =
            model.materials.get(leaf.material as usize).is_some_and(|of| of.alpha_mode != AlphaMode::Opaque);
        let seen = SEEN[0] * if is_masked { FILLED } else { 1.0 };
        for of in model.indices[leaf.indices[0] as usize..leaf.indices[1] as usize].chunks_exact(3) {
            grids[0].add([0, 1, 2].map(|i| placed(model.vertices[of[i] as usize].position)), seen);
        }
    }
    for of in model.wood.indices.chunks_exact(3) {
        grids[1].add([0, 1, 2].map(|i| placed(model.wood.vertices[of[i] as usize].position)), SEEN[1]);
    }
    let all: f32 = grids.iter().flat_map(|grid| &grid.cells).map(|cell| cell.area).sum();
    let is_part = |cell: &&Cell| cell.area > LEAST_AREA * all && cell.area.is_finite();
    let of = |grid: &Grid, is_wood: bool| -> Vec<Part> {
        grid.cells.iter().filter(is_part).map(|cell| cell.part(is_wood)).collect()
    };
    [of(&grids[0], false), of(&grids[1], true)].concat()
}

struct Grid {
    low: Vec3,
    cell: Vec3,
    cells: Vec<Cell>,
}

impl Grid {
    fn new(model: &FoliageModel, center: &DVec3, radius: f64) -> Self {
        let all = model.vertices.iter().chain(&model.wood.vertices).map(|vertex| vertex.position);
        let around = Aabb::of_points(all);
        let size = around.size() / radius as f32;
        let low = ((around.center() - *center) / radius).as_vec3() - 0.5 * size;
        let cell = size / CELLS as f32;
        Self { low, cell: cell.max(Vec3::splat(LEAST_HALF)), cells: vec![Cell::default(); CELLS.pow(3)] }
    }

    /// Adds a triangle, in pieces of up to half a cell.
    fn add(&mut self, [a, b, c]: [Vec3; 3], seen: f32) {
        let [right, up] = [b - a, c - a];
        let longest = (right / self.cell).abs().max((up / self.cell).abs()).max(((c - b) / self.cell).abs());
        let pieces = (2.0 * longest.max_element()).ceil().clamp(1.0, MOST_PIECES) as u32;
        let area = 0.5 * right.cross(up).length() * seen / (pieces * pieces) as f32;
        if !area.is_finite() {
            return;
        }
        let mut add = |x: u32, y: u32, middle: f32| {
            let [x, y] = [x, y].map(|at| (at as f32 + middle) / pieces as f32);
            let at = a + right * x + up * y;
            let [i, j, k] = ((at - self.low) / self.cell).to_array().map(|at| (at.max(0.0) as usize).min(CELLS - 1));
            self.cells[(i * CELLS + j) * CELLS + k].add(at, area);
        };
        for y in 0..pieces {
            for x in 0..pieces - y {
                add(x, y, 1.0 / 3.0);
                if x + y + 1 < pieces {
                    add(x, y, 2.0 / 3.0);
                }
            }
        }
    }
}
