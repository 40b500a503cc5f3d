//! Alpha masks of the plant's materials: the alpha test, evaluated once per texel.

use super::fragments::{AlphaMask, NO_MASK};
use crate::{Result, material::Material, plant::Plant};

/// Alpha masks and the materials that use them.
#[derive(Debug, Default)]
pub struct Masks {
    /// One for each material whose alpha test rejects some texels but not all.
    pub masks: Vec<AlphaMask>,
    of_material: Vec<u32>,
}

impl Masks {
    /// Creates the masks of all materials that leaves use, decoding their textures.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded.
    pub fn new(plant: &Plant) -> Result<Self> {
        let mut masks = Self { masks: Vec::new(), of_material: vec![NO_MASK; plant.materials.len()] };
        for (index, material) in plant.materials.iter().enumerate() {
            if plant.leaves.iter().any(|leaf| leaf.material as usize == index)
                && let Some(mask) = mask(plant, material)?
            {
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
}

/// Returns the mask of one material, or `None` if it has no alpha-tested texture, or if every texel
/// passes the test or none does. (A leaf that cannot be seen has no sensible place in the order, so
/// a mask without opaque texels is treated as a fault of the file.)
fn mask(plant: &Plant, material: &Material) -> Result<Option<AlphaMask>> {
    let (Some(cutoff), Some(texture)) = (material.cutoff(), material.texture) else { return Ok(None) };
    let pixels = plant.textures[texture as usize].decode()?;
    let least_alpha = f64::from(cutoff) * 255.0;
    let factor = f64::from(material.base_color[3]);
    let mut bits = vec![0_u32; (pixels.width as usize * pixels.height as usize).div_ceil(32)];
    let mut covered = 0_usize;
    for (texel, rgba) in pixels.rgba.chunks_exact(4).enumerate() {
        if f64::from(rgba[3]) * factor >= least_alpha {
            bits[texel / 32] |= 1 << (texel % 32);
            covered += 1;
        }
    }
    let every = covered == pixels.rgba.len() / 4;
    let mask = AlphaMask { width: pixels.width, height: pixels.height, wrap: material.wrap, bits };
    Ok((covered > 0 && !every).then_some(mask))
}
