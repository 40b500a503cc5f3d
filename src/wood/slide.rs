//! Wood at an error: vertices on their way to their parents, and triangles that are still drawn.

use super::{
    order::{Swell, WoodOrder, widened},
    ribbon::breadth,
};
use crate::{leaf::Vertex, plant::Wood};
use glam::{Vec2, Vec3};

/// Share of its threshold over which a vertex slides.
pub const SLIDE: f32 = 0.2;

/// A vertex on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slid {
    /// In plant space, on the surface.
    pub position: Vec3,
    /// How far from there it is drawn, so that wood covers as much as without levels.
    pub widened: Vec3,
    /// Of a vertex of a ribbon: along its centre line, as long as half of its width, turned round
    /// on one of both sides.
    pub across: Vec3,
    /// Normal, not of unit length; 0 for a ribbon.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Linear colour factor.
    pub color: Vec3,
}

/// Where the vertices of a plant's wood are at any error.
#[derive(Debug, Clone, Copy)]
pub struct Slides<'a> {
    /// Vertices of the wood and of its ribbons.
    pub vertices: &'a [Vertex],
    /// The vertex that each one slides to.
    pub parents: &'a [u32],
    /// The error from which on each vertex is where its parent is.
    pub thresholds: &'a [f32],
    /// How far each stem is widened.
    pub swells: &'a [Swell],
    /// Half of the width of the ribbons, for each of the last vertices.
    pub halves: &'a [f32],
    /// Stem of each vertex; without it, nothing is widened.
    pub stems: &'a [u32],
    /// Width of each stem, in the plant's units.
    pub widths: &'a [f32],
}

impl<'a> Slides<'a> {
    /// Vertices of wood without ribbons, of which nothing is widened, given an order that is
    /// [valid](WoodOrder::validate) for it.
    pub fn new(vertices: &'a [Vertex], order: &'a WoodOrder) -> Self {
        let WoodOrder { parents, thresholds, swells, .. } = order;
        Self { vertices, parents, thresholds, swells, halves: &[], stems: &[], widths: &[] }
    }

    /// A vertex at an error in the plant's units. Vertices that have met differ by rounding alone.
    pub fn at(&self, vertex: u32, error: f32) -> Slid {
        let nothing = Vec3::ZERO;
        let mut slid = Slid {
            position: nothing,
            widened: nothing,
            across: nothing,
            normal: nothing,
            uv: Vec2::ZERO,
            color: nothing,
        };
        for (at, here) in self.way(vertex, error) {
            let Vertex { position, normal, uv, color: [r, g, b, _] } = self.vertices[at as usize];
            slid.position += here * Vec3::from(position);
            match self.half(at, error) {
                Some(half) => slid.across += here * half * Vec3::from(normal),
                None => {
                    slid.normal += here * Vec3::from(normal);
                    slid.widened += here * self.widened(at, error);
                }
            }
            slid.uv += here * Vec2::from(uv);
            slid.color += here * Vec3::new(r, g, b);
        }
        slid
    }

    /// The vertices that a vertex is between at an error, each with its weight; they add up to 1.
    pub fn way(&self, vertex: u32, error: f32) -> impl Iterator<Item = (u32, f32)> {
        let (mut at, mut weight) = (vertex, 1.0);
        std::iter::from_fn(move || {
            while weight > 0.0 {
                let (here, share) = (at, slide(error, self.thresholds[at as usize]));
                let own = weight * (1.0 - share);
                weight *= share;
                at = self.parents[at as usize];
                if own > 0.0 {
                    return Some((here, own));
                }
            }
            None
        })
    }

    /// Half of the width of a ribbon at a vertex that does not slide; `None` if it is of no ribbon.
    pub fn half(&self, vertex: u32, error: f32) -> Option<f32> {
        let number = (vertex as usize).checked_sub(self.vertices.len() - self.halves.len())?;
        let stem = self.stems[vertex as usize] as usize;
        Some(self.halves[number] * breadth(&self.swells[stem], self.widths[stem], error))
    }

    /// How far a vertex that does not slide is drawn outside the surface.
    pub fn widened(&self, vertex: u32, error: f32) -> Vec3 {
        let Some(&stem) = self.stems.get(vertex as usize).filter(|_| error > 0.0) else { return Vec3::ZERO };
        let by = widened(&self.swells[stem as usize], self.widths[stem as usize], error);
        by * Vec3::from(self.vertices[vertex as usize].normal)
    }
}

