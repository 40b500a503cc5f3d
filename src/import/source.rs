//! The content of a file before it is classified as leaves and wood.

use super::{Warning, alpha_range::AlphaRange, transform::normal_matrix};
use crate::{
    bounds::Aabb,
    leaf::Vertex,
    material::{AlphaMode, Material, Texture},
};
use glam::{BVec3, DAffine3, DMat3, DVec3, Vec3};
use std::{ops::Range, path::Path, rc::Rc};

/// The content of a file: meshes, their places, materials.
#[derive(Debug, Default)]
pub(super) struct Source {
    /// Name of the plant.
    pub(super) name: String,
    /// Meshes, each in its own space.
    pub(super) meshes: Vec<Mesh>,
    /// All nodes, which form trees.
    pub(super) nodes: Vec<Node>,
    /// The meshes as placed in the scene, in scene order.
    pub(super) parts: Vec<Part>,
    /// Subtrees that may be whole plants, with their parts; empty if one was chosen.
    pub(super) plants: Vec<(String, Range<usize>)>,
    /// Materials; the material index of every mesh is valid.
    pub(super) materials: Vec<Material>,
    /// The alpha mode that the file specifies for each material, even if the texture it needs is
    /// missing.
    pub(super) stated_alpha: Vec<AlphaMode>,
    /// Textures; the texture index of every material is valid.
    pub(super) textures: Vec<Texture>,
    /// The range of each texture's alpha.
    pub(super) alpha_ranges: Vec<AlphaRange>,
    /// Anything that was ignored or changed.
    pub(super) warnings: Vec<Warning>,
}

impl Source {
    /// Corners of a bounding box around all placed meshes; `None` if there is nothing.
    pub(super) fn bounds(&self) -> Option<[DVec3; 2]> {
        self.boxes().into_iter().flatten().reduce(around)
    }

    /// Corners of a bounding box around each part at all its places; `None` for an empty part.
    pub(super) fn boxes(&self) -> Vec<Option<[DVec3; 2]>> {
        let of_mesh = |mesh: &Mesh| Aabb::of_points(mesh.vertices.iter().map(|vertex| vertex.position));
        let of_meshes: Vec<Aabb> = self.meshes.iter().map(of_mesh).collect();
        self.parts.iter().map(|part| part.bounds(&of_meshes[part.mesh])).collect()
    }

    /// Name of a part, else of its mesh.
    pub(super) fn part_name<'a>(&'a self, part: &'a Part) -> &'a str {
        if part.name.is_empty() { &self.meshes[part.mesh].name } else { &part.name }
    }

    /// Names of the node, mesh and material of a part.
    pub(super) fn names<'a>(&'a self, part: &'a Part) -> [&'a str; 3] {
        let mesh = &self.meshes[part.mesh];
        [&part.name, &mesh.name, &self.materials[mesh.material].name]
    }

    /// Drops every part whose number `keep` refuses.
    pub(super) fn keep_parts(&mut self, keep: impl Fn(usize) -> bool) {
        let mut kept = vec![0];
        kept.extend((0..self.parts.len()).scan(0, |kept, part| {
            *kept += usize::from(keep(part));
            Some(*kept)
        }));
        let mut number = 0..;
        self.parts.retain(|_| number.next().is_some_and(&keep));
        self.plants.iter_mut().for_each(|(_, parts)| *parts = kept[parts.start]..kept[parts.end]);
    }

    /// Offset to subtract from every position so that single precision keeps them to [`PRECISION`]
    /// of the radius of the plant: the middle of a plant that is far away, otherwise zero.
    pub(super) fn origin(&self) -> DVec3 {
        let Some([min, max]) = self.bounds() else { return DVec3::ZERO };
        let middle = min.midpoint(max).as_vec3().as_dvec3();
        let rounding = middle.abs().max_element() * f64::from(f32::EPSILON) * 0.5;
        let is_far = middle.is_finite() && rounding > PRECISION * min.distance(max) * 0.5;
        if is_far { middle } else { DVec3::ZERO }
    }
}

/// The union of two boxes.
pub(super) fn around([min, max]: [DVec3; 2], [other_min, other_max]: [DVec3; 2]) -> [DVec3; 2] {
    [min.min(other_min), max.max(other_max)]
}

