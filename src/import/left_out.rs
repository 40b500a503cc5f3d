//! Nodes of a glTF file that are not to be drawn.

use super::{
    Warning, WarningKind,
    graph::Graph,
    roles::{Cause, Role, causes},
    source::{listed, truncated},
};
use ::gltf::json::{Node, Root};

/// Why each node is left out, with all below it; `None` for one that is drawn.
pub(super) struct LeftOut {
    causes: Vec<Option<Cause>>,
    found: Vec<(Cause, String)>,
}

impl LeftOut {
    /// Leaves out nothing.
    pub(super) fn nothing(root: &Root) -> Self {
        Self { causes: vec![None; root.nodes.len()], found: Vec::new() }
    }

    /// Leaves out hidden nodes and, unless nothing else is in the file, coarser levels, billboards
    /// and collision shapes.
    pub(super) fn of(root: &Root, graph: &Graph) -> Self {
        let mut left_out = Self::nothing(root);
        let hidden = graph.order().filter(|&node| is_hidden(&root.nodes[node]));
        hidden.for_each(|node| left_out.causes[node] = Some(Cause::Hidden));
        left_out.mark_siblings(root, graph, graph.starts());
        for node in graph.order() {
            let children: Vec<usize> = children(&root.nodes[node]).collect();
            left_out.mark_siblings(root, graph, &children);
            left_out.mark_alternatives(&root.nodes[node]);
        }
        if !left_out.draws_anything(root, graph) {
            left_out.causes.iter_mut().filter(|cause| **cause != Some(Cause::Hidden)).for_each(|cause| *cause = None);
        }
        left_out
    }

    fn mark_siblings(&mut self, root: &Root, graph: &Graph, siblings: &[usize]) {
        let is_drawn = |node: &usize| graph.triangles(*node) > 0 && self.causes[*node].is_none();
        let drawing: Vec<usize> = siblings.iter().copied().filter(is_drawn).collect();
        let roles: Vec<(Role, u64)> =
            drawing.iter().map(|&node| (Role::of(name_of(root, node)), graph.triangles(node))).collect();
        for (node, cause) in drawing.into_iter().zip(causes(&roles)) {
            self.causes[node] = cause;
        }
    }

    /// Marks the coarser levels that `MSFT_lod` lists, which some files also place in the scene.
    fn mark_alternatives(&mut self, node: &Node) {
        let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get("MSFT_lod"));
        let ids = extension.and_then(|extension| extension.get("ids")?.as_array());
        for id in ids.into_iter().flatten().filter_map(|id| id.as_u64()) {
            if let Some(cause) = usize::try_from(id).ok().and_then(|id| self.causes.get_mut(id)) {
                *cause = Some(Cause::Coarse);
            }
        }
    }

    fn draws_anything(&self, root: &Root, graph: &Graph) -> bool {
        let mut hidden_above = vec![false; root.nodes.len()];
        graph.order().any(|node| {
            let is_out = self.causes[node].is_some() || graph.parent(node).is_some_and(|parent| hidden_above[parent]);
            hidden_above[node] = is_out;
            !is_out && root.nodes[node].mesh.is_some()
        })
    }

    /// Whether `node` is left out.
    pub(super) fn has(&self, node: usize) -> bool {
        self.causes[node].is_some()
    }

    /// Notes that `node` has been left out, for the warnings.
    pub(super) fn note(&mut self, root: &Root, graph: &Graph, node: usize) {
        if let Some(cause) = self.causes[node].filter(|_| graph.triangles(node) > 0) {
            self.found.push((cause, name_of(root, node).to_owned()));
        }
    }

    /// Whether the file hides any node that draws something.
    pub(super) fn hides(&self) -> bool {
        self.found.iter().any(|(cause, _)| *cause == Cause::Hidden)
    }

    /// A warning for each cause.
    pub(super) fn warnings(&self) -> impl Iterator<Item = Warning> {
        warnings(&self.found).into_iter()
    }
}

/// A warning for each cause in `found`, which lists the names.
pub(super) fn warnings(found: &[(Cause, String)]) -> Vec<Warning> {
    let kinds = [
        (Cause::Coarse, "coarser levels of detail or billboards are left out"),
        (Cause::Collision, "collision shapes are left out"),
        (Cause::Hidden, "nodes that KHR_node_visibility hides are left out"),
    ];
    let of = |(cause, what): (Cause, &str)| {
        let names: Vec<&str> = found.iter().filter(|(other, _)| *other == cause).map(|(_, name)| &**name).collect();
        let message = format!("{what}: {}", listed(&names));
        let fix = "to have one of them instead, name it in `plant`";
        (!names.is_empty()).then(|| Warning::new(WarningKind::LeftOut, message, fix))
    };
    kinds.into_iter().filter_map(of).collect()
}

/// Name of a node, else of its mesh, truncated if it is too long.
pub(super) fn name_of(root: &Root, node: usize) -> &str {
    let node = &root.nodes[node];
    let given = node.name.as_deref().filter(|name| !name.is_empty());
    let mesh = || root.meshes.get(node.mesh?.value())?.name.as_deref();
    truncated(given.or_else(mesh).unwrap_or_default())
}

/// The children of a node.
pub(super) fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(|child| child.value())
}

fn is_hidden(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get("KHR_node_visibility"));
    extension.and_then(|extension| extension.get("visible")?.as_bool()) == Some(false)
}
