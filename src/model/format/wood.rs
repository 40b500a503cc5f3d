//! The section of wood.

use super::{fault::Decoded, ints::Ints, vertices::Vertices};
use crate::plant::{Wood, WoodPart};
use serde::{Deserialize, Serialize};

/// Vertices, indices and parts of the wood.
#[derive(Serialize, Deserialize)]
pub(super) struct PackedWood<'a> {
    parts: Vec<WoodPart>,
    #[serde(borrow)]
    indices: Ints<'a>,
    vertices: Vertices<'a>,
}

impl PackedWood<'_> {
    pub(super) fn encode(wood: &Wood) -> PackedWood<'static> {
        PackedWood {
            parts: wood.parts.clone(),
            indices: Ints::encode(&wood.indices),
            vertices: Vertices::encode(&wood.vertices, |_| None),
        }
    }

    /// Decodes wood with so many vertices and indices.
    pub(super) fn decode(self, [vertices, indices]: [usize; 2]) -> Decoded<Wood> {
        let mut wood = Wood {
            vertices: vec![bytemuck::Zeroable::zeroed(); vertices],
            indices: self.indices.decode(indices)?,
            parts: self.parts,
        };
        self.vertices.decode(vertices, |i| (i, None), &mut wood.vertices)?;
        Ok(wood)
    }
}