/// Required precision of positions, as a fraction of the radius of the plant. Beyond about 170
/// radii from the origin, single precision does not reach it.
const PRECISION: f64 = 1e-5;
/// Maximum length of a name in bytes. A name may be repeated many times.
const MAX_NAME_BYTES: usize = 256;
/// Maximum number of names in a list.
const MAX_LISTED: usize = 8;

/// A name from a file, truncated if it is too long.
pub(super) fn name(given: Option<&str>) -> String {
    truncated(given.unwrap_or_default()).to_owned()
}

/// The start of a text, short enough for a name.
pub(super) fn truncated(text: &str) -> &str {
    let is_end = |end: &usize| text.is_char_boundary(*end);
    let end = (0..=MAX_NAME_BYTES.min(text.len())).rev().find(is_end);
    &text[..end.unwrap_or_default()]
}

/// Names in a list of a message: quoted, and cut short.
pub(super) fn listed(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(MAX_LISTED).map(|name| format!("{name:?}")).collect();
    let rest = names.len().saturating_sub(MAX_LISTED);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    shown.join(", ") + &more
}

/// Name of the plant in the file at `path`.
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
    /// Vertices. Positions, uvs and colours are finite; normals are of any length, zero if the file
    /// has none.
    pub(super) vertices: Vec<Vertex>,
    /// Three per triangle, each below the number of vertices.
    pub(super) indices: Vec<u32>,
}

/// A node, which stands for everything below it.
#[derive(Debug)]
pub(super) struct Node {
    /// Name in the file; may be empty.
    pub(super) name: String,
    /// Index of the node above, if any.
    pub(super) parent: Option<usize>,
}

/// One mesh at one or more places.
#[derive(Debug)]
pub(super) struct Part {
    /// Name of the node; may be empty.
    pub(super) name: String,
    /// Index into [`Source::nodes`], if the file has any.
    pub(super) node: Option<usize>,
    /// Index into [`Source::meshes`].
    pub(super) mesh: usize,
    /// Transforms from the mesh to the scene, at least one; all meshes of a node share them.
    pub(super) places: Rc<[DAffine3]>,
}

impl Part {
    /// Corners of a bounding box around what is in `aabb`, at all places; `None` if that is empty.
    pub(super) fn bounds(&self, aabb: &Aabb) -> Option<[DVec3; 2]> {
        let [min, max] = [aabb.min, aabb.max].map(|corner| Vec3::from(corner).as_dvec3());
        let corners = (0..8).map(|i| DVec3::select(BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), min, max));
        let placed = corners.flat_map(|corner| self.places.iter().map(move |place| place.transform_point3(corner)));
        placed.map(|corner| [corner; 2]).reduce(around).filter(|_| !aabb.is_empty())
    }
}

impl Mesh {
    /// The vertex indices of triangle `triangle`.
    pub(super) fn corners(&self, triangle: u32) -> [u32; 3] {
        let first = triangle as usize * 3;
        [self.indices[first], self.indices[first + 1], self.indices[first + 2]]
    }

    /// The triangles with the indices `triangles` in the space of the plant. Each corner has a
    /// vertex of its own; missing normals are replaced by the face normal, and the winding is
    /// reversed where the place mirrors.
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

/// A place of a mesh, prepared to transform vertices into the space of the plant.
pub(super) struct Place {
    plant_from_mesh: DAffine3,
    normals_from_mesh: DMat3,
    mirrors: bool,
    is_identity: bool,
}

impl Place {
    /// The place `source_from_mesh`, for a plant whose origin is at `origin` in the source.
    pub(super) fn new(source_from_mesh: &DAffine3, origin: DVec3) -> Self {
        let plant_from_mesh = DAffine3 { translation: source_from_mesh.translation - origin, ..*source_from_mesh };
        Self {
            plant_from_mesh,
            normals_from_mesh: normal_matrix(&plant_from_mesh.matrix3),
            mirrors: plant_from_mesh.matrix3.determinant() < 0.0,
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

/// Unit normal of a counter-clockwise triangle; +Y for one without area.
fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3()
}
