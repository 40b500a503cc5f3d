//! Where each mesh of a glTF file is placed, and which of its nodes are drawn.

use super::{
    Warning,
    accessor::Accessors,
    fault::{Fault, limit},
    graph::{Graph, parent_from_node},
    instancing,
    left_out::{LeftOut, children, name_of},
    roles::Role,
    source::{self, name},
};
use ::gltf::json::{Node, Root};
use glam::DAffine3;
use std::{ops::Range, rc::Rc};

/// Bytes of a file required per instance, besides one instance per node: a translation takes 12
/// bytes, which a few nodes may share. The limit keeps a small file from using a lot of memory.
const BYTES_PER_INSTANCE: u64 = 2;
/// Name of a plant that stands for everything in the file.
pub(super) const EVERYTHING: &str = "*";

/// A mesh as placed by a node.
pub(super) struct PlacedMesh {
    /// Name of the node; may be empty.
    pub(super) name: String,
    /// Index into the file's nodes.
    pub(super) node: usize,
    /// Shape of the mesh.
    pub(super) shape: Shape,
    /// Scene from mesh, one per instance. Skins place their meshes themselves.
    pub(super) places: Rc<[DAffine3]>,
}

/// A mesh in its rest pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Shape {
    /// Index into the file's meshes.
    pub(super) mesh: usize,
    /// Index into the file's skins.
    pub(super) skin: Option<usize>,
    /// The node whose morph weights replace those of the mesh.
    pub(super) weights_of: Option<usize>,
}

impl Shape {
    fn of(node: &Node, index: usize) -> Option<Self> {
        let weights_of = node.weights.as_ref().filter(|weights| !weights.is_empty()).map(|_| index);
        Some(Self { mesh: node.mesh?.value(), skin: node.skin.map(|skin| skin.value()), weights_of })
    }
}

/// The meshes of a scene.
#[derive(Default)]
pub(super) struct Placed {
    /// Meshes in scene order: parents before children, and children in order.
    pub(super) meshes: Vec<PlacedMesh>,
    /// Subtrees that may be whole plants, with their meshes.
    pub(super) plants: Vec<(String, Range<usize>)>,
    /// Anything left out.
    pub(super) warnings: Vec<Warning>,
}

/// The meshes of the scene, or those of the node named `plant` and below it.
pub(super) fn placed_meshes(
    root: &Root,
    graph: &Graph,
    accessors: &Accessors,
    plant: Option<&str>,
) -> Result<Placed, Fault> {
    let left_out = if plant == Some(EVERYTHING) { LeftOut::nothing(root) } else { LeftOut::of(root, graph) };
    let candidates = candidates(root, graph, &left_out);
    let chosen = chosen(root, graph, &left_out, plant);
    if let (Some(plant), Some([])) = (plant, chosen.as_deref()) {
        let known = candidates.iter().map(|&node| name_of(root, node).to_owned()).collect();
        return Err(Fault::UnknownPlant { name: plant.to_owned(), known });
    }
    let mut walk = Walk {
        root,
        graph,
        accessors,
        left_out,
        chosen,
        stack: graph.starts().iter().rev().map(|&index| (index, DAffine3::IDENTITY, false)).collect(),
        first_mesh: vec![0; root.nodes.len()],
        instances: 0,
        placed: Placed::default(),
    };
    walk.run()?;
    if plant.is_none() {
        walk.note_plants(&candidates);
    }
    walk.placed.warnings.extend(walk.left_out.warnings());
    Ok(walk.placed)
}

/// Names and parents of all nodes.
pub(super) fn tree(root: &Root, graph: &Graph) -> Vec<source::Node> {
    let node =
        |(index, node): (usize, &Node)| source::Node { name: name(node.name.as_deref()), parent: graph.parent(index) };
    root.nodes.iter().enumerate().map(node).collect()
}

/// A walk through the nodes of a scene.
struct Walk<'a> {
    root: &'a Root,
    graph: &'a Graph,
    accessors: &'a Accessors<'a>,
    left_out: LeftOut,
    /// Nodes to be drawn with all below them, ascending; `None` for all.
    chosen: Option<Vec<usize>>,
    /// Nodes to visit, each with scene from parent, and whether it is below a chosen one.
    stack: Vec<(usize, DAffine3, bool)>,
    /// Number of meshes placed before each node.
    first_mesh: Vec<usize>,
    instances: u64,
    placed: Placed,
}

