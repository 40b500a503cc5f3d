//! Trees grown from the numbers of a species: stems, wood, leaves and textures.
//!
//! ```text
//! data/species/*.toml -> Species -> weber_penn (stems) -> tube (wood)
//!                                                      -> leaves (cards) -> Plant -> glb
//!                            paint (leaf and bark textures) -----------------^
//! ```
//!
//! The same species, options and version give the same bytes on every machine.

mod frame;
pub mod glb;
mod leaves;
mod paint;
mod ranges;
mod species;
mod stem;
mod tube;
mod weber_penn;

pub use species::{BarkPattern, BarkStyle, Blade, Crown, LeafStyle, Level, MAX_GROWN_LEAVES, Shape, Species};

use crate::{
    Plant, Result,
    error::check_range,
    material::{AlphaMode, Material, Wrap},
};

/// Materials of a grown plant, and the textures of the same index.
const LEAF: u32 = 0;
const BARK: u32 = 1;

/// What may be asked of growth; the default grows the species as its file says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GrowOptions {
    /// Exact number of leaves, 1 to [`MAX_GROWN_LEAVES`]; the species' own when `None`. Stems stay as they are; cards
    /// shrink with more leaves and grow with fewer, within limits, so that the crown stays as dense.
    pub leaves: Option<u32>,
    /// Another individual of the species; the species' own when `None`.
    pub seed: Option<u64>,
}

/// Grows a tree: leaves of two triangles each, their pivot on the twig, foot at the origin.
///
/// # Errors
/// [`InvalidOption`](Error::InvalidOption) for a leaf count out of range; those of [`Species::validate`];
/// [`TooLarge`](Error::TooLarge) for a species with too many stems.
pub fn grow(species: &Species, options: &GrowOptions) -> Result<Plant> {
    let count = options.leaves.unwrap_or(species.leaves);
    check_range("leaves", count, 1..=MAX_GROWN_LEAVES)?;
    species.validate()?;
    let seed = options.seed.unwrap_or(species.seed);
    let stems = weber_penn::grow_stems(species, seed)?;
    let paint_leaf = || paint::leaf_texture(&species.leaf, seed);
    let (leaf, bark) = rayon::join(paint_leaf, || paint::bark_texture(&species.bark, seed));
    let mut plant = Plant {
        name: species.name.clone(),
        wood: tube::build_wood(species, &stems, BARK),
        materials: vec![leaf_material(), bark_material()],
        textures: vec![leaf?, bark?],
        ..Plant::default()
    };
    leaves::push_leaves(&mut plant, species, &stems, count, seed, LEAF);
    Ok(plant)
}

fn leaf_material() -> Material {
    Material {
        name: "leaves".into(),
        texture: Some(LEAF),
        wrap: [Wrap::Clamp; 2],
        alpha_mode: AlphaMode::Mask,
        alpha_cutoff: 0.5,
        double_sided: true,
        ..Material::default()
    }
}

fn bark_material() -> Material {
    Material { name: "bark".into(), texture: Some(BARK), ..Material::default() }
}
