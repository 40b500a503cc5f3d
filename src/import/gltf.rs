//! Reads glTF and binary glTF into a [`Source`].

use super::{
    ImportOptions, Warning, WarningKind,
    accessor::Accessors,
    attributes::Attributes,
    budget::Budget,
    buffers::Buffers,
    container,
    draco::DracoMesh,
    extensions,
    fault::{Fault, limit},
    graph::Graph,
    materials::{Materials, Surface},
    morph,
    nodes::{self, Placed, PlacedMesh, Shape},
    skin::{self, Skins},
    source::{Mesh, Part, Source, name, name_of},
    topology,
};
use crate::leaf::Vertex;
use ::gltf::json::{
    Index, Root, Value,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
use glam::DAffine3;
use std::{
    collections::{BTreeMap, btree_map::Entry},
    ops::Range,
    path::Path,
    rc::Rc,
};

/// Maximum number of indices per byte of a file: Draco needs about half a byte for a triangle, and
/// primitives that share buffers need even less. The limit keeps a small file from using a lot of
/// memory.
const MAX_INDICES_PER_BYTE: u64 = 16;

/// Bytes of JSON required per object in it, and the number of objects that any file may have. A
/// parsed object takes half a kilobyte of memory; in real files it takes tens of bytes of JSON.
const BYTES_PER_OBJECT: u64 = 8;
const ALWAYS_OBJECTS: u64 = 100_000;

/// Reads the default scene of a file, or the part of it that `options` name.
pub(super) fn read(bytes: &[u8], path: &Path, options: &ImportOptions, budget: &Budget) -> Result<Source, Fault> {
    let container = container::split(bytes)?;
    let objects = container.json.iter().filter(|&&byte| byte == b'{').count() as u64;
    let most_objects = (container.json.len() as u64 / BYTES_PER_OBJECT).max(ALWAYS_OBJECTS);
    limit("the number of JSON objects for a file of its size", objects, most_objects)?;
    let root = Root::from_slice(container.json).map_err(|error| {
        Fault::broken(format!("its JSON is not valid glTF: {error}").replace(char::is_control, " "))
    })?;
    extensions::check_required(&root.extensions_required)?;
    let buffers = Buffers::load(&root, container.binary, path)?;
    let accessors = Accessors::new(&root, &buffers);
    let mut materials = Materials::new(&root, &buffers, path);
    let surfaces = materials.read()?;
    let graph = Graph::new(&root)?;
    let mut reader = Reader {
        root: &root,
        buffers: &buffers,
        accessors: &accessors,
        surfaces: &surfaces,
        skins: Skins::new(&root, &accessors, &graph),
        budget,
        indices: 0,
        most_indices: buffers.total_bytes().saturating_mul(MAX_INDICES_PER_BYTE),
        draco_bytes_left: buffers.total_bytes(),
        warnings: materials.warnings,
    };
    let Placed { meshes: placed, plants, warnings } =
        nodes::placed_meshes(&root, &graph, &accessors, options.plant.as_deref())?;
    reader.warnings.extend(warnings);
    reader.warnings.extend(extensions::place_on_earth(&root).into_iter().chain(animations(&root)));
    let mut meshes = Vec::new();
    let mut range_of: BTreeMap<Shape, Range<usize>> = BTreeMap::new();
    for placed in &placed {
        if let Entry::Vacant(range) = range_of.entry(placed.shape) {
            let first = meshes.len();
            meshes.extend(reader.meshes(placed.shape)?);
            range.insert(first..meshes.len());
        }
    }
    let corners = |placed: &PlacedMesh| {
        let meshes = &meshes[range_of[&placed.shape].clone()];
        meshes
            .iter()
            .map(|mesh: &Mesh| mesh.indices.len() as u64)
            .sum::<u64>()
            .saturating_mul(placed.places.len() as u64)
    };
    budget.check(placed.iter().map(corners).fold(0, u64::saturating_add))?;
    let mut parts = Vec::new();
    let mut first_part = Vec::with_capacity(placed.len() + 1);
    for placed in placed {
        first_part.push(parts.len());
        let range = range_of[&placed.shape].clone().filter(|_| !placed.places.is_empty());
        let part =
            |mesh| Part { name: placed.name.clone(), node: Some(placed.node), mesh, places: Rc::clone(&placed.places) };
        parts.extend(range.map(part));
    }
    first_part.push(parts.len());
    let part_range = |meshes: Range<usize>| first_part[meshes.start]..first_part[meshes.end];
    Ok(Source {
        name: name_of(path),
        nodes: nodes::tree(&root, &graph),
        meshes,
        parts,
        plants: plants.into_iter().map(|(name, meshes)| (name, part_range(meshes))).collect(),
        stated_alpha: surfaces.iter().map(|surface| surface.stated_alpha).collect(),
        warnings: reader.warnings,
        textures: materials.textures,
        alpha_ranges: materials.alpha_ranges,
        materials: surfaces.into_iter().map(|surface| surface.material).collect(),
    })
}

/// A warning for a file with animations.
fn animations(root: &Root) -> Option<Warning> {
    let count = root.animations.len();
    let message = format!("{count} animations are ignored: the plant keeps its rest pose");
    (count > 0).then(|| Warning::new(WarningKind::Pose, message, ""))
}

/// Joints and morph weights of a mesh in its rest pose.
struct Pose<'a> {
    joints: Option<Rc<[DAffine3]>>,
    weights: &'a [f32],
}

/// Vertices, and three indices into them per triangle.
type Triangles = (Vec<Vertex>, Vec<u32>);

