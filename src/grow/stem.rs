//! A grown stem, as nodes along its axis.

use super::frame::Frame;
use glam::Vec3;

/// A point on the axis of a stem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Position in metres.
    pub position: Vec3,
    /// Direction of growth.
    pub frame: Frame,
    /// Radius in metres.
    pub radius: f32,
    /// Fraction of the length of the stem, 0 at the foot.
    pub t: f32,
}

/// A trunk, limb, branch or twig, or one arm of it above a fork.
#[derive(Debug, Clone)]
pub(super) struct Stem {
    /// 0 for the trunk.
    pub level: usize,
    /// Length in metres from `t = 0` to `t = 1`; an arm above a fork keeps the length of the whole
    /// stem.
    pub length: f32,
    /// At least two nodes, `t` ascending to 1. On an arm above a fork, the first has `t > 0`.
    pub nodes: Vec<Node>,
}

impl Stem {
    /// The node where the stem, or this arm of it, starts.
    pub fn foot(&self) -> &Node {
        &self.nodes[0]
    }

    /// The point at `t`, interpolated between neighbouring nodes; clamped to the ends of the stem.
    pub fn at(&self, t: f32) -> Node {
        let above = self.nodes.partition_point(|node| node.t < t);
        if above == 0 {
            return self.nodes[0];
        }
        let Some(high) = self.nodes.get(above) else { return self.nodes[above - 1] };
        let low = &self.nodes[above - 1];
        let share = (t - low.t) / (high.t - low.t);
        Node {
            position: low.position.lerp(high.position, share),
            frame: high.frame,
            radius: low.radius + (high.radius - low.radius) * share,
            t,
        }
    }
}