/// Share of the way to its parent that a vertex has gone: 0 up to four fifths of the threshold, 1
/// from it on.
fn slide(error: f32, threshold: f32) -> f32 {
    (error / threshold * (1.0 / SLIDE) - (1.0 / SLIDE - 1.0)).clamp(0.0, 1.0)
}

/// The error from which on each triangle is not drawn, because two of its corners have met; in the
/// order of the wood's indices. O(wood).
pub fn vanishing(wood: &Wood, order: &WoodOrder) -> Vec<f32> {
    let meetings = Meetings { wood, order, depths: depths(order) };
    let of_triangle = |corners: &[u32]| {
        let pairs = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| meetings.of(corners[a], corners[b]));
        pairs.into_iter().fold(f32::INFINITY, f32::min)
    };
    wood.indices.chunks_exact(3).map(of_triangle).collect()
}

struct Meetings<'a> {
    wood: &'a Wood,
    order: &'a WoodOrder,
    depths: Vec<u8>,
}

impl Meetings<'_> {
    /// The error from which on two vertices are at the same place; 0 if they are from the start.
    /// Vertices at the same place stay together.
    fn of(&self, a: u32, b: u32) -> f32 {
        let Self { wood, order, depths } = self;
        let (mut a, mut b) = (a as usize, b as usize);
        let mut error = 0.0;
        while wood.vertices[a].position != wood.vertices[b].position {
            let [of_a, of_b] = [a, b].map(|vertex| (order.thresholds[vertex], -i16::from(depths[vertex])));
            let next = if of_a <= of_b { &mut a } else { &mut b };
            error = order.thresholds[*next];
            if error == f32::INFINITY {
                return error;
            }
            *next = order.parents[*next] as usize;
        }
        error
    }
}

/// Number of parents that follow each vertex.
fn depths(order: &WoodOrder) -> Vec<u8> {
    let depth = |vertex: usize| {
        let mut at = vertex;
        let mut depth = 0;
        while order.parents[at] as usize != at {
            at = order.parents[at] as usize;
            depth += 1;
        }
        depth
    };
    (0..order.parents.len()).map(depth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(x: f32) -> Vertex {
        Vertex { position: [x, 0.0, 0.0], normal: [0.0, 1.0, 0.0], uv: [x, 1.0], color: [1.0; 4] }
    }

    /// Four vertices at 0, 1, 2 and 3, each sliding to the one before it.
    fn chain() -> (Vec<Vertex>, WoodOrder) {
        let order = WoodOrder {
            parents: vec![0, 0, 1, 2],
            thresholds: vec![f32::INFINITY, 4.0, 2.0, 2.0],
            ..WoodOrder::default()
        };
        ((0..4).map(|i| vertex(i as f32)).collect(), order)
    }

    #[test]
    fn vertices_slide_without_a_jump_and_stay_together_once_they_have_met() {
        let (vertices, order) = chain();
        let slides = Slides::new(&vertices, &order);
        let at = |vertex, error| slides.at(vertex, error);
        assert_eq!(at(3, 0.0).position.x, 3.0);
        assert_eq!(at(3, 1.59).position.x, 3.0);
        let mut before = 3.0;
        for step in 0..=4000 {
            let error = 0.001 * step as f32 + 1.0;
            let x = at(3, error).position.x;
            assert!(x <= before && before - x < 0.01, "{x} after {before} at {error}");
            before = x;
        }
        assert_eq!(before, 0.0);
        for error in [2.0, 3.0, 3.5, 3.9, 4.0, 9.0] {
            assert_eq!(at(3, error), at(1, error), "{error}");
            assert_eq!(at(2, error), at(1, error), "{error}");
        }
    }

    #[test]
    fn triangles_vanish_where_their_first_two_corners_meet() {
        let (vertices, order) = chain();
        let wood = Wood { vertices, indices: vec![0, 1, 2, 1, 2, 3, 0, 2, 3, 0, 0, 1], parts: Vec::new() };
        assert_eq!(vanishing(&wood, &order), [2.0, 2.0, 2.0, 0.0]);
        let apart = WoodOrder { parents: vec![0, 1, 2, 3], thresholds: vec![f32::INFINITY; 4], ..WoodOrder::default() };
        assert_eq!(vanishing(&wood, &apart)[..3], [f32::INFINITY; 3]);
    }
}
