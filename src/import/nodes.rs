//! The node graph of a glTF file: where each mesh is placed.

use super::{
    accessor::Accessors,
    fault::{Fault, limit},
    instancing,
    source::name,
    transform::{NO_ROTATION, affine},
};
use ::gltf::json::{Node, Root};
use glam::{DAffine3, DMat4};
use std::rc::Rc;

/// Bytes of a file required per instance, besides one instance per node: a translation takes 12
/// bytes, which a few nodes may share. The limit keeps a small file from using a lot of memory.
const BYTES_PER_INSTANCE: u64 = 2;

/// A mesh as placed by a node.
pub(super) struct PlacedMesh {
    /// Name of the node; may be empty.
    pub(super) name: String,
    /// Index into the file's meshes.
    pub(super) mesh: usize,
    /// Scene from mesh, one per instance.
    pub(super) places: Rc<[DAffine3]>,
}

/// The meshes of the default scene, else of the first scene, else of all root nodes. Parents come
/// before children, and children are in order.
pub(super) fn placed_meshes(root: &Root, accessors: &Accessors) -> Result<Vec<PlacedMesh>, Fault> {
    let most_instances = accessors.total_bytes() / BYTES_PER_INSTANCE + root.nodes.len() as u64;
    let parents = parents(root)?;
    let mut stack: Vec<(usize, DAffine3)> =
        starts(root, &parents)?.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    let mut visited = vec![false; root.nodes.len()];
    let mut placed = Vec::new();
    let mut instances = 0;
    while let Some((index, scene_from_parent)) = stack.pop() {
        if std::mem::replace(&mut visited[index], true) {
            continue;
        }
        let node = &root.nodes[index];
        let scene_from_node = scene_from_parent * parent_from_node(node);
        if let Some(mesh) = node.mesh {
            let places: Rc<[DAffine3]> = match instancing::places(node, accessors, most_instances - instances)? {
                Some(places) => places.into_iter().map(|place| scene_from_node * place).collect(),
                None => [scene_from_node].into(),
            };
            instances += places.len() as u64;
            limit("the number of instances for a file of its size", instances, most_instances)?;
            placed.push(PlacedMesh { name: name(node.name.as_deref()), mesh: mesh.value(), places });
        }
        stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), scene_from_node)));
    }
    Ok(placed)
}

/// The parent of each node. Fails unless the graph is a forest: one parent each, no cycle.
fn parents(root: &Root) -> Result<Vec<Option<usize>>, Fault> {
    let mut parents = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten() {
            let child = child.value();
            let slot = parents.get_mut(child).ok_or_else(|| missing_node(child, root))?;
            if let Some(first) = slot.replace(parent) {
                return Err(Fault::broken(format!("node {child} is a child of node {first} and of node {parent}")));
            }
        }
    }
    // Each node has at most one parent, so a walk up from a node ends at a root or enters a cycle.
    let mut known_to_end = vec![false; parents.len()];
    for start in 0..parents.len() {
        let mut walked = Vec::new();
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| !known_to_end[node]) {
            if walked.len() > parents.len() {
                return Err(Fault::broken(format!("node {node} is its own ancestor")));
            }
            walked.push(node);
            at = parents[node];
        }
        walked.into_iter().for_each(|node| known_to_end[node] = true);
    }
    Ok(parents)
}

fn starts(root: &Root, parents: &[Option<usize>]) -> Result<Vec<usize>, Fault> {
    let default = root.scene.map_or(0, |scene| scene.value());
    let nodes = match root.scenes.get(default) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => (0..root.nodes.len()).filter(|&node| parents[node].is_none()).collect::<Vec<_>>(),
    };
    match nodes.iter().find(|&&node| node >= root.nodes.len()) {
        Some(&node) => Err(missing_node(node, root)),
        None => Ok(nodes),
    }
}

fn missing_node(node: usize, root: &Root) -> Fault {
    Fault::broken(format!("node {node} is referenced and {} exist", root.nodes.len()))
}

fn parent_from_node(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let rotation = node.rotation.map_or(NO_ROTATION, |rotation| rotation.0);
    affine(node.translation.unwrap_or([0.0; 3]), rotation, node.scale.unwrap_or([1.0; 3]))
}
