//! Wood: every stem as a tapered tube of bark.
//!
//! A stem's tube starts on the axis of its parent, inside the parent's tube, so that no gap shows; an arm above a fork
//! starts on the fork's own ring. Tips are closed by a cone. The trunk's foot gets rings of its own for the flare and the
//! lobes (Weber & Penn 1995, section 4.4).

use super::{
    frame::sin_cos,
    species::Species,
    stem::{Node, Stem},
    weber_penn::flare,
};
use crate::{leaf::Vertex, plant::Wood};
use glam::Vec3;
use std::f32::consts::TAU;

/// Heights of the trunk's extra rings over its length; the flare (100^(1 - 8 t)) needs them.
const FOOT_RINGS: [f32; 5] = [0.008, 0.02, 0.04, 0.07, 0.12];
/// Lobes fade from the foot to this fraction of the trunk.
const LOBE_HEIGHT: f32 = 0.35;

/// Appends the tubes of all stems as one part of material `material`.
pub(super) fn build_wood(species: &Species, stems: &[Stem], material: u32) -> Wood {
    let mut wood = Wood::default();
    for stem in stems {
        push_tube(&mut wood, species, stem);
    }
    let indices = [0, wood.indices.len() as u32];
    wood.parts.push(crate::plant::WoodPart { indices, material });
    wood
}

fn push_tube(wood: &mut Wood, species: &Species, stem: &Stem) {
    let rings = rings(species, stem);
    let sides = species.levels[stem.level].sides;
    let repeats = (TAU * rings[0].radius / species.bark.size_m).round().max(1.0);
    let first_vertex = wood.vertices.len() as u32;
    let tip = rings.len() - 1;
    for (i, ring) in rings[..tip].iter().enumerate() {
        let slope = (ring.radius - rings[i + 1].radius) / ring.position.distance(rings[i + 1].position).max(1e-6);
        for side in 0..=sides {
            wood.vertices.push(ring_vertex(species, stem, ring, side as f32 / sides as f32, repeats, slope));
        }
    }
    for side in 0..sides {
        wood.vertices.push(tip_vertex(species, stem, &rings[tip], (side as f32 + 0.5) / sides as f32, repeats));
    }
    push_indices(&mut wood.indices, first_vertex, tip as u32, sides);
}

/// The nodes of the tube; a trunk gets [`FOOT_RINGS`] and its flare.
fn rings(species: &Species, stem: &Stem) -> Vec<Node> {
    let mut rings = stem.nodes.clone();
    if stem.level == 0 {
        if stem.foot().t == 0.0 {
            rings.extend(FOOT_RINGS.iter().map(|&t| stem.at(t)));
            rings.sort_by(|a, b| a.t.total_cmp(&b.t));
            rings.dedup_by(|a, b| a.t == b.t);
        }
        for ring in &mut rings {
            ring.radius *= flare(&species.crown, ring.t);
        }
    }
    rings
}

/// Vertex of a ring at `around` (0 to 1). The first and last share their place but not their texture coordinate.
fn ring_vertex(species: &Species, stem: &Stem, ring: &Node, around: f32, repeats: f32, slope: f32) -> Vertex {
    let outward = outward(ring, around);
    let lobe = if stem.level == 0 { lobe(species, ring.t, around) } else { 1.0 };
    let position = ring.position + outward * ring.radius * lobe;
    let normal = (outward + ring.frame.heading * slope).normalize();
    vertex(species, stem, ring, position, normal, around * repeats)
}

fn tip_vertex(species: &Species, stem: &Stem, tip: &Node, around: f32, repeats: f32) -> Vertex {
    let normal = (outward(tip, around) + tip.frame.heading).normalize();
    vertex(species, stem, tip, tip.position, normal, around * repeats)
}

fn vertex(species: &Species, stem: &Stem, ring: &Node, position: Vec3, normal: Vec3, u: f32) -> Vertex {
    let bark = &species.bark;
    let barkness = ((ring.radius / bark.twig_radius_m - 1.0) / 2.0).clamp(0.0, 1.0);
    let tint = bark.twig_tint.map(super::paint::linear);
    let color = tint.map(|twig| twig + (1.0 - twig) * barkness);
    Vertex {
        position: position.to_array(),
        normal: normal.to_array(),
        uv: [u, -ring.t * stem.length / bark.size_m],
        color: [color[0], color[1], color[2], 1.0],
    }
}

/// Unit vector from the axis, `around` of a full turn from the frame's side.
fn outward(ring: &Node, around: f32) -> Vec3 {
    let (sin, cos) = if around == 1.0 { (0.0, 1.0) } else { sin_cos(TAU * around) };
    ring.frame.side * cos + ring.frame.heading.cross(ring.frame.side) * sin
}

fn lobe(species: &Species, t: f32, around: f32) -> f32 {
    let crown = &species.crown;
    let fade = (1.0 - t / LOBE_HEIGHT).max(0.0);
    1.0 + crown.lobe_depth * fade * sin_cos(TAU * around * crown.lobes as f32).0
}

/// Two triangles per side between rings, one per side at the tip.
fn push_indices(indices: &mut Vec<u32>, first: u32, rings: u32, sides: u32) {
    let stride = sides + 1;
    for ring in 0..rings - 1 {
        for side in 0..sides {
            let low = first + ring * stride + side;
            let high = low + stride;
            indices.extend([low, low + 1, high + 1, low, high + 1, high]);
        }
    }
    let last_ring = first + (rings - 1) * stride;
    let tip = first + rings * stride;
    for side in 0..sides {
        indices.extend([last_ring + side, last_ring + side + 1, tip + side]);
    }
}
