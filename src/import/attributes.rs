//! The vertex attributes of one glTF primitive, in accessors or in a Draco stream.

use super::{Warning, WarningKind, accessor::Accessors, draco::DracoMesh, fault::Fault, materials::Surface};
use crate::leaf::Vertex;
use ::gltf::json::{
    Accessor, Index, Value,
    mesh::{Primitive, Semantic},
    validation::Checked,
};

/// The attributes of one primitive.
pub(super) struct Attributes<'a> {
    pub(super) accessors: &'a Accessors<'a>,
    pub(super) primitive: &'a Primitive,
    /// Decoded stream, and the map of the extension from attribute names to its ids.
    pub(super) draco: Option<(DracoMesh, &'a Value)>,
}

impl Attributes<'_> {
    /// The accessor of an attribute, if the primitive has it.
    pub(super) fn index(&self, semantic: &Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic.clone())).copied()
    }

    /// The values of an attribute at the vertices `picks` (ascending); `None` if the primitive does
    /// not have it.
    pub(super) fn floats<const N: usize>(
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

    /// The vertices `picks` (ascending).
    pub(super) fn vertices(
        &self,
        picks: &[u32],
        surface: &Surface,
        warnings: &mut Vec<Warning>,
    ) -> Result<Vec<Vertex>, Fault> {
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
            let message =
                format!("{replaced} normals, texture coordinates or colours were not finite and have been replaced");
            warnings.push(Warning::new(WarningKind::Geometry, message, ""));
        }
        Ok(vertices)
    }
}

/// Whether all `values` are numbers.
pub(super) fn is_finite(values: &[f32]) -> bool {
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
