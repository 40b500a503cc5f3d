//! Ground below a plant: left out, because a model of a plant is drawn on other ground.

use super::{
    Warning, WarningKind,
    named::{self, Named},
    pieces::pieces,
    source::{Part, Source, around, listed},
};
use crate::material::AlphaMode;
use glam::DVec3;

/// Maximum height of ground, as a fraction of its width.
const FLAT: f64 = 0.1;
/// Maximum height of ground above the lowest root, as a fraction of the height of the plant. Roots
/// reach below the ground by up to a fifth in the trees measured.
const LOW: f64 = 0.3;
/// Maximum number of pieces of ground: the leaves of a water plant are more.
const MAX_PIECES: usize = 4;
/// Maximum number of flat parts that are looked at.
const MAX_GROUNDS: usize = 16;
/// Minimum width of ground with a telling name, as a fraction of the width of the plant. Other
/// ground is wider than the plant.
const NAMED_WIDTH: f64 = 0.5;
/// Words in the name of a node, mesh or material of ground.
const NAMES: [&str; 4] = ["floor", "ground", "soil", "terrain"];

/// Leaves out every part that is certainly ground, unless `leaves` names it, and not only a node
/// above it; returns a warning if there is any.
pub(super) fn leave_out(source: &mut Source, leaves: &[String]) -> Option<Warning> {
    let bounds = source.boxes();
    let named = named::parts(source, leaves);
    let is_named = |part: usize| matches!(named[part], Some(Named::Material | Named::Node));
    let candidates = (0..source.parts.len()).filter(|&part| is_flat(source, part, bounds[part])).take(MAX_GROUNDS);
    let mut is_ground = vec![false; source.parts.len()];
    for part in candidates {
        is_ground[part] = is_below(source, part, &bounds) && !is_named(part);
    }
    let grounds = source.parts.iter().zip(&is_ground).filter(|(_, is_ground)| **is_ground);
    let names: Vec<&str> = grounds.map(|(part, _)| source.part_name(part)).collect();
    if names.is_empty() || names.len() == source.parts.len() {
        return None;
    }
    let message = format!("ground below the plant is left out: {}", listed(&names));
    source.keep_parts(|part| !is_ground[part]);
    Some(Warning::new(WarningKind::LeftOut, message, "to keep everything, use `plant` '*'"))
}

/// Whether a part is opaque, flat and horizontal.
fn is_flat(source: &Source, part: usize, bounds: Option<[DVec3; 2]>) -> bool {
    let is_opaque = source.stated_alpha[source.meshes[source.parts[part].mesh].material] == AlphaMode::Opaque;
    let is_flat = |[low, high]: [DVec3; 2]| {
        let size = high - low;
        let wide = size.x.max(size.z);
        size.y <= wide * FLAT && size.x.min(size.z) * 2.0 >= wide
    };
    is_opaque && bounds.is_some_and(is_flat)
}

/// Whether a flat part lies below all others and is as wide as they are.
fn is_below(source: &Source, index: usize, bounds: &[Option<[DVec3; 2]>]) -> bool {
    let part = &source.parts[index];
    let mesh = &source.meshes[part.mesh];
    let others = bounds.iter().enumerate().filter(|(other, _)| *other != index);
    let rest = others.filter_map(|(_, bounds)| *bounds).reduce(around);
    let (Some([low, high]), Some([rest_low, rest_high])) = (bounds[index], rest) else { return false };
    let [size, rest] = [high - low, rest_high - rest_low];
    let width = if has_telling_name(source, part) { NAMED_WIDTH } else { 1.0 };
    let is_wide = size.x >= rest.x * width && size.z >= rest.z * width;
    let is_low = rest.y > size.y && low.midpoint(high).y <= rest_low.y + rest.y * LOW;
    is_wide && is_low && part.places.len() * pieces(&mesh.vertices, &mesh.indices).len() <= MAX_PIECES
}

fn has_telling_name(source: &Source, part: &Part) -> bool {
    let tells = |name: &str| NAMES.iter().any(|word| name.to_lowercase().contains(word));
    source.names(part).into_iter().any(tells)
}
