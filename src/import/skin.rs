//! Skins in their bind pose: each vertex moves with the joints of the node graph that hold it.

use super::{
    Warning, WarningKind,
    accessor::Accessors,
    attributes::{Attributes, is_finite},
    fault::{Fault, limit},
    graph::Graph,
    transform::normal_matrix,
};
use crate::leaf::Vertex;
use ::gltf::json::{Root, mesh::Semantic};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    rc::Rc,
};

/// Maximum number of sets of four joints that hold a vertex.
const MAX_SETS: u64 = 4;
/// Bytes of a file required per joint, besides one joint per node: an inverse bind matrix takes 64,
/// which a few skins may share.
const BYTES_PER_JOINT: u64 = 16;

/// The skins in use, as matrices that move a vertex with each of its joints.
pub(super) struct Skins<'a> {
    root: &'a Root,
    accessors: &'a Accessors<'a>,
    graph: &'a Graph,
    scene_from_node: Option<Vec<DAffine3>>,
    known: BTreeMap<usize, Rc<[DAffine3]>>,
    joints: u64,
}

impl<'a> Skins<'a> {
    pub(super) fn new(root: &'a Root, accessors: &'a Accessors<'a>, graph: &'a Graph) -> Self {
        Self { root, accessors, graph, scene_from_node: None, known: BTreeMap::new(), joints: 0 }
    }

    /// Scene from bind pose, one matrix per joint of skin `index`.
    pub(super) fn matrices(&mut self, index: usize) -> Result<Rc<[DAffine3]>, Fault> {
        if let Entry::Occupied(known) = self.known.entry(index) {
            return Ok(Rc::clone(known.get()));
        }
        let skin =
            self.root.skins.get(index).ok_or_else(|| {
                Fault::broken(format!("skin {index} is referenced and {} exist", self.root.skins.len()))
            })?;
        if skin.joints.is_empty() {
            return Err(Fault::broken(format!("skin {index} has no joints")));
        }
        self.joints += skin.joints.len() as u64;
        let most = self.root.nodes.len() as u64 + self.accessors.total_bytes() / BYTES_PER_JOINT;
        limit("the number of joints for a file of its size", self.joints, most)?;
        let joint_from_mesh = self.inverse_binds(index)?;
        let places = self.scene_from_node.get_or_insert_with(|| self.graph.scene_from_nodes(self.root));
        let mut matrices = Vec::with_capacity(skin.joints.len());
        for (joint, joint_from_mesh) in skin.joints.iter().zip(joint_from_mesh) {
            let [node, nodes] = [joint.value(), places.len()];
            let place = places.get(node).ok_or_else(|| {
                Fault::broken(format!("skin {index} has node {node} as a joint and {nodes} nodes exist"))
            })?;
            matrices.push(*place * joint_from_mesh);
        }
        let matrices: Rc<[DAffine3]> = matrices.into();
        self.known.insert(index, Rc::clone(&matrices));
        Ok(matrices)
    }

    /// The inverse bind matrices of skin `index`; identities if the file has none.
    fn inverse_binds(&self, index: usize) -> Result<Vec<DAffine3>, Fault> {
        let skin = &self.root.skins[index];
        let joints = skin.joints.len();
        let Some(accessor) = skin.inverse_bind_matrices else { return Ok(vec![DAffine3::IDENTITY; joints]) };
        let count = self.accessors.count(accessor)?;
        if count < joints {
            let reason = format!("skin {index} has {joints} joints and {count} inverse bind matrices");
            return Err(Fault::broken(reason));
        }
        let picks: Vec<u32> = (0..joints as u32).collect();
        let values = self.accessors.floats::<16>(accessor, "inverse bind matrices", &picks, 16..=16, [0.0; 16])?;
        if let Some(joint) = values.iter().position(|values| !is_finite(values)) {
            return Err(Fault::broken(format!("skin {index}: the inverse bind matrix of joint {joint} is not finite")));
        }
        Ok(values.into_iter().map(|v| DAffine3::from_mat4(DMat4::from_cols_array(&v.map(f64::from)))).collect())
    }
}

