//! Leaf pass and wood pass: pipelines that draw many plants of one model, each at its own active
//! count.
//!
//! A plant's prefix is cut into runs of [`RUN_QUADS`](crate::draw::records::RUN_QUADS) quads; the
//! draw call has one instance for each run of each plant, and the same indices for all of them. The
//! vertex shader fetches the corner and its leaf, and the leaf's drawn scale from the timeline (by
//! binary search) or from the plant's own scales. Wood is an ordinary indexed mesh, or, where its
//! vertices slide, indices of vertices that the shader fetches with those that they slide to.

use super::{
    bindings::bound,
    pipeline::{PassDescription, Surface, Target},
};
use crate::{
    Depth,
    draw::{
        look::{Coloring, Look, Variant},
        records::{PackedWood, Run},
        shaders,
    },
};

/// Part of a plant that a pass draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Part {
    /// Runs of leaves.
    Leaves,
    /// Runs of cards of clusters.
    Cards,
    /// Trunk and branches.
    Wood {
        /// Whether their vertices slide.
        slides: bool,
    },
    /// Impostors.
    Impostor {
        /// Whether the depth of their pictures is followed.
        is_deep: bool,
    },
}

/// Instance attributes of a run: the index of the plant's record, and of the run within the plant.
const RUN: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Uint32x2];
/// Vertex attribute of the wood: the four numbers of a [`PackedWood`].
const WOOD: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Uint32x4];

/// Compiles the pipeline that draws `part` into `target` for one variant.
pub(super) fn pipeline(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout],
    target: Target,
    part: Part,
    look: &Look,
    variant: Variant,
    depth: Depth,
) -> wgpu::RenderPipeline {
    let (name, wgsl, entry_points) = match (part, target) {
        (Part::Leaves, Target::Picture(..)) => {
            ("leaf_pass", shaders::leaf_pass(look, variant), ["leaf_corner", "leaf_color"])
        }
        (Part::Leaves, Target::Shadow) => {
            ("leaf_pass", shaders::leaf_shadow(look, variant), ["leaf_corner", "cast_shadow"])
        }
        (Part::Leaves, Target::Motion(..)) => {
            ("leaf_pass", shaders::leaf_motion(look, variant), ["leaf_motion", "motion"])
        }
        (Part::Cards, Target::Picture(..)) => {
            ("card_pass", shaders::card_pass(look, variant), ["card_corner", "card_color"])
        }
        (Part::Cards, Target::Shadow) => {
            ("card_pass", shaders::card_shadow(look, variant), ["card_corner", "cast_card"])
        }
        (Part::Cards, Target::Motion(..)) => {
            ("card_pass", shaders::card_motion(look, variant), ["card_motion", "card_moved"])
        }
        (Part::Wood { slides }, Target::Picture(..)) => {
            ("wood_pass", shaders::wood_pass(look, variant, slides), ["wood_corner", "wood_color"])
        }
        (Part::Wood { slides }, Target::Shadow) => {
            ("wood_pass", shaders::wood_shadow(look, variant, slides), ["wood_corner", "cast_shadow"])
        }
        (Part::Wood { slides }, Target::Motion(..)) => {
            ("wood_pass", shaders::wood_motion(look, variant, slides), ["wood_motion", "motion"])
        }
        (Part::Impostor { is_deep }, Target::Picture(..)) => {
            let fragment = if is_deep { "impostor_deep" } else { "impostor_flat" };
            ("impostor_pass", shaders::impostor_pass(look, variant), ["impostor_corner", fragment])
        }
        (Part::Impostor { .. }, Target::Shadow) => {
            ("impostor_pass", shaders::impostor_shadow(look, variant), ["impostor_corner", "cast_impostor"])
        }
        (Part::Impostor { .. }, Target::Motion(..)) => {
            ("impostor_pass", shaders::impostor_motion(look, variant), ["impostor_corner", "impostor_motion"])
        }
    };
    let vertices = |stride: usize, step_mode, attributes| {
        vec![Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes })]
    };
    let vertex_buffers = match part {
        Part::Leaves | Part::Cards => vertices(size_of::<Run>(), wgpu::VertexStepMode::Instance, &RUN[..]),
        Part::Wood { slides: false } => vertices(size_of::<PackedWood>(), wgpu::VertexStepMode::Vertex, &WOOD[..]),
        Part::Wood { slides: true } | Part::Impostor { .. } => Vec::new(),
    };
    PassDescription {
        name,
        wgsl,
        entry_points,
        layouts: bound(layouts, look, variant),
        vertex_buffers: &vertex_buffers,
        surface: Surface::Plants(coloring(part, look), depth),
    }
    .pipeline(device, target)
}

/// Colouring of a part: of diagnostic ones, wood and impostors know few.
fn coloring(part: Part, look: &Look) -> Coloring {
    match (part, look.coloring) {
        (Part::Leaves | Part::Cards, coloring) | (Part::Impostor { .. }, coloring @ Coloring::Parts) => coloring,
        _ => Coloring::Picture,
    }
}
