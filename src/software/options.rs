//! Options of a picture.

use super::toning::Toning;
use crate::draw::{landscape::Landscape, light::Lighting};

/// Background behind the plants.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[expect(clippy::large_enum_variant, reason = "there is one per picture")]
pub enum Background {
    /// A soft gradient from ground to sky.
    #[default]
    Sky,
    /// One sRGB colour.
    Color([u8; 3]),
    /// Sky and ground along each pixel's ray.
    Landscape(Landscape),
    /// No background: alpha is the covered fraction of each pixel.
    Transparent,
}

/// Drawing options of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawOptions {
    /// Background behind the plants.
    pub background: Background,
    /// Whether the trunk and branches are drawn.
    pub wood: bool,
    /// Moves the shaded colours of leaves towards their mean; `None` keeps them.
    pub tone: Option<Toning>,
    /// Sun and sky.
    pub lighting: Lighting,
    /// Whether the full textures are sampled at any distance instead of their mip levels: a
    /// reference, if the picture has many more pixels than it will be shown with.
    pub full_textures: bool,
}

impl Default for DrawOptions {
    fn default() -> Self {
        Self {
            background: Background::Sky,
            wood: true,
            tone: None,
            lighting: Lighting::default(),
            full_textures: false,
        }
    }
}
