//! Alpha masks of the plant's materials: the alpha test, evaluated once per texel.

use super::fragments::{AlphaMask, NO_MASK};
use crate::{
    Result,
    material::Material,
    plant::{Plant, Wood},
};

/// Alpha masks and the materials that use them.
#[derive(Debug, Default)]
pub struct Masks {
    /// One for each material of leaves whose alpha test rejects some texels.
    pub masks: Vec<AlphaMask>,
    of_material: Vec<u32>,
    /// For each material of the wood, whether its alpha test rejects every texel.
    is_clear: Vec<bool>,
}

impl Masks {
    /// Creates the masks of all materials that leaves use, decoding their textures. Of a material
    /// that only wood uses, the texture is decoded if it has an alpha test.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded.
    pub fn new(plant: &Plant) -> Result<Self> {
        let count = plant.materials.len();
        let mut masks = Self { masks: Vec::new(), of_material: vec![NO_MASK; count], is_clear: vec![false; count] };
        for (index, material) in plant.materials.iter().enumerate() {
            let has_leaves = plant.leaves.iter().any(|leaf| leaf.material as usize == index);
            let has_wood = plant.wood.parts.iter().any(|part| part.material as usize == index);
            let mask = if has_leaves || has_wood { mask(plant, material)? } else { None };
            masks.is_clear[index] = mask.as_ref().is_some_and(is_empty);
            if let Some(mask) = mask.filter(|_| has_leaves) {
                masks.of_material[index] = masks.masks.len() as u32;
                masks.masks.push(mask);
            }
        }
        Ok(masks)
    }

    /// Index of a material's mask, or [`NO_MASK`].
    pub fn of_material(&self, material: u32) -> u32 {
        self.of_material[material as usize]
    }

    /// Indices of the wood's triangles, except those that are not drawn because every texel of
    /// their material fails the alpha test. Wood is solid otherwise: holes in bark are not masked.
    pub fn wood_indices<'a>(&'a self, wood: &'a Wood) -> impl Iterator<Item = u32> + 'a {
        let parts = wood.parts.iter().filter(|part| !self.is_clear[part.material as usize]);
        parts.flat_map(|part| wood.indices[part.indices[0] as usize..part.indices[1] as usize].iter().copied())
    }
}

fn is_empty(mask: &AlphaMask) -> bool {
    mask.bits.iter().all(|bits| *bits == 0)
}

/// Returns the mask of one material, or `None` if it has no alpha test or every texel passes it. If
/// no texel passes, the mask is empty: such a leaf covers nothing, as in a picture.
fn mask(plant: &Plant, material: &Material) -> Result<Option<AlphaMask>> {
    let mask = |[width, height]: [u32; 2], bits| AlphaMask { width, height, wrap: material.wrap, bits };
    let (Some(_), Some(texture)) = (material.cutoff(), material.texture) else {
        return Ok(material.is_clear().then(|| mask([1; 2], vec![0])));
    };
    let pixels = plant.textures[texture as usize].decode()?;
    let mut bits = vec![0_u32; (pixels.width as usize * pixels.height as usize).div_ceil(32)];
    let mut covered = 0_usize;
    for (texel, rgba) in pixels.rgba.chunks_exact(4).enumerate() {
        if material.covers(rgba[3]) {
            bits[texel / 32] |= 1 << (texel % 32);
            covered += 1;
        }
    }
    let every = covered == pixels.rgba.len() / 4;
    Ok((!every).then(|| mask([pixels.width, pixels.height], bits)))
}
