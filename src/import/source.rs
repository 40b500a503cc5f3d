//! What a file holds, before anything in it is called leaf or wood.

use crate::{
    bounds::Aabb,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture},
};
use glam::{BVec3, DAffine3, DMat3, DVec3, Vec3};
use std::{path::Path, rc::Rc};

/// The content of a file: meshes, where they stand, materials.
#[derive(Debug, Default)]
pub(super) struct Source {
    /// Name of the plant.
    pub(super) name: String,
    /// Geometry, each in its own space.
    pub(super) meshes: Vec<Mesh>,
    /// The meshes as they stand in the scene, in scene order.
    pub(super) parts: Vec<Part>,
    /// Materials; every mesh's index exists.
    pub(super) materials: Vec<Material>,
    /// The alpha mode that the file gives each material, also where the texture it needs is missing.
    pub(super) stated_alpha: Vec<AlphaMode>,
    /// Textures; every material's index exists.
    pub(super) textures: Vec<Texture>,
    /// What was left out, one line each.
    pub(super) warnings: Vec<String>,
}

impl Source {
    /// Least and greatest corner of a box around everything as it stands; `None` where there is nothing.
    pub(super) fn bounds(&self) -> Option<[DVec3; 2]> {
        let of_part = |part: &Part| {
            let mesh = Aabb::of_points(self.meshes[part.mesh].vertices.iter().map(|vertex| vertex.position));
            let [min, max] = [mesh.min, mesh.max].map(|corner| Vec3::from(corner).as_dvec3());
            let corners = (0..8).map(|i| DVec3::select(BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), min, max));
            let placed = corners.flat_map(|corner| part.places.iter().map(move |place| place.transform_point3(corner)));
            placed.map(|corner| [corner; 2]).reduce(around).filter(|_| !mesh.is_empty())
        };
        self.parts.iter().filter_map(of_part).reduce(around)
    }

    /// What has to be taken off every position so that single precision keeps them to [`PRECISION`] of the plant's size: the
    /// middle of a plant that stands far away, else nothing.
    pub(super) fn origin(&self) -> DVec3 {
        let Some([min, max]) = self.bounds() else { return DVec3::ZERO };
        let middle = min.midpoint(max).as_vec3().as_dvec3();
        let rounding = middle.abs().max_element() * f64::from(f32::EPSILON) * 0.5;
        let is_far = middle.is_finite() && rounding > PRECISION * min.distance(max) * 0.5;
        if is_far { middle } else { DVec3::ZERO }
    }
}

/// The box around two.
fn around([min, max]: [DVec3; 2], [other_min, other_max]: [DVec3; 2]) -> [DVec3; 2] {
    [min.min(other_min), max.max(other_max)]
}

/// To how much of a plant's radius positions should be right. Farther from the origin than about 170 radii they would not be.
const PRECISION: f64 = 1e-5;
/// Longest name in bytes. One name may be told many times over.
const MAX_NAME_BYTES: usize = 256;

/// A name in a file, cut where it is too long.
pub(super) fn name(given: Option<&str>) -> String {
    let fits = |(start, letter): &(usize, char)| start + letter.len_utf8() <= MAX_NAME_BYTES;
    given.unwrap_or_default().char_indices().take_while(fits).map(|(_, letter)| letter).collect()
}

/// The name of the plant in the file at `path`.
pub(super) fn name_of(path: &Path) -> String {
    name(path.file_stem().map(|stem| stem.to_string_lossy()).as_deref())
}

/// Triangles with one material, in the mesh's own space.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    /// Name in the file; may be empty.
    pub(super) name: String,
    /// Index into [`Source::materials`].
    pub(super) material: usize,
    /// Vertices; positions, uvs and colours are finite, normals are of any length, zero where the file gave none.
    pub(super) vertices: Vec<Vertex>,
    /// Three per triangle, each below the number of vertices.
    pub(super) indices: Vec<u32>,
}

/// One mesh at one or many places.
#[derive(Debug)]
pub(super) struct Part {
    /// Name of the node; may be empty.
    pub(super) name: String,
    /// Index into [`Source::meshes`].
    pub(super) mesh: usize,
    /// Plant from mesh, at least one; all meshes of a node share them.
    pub(super) places: Rc<[DAffine3]>,
}

impl Mesh {
    /// The corners of triangle `triangle`.
    pub(super) fn corners(&self, triangle: u32) -> [u32; 3] {
        let first = triangle as usize * 3;
        [self.indices[first], self.indices[first + 1], self.indices[first + 2]]
    }

    /// The triangles `triangles` in the plant's space: one vertex per corner, the face's normal where there is none, and
    /// the winding turned where the place mirrors.
    pub(super) fn triangles_at(&self, triangles: &[u32], place: &Place) -> Vec<[Vertex; 3]> {
        triangles.iter().map(|&triangle| self.triangle_at(triangle, place)).collect()
    }

    fn triangle_at(&self, triangle: u32, place: &Place) -> [Vertex; 3] {
        let mut corners = self.corners(triangle).map(|corner| place.vertex(&self.vertices[corner as usize]));
        if place.mirrors {
            corners.swap(1, 2);
        }
        if corners.iter().any(|corner| corner.normal == [0.0; 3]) {
            let normal = face_normal(corners.map(|corner| Vec3::from(corner.position)));
            for corner in corners.iter_mut().filter(|corner| corner.normal == [0.0; 3]) {
                corner.normal = normal.to_array();
            }
        }
        corners
    }
}

/// A place of a mesh, ready to carry vertices into the plant's space.
pub(super) struct Place {
    plant_from_mesh: DAffine3,
    normals_from_mesh: DMat3,
    mirrors: bool,
    is_identity: bool,
}

impl Place {
    /// The place `source_from_mesh` of a plant whose origin is at `origin` of the source.
    pub(super) fn new(source_from_mesh: &DAffine3, origin: DVec3) -> Self {
        let plant_from_mesh = DAffine3 { translation: source_from_mesh.translation - origin, ..*source_from_mesh };
        let linear = plant_from_mesh.matrix3;
        // The cofactors turn normals as the inverse transpose does and exist for flat scales too.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        let mirrors = linear.determinant() < 0.0;
        Self {
            plant_from_mesh,
            normals_from_mesh: if mirrors { cofactors * -1.0 } else { cofactors },
            mirrors,
            is_identity: plant_from_mesh == DAffine3::IDENTITY,
        }
    }

    fn vertex(&self, vertex: &Vertex) -> Vertex {
        let mut placed = *vertex;
        let mut normal = Vec3::from(vertex.normal).as_dvec3();
        if !self.is_identity {
            let position = Vec3::from(vertex.position).as_dvec3();
            placed.position = self.plant_from_mesh.transform_point3(position).as_vec3().to_array();
            normal = self.normals_from_mesh * normal;
        }
        placed.normal = normal.normalize_or_zero().as_vec3().to_array();
        placed
    }
}

/// Unit normal of a counter-clockwise triangle; up for one without area.
fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3()
}
