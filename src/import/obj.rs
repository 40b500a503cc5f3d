//! Reads OBJ into a [`Source`].

use super::{
    budget::Budget,
    fault::Fault,
    mtl_surfaces::{Libraries, Surface, Surfaces},
    obj_lines,
    source::{Mesh, Part, Source, name, name_of},
    text,
};
use crate::{leaf::Vertex, srgb};
use glam::DAffine3;
use std::{cell::RefCell, collections::BTreeMap, path::Path};
use tobj::{LoadError, LoadOptions};

/// Parser options: every face becomes triangles, and every attribute keeps its own indices.
const OPTIONS: LoadOptions =
    LoadOptions { single_index: false, triangulate: true, ignore_points: true, ignore_lines: true };

/// Reads a file and the material libraries beside it.
pub(super) fn read(bytes: &[u8], path: &Path, budget: &Budget) -> Result<Source, Fault> {
    let text = text::text(bytes);
    obj_lines::check(&text)?;
    let libraries = RefCell::new(Libraries::new(path));
    // tobj needs the materials' places alone: an index of each by its name.
    let library = |name: &Path| Ok((Vec::new(), libraries.borrow_mut().read(&name.to_string_lossy())));
    let plain = obj_lines::plain(&text);
    let (models, _) = tobj::load_obj_buf(&mut plain.as_bytes(), &OPTIONS, library).map_err(broken)?;
    budget.check(models.iter().map(|model| model.mesh.indices.len() as u64).sum())?;
    let libraries = libraries.into_inner();
    let mut surfaces = Surfaces::new(path, libraries.warnings_for(obj_lines::materials_in_use(&text)));
    let mut read: Vec<Surface> = libraries.statements.iter().map(|statement| surfaces.surface(statement)).collect();
    read.push(Surface::default());
    let mut source = Source {
        name: name_of(path),
        materials: read.iter().map(|surface| surface.material.clone()).collect(),
        stated_alpha: read.iter().map(|surface| surface.stated_alpha).collect(),
        textures: surfaces.textures,
        alpha_ranges: surfaces.alpha_ranges,
        warnings: surfaces.warnings,
        ..Source::default()
    };
    models.iter().try_for_each(|model| source.push(model, &read))?;
    Ok(source)
}

fn broken(error: LoadError) -> Fault {
    Fault::Broken { reason: format!("its content is not valid OBJ: {error}"), fix: obj_lines::FIX }
}

impl Source {
    /// Appends the triangles of one combination of object, group and material.
    fn push(&mut self, model: &tobj::Model, surfaces: &[Surface]) -> Result<(), Fault> {
        let from = &model.mesh;
        let material = from.material_id.unwrap_or(surfaces.len() - 1).min(surfaces.len() - 1);
        let name = name(Some(&model.name));
        let mut mesh = Mesh { name: name.clone(), material, ..Mesh::default() };
        let mut known: BTreeMap<[u32; 3], u32> = BTreeMap::new();
        for corner in 0..from.indices.len() / 3 * 3 {
            let of = |indices: &[u32]| indices.get(corner).copied().unwrap_or(u32::MAX);
            let key = [from.indices[corner], of(&from.normal_indices), of(&from.texcoord_indices)];
            let next = mesh.vertices.len() as u32;
            let index = *known.entry(key).or_insert(next);
            if index == next {
                mesh.vertices.push(vertex(from, key, &surfaces[material])?);
            }
            mesh.indices.push(index);
        }
        self.parts.push(Part { name, node: None, mesh: self.meshes.len(), places: [DAffine3::IDENTITY].into() });
        self.meshes.push(mesh);
        Ok(())
    }
}

fn vertex(from: &tobj::Mesh, [position, normal, uv]: [u32; 3], surface: &Surface) -> Result<Vertex, Fault> {
    let found = triple(&from.positions, position).filter(|position| position.iter().all(|value| value.is_finite()));
    let color = triple(&from.vertex_color, position).map_or([1.0; 3], |color| color.map(srgb::linear));
    let position = found.ok_or_else(|| Fault::Broken {
        reason: format!("vertex {position} is missing or not finite"),
        fix: obj_lines::FIX,
    })?;
    let finite = |values: &[f32; 3]| values.iter().all(|value| value.is_finite());
    let normal = triple(&from.normals, normal).filter(finite).unwrap_or_default();
    let uv = from.texcoords.get(uv as usize * 2..).and_then(|rest| rest.first_chunk::<2>());
    let uv = uv.copied().filter(|uv| uv.iter().all(|value| value.is_finite())).unwrap_or_default();
    Ok(Vertex { position, normal, uv: surface.uv(uv), color: [color[0], color[1], color[2], 1.0] })
}

fn triple(values: &[f32], index: u32) -> Option<[f32; 3]> {
    values.get(index as usize * 3..)?.first_chunk::<3>().copied()
}
