//! Smaller textures, for files that have to be.

use super::coverage::keep_coverage;
use crate::{
    Result,
    draw::mips::{Mips, SrgbTable},
    error::check_range,
    material::{Material, Texture, TextureFormat, encode},
    plant::PlantOf,
};
use std::ops::RangeInclusive;

/// Sides in texels that textures can be reduced to.
pub const TEXTURE_SIDES: RangeInclusive<u32> = 1..=8192;

/// The textures of a plant, halved until no side is longer than `side` texels, as PNG: alpha lets
/// as much be drawn as before. Textures that are small enough are as they are, bit for bit.
///
/// # Errors
/// [`InvalidOption`](crate::Error::InvalidOption) for a side beyond [`TEXTURE_SIDES`];
/// [`Unreadable`](crate::Error::Unreadable) for a damaged texture.
pub fn resized<L>(plant: &PlantOf<L>, side: u32) -> Result<Vec<Texture>> {
    check_range("textures", side, TEXTURE_SIDES)?;
    let srgb = SrgbTable::new();
    let smaller = |(number, texture): (u32, &Texture)| {
        let material = plant.materials.iter().find(|material| material.texture == Some(number));
        smaller(texture, material, side, &srgb).map(|smaller| smaller.unwrap_or_else(|| texture.clone()))
    };
    (0..).zip(&plant.textures).map(smaller).collect()
}

/// The texture of a material, smaller; `None` if it is small enough, or not in use.
fn smaller(texture: &Texture, material: Option<&Material>, side: u32, srgb: &SrgbTable) -> Result<Option<Texture>> {
    let Some(material) = material else { return Ok(None) };
    let pixels = texture.decode()?;
    if pixels.width.max(pixels.height) <= side {
        return Ok(None);
    }
    let cutoff = material.texture_cutoff();
    let mips = Mips::new(pixels, material.wrap, cutoff, srgb);
    let Some(level) = mips.as_ref().and_then(|mips| mips.within(side)) else { return Ok(None) };
    let size = [level.width, level.height];
    let bytes = match cutoff {
        None => {
            let rgb: Vec<u8> = level.rgba.chunks_exact(4).flat_map(|texel| &texel[..3]).copied().collect();
            encode::png(&texture.name, image::ColorType::Rgb8, size, &rgb)?
        }
        Some(cutoff) => {
            let mut rgba = level.rgba.clone();
            keep_coverage(&mut rgba, cutoff.min(1.0));
            encode::png(&texture.name, image::ColorType::Rgba8, size, &rgba)?
        }
    };
    Ok(Some(Texture { name: texture.name.clone(), format: TextureFormat::Png, bytes }))
}
