//! Procedural trees: stems, wood, leaves and textures grown from the parameters of a species.
//!
//! ```text
//! data/species/*.toml -> Species -> weber_penn (stems) -> tube (wood)
//!                                                      -> leaves (cards) -> Plant
//!                            paint (leaf and bark textures) -----------------^
//! ```
//!
//! The same species, options and version give the same bytes on every machine.

mod frame;
mod leaves;
mod paint;
mod ranges;
mod species;
mod species_file;
mod stem;
mod tube;
mod weber_penn;

pub use species::{BarkPattern, BarkStyle, Blade, Crown, LeafStyle, Level, MAX_GROWN_LEAVES, Shape, Species};

use crate::{
    Plant, Result,
    error::check_range,
    material::{AlphaMode, Material, Wrap},
};

/// Material indices of a grown plant; its textures have the same indices.
const LEAF: u32 = 0;
const BARK: u32 = 1;

/// Options of [`grow`]; the default grows the species as specified in its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GrowOptions {
    /// Exact number of leaves, 1 to [`MAX_GROWN_LEAVES`]; `None` uses the count of the species. The
    /// stems do not depend on it. With more leaves the cards shrink, with fewer they grow, within
    /// limits, so that the density of the crown stays the same.
    pub leaves: Option<u32>,
    /// Seed of the individual; `None` uses the seed of the species.
    pub seed: Option<u64>,
}

/// Grows a tree with its foot at the origin. Leaves are cards of two triangles, each with its pivot
/// on the twig.
///
/// # Errors
/// [`InvalidOption`](crate::Error::InvalidOption) for a leaf count out of range; the errors of
/// [`Species::validate`]; [`TooLarge`](crate::Error::TooLarge) for a species with too many stems.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::cut;

    /// Wood is cut into the stems that it was grown from.
    #[test]
    fn the_stems_of_grown_wood_are_recovered() {
        for name in ["english-oak", "betula-populifolia", "carya-illinoinensis"] {
            let species = Species::embedded(name).unwrap();
            let grown = weber_penn::grow_stems(&species, species.seed).unwrap();
            let found = cut(&tube::build_wood(&species, &grown, BARK)).0.len();
            assert!(found.abs_diff(grown.len()) * 100 <= grown.len(), "{name}: {found} of {}", grown.len());
        }
    }
}