impl Walk<'_> {
    fn run(&mut self) -> Result<(), Fault> {
        let mut visited = vec![false; self.root.nodes.len()];
        while let Some((index, scene_from_parent, is_inside)) = self.stack.pop() {
            if std::mem::replace(&mut visited[index], true) {
                continue;
            }
            let is_chosen = self.chosen.as_ref().is_some_and(|chosen| chosen.binary_search(&index).is_ok());
            let is_inside = is_inside || self.chosen.is_none();
            if is_inside && !is_chosen && self.left_out.has(index) {
                self.left_out.note(self.root, self.graph, index);
                continue;
            }
            self.first_mesh[index] = self.placed.meshes.len();
            self.visit(index, scene_from_parent, is_inside || is_chosen)?;
        }
        if self.placed.meshes.is_empty() && self.left_out.hides() {
            let reason = "KHR_node_visibility hides everything in it".to_owned();
            return Err(Fault::Broken { reason, fix: "name the node to be shown in `plant`" });
        }
        Ok(())
    }

    /// Notes the meshes of each subtree that may be a plant.
    fn note_plants(&mut self, candidates: &[usize]) {
        let first = |node: usize| self.first_mesh[node];
        let ends = candidates.iter().skip(1).map(|&node| first(node)).chain([self.placed.meshes.len()]);
        let plant =
            |(&node, end): (&usize, usize)| (name_of(self.root, node).to_owned(), first(node)..end.max(first(node)));
        self.placed.plants = candidates.iter().zip(ends).map(plant).collect();
    }

    fn visit(&mut self, index: usize, scene_from_parent: DAffine3, is_drawn: bool) -> Result<(), Fault> {
        let node = &self.root.nodes[index];
        let scene_from_node = scene_from_parent * parent_from_node(node);
        if let Some(shape) = Shape::of(node, index).filter(|_| is_drawn) {
            self.place(index, shape, scene_from_node)?;
        }
        self.stack.extend(children(node).rev().map(|child| (child, scene_from_node, is_drawn)));
        Ok(())
    }

    fn place(&mut self, index: usize, shape: Shape, scene_from_node: DAffine3) -> Result<(), Fault> {
        let node = &self.root.nodes[index];
        let most_instances = self.accessors.total_bytes() / BYTES_PER_INSTANCE + self.root.nodes.len() as u64;
        let places: Rc<[DAffine3]> = match instancing::places(node, self.accessors, most_instances - self.instances)? {
            _ if shape.skin.is_some() => [DAffine3::IDENTITY].into(),
            Some(places) => places.into_iter().map(|place| scene_from_node * place).collect(),
            None => [scene_from_node].into(),
        };
        self.instances += places.len() as u64;
        limit("the number of instances for a file of its size", self.instances, most_instances)?;
        self.placed.meshes.push(PlacedMesh { name: name(node.name.as_deref()), node: index, shape, places });
        Ok(())
    }
}

/// The nodes below the first fork of the scene, which may each be a plant.
fn candidates(root: &Root, graph: &Graph, left_out: &LeftOut) -> Vec<usize> {
    let draws = |node: &usize| graph.triangles(*node) > 0 && !left_out.has(*node);
    let mut candidates: Vec<usize> = graph.starts().iter().copied().filter(draws).collect();
    while let [only] = candidates[..]
        && root.nodes[only].mesh.is_none()
    {
        candidates = children(&root.nodes[only]).filter(draws).collect();
    }
    candidates
}

/// The nodes named `plant`, ascending; else those whose name is `plant` and a level of detail.
/// `None` without a name, or if it stands for everything.
fn chosen(root: &Root, graph: &Graph, left_out: &LeftOut, plant: Option<&str>) -> Option<Vec<usize>> {
    let plant = plant.filter(|plant| *plant != EVERYTHING)?;
    let draws = |node: &usize| graph.triangles(*node) > 0;
    let named = |node: &usize| name_of(root, *node) == plant;
    let mut chosen: Vec<usize> = graph.order().filter(draws).filter(named).collect();
    if chosen.is_empty() {
        let base = Role::of(plant).base;
        let is_level = |node: &usize| {
            let role = Role::of(name_of(root, *node));
            role.level.is_some() && role.base == base && !left_out.has(*node)
        };
        chosen = graph.order().filter(draws).filter(is_level).collect();
    }
    chosen.sort_unstable();
    Some(chosen)
}
