//! A grown stem: the nodes along its axis.

use super::frame::Frame;
use glam::Vec3;

/// A point of a stem's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// Position in metres.
    pub position: Vec3,
    /// Direction of growth.
    pub frame: Frame,
    /// Radius in metres.
    pub radius: f32,
    /// Fraction of the stem's length, 0 at the foot.
    pub t: f32,
}

/// A trunk, limb, branch or twig, or one arm of it above a fork.
#[derive(Debug, Clone)]
pub(super) struct Stem {
    /// 0 for the trunk.
    pub level: usize,
    /// Metres from `t = 0` to `t = 1`; an arm above a fork keeps its whole stem's length.
    pub length: f32,
    /// At least two, `t` rising to 1. The first has `t > 0` on an arm above a fork.
    pub nodes: Vec<Node>,
}

impl Stem {
    /// Where the stem, or this arm of it, starts.
    pub fn foot(&self) -> &Node {
        &self.nodes[0]
    }

    /// The point at `t`, between its neighbours; the nearest end outside of the stem.
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