/// Reads meshes, given their buffers and materials.
struct Reader<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    accessors: &'a Accessors<'a>,
    surfaces: &'a [Surface],
    skins: Skins<'a>,
    budget: &'a Budget,
    /// Number of indices so far, and the maximum for a file of this size.
    indices: u64,
    most_indices: u64,
    /// Bytes that Draco streams may still cover: each covers its own, unless views overlap.
    draco_bytes_left: u64,
    warnings: Vec<Warning>,
}

impl<'a> Reader<'a> {
    /// The triangles of one glTF mesh, as one [`Mesh`] per material: exporters split a surface into
    /// several primitives where 16-bit indices run out.
    fn meshes(&mut self, shape: Shape) -> Result<Vec<Mesh>, Fault> {
        let (root, index) = (self.root, shape.mesh);
        let source = root
            .meshes
            .get(index)
            .ok_or_else(|| Fault::broken(format!("mesh {index} is referenced and {} exist", root.meshes.len())))?;
        let weights = shape.weights_of.and_then(|node| root.nodes[node].weights.as_ref()).or(source.weights.as_ref());
        let pose = Pose {
            joints: shape.skin.map(|skin| self.skins.matrices(skin)).transpose()?,
            weights: weights.map_or(&[], Vec::as_slice),
        };
        let name = name(source.name.as_deref());
        let mut meshes: Vec<Mesh> = Vec::new();
        let mut has_others = false;
        for primitive in &source.primitives {
            let material = primitive.material.map_or(self.surfaces.len() - 1, |material| material.value());
            if material >= self.surfaces.len() {
                return Err(Fault::broken(format!(
                    "material {material} is referenced and {} exist",
                    self.root.materials.len()
                )));
            }
            let surfaces = self.surfaces;
            let Some((vertices, indices)) = self.primitive(primitive, &surfaces[material], &pose)? else {
                has_others = true;
                continue;
            };
            if indices.is_empty() {
                continue;
            }
            let known = meshes.iter().position(|mesh| mesh.material == material).unwrap_or(meshes.len());
            if known == meshes.len() {
                meshes.push(Mesh { name: name.clone(), material, ..Mesh::default() });
            }
            let mesh = &mut meshes[known];
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(vertices);
            mesh.indices.extend(indices.into_iter().map(|index| index + first));
        }
        if has_others {
            let message = format!("mesh {index} ({name:?}): points and lines are ignored");
            self.warnings.push(Warning::new(WarningKind::Geometry, message, ""));
        }
        Ok(meshes)
    }

    /// The vertices that a primitive uses, and its triangles as indices into them; `None` for
    /// points and lines.
    fn primitive(
        &mut self,
        primitive: &'a Primitive,
        surface: &Surface,
        pose: &Pose,
    ) -> Result<Option<Triangles>, Fault> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(Fault::broken("a primitive has an unknown mode"));
        };
        let attributes = self.attributes(primitive)?;
        let Some(positions) = attributes.index(&Semantic::Positions) else {
            return Err(Fault::broken("a primitive has no positions"));
        };
        let (mode, indices) = match (&attributes.draco, primitive.indices) {
            // Draco has already expanded strips: whatever the mode of the primitive, its faces are
            // triangles.
            (Some((draco, _)), _) => (Mode::Triangles, draco.indices()),
            (None, Some(indices)) => (mode, self.accessors.indices(indices)?),
            (None, None) => (mode, (0..self.accessors.count(positions)?.min(u32::MAX as usize) as u32).collect()),
        };
        self.indices += indices.len() as u64;
        limit("the number of indices for a file of its size", self.indices, self.most_indices)?;
        self.budget.check(self.indices)?;
        let Some(mut indices) = topology::triangle_list(mode, indices) else { return Ok(None) };
        let picks = compact(&mut indices);
        let mut vertices = attributes.vertices(&picks, surface, &mut self.warnings)?;
        morph::apply(self.accessors, primitive, pose.weights, &picks, &mut vertices)?;
        if let Some(joints) = &pose.joints {
            skin::apply(&attributes, joints, &picks, (&mut vertices, &mut indices), &mut self.warnings)?;
        }
        Ok(Some((vertices, indices)))
    }

    fn attributes(&mut self, primitive: &'a Primitive) -> Result<Attributes<'a>, Fault> {
        let extension = primitive.extensions.as_ref().and_then(|e| e.others.get("KHR_draco_mesh_compression"));
        let draco = extension.map(|extension| self.draco(extension)).transpose()?;
        Ok(Attributes { accessors: self.accessors, primitive, draco })
    }

    fn draco(&mut self, extension: &'a Value) -> Result<(DracoMesh, &'a Value), Fault> {
        let broken = || Fault::broken("KHR_draco_mesh_compression: bufferView or attributes are missing");
        let view = extension.get("bufferView").and_then(Value::as_u64).and_then(|view| u32::try_from(view).ok());
        let view = self.buffers.view(Index::new(view.ok_or_else(broken)?))?;
        let left = self.draco_bytes_left.checked_sub(view.bytes.len() as u64);
        self.draco_bytes_left =
            left.ok_or_else(|| Fault::broken("KHR_draco_mesh_compression: a stream is used more than once"))?;
        Ok((DracoMesh::decode(view.bytes)?, extension.get("attributes").ok_or_else(broken)?))
    }
}

/// Renumbers the indices so that only the vertices in use remain; returns their old numbers in
/// ascending order.
fn compact(indices: &mut [u32]) -> Vec<u32> {
    let mut picks = indices.to_vec();
    picks.sort_unstable();
    picks.dedup();
    for index in indices {
        *index = picks.partition_point(|pick| pick < index) as u32;
    }
    picks
}
