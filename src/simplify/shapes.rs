//! Triangles of the plant as the views see them: scaled about a leaf's pivot and projected, with
//! planes that give depth and texture coordinates at any pixel.
//!
//! The depth of a fragment is where the ray through the pixel's centre meets the plane of its
//! triangle; 1/w is then affine in screen space. A plane through the leaf's pivot does not move
//! when the leaf is scaled. For flat leaves, and for cards crossed on an axis through the pivot,
//! growth therefore changes no depth and touches only new pixels.

use super::{
    depth::DepthPlane,
    fragments::{AlphaTest, NO_MASK},
    masks::Masks,
    raster::Bounds,
    views::{CAMERA_DISTANCE, NEAR, ScreenPoint, View, ViewSet},
};
use crate::{
    edge::SUBPIXEL,
    plant::{Plant, Tiles, Tiling},
};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// Distance, as a fraction of a leaf's reach, below which its planes are merged with each other and
/// moved to the pivot: well above the rounding of `f32` positions, well below the bend of a leaf.
const PLANE_TOLERANCE: f64 = 1e-4;

/// A plane `normal . p = normal . pivot + scale * offset` in unit space.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: DVec3,
    offset: f64,
}

/// A triangle of a leaf or of the wood.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Indices into the vertices of [`Shapes`].
    corners: [u32; 3],
    /// Its plane; triangles in the same plane follow each other.
    plane: u32,
}

/// One leaf, or the wood as a whole, in unit space.
#[derive(Debug, Clone)]
pub struct Shape {
    /// First and one-past-last vertex in [`Shapes`].
    vertices: [u32; 2],
    /// First and one-past-last triangle.
    pub triangles: [u32; 2],
    pivot: DVec3,
    /// Largest distance of a vertex from the pivot.
    reach: f64,
    /// Sphere around the vertices: its centre, from the pivot, and its radius.
    sphere: (DVec3, f64),
    mask: u32,
    /// What an enlarged leaf repeats, if it grows by tiling.
    tiles: Option<Tiles>,
}

impl Shape {
    /// Tiling at a scale, if the leaf can grow by it and is enlarged.
    pub fn tiling(&self, scale: f32) -> Option<Tiling> {
        self.tiles.and_then(|tiles| tiles.at(scale))
    }
}

/// All leaves and the wood, prepared once.
#[derive(Debug)]
pub struct Shapes {
    /// One per leaf, then the wood.
    pub shapes: Vec<Shape>,
    /// All triangles, leaf by leaf, then the wood's.
    pub triangles: Vec<Triangle>,
    offsets: Vec<DVec3>,
    uv: Vec<Vec2>,
    planes: Vec<Plane>,
    max_scale: f64,
}

impl Shapes {
    /// Prepares `plant` for `views`. Leaves may grow up to `max_scale`.
    pub fn new(plant: &Plant, views: &ViewSet, masks: &Masks, max_scale: f32) -> Self {
        let mut shapes = Self {
            shapes: Vec::with_capacity(plant.leaves.len() + 1),
            triangles: Vec::with_capacity(plant.leaf_triangles() + plant.wood.triangles()),
            offsets: Vec::with_capacity(plant.vertices.len() + plant.wood.vertices.len()),
            uv: Vec::with_capacity(plant.vertices.len() + plant.wood.vertices.len()),
            planes: Vec::with_capacity(plant.leaf_triangles() + plant.wood.triangles()),
            max_scale: f64::from(max_scale),
        };
        let place = |position: [f32; 3]| views.unit_from_plant(Vec3::from(position).as_dvec3());
        for leaf in &plant.leaves {
            let first = leaf.vertices[0];
            let vertices = &plant.vertices[leaf.vertex_range()];
            let indices = plant.indices[leaf.index_range()].iter().map(|index| index - first);
            let vertices = vertices.iter().map(|v| (place(v.position), v.uv));
            shapes.push(place(leaf.pivot), vertices, indices, masks.of_material(leaf.material));
            let material = &plant.materials[leaf.material as usize];
            let tiles = Tiles::of_leaf(leaf, material, &plant.vertices, &plant.indices);
            shapes.shapes.last_mut().expect("pushed just now").tiles = tiles;
        }
        let wood = plant.wood.vertices.iter().map(|v| (place(v.position), v.uv));
        shapes.push(DVec3::ZERO, wood, masks.wood_indices(&plant.wood), NO_MASK);
        shapes
    }

