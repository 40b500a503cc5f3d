//! Alpha cutoffs: which texels of a material are drawn, and a warning where none is.
//!
//! A masked material has the cutoff of its file. A blended one is cut relative to how opaque it
//! gets at all: at half of its largest alpha, which is that of its texture times that of its colour
//! factor. A material that reaches alpha 1 is thus cut at 0.5.
//!
//! If no texel reaches the cutoff, nothing of the material is drawn, as its file demands: pictures
//! show none of its surface, and for the simplification its leaves cover nothing. That is rarely
//! meant, so there is a warning; also where all of a material shows one hole of its texture.

use super::{Warning, WarningKind, alpha_range::AlphaRange, source::Source, textures};
use crate::material::{AlphaMode, Material};
use std::collections::{BTreeMap, BTreeSet};

/// Cutoff of a material that reaches alpha 1, unless its file specifies another.
const HALF: f32 = 0.5;

/// Alphas below this count as 0: half of the largest is beyond the precision of the drawers.
const FAINTEST: f32 = 1e-6;

/// The cutoff of a blended material whose largest alpha is `largest`.
pub(super) fn relative(largest: f32) -> f32 {
    if largest > FAINTEST { HALF * largest.min(1.0) } else { HALF }
}

/// Sets the cutoffs of all materials, to `wanted` if it is set, and warns of materials in use of
/// which nothing is drawn.
pub(super) fn settle(source: &mut Source, wanted: Option<f32>) {
    let places = places(source);
    let mut at_one_place = Vec::new();
    for (index, material) in source.materials.iter_mut().enumerate() {
        material.base_color[3] = material.base_color[3].max(0.0);
        let largest = largest(material, &source.alpha_ranges);
        material.alpha_cutoff = match (wanted, material.alpha_mode) {
            (Some(wanted), AlphaMode::Mask | AlphaMode::Blend) => wanted,
            (None, AlphaMode::Blend) => relative(largest.alpha),
            (_, AlphaMode::Opaque) | (None, AlphaMode::Mask) => material.alpha_cutoff,
        };
        let Some(place) = places.get(&index) else { continue };
        if !material.covers(largest.texel) {
            source.warnings.push(invisible(material, largest.alpha));
        } else if let (Some(uv), Some(texture), true) = (place, material.texture, material.cutoff().is_some()) {
            at_one_place.push((texture, index, *uv));
        }
    }
    warn_of_holes(source, at_one_place);
}

/// For each material in use, the texture coordinates of all its vertices if they are the same, as
/// they are where the file has none.
fn places(source: &Source) -> BTreeMap<usize, Option<[f32; 2]>> {
    let used: BTreeSet<usize> = source.parts.iter().map(|part| part.mesh).collect();
    let mut places = BTreeMap::new();
    for mesh in used.into_iter().map(|mesh| &source.meshes[mesh]) {
        let Some(first) = mesh.vertices.first().map(|vertex| vertex.uv) else { continue };
        let place = places.entry(mesh.material).or_insert(Some(first));
        if place.is_some_and(|place| mesh.vertices.iter().any(|vertex| vertex.uv != place)) {
            *place = None;
        }
    }
    places
}

/// Warns of materials that show one place of their texture alone, and that place is a hole. Each
/// texture is decoded once.
fn warn_of_holes(source: &mut Source, mut at_one_place: Vec<(u32, usize, [f32; 2])>) {
    at_one_place.sort_by_key(|&(texture, index, _)| (texture, index));
    for of_texture in at_one_place.chunk_by(|a, b| a.0 == b.0) {
        let Ok(pixels) = source.textures[of_texture[0].0 as usize].decode() else { continue };
        for &(_, index, uv) in of_texture {
            let material = &source.materials[index];
            let alpha = textures::alpha(&pixels, material.wrap, uv.into());
            if !material.covers(alpha) {
                source.warnings.push(in_a_hole(material, uv));
            }
        }
    }
}

fn in_a_hole(material: &Material, uv: [f32; 2]) -> Warning {
    let message = format!(
        "material {:?} has no texture coordinates but {uv:?}, where its texture has a hole: nothing of it is drawn",
        material.name
    );
    let fix = "export it with texture coordinates, or set `alpha_cutoff` to 0 to draw it solid";
    Warning::new(WarningKind::Invisible, message, fix)
}

/// The largest alpha of a material, and of its texels.
struct Largest {
    alpha: f32,
    texel: u8,
}

fn largest(material: &Material, ranges: &[AlphaRange]) -> Largest {
    let range = material.texture.and_then(|texture| ranges.get(texture as usize));
    let texel = range.map_or(255, |range| range.most);
    Largest { alpha: f32::from(texel) / 255.0 * material.base_color[3], texel }
}

fn invisible(material: &Material, largest: f32) -> Warning {
    let Material { name, alpha_cutoff, .. } = material;
    let [cutoff, most] = [*alpha_cutoff, largest].map(|alpha| rounded(alpha, 3));
    let message = format!(
        "material {name:?} is cut out at alpha {cutoff} and its largest alpha is {most}: nothing of it is drawn"
    );
    let fix = match largest > FAINTEST {
        true => format!("lower the cutoff in the file, or set `alpha_cutoff` to {}", rounded(relative(largest), 2)),
        false => "give its texture or colour an alpha, or set `alpha_cutoff` to 0 to draw it solid".to_owned(),
    };
    Warning::new(WarningKind::Invisible, message, fix)
}

/// `value` with this number of significant digits.
fn rounded(value: f32, digits: usize) -> f32 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_largest_alpha_is_the_cutoff() {
        assert_eq!([1.0, 0.43, 0.001, 2.0].map(relative), [0.5, 0.215, 0.0005, 0.5]);
        assert_eq!([0.0, -1.0, f32::NAN].map(relative), [0.5; 3]);
    }

    #[test]
    fn numbers_in_messages_are_short() {
        assert_eq!(rounded(100.0 / 255.0, 3).to_string(), "0.392");
        assert_eq!(rounded(1.0, 3).to_string(), "1");
        assert_eq!(rounded(0.000_123_4, 2).to_string(), "0.00012");
    }
}
