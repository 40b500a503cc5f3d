//! Alpha masks of the plant's materials: the alpha test done once per texel.

use super::fragments::{AlphaMask, NO_MASK};
use crate::{Result, material::Material, plant::Plant};

/// The masks, and which material uses which.
#[derive(Debug, Default)]
pub struct Masks {
    /// One per masked material whose texture has uncovered texels.
    pub masks: Vec<AlphaMask>,
    of_material: Vec<u32>,
}

impl Masks {
    /// Decodes the textures of all materials that leaves use.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) when a texture cannot be decoded.
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

    /// The mask of a material, or [`NO_MASK`].
    pub fn of_material(&self, material: u32) -> u32 {
        self.of_material[material as usize]
    }
}

/// The mask of one material; `None` where every texel covers, or none does (a leaf that cannot be seen has no sensible
/// place in the order, so such a mask counts as a fault of the file).
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