    fn push(
        &mut self,
        pivot: DVec3,
        vertices: impl Iterator<Item = (DVec3, [f32; 2])>,
        indices: impl Iterator<Item = u32>,
        mask: u32,
    ) {
        let first_vertex = self.offsets.len() as u32;
        let first_triangle = self.triangles.len() as u32;
        let first_plane = self.planes.len();
        for (position, uv) in vertices {
            self.offsets.push(position - pivot);
            self.uv.push(Vec2::from(uv));
        }
        let offsets = &self.offsets[first_vertex as usize..];
        let radius = |center: DVec3| offsets.iter().map(|o| (*o - center).length_squared()).fold(0.0, f64::max).sqrt();
        let reach = radius(DVec3::ZERO);
        let center = offsets.iter().sum::<DVec3>() / offsets.len().max(1) as f64;
        let sphere = (center, radius(center));
        let mut corner = [0; 3];
        for (i, index) in indices.enumerate() {
            corner[i % 3] = index + first_vertex;
            if i % 3 == 2 {
                let plane = self.plane_of(corner, first_plane, reach);
                self.triangles.push(Triangle { corners: corner, plane });
            }
        }
        self.shapes.push(Shape {
            vertices: [first_vertex, self.offsets.len() as u32],
            triangles: [first_triangle, self.triangles.len() as u32],
            pivot,
            reach,
            sphere,
            mask,
            tiles: None,
        });
    }

    /// Returns the plane of a triangle: the last plane of the same shape if the triangle lies in
    /// it, else a new one.
    fn plane_of(&mut self, corners: [u32; 3], first_plane: usize, reach: f64) -> u32 {
        let [a, b, c] = corners.map(|corner| self.offsets[corner as usize]);
        let tolerance = reach * PLANE_TOLERANCE;
        if let Some(last) = self.planes[first_plane..].last()
            && [a, b, c].iter().all(|p| (last.normal.dot(*p) - last.offset).abs() <= tolerance)
        {
            return self.planes.len() as u32 - 1;
        }
        let cross = (b - a).cross(c - a);
        let length = cross.length_squared().sqrt();
        let normal = if length > 0.0 { cross / length } else { DVec3::ZERO };
        let offset = normal.dot(a);
        let offset = if offset.abs() <= tolerance { 0.0 } else { offset };
        self.planes.push(Plane { normal, offset });
        self.planes.len() as u32 - 1
    }

    /// Projects the vertices of `shape` at `scale` into `out`.
    pub fn project(&self, views: &ViewSet, view: &View, shape: &Shape, scale: f32, out: &mut Vec<Option<ScreenPoint>>) {
        let scale = f64::from(scale);
        let offsets = &self.offsets[shape.vertices[0] as usize..shape.vertices[1] as usize];
        out.clear();
        out.extend(offsets.iter().map(|&offset| views.project(view, shape.pivot + offset * scale)));
    }

    /// Rectangle of pixels that holds all those that a shape may cover at `scale`, the last ones
    /// included; `None` if it may come closer than [`NEAR`].
    pub fn around(&self, views: &ViewSet, view: &View, shape: &Shape, scale: f32) -> Option<Bounds> {
        let (center, radius) = shape.sphere;
        let scale = f64::from(scale);
        views.around(view, shape.pivot + center * scale, radius * scale)
    }

    /// Smallest and largest 1/w of a shape at any scale up to the largest scale allowed.
    fn range(&self, view: &View, shape: &Shape) -> [f64; 2] {
        let pivot_w = CAMERA_DISTANCE - shape.pivot.dot(view.toward);
        let reach = shape.reach * self.max_scale;
        [1.0 / (pivot_w + reach), 1.0 / (pivot_w - reach).max(NEAR)]
    }

