//! Reads OBJ into a [`Source`].

use super::{
    budget::Budget,
    fault::Fault,
    source::{Mesh, Part, Source, name, name_of},
    textures, uri,
};
use crate::{
    leaf::Vertex,
    material::{AlphaMode, Material, Texture},
    plant::MAX_ELEMENTS,
};
use glam::DAffine3;
use std::{
    cell::RefCell,
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};
use tobj::{LoadError, LoadOptions};

/// Suggested fix for most errors in an OBJ file.
const FIX: &str = "export it again as triangles";

/// Parser options: every face becomes triangles, and every attribute keeps its own indices.
const OPTIONS: LoadOptions =
    LoadOptions { single_index: false, triangulate: true, ignore_points: true, ignore_lines: true };

/// Reads a file and the material libraries beside it.
pub(super) fn read(bytes: &[u8], path: &Path, budget: &Budget) -> Result<Source, Fault> {
    check_lines(bytes)?;
    let warnings = RefCell::new(Vec::new());
    let read = RefCell::new(BTreeSet::new());
    let library = |name: &Path| match read.borrow_mut().insert(uri::file_of(&name.to_string_lossy(), path)) {
        true => library(name, path, &mut warnings.borrow_mut()),
        false => Ok(Default::default()),
    };
    let (models, libraries) = tobj::load_obj_buf(&mut &bytes[..], &OPTIONS, library).map_err(broken)?;
    budget.check(models.iter().map(|model| model.mesh.indices.len() as u64).sum())?;
    let mut materials =
        Materials { path, textures: Vec::new(), known: BTreeMap::new(), warnings: warnings.into_inner() };
    let libraries = libraries.unwrap_or_default();
    let mut source = Source { name: name_of(path), ..Source::default() };
    for library in &libraries {
        let (material, stated_alpha) = materials.material(library);
        source.materials.push(material);
        source.stated_alpha.push(stated_alpha);
    }
    source.materials.push(Material { double_sided: true, ..Material::default() });
    source.stated_alpha.push(AlphaMode::Opaque);
    for model in &models {
        source.push(model)?;
    }
    (source.textures, source.warnings) = (materials.textures, materials.warnings);
    Ok(source)
}

/// Keys of lines that contain names, and the maximum length of such a line in bytes: tobj repeats a
/// name for each group and material.
const NAMING: [&str; 4] = ["o", "g", "usemtl", "newmtl"];
const MAX_NAME_LINE: usize = 1024;

/// Rejects input that tobj cannot handle: very long names, and faces with indices before the first
/// element or above [`MAX_ELEMENTS`], which overflow when tobj multiplies them.
fn check_lines(bytes: &[u8]) -> Result<(), Fault> {
    let text = str::from_utf8(bytes)
        .map_err(|error| Fault::Broken { reason: format!("its content is not UTF-8 text: {error}"), fix: FIX })?;
    let kinds = ["v", "vt", "vn"];
    let mut counts = [0_i64; 3];
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        if let Some(kind) = kinds.iter().position(|&kind| kind == key) {
            counts[kind] += 1;
        }
        if NAMING.contains(&key) && line.len() > MAX_NAME_LINE {
            let reason = format!("line {} has a name of {} bytes", number + 1, line.len());
            return Err(Fault::Broken { reason, fix: FIX });
        }
        if !["f", "l", "p"].contains(&key) {
            continue;
        }
        let indices = words.flat_map(|word| (0..).zip(word.split('/')).take(3));
        for (kind, index) in indices.filter_map(|(kind, index)| Some((kind, index.parse::<i64>().ok()?))) {
            if index < -counts[kind] || index > MAX_ELEMENTS as i64 {
                let reason = format!("line {} refers to {} {index} of {}", number + 1, kinds[kind], counts[kind]);
                return Err(Fault::Broken { reason, fix: FIX });
            }
        }
    }
    Ok(())
}

fn broken(error: LoadError) -> Fault {
    Fault::Broken { reason: format!("its content is not valid OBJ: {error}"), fix: FIX }
}

/// Reads a material library; one that is missing or damaged is ignored with a warning.
fn library(name: &Path, path: &Path, warnings: &mut Vec<String>) -> tobj::MTLLoadResult {
    let bytes = uri::read(&name.to_string_lossy(), path).map_err(|fault| fault.at(path).to_string());
    let library = bytes.and_then(|bytes| {
        check_lines(&bytes).map_err(|fault| fault.at(path).to_string())?;
        let text = with_whole_colors(str::from_utf8(&bytes).map_err(|error| error.to_string())?);
        tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|error| error.to_string())
    });
    library.or_else(|reason| {
        warnings.push(format!("material library {name:?} is ignored: {reason}"));
        Ok(Default::default())
    })
}

