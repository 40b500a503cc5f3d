//! Materials and the textures they name, kept as the encoded bytes of the source file.

use serde::{Deserialize, Serialize};

#[cfg(feature = "textures")]
mod decode;

/// How a material's alpha is read (glTF `alphaMode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Covered where alpha >= the cutoff.
    Mask,
    /// Blended; where a yes or no is needed it counts as covered from alpha 0.5.
    Blend,
}

/// What a texture does outside 0..1 (glTF sampler `wrapS`, `wrapT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every other time mirrored.
    Mirror,
    /// The edge texel goes on.
    Clamp,
}

/// Surface of foliage or wood: the part of glTF's metallic-roughness model that foliage needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the source file; may be empty.
    pub name: String,
    /// Linear colour factor, RGBA.
    pub base_color: [f32; 4],
    /// Index into the owner's textures, if any: sRGB colour and linear alpha.
    pub texture: Option<u32>,
    /// Wrap mode along u and v.
    pub wrap: [Wrap; 2],
    /// How alpha is read.
    pub alpha_mode: AlphaMode,
    /// Alpha from which a masked texel covers; 0.5 unless the file says otherwise.
    pub alpha_cutoff: f32,
    /// Both sides are drawn.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            texture: None,
            wrap: [Wrap::Repeat; 2],
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: 0.5,
            double_sided: false,
        }
    }
}

impl Material {
    /// The alpha from which a texel covers, or `None` where alpha is ignored.
    pub fn cutoff(&self) -> Option<f32> {
        match self.alpha_mode {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => Some(self.alpha_cutoff),
            AlphaMode::Blend => Some(0.5),
        }
    }
}

/// Encoding of a [`Texture`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextureFormat {
    /// PNG.
    Png,
    /// JPEG: has no alpha.
    Jpeg,
    /// WebP.
    Webp,
}

/// An image as the source file held it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Name in the source file; may be empty.
    pub name: String,
    /// How `bytes` are encoded.
    pub format: TextureFormat,
    /// The encoded image.
    pub bytes: Vec<u8>,
}

/// A decoded texture: sRGB colour and linear alpha, 8 bits each, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

/// Greatest width and height that a texture may have: what every wgpu adapter takes.
pub const MAX_TEXTURE_SIDE: u32 = 8192;
