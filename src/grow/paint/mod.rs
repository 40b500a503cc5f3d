//! Textures painted by arithmetic: leaf cards with their alpha masks, and bark.

mod bark;
mod blade;
mod canvas;
mod spray;

use super::species::{BarkStyle, LeafStyle};
use crate::{
    Error, Result,
    material::{Pixels, Texture, TextureFormat},
};

/// Rows of a leaf texture.
const LEAF_ROWS: u32 = 256;
/// Least and greatest number of columns of a leaf texture.
const LEAF_COLUMNS: [u32; 2] = [64, 512];

/// The texture of a leaf card: its foot is the middle of the lower edge. Transparent texels carry the colour of the leaf
/// beside them, so that filtering draws no dark fringe.
///
/// # Errors
/// None in practice: encoding to memory.
pub(super) fn leaf_texture(style: &LeafStyle, seed: u64) -> Result<Texture> {
    // A power of two, as mipmaps like it, near the card's own proportion.
    let columns = ((LEAF_ROWS as f32 * style.aspect * std::f32::consts::FRAC_1_SQRT_2) as u32 + 1).next_power_of_two();
    let mut canvas = canvas::Canvas::new(columns.clamp(LEAF_COLUMNS[0], LEAF_COLUMNS[1]), LEAF_ROWS);
    spray::paint(&mut canvas, style, seed);
    let [width, height] = canvas.size();
    texture("leaf", image::ColorType::Rgba8, [width, height], &canvas.finish())
}

/// The texture of the bark; it repeats without a seam.
///
/// # Errors
/// None in practice: encoding to memory.
pub(super) fn bark_texture(style: &BarkStyle, seed: u64) -> Result<Texture> {
    texture("bark", image::ColorType::Rgb8, [bark::SIDE; 2], &bark::paint(style, seed))
}

fn texture(name: &str, color: image::ColorType, size: [u32; 2], texels: &[u8]) -> Result<Texture> {
    Ok(Texture { name: name.into(), format: TextureFormat::Png, bytes: encoded(name, color, size, texels)? })
}

/// `pixels` as a PNG; `name` stands in messages.
///
/// # Errors
/// None in practice: encoding to memory.
pub(super) fn png(name: &str, pixels: &Pixels) -> Result<Vec<u8>> {
    encoded(name, image::ColorType::Rgba8, [pixels.width, pixels.height], &pixels.rgba)
}

fn encoded(name: &str, color: image::ColorType, [width, height]: [u32; 2], texels: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut bytes, texels, width, height, color, image::ImageFormat::Png)
        .map_err(|error| Error::unreadable(name, error.to_string(), "give the image as PNG or JPEG"))?;
    Ok(bytes.into_inner())
}

/// Linear value of an 8-bit sRGB one (IEC 61966-2-1).
pub(super) fn linear(srgb: u8) -> f32 {
    crate::srgb::linear(f32::from(srgb) / 255.0)
}

/// sRGB bytes as floats from 0 to 1.
fn unit_color(color: [u8; 3]) -> [f32; 3] {
    color.map(|channel| f32::from(channel) / 255.0)
}

/// Between two colours.
fn mixed(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// A colour made lighter (above 1) or darker.
fn shaded(color: [f32; 3], factor: f32) -> [f32; 3] {
    color.map(|channel| channel * factor)
}

/// From 0 at `low` to 1 at `high` without a kink.
fn smooth(low: f32, high: f32, value: f32) -> f32 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
