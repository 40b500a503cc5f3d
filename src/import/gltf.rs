//! Reads glTF and binary glTF into a [`Source`].

use super::{
    accessor::Accessors,
    budget::Budget,
    buffers::Buffers,
    container,
    draco::DracoMesh,
    extensions,
    fault::{Fault, limit},
    materials::{Materials, Surface},
    nodes::{self, PlacedMesh},
    source::{Mesh, Part, Source, name, name_of},
    topology,
};
use crate::leaf::Vertex;
use ::gltf::json::{
    Accessor, Index, Root, Value,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
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

/// Reads the default scene of a file.
pub(super) fn read(bytes: &[u8], path: &Path, budget: &Budget) -> Result<Source, Fault> {
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
    let mut reader = Reader {
        root: &root,
        buffers: &buffers,
        accessors: &accessors,
        surfaces: &surfaces,
        budget,
        indices: 0,
        most_indices: buffers.total_bytes().saturating_mul(MAX_INDICES_PER_BYTE),
        draco_bytes_left: buffers.total_bytes(),
        warnings: materials.warnings,
    };
    let placed = nodes::placed_meshes(&root, &accessors)?;
    let mut meshes = Vec::new();
    let mut range_of: BTreeMap<usize, Range<usize>> = BTreeMap::new();
    for placed in &placed {
        if let Entry::Vacant(range) = range_of.entry(placed.mesh) {
            let first = meshes.len();
            meshes.extend(reader.meshes(placed.mesh)?);
            range.insert(first..meshes.len());
        }
    }
    let corners = |placed: &PlacedMesh| {
        let meshes = &meshes[range_of[&placed.mesh].clone()];
        meshes
            .iter()
            .map(|mesh: &Mesh| mesh.indices.len() as u64)
            .sum::<u64>()
            .saturating_mul(placed.places.len() as u64)
    };
    budget.check(placed.iter().map(corners).fold(0, u64::saturating_add))?;
    let parts = placed.into_iter().filter(|placed| !placed.places.is_empty()).flat_map(|placed| {
        let range = range_of[&placed.mesh].clone();
        range.map(move |mesh| Part { name: placed.name.clone(), mesh, places: Rc::clone(&placed.places) })
    });
    let parts = parts.collect();
    Ok(Source {
        name: name_of(path),
        meshes,
        parts,
        stated_alpha: surfaces.iter().map(|surface| surface.stated_alpha).collect(),
        warnings: reader.warnings,
        textures: materials.textures,
        materials: surfaces.into_iter().map(|surface| surface.material).collect(),
    })
}

/// Vertices, and three indices into them per triangle.
type Triangles = (Vec<Vertex>, Vec<u32>);

/// Reads meshes, given their buffers and materials.
struct Reader<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    accessors: &'a Accessors<'a>,
    surfaces: &'a [Surface],
    budget: &'a Budget,
    /// Number of indices so far, and the maximum for a file of this size.
    indices: u64,
    most_indices: u64,
    /// Bytes that Draco streams may still cover: each covers its own, unless views overlap.
    draco_bytes_left: u64,
    warnings: Vec<String>,
}

impl<'a> Reader<'a> {
    /// The triangles of one glTF mesh, as one [`Mesh`] per material: exporters split a surface into
    /// several primitives where 16-bit indices run out.
    fn meshes(&mut self, index: usize) -> Result<Vec<Mesh>, Fault> {
        let source =
            self.root.meshes.get(index).ok_or_else(|| {
                Fault::broken(format!("mesh {index} is referenced and {} exist", self.root.meshes.len()))
            })?;
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
            let Some((vertices, indices)) = self.primitive(primitive, &surfaces[material])? else {
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
            self.warnings.push(format!("mesh {index} ({name:?}): points and lines are ignored"));
        }
        Ok(meshes)
    }

    /// The vertices that a primitive uses, and its triangles as indices into them; `None` for
    /// points and lines.
    fn primitive(&mut self, primitive: &'a Primitive, surface: &Surface) -> Result<Option<Triangles>, Fault> {
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
        Ok(Some((attributes.vertices(&picks, surface, &mut self.warnings)?, indices)))
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

/// The vertex attributes of one primitive, in accessors or in a Draco stream.
struct Attributes<'a> {
    accessors: &'a Accessors<'a>,
    primitive: &'a Primitive,
    /// Decoded stream, and the map of the extension from attribute names to its ids.
    draco: Option<(DracoMesh, &'a Value)>,
}

impl Attributes<'_> {
    fn index(&self, semantic: &Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic.clone())).copied()
    }

    fn floats<const N: usize>(
        &self,
        semantic: &Semantic,
        picks: &[u32],
        least_components: usize,
        absent: [f32; N],
    ) -> Result<Option<Vec<[f32; N]>>, Fault> {
        let Some(index) = self.index(semantic) else { return Ok(None) };
        let name = semantic.to_string();
        let id = self.draco.as_ref().and_then(|(draco, ids)| Some((draco, ids.get(&name)?.as_u64()?)));
        match id {
            Some((draco, id)) => draco.floats(id, picks, self.accessors.divisor(index)?, absent).map(Some),
            None => self.accessors.floats(index, &name, picks, least_components..=N, absent).map(Some),
        }
    }

    fn vertices(&self, picks: &[u32], surface: &Surface, warnings: &mut Vec<String>) -> Result<Vec<Vertex>, Fault> {
        let positions = self.floats(&Semantic::Positions, picks, 3, [0.0; 3])?.unwrap_or_default();
        if let Some(i) = positions.iter().position(|position| !is_finite(position)) {
            return Err(Fault::broken(format!("the position of vertex {} is {:?}", picks[i], positions[i])));
        }
        let normals = self.floats(&Semantic::Normals, picks, 3, [0.0; 3])?;
        let uvs = self.floats(&Semantic::TexCoords(surface.uv_set), picks, 2, [0.0; 2])?;
        let colors = self.floats(&Semantic::Colors(0), picks, 3, [1.0; 4])?;
        let mut replaced = 0;
        let vertices = (0..picks.len()).map(|i| {
            let uv = finite_or(uvs.as_ref().map(|uvs| uvs[i]), [0.0; 2], &mut replaced);
            let uv = surface.uv_transform.map_or(uv, |transform| transform.apply(uv));
            Vertex {
                position: positions[i],
                normal: finite_or(normals.as_ref().map(|normals| normals[i]), [0.0; 3], &mut replaced),
                uv: finite_or(Some(uv), [0.0; 2], &mut replaced),
                color: finite_or(colors.as_ref().map(|colors| colors[i]), [1.0; 4], &mut replaced),
            }
        });
        let vertices = vertices.collect();
        if replaced > 0 {
            warnings.push(format!(
                "{replaced} normals, texture coordinates or colours were not finite and have been replaced"
            ));
        }
        Ok(vertices)
    }
}

fn is_finite(values: &[f32]) -> bool {
    values.iter().all(|value| value.is_finite())
}

fn finite_or<const N: usize>(values: Option<[f32; N]>, absent: [f32; N], replaced: &mut usize) -> [f32; N] {
    match values {
        Some(values) if is_finite(&values) => values,
        Some(_) => {
            *replaced += 1;
            absent
        }
        None => absent,
    }
}
