//! The node graph of a glTF file: a forest, walked from the roots of its scene.

use super::{
    fault::Fault,
    transform::{NO_ROTATION, affine},
};
use ::gltf::json::{Mesh, Node, Root, mesh::Semantic, validation::Checked};
use glam::{DAffine3, DMat4};

/// A checked node graph.
pub(super) struct Graph {
    parents: Vec<Option<usize>>,
    starts: Vec<usize>,
    /// The nodes of the scene, parents before children.
    order: Vec<usize>,
    /// Number of triangles of each node and all below it, as stated by the file.
    triangles: Vec<u64>,
}

impl Graph {
    /// Checks the graph. Its roots are those of the default scene, else of the first scene, else
    /// all nodes without a parent.
    pub(super) fn new(root: &Root) -> Result<Self, Fault> {
        let parents = parents(root)?;
        let starts = starts(root, &parents)?;
        let order = order(root, &starts);
        let mut triangles = vec![0; root.nodes.len()];
        for &node in order.iter().rev() {
            let mesh = root.nodes[node].mesh.and_then(|mesh| root.meshes.get(mesh.value()));
            let own = mesh.map_or(0, |mesh| stated_triangles(root, mesh));
            let of_children = root.nodes[node].children.iter().flatten().map(|child| triangles[child.value()]);
            triangles[node] = of_children.fold(own, u64::saturating_add);
        }
        Ok(Self { parents, starts, order, triangles })
    }

    /// The roots of the scene.
    pub(super) fn starts(&self) -> &[usize] {
        &self.starts
    }

    /// The nodes of the scene, parents before children.
    pub(super) fn order(&self) -> impl Iterator<Item = usize> {
        self.order.iter().copied()
    }

    /// The parent of a node.
    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.parents[node]
    }

    /// Number of triangles of a node and all below it, as stated by the file.
    pub(super) fn triangles(&self, node: usize) -> u64 {
        self.triangles[node]
    }

    /// Scene from node, for every node of the file.
    pub(super) fn scene_from_nodes(&self, root: &Root) -> Vec<DAffine3> {
        let all_roots: Vec<usize> = (0..root.nodes.len()).filter(|&node| self.parents[node].is_none()).collect();
        let mut places = vec![DAffine3::IDENTITY; root.nodes.len()];
        for node in order(root, &all_roots) {
            let above = self.parents[node].map_or(DAffine3::IDENTITY, |parent| places[parent]);
            places[node] = above * parent_from_node(&root.nodes[node]);
        }
        places
    }
}

fn stated_triangles(root: &Root, mesh: &Mesh) -> u64 {
    let corners = mesh.primitives.iter().map(|primitive| {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let accessor = primitive.indices.or(positions.copied()).and_then(|index| root.accessors.get(index.value()));
        accessor.map_or(0, |accessor| accessor.count.0)
    });
    corners.fold(0, u64::saturating_add).div_ceil(3)
}

/// The nodes below `starts`, parents before children, each once.
fn order(root: &Root, starts: &[usize]) -> Vec<usize> {
    let mut order = Vec::new();
    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<usize> = starts.iter().rev().copied().collect();
    while let Some(node) = stack.pop() {
        if !std::mem::replace(&mut visited[node], true) {
            order.push(node);
            stack.extend(root.nodes[node].children.iter().flatten().rev().map(|child| child.value()));
        }
    }
    order
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

/// Parent from node.
pub(super) fn parent_from_node(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let rotation = node.rotation.map_or(NO_ROTATION, |rotation| rotation.0);
    affine(node.translation.unwrap_or([0.0; 3]), rotation, node.scale.unwrap_or([1.0; 3]))
}
