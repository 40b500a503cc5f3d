//! Procedural textures: leaf cards with their alpha masks, and bark.

mod bark;
mod blade;
mod canvas;
mod spray;

use super::species::{BarkStyle, LeafStyle};
use crate::{
    Result,
    material::{Texture, TextureFormat, encode},
};

/// Height of a leaf texture in texels.
const LEAF_ROWS: u32 = 256;
/// Minimum and maximum width of a leaf texture in texels.
const LEAF_COLUMNS: [u32; 2] = [64, 512];

/// The texture of a leaf card; the foot of the card is at the middle of the lower edge. Transparent
/// texels have the colour of the leaf next to them, so that filtering produces no dark fringe.
///
/// # Errors
/// None in practice: the PNG is encoded to memory.
pub(super) fn leaf_texture(style: &LeafStyle, seed: u64) -> Result<Texture> {
    // A power of two, which suits mipmaps, near the proportions of the card.
    let columns = ((LEAF_ROWS as f32 * style.aspect * std::f32::consts::FRAC_1_SQRT_2) as u32 + 1).next_power_of_two();
    let mut canvas = canvas::Canvas::new(columns.clamp(LEAF_COLUMNS[0], LEAF_COLUMNS[1]), LEAF_ROWS);
    spray::paint(&mut canvas, style, seed);
    let [width, height] = canvas.size();
    texture("leaf", image::ColorType::Rgba8, [width, height], &canvas.finish())
}

/// The texture of the bark, which tiles seamlessly.
///
/// # Errors
/// None in practice: the PNG is encoded to memory.
pub(super) fn bark_texture(style: &BarkStyle, seed: u64) -> Result<Texture> {
    texture("bark", image::ColorType::Rgb8, [bark::SIDE; 2], &bark::paint(style, seed))
}

fn texture(name: &str, color: image::ColorType, size: [u32; 2], texels: &[u8]) -> Result<Texture> {
    Ok(Texture { name: name.into(), format: TextureFormat::Png, bytes: encode::png(name, color, size, texels)? })
}

/// Converts an 8-bit sRGB value to linear (IEC 61966-2-1).
pub(super) fn linear(srgb: u8) -> f32 {
    crate::srgb::linear(f32::from(srgb) / 255.0)
}

/// sRGB bytes as floats from 0 to 1.
fn unit_color(color: [u8; 3]) -> [f32; 3] {
    color.map(|channel| f32::from(channel) / 255.0)
}

/// Interpolates linearly between two colours.
fn mixed(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// Multiplies a colour by `factor`: above 1 is lighter, below 1 darker.
fn shaded(color: [f32; 3], factor: f32) -> [f32; 3] {
    color.map(|channel| channel * factor)
}

/// Smoothstep: from 0 at `low` to 1 at `high`.
fn smooth(low: f32, high: f32, value: f32) -> f32 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