/// Moves the vertices of a primitive, which have the numbers `picks` in the file, into the pose of
/// the `joints`, and turns the triangles that this mirrors.
pub(super) fn apply(
    attributes: &Attributes,
    joints: &[DAffine3],
    picks: &[u32],
    (vertices, indices): (&mut [Vertex], &mut [u32]),
    warnings: &mut Vec<Warning>,
) -> Result<(), Fault> {
    let holds = holds(attributes, picks)?;
    let mut mirrored = vec![false; vertices.len()];
    let mut loose = 0;
    for (i, vertex) in vertices.iter_mut().enumerate() {
        let matrix = blend(&holds, i, joints)?;
        loose += usize::from(matrix.is_none());
        // As elsewhere: what no joint holds moves with the first one.
        let matrix = matrix.unwrap_or(joints[0]);
        mirrored[i] = matrix.matrix3.determinant() < 0.0;
        *vertex = moved(vertex, &matrix);
        if !is_finite(&vertex.position) {
            return Err(Fault::broken(format!("a skin moves vertex {} to {:?}", picks[i], vertex.position)));
        }
    }
    for corners in indices.chunks_exact_mut(3) {
        if corners.iter().all(|&corner| mirrored[corner as usize]) {
            corners.swap(1, 2);
        }
    }
    if loose > 0 {
        let message = format!("{loose} vertices of a skinned mesh have no joint weights and move with its first joint");
        warnings.push(Warning::new(WarningKind::Pose, message, ""));
    }
    Ok(())
}

/// Joints and weights of each vertex, one pair of lists per set.
type Holds = Vec<[Vec<[f32; 4]>; 2]>;

fn holds(attributes: &Attributes, picks: &[u32]) -> Result<Holds, Fault> {
    let has = |set: u32| attributes.index(&Semantic::Joints(set)).is_some();
    let sets = (0..).take_while(|&set| has(set)).count() as u64;
    limit("the number of joint sets", sets, MAX_SETS)?;
    let mut holds = Vec::new();
    for set in 0..sets as u32 {
        let joints = attributes.floats(&Semantic::Joints(set), picks, 4, [0.0; 4])?;
        let weights = attributes.floats(&Semantic::Weights(set), picks, 4, [0.0; 4])?;
        holds.extend(joints.zip(weights).map(|(joints, weights)| [joints, weights]));
    }
    Ok(holds)
}

/// The mean of the joints that hold vertex `i`, by weight; `None` if none does.
fn blend(holds: &Holds, i: usize, joints: &[DAffine3]) -> Result<Option<DAffine3>, Fault> {
    let mut sum = (DMat3::ZERO, DVec3::ZERO);
    let mut total = 0.0;
    for [of_joints, of_weights] in holds {
        for (&joint, &weight) in of_joints[i].iter().zip(&of_weights[i]).filter(|(_, weight)| **weight != 0.0) {
            let matrix = joints.get(joint as usize).ok_or_else(|| {
                Fault::broken(format!("a vertex is held by joint {joint} of a skin with {}", joints.len()))
            })?;
            let weight = f64::from(weight);
            sum = (sum.0 + matrix.matrix3 * weight, sum.1 + matrix.translation * weight);
            total += weight;
        }
    }
    let mean = || DAffine3 { matrix3: sum.0 * (1.0 / total), translation: sum.1 / total };
    Ok((total > 0.0).then(mean))
}

fn moved(vertex: &Vertex, matrix: &DAffine3) -> Vertex {
    let position = matrix.transform_point3(Vec3::from(vertex.position).as_dvec3()).as_vec3().to_array();
    let normal = normal_matrix(&matrix.matrix3) * Vec3::from(vertex.normal).as_dvec3();
    Vertex { position, normal: normal.normalize_or_zero().as_vec3().to_array(), ..*vertex }
}
