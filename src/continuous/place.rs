//! Nodes: which primitives are in the scene, and where.

use super::{
    damaged,
    file::{File, Node, Primitive},
};
use crate::{Error, Result};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

/// Difference from 1 of the squared length of normals that are unit vectors.
const UNIT_TOLERANCE: f64 = 1e-5;

/// The scene's space from a node's.
#[derive(Clone, Copy)]
pub(super) struct Place {
    scene_from_node: DAffine3,
    /// For normals.
    cofactors: DMat3,
}

impl Place {
    fn new(scene_from_node: DAffine3) -> Result<Self> {
        let linear = scene_from_node.matrix3;
        let volume = linear.determinant();
        if !(volume > 0.0 && volume.is_finite() && scene_from_node.translation.is_finite()) {
            let reason = "a node with a mesh is mirrored, flat or beyond all numbers";
            return Err(Error::unreadable("model", reason, "apply its transform, or export the model again"));
        }
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = linear;
        Ok(Self { scene_from_node, cofactors: DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) })
    }

    pub(super) fn point(&self, point: [f32; 3]) -> [f32; 3] {
        self.scene_from_node.transform_point3(DVec3::from_array(point.map(f64::from))).as_vec3().to_array()
    }

    /// The normal as a unit vector; upwards if it has no length.
    pub(super) fn normal(&self, normal: [f32; 3]) -> [f32; 3] {
        let turned = self.cofactors * DVec3::from_array(normal.map(f64::from));
        let is_unit = (turned.length_squared() - 1.0).abs() < UNIT_TOLERANCE;
        let unit = if is_unit { turned } else { turned.normalize_or(DVec3::Y) };
        unit.as_vec3().to_array()
    }
}

/// All primitives of the scene.
pub(super) fn primitives<'a>(file: &'a File<'_>) -> Result<Vec<(&'a Primitive, Place)>> {
    let nodes = &file.json.nodes;
    // Once each: neither circles nor copies of copies.
    let mut is_placed = vec![false; nodes.len()];
    let mut is_shown = vec![false; file.json.meshes.len()];
    let mut open: Vec<(usize, DAffine3)> = file.roots().iter().rev().map(|&root| (root, DAffine3::IDENTITY)).collect();
    let mut found = Vec::new();
    while let Some((number, scene_from_parent)) = open.pop() {
        let node = nodes.get(number).ok_or_else(|| damaged(format!("there is no node {number}")))?;
        if std::mem::replace(&mut is_placed[number], true) {
            return Err(damaged(format!("node {number} is in several places")));
        }
        let scene_from_node = scene_from_parent * local(node);
        if let Some(number) = node.mesh {
            let place = Place::new(scene_from_node)?;
            let mesh = file.json.meshes.get(number).ok_or_else(|| damaged(format!("there is no mesh {number}")))?;
            if std::mem::replace(&mut is_shown[number], true) {
                return Err(damaged(format!("mesh {number} is in several places")));
            }
            for primitive in &mesh.primitives {
                primitive.check()?;
                found.push((primitive, place));
            }
        }
        open.extend(node.children.iter().rev().map(|&child| (child, scene_from_node)));
    }
    Ok(found)
}

fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    let quaternion = node.rotation.as_deref().map_or(DQuat::IDENTITY, |&rotation| DQuat::from_array(rotation));
    let quaternion = if quaternion.length_squared() > 0.0 { quaternion.normalize() } else { DQuat::IDENTITY };
    let vector = |told: &Option<Box<[f64; 3]>>, otherwise: DVec3| told.as_deref().map_or(otherwise, |&v| v.into());
    let [scale, translation] = [vector(&node.scale, DVec3::ONE), vector(&node.translation, DVec3::ZERO)];
    DAffine3::from_scale_rotation_translation(scale, quaternion, translation)
}