    /// Returns the projected corners of a triangle, or `None` if one is closer than [`NEAR`].
    /// `projected` holds the projected vertices of its shape.
    pub fn corners(&self, shape: &Shape, triangle: u32, projected: &[Option<ScreenPoint>]) -> Option<[ScreenPoint; 3]> {
        let [a, b, c] = self.triangles[triangle as usize].corners.map(|c| projected[(c - shape.vertices[0]) as usize]);
        Some([a?, b?, c?])
    }

    /// Plane of a triangle. Those of a shape are numbered on from its first triangle's.
    pub fn plane(&self, triangle: u32) -> u32 {
        self.triangles[triangle as usize].plane
    }

    /// Whether scale does not change the depth of a shape: it lies in one plane through its pivot.
    pub fn is_steady(&self, shape: &Shape) -> bool {
        let [first, end] = shape.triangles;
        first < end && self.plane(first) == self.plane(end - 1) && self.planes[self.plane(first) as usize].offset == 0.0
    }

    /// Depth plane of a triangle in a view.
    pub fn depth_plane(&self, views: &ViewSet, view: &View, shape: &Shape, triangle: u32, scale: f32) -> DepthPlane {
        let Plane { normal, offset } = self.planes[self.plane(triangle) as usize];
        let pivot_w = CAMERA_DISTANCE - shape.pivot.dot(view.toward);
        let range = self.range(view, shape);
        let facing = normal.dot(view.toward);
        // normal . (w x right + w y up + (CAMERA_DISTANCE - w) toward) = level, solved for 1/w.
        let level = normal.dot(shape.pivot) + f64::from(scale) * offset;
        let from_camera = level - CAMERA_DISTANCE * facing;
        if from_camera == 0.0 {
            return DepthPlane { per_x: 0.0, per_y: 0.0, at_origin: 1.0 / pivot_w, range };
        }
        let [(origin_x, origin_y), (next_x, next_y)] = views.first_rays();
        let (along, upward) = (normal.dot(view.right), normal.dot(view.up));
        DepthPlane {
            per_x: along * (next_x - origin_x) / from_camera,
            per_y: upward * (next_y - origin_y) / from_camera,
            at_origin: (along * origin_x + upward * origin_y - facing) / from_camera,
            range,
        }
    }

    /// Share of the leaves that can grow by tiling.
    pub fn tileable(&self) -> f64 {
        let leaves = &self.shapes[..self.shapes.len() - 1];
        leaves.iter().filter(|leaf| leaf.tiles.is_some()).count() as f64 / leaves.len().max(1) as f64
    }

    /// Alpha test of a triangle in a view, from its projected corners.
    pub fn alpha_test(&self, shape: &Shape, triangle: u32, corners: &[ScreenPoint; 3]) -> AlphaTest {
        if shape.mask == NO_MASK {
            return AlphaTest::NONE;
        }
        let [a, b, c] = corners.map(|p| DVec2::new(p.x as f64, p.y as f64) / SUBPIXEL as f64);
        let (ab, ac) = (b - a, c - a);
        let doubled_area = ab.perp_dot(ac);
        if doubled_area == 0.0 {
            return AlphaTest::NONE;
        }
        let anchor = a.floor();
        let plane = |[at_a, at_b, at_c]: [f64; 3]| {
            let (to_b, to_c) = (at_b - at_a, at_c - at_a);
            let per_x = (to_b * ac.y - to_c * ab.y) / doubled_area;
            let per_y = (to_c * ab.x - to_b * ac.x) / doubled_area;
            let at_anchor = at_a + per_x * (anchor.x - a.x) + per_y * (anchor.y - a.y);
            [per_x as f32, per_y as f32, at_anchor as f32]
        };
        let uv = self.triangles[triangle as usize].corners.map(|corner| self.uv[corner as usize].as_dvec2());
        let q = corners.map(|corner| corner.inv_w);
        AlphaTest {
            u: plane([0, 1, 2].map(|i| uv[i].x * q[i])),
            v: plane([0, 1, 2].map(|i| uv[i].y * q[i])),
            q: plane(q),
            anchor: anchor.as_vec2().to_array(),
            mask: shape.mask,
        }
    }
}
