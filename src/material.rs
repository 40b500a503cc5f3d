//! Materials, and their textures stored as the encoded bytes of the source file.

use serde::{Deserialize, Serialize};

#[cfg(feature = "textures")]
mod decode;
#[cfg(feature = "software")]
pub(crate) mod encode;
#[cfg(feature = "textures")]
pub(crate) use decode::decode_grey;
#[cfg(feature = "simplify")]
pub(crate) use decode::{bound, decode_tga};

/// How a material's alpha is interpreted (glTF `alphaMode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Texels with alpha >= the cutoff are covered.
    Mask,
    /// Alpha-blended. Where a binary decision is needed, texels with alpha >= the cutoff are
    /// covered.
    Blend,
}

/// Texture wrapping outside 0..1 (glTF sampler `wrapS`, `wrapT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// The texture repeats and every other copy is mirrored.
    Mirror,
    /// The edge texel extends outwards.
    Clamp,
}

/// Surface of foliage or wood: the subset of glTF's metallic-roughness model that foliage needs.
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
    /// How alpha is interpreted.
    pub alpha_mode: AlphaMode,
    /// Alpha at or above which a texel is covered, unless the material is opaque: 0.5 unless the
    /// file specifies another. An import sets that of a blended material to half of the largest
    /// alpha that it reaches.
    pub alpha_cutoff: f32,
    /// Whether both sides are drawn.
    pub double_sided: bool,
}

impl Wrap {
    /// The texel that a texel beside a texture of `size` texels repeats.
    #[cfg(feature = "textures")]
    pub(crate) fn inside(self, index: i64, size: u32) -> u32 {
        let size = i64::from(size);
        let inside = match self {
            _ if (0..size).contains(&index) => index,
            Self::Repeat => index.rem_euclid(size),
            Self::Clamp => index.clamp(0, size - 1),
            Self::Mirror => {
                let twice = index.rem_euclid(2 * size);
                twice.min(2 * size - 1 - twice)
            }
        };
        inside as u32
    }
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
    /// Alpha at or above which a texel is covered, or `None` if alpha is ignored.
    pub fn cutoff(&self) -> Option<f32> {
        (self.alpha_mode != AlphaMode::Opaque).then_some(self.alpha_cutoff)
    }

    /// Alpha of the texture alone, without the colour factor's, at or above which a texel is
    /// covered: [`cutoff`](Self::cutoff) over the alpha of the colour factor, so 0 or more, and
    /// above 1 where no texel is. `None` if alpha is ignored.
    pub fn texture_cutoff(&self) -> Option<f32> {
        self.cutoff().map(|cutoff| cutoff / self.base_color[3].max(f32::MIN_POSITIVE))
    }

    /// Whether nothing is drawn of a surface with this material: it has no texture, and the alpha
    /// of its colour factor is below the cutoff.
    #[cfg(feature = "software")]
    pub(crate) fn is_clear(&self) -> bool {
        self.texture.is_none() && self.cutoff().is_some_and(|cutoff| self.base_color[3] < cutoff)
    }

    /// Whether a texel with this alpha is covered.
    #[cfg(feature = "simplify")]
    pub(crate) fn covers(&self, alpha: u8) -> bool {
        let least = |cutoff: f32| f64::from(cutoff) * 255.0;
        self.cutoff().is_none_or(|cutoff| f64::from(alpha) * f64::from(self.base_color[3]) >= least(cutoff))
    }
}

/// Encoding of a [`Texture`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextureFormat {
    /// PNG.
    Png,
    /// JPEG, which has no alpha.
    Jpeg,
    /// WebP.
    Webp,
}

/// An image, still encoded as in the source file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Name in the source file; may be empty.
    pub name: String,
    /// Encoding of `bytes`.
    pub format: TextureFormat,
    /// The encoded image.
    pub bytes: Vec<u8>,
}

/// A decoded texture: sRGB colour and linear alpha, 8 bits per channel, top row first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

/// Maximum width and height of a texture: the size that every wgpu adapter supports.
pub const MAX_TEXTURE_SIDE: u32 = 8192;
