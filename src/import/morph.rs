//! Morph targets at the default weights of their node or mesh.

use super::{accessor::Accessors, attributes::is_finite, fault::Fault};
use crate::leaf::Vertex;
use ::gltf::json::{Accessor, Index, mesh::Primitive};
use glam::Vec3;

/// Adds the targets of a primitive, times their `weights`, to its vertices, which have the numbers
/// `picks` in the file. Missing weights are zero.
pub(super) fn apply(
    accessors: &Accessors,
    primitive: &Primitive,
    weights: &[f32],
    picks: &[u32],
    vertices: &mut [Vertex],
) -> Result<(), Fault> {
    let targets = primitive.targets.as_deref().unwrap_or_default();
    if let Some(weight) = weights.iter().find(|weight| !weight.is_finite()) {
        return Err(Fault::broken(format!("a morph weight is {weight}")));
    }
    if weights.iter().skip(targets.len()).any(|&weight| weight != 0.0) {
        let [weights, targets] = [weights.len(), targets.len()];
        return Err(Fault::broken(format!("{weights} morph weights are given for {targets} targets")));
    }
    for (target, &weight) in targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let moves = differences(accessors, target.positions, picks)?;
        moves.iter().zip(&mut *vertices).for_each(|(by, vertex)| add(&mut vertex.position, *by, weight));
        let turns = differences(accessors, target.normals, picks)?;
        turns.iter().zip(&mut *vertices).for_each(|(by, vertex)| add(&mut vertex.normal, *by, weight));
    }
    let is_sound = |vertex: &Vertex| is_finite(&vertex.position) && is_finite(&vertex.normal);
    match vertices.iter().position(|vertex| !is_sound(vertex)) {
        Some(i) => Err(Fault::broken(format!("morph targets move vertex {} to {:?}", picks[i], vertices[i].position))),
        None => Ok(()),
    }
}

fn differences(accessors: &Accessors, index: Option<Index<Accessor>>, picks: &[u32]) -> Result<Vec<[f32; 3]>, Fault> {
    index.map_or(Ok(Vec::new()), |index| accessors.floats(index, "morph target", picks, 3..=3, [0.0; 3]))
}

fn add(to: &mut [f32; 3], by: [f32; 3], weight: f32) {
    *to = (Vec3::from(*to) + Vec3::from(by) * weight).to_array();
}