/// Rewrites a material library so that every colour has three numbers, because tobj panics on
/// fewer. A single number is a grey, as the format defines; a colour with none or two is dropped.
fn with_whole_colors(library: &str) -> String {
    let line = |line: &str| match line.split_whitespace().collect::<Vec<_>>()[..] {
        [key @ ("Ka" | "Kd" | "Ks" | "Ke"), grey] => format!("{key} {grey} {grey} {grey}\n"),
        ["Ka" | "Kd" | "Ks" | "Ke"] | ["Ka" | "Kd" | "Ks" | "Ke", _, _] => "\n".to_owned(),
        _ => format!("{line}\n"),
    };
    library.lines().map(line).collect()
}

impl Source {
    /// Appends the triangles of one combination of object, group and material.
    fn push(&mut self, model: &tobj::Model) -> Result<(), Fault> {
        let from = &model.mesh;
        let material = from.material_id.unwrap_or(self.materials.len() - 1).min(self.materials.len() - 1);
        let name = name(Some(&model.name));
        let mut mesh = Mesh { name: name.clone(), material, ..Mesh::default() };
        let mut known: BTreeMap<[u32; 3], u32> = BTreeMap::new();
        for corner in 0..from.indices.len() / 3 * 3 {
            let of = |indices: &[u32]| indices.get(corner).copied().unwrap_or(u32::MAX);
            let key = [from.indices[corner], of(&from.normal_indices), of(&from.texcoord_indices)];
            let next = mesh.vertices.len() as u32;
            let index = *known.entry(key).or_insert(next);
            if index == next {
                mesh.vertices.push(vertex(from, key)?);
            }
            mesh.indices.push(index);
        }
        self.parts.push(Part { name, mesh: self.meshes.len(), places: [DAffine3::IDENTITY].into() });
        self.meshes.push(mesh);
        Ok(())
    }
}

fn vertex(from: &tobj::Mesh, [position, normal, uv]: [u32; 3]) -> Result<Vertex, Fault> {
    let found = triple(&from.positions, position).filter(|position| position.iter().all(|value| value.is_finite()));
    let position = found
        .ok_or_else(|| Fault::Broken { reason: format!("vertex {position} is missing or not finite"), fix: FIX })?;
    let finite = |values: &[f32; 3]| values.iter().all(|value| value.is_finite());
    let normal = triple(&from.normals, normal).filter(finite).unwrap_or_default();
    let uv = from.texcoords.get(uv as usize * 2..).and_then(|rest| rest.first_chunk::<2>());
    let uv = uv.copied().filter(|uv| uv.iter().all(|value| value.is_finite())).unwrap_or_default();
    // In OBJ, v starts at the last row of texels.
    Ok(Vertex { position, normal, uv: [uv[0], 1.0 - uv[1]], color: [1.0; 4] })
}

fn triple(values: &[f32], index: u32) -> Option<[f32; 3]> {
    values.get(index as usize * 3..)?.first_chunk::<3>().copied()
}

/// Materials of one file while they are being read.
struct Materials<'a> {
    path: &'a Path,
    textures: Vec<Texture>,
    /// Texture index of each file, `None` if it cannot be used.
    known: BTreeMap<PathBuf, Option<u32>>,
    warnings: Vec<String>,
}

impl Materials<'_> {
    /// The material, and the alpha mode that the file specifies. OBJ has no cutoff and no culling:
    /// the cutoff is 0.5 and both sides are drawn. A constant dissolve is ignored because exporters
    /// write 0 next to a texture.
    fn material(&mut self, from: &tobj::Material) -> (Material, AlphaMode) {
        let texture = from.diffuse_texture.as_deref().and_then(|name| self.texture(name));
        let has_holes = texture.is_some_and(|texture| textures::has_holes(&self.textures[texture as usize]));
        if from.dissolve_texture.is_some() && from.dissolve_texture != from.diffuse_texture {
            self.warnings.push(format!("material {:?}: its map_d differs from its map_Kd and is ignored", from.name));
        }
        let states_alpha = has_holes || from.dissolve_texture.is_some();
        let [r, g, b] = from.diffuse.filter(|_| texture.is_none()).unwrap_or([1.0; 3]);
        let material = Material {
            name: name(Some(&from.name)),
            base_color: [r, g, b, 1.0].map(|factor| if factor.is_finite() { factor } else { 1.0 }),
            texture,
            alpha_mode: if has_holes { AlphaMode::Mask } else { AlphaMode::Opaque },
            double_sided: true,
            ..Material::default()
        };
        (material, if states_alpha { AlphaMode::Mask } else { AlphaMode::Opaque })
    }

    fn texture(&mut self, name: &str) -> Option<u32> {
        let file = uri::file_of(name, self.path);
        if let Some(&known) = self.known.get(&file) {
            return known;
        }
        let bytes = uri::read(name, self.path).map_err(|fault| fault.at(self.path).to_string());
        let index = match bytes.and_then(|bytes| textures::texture(name, &bytes)) {
            Ok(texture) => {
                self.textures.push(texture);
                Some(self.textures.len() as u32 - 1)
            }
            Err(reason) => {
                self.warnings.push(format!("texture {name:?} is ignored and its materials are opaque: {reason}"));
                None
            }
        };
        self.known.insert(file, index);
        index
    }
}
