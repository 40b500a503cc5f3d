//! Leaves that repeat the shape of another: turned, scaled and moved.
//!
//! The arithmetic is that of `f64` with square roots alone, so that a copy has the same bits on
//! every machine.

use crate::leaf::Vertex;
use glam::{DMat3, DQuat, Vec3};

/// A leaf whose vertices are those of an earlier one, turned and scaled about its pivot and moved.
///
/// The model has the vertices of both; its file only needs those of the earlier one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafCopy {
    /// Index of the copy.
    pub leaf: u32,
    /// Index of the leaf that it repeats: a smaller one, of a leaf that is no copy.
    pub of: u32,
    /// How it is turned.
    pub turn: Turn,
    /// Its linear size relative to the other one's; above 0.
    pub size: f32,
    /// How far it is moved beside its pivot.
    pub shift: [f32; 3],
}

/// A rotation: a unit quaternion without the component that is largest, which is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Index of the largest component among x, y, z and w: 0 to 3.
    pub largest: u8,
    /// The others in this order.
    pub others: [f32; 3],
}

impl Turn {
    /// The rotation, its components rounded by `rounded`.
    pub(super) fn rounded(rotation: DQuat, rounded: impl Fn(f64) -> f32) -> Self {
        let components = rotation.to_array();
        let largest = (0..4).fold(0, |most, i| if components[i].abs() > components[most].abs() { i } else { most });
        let sign = components[largest].signum();
        let others = std::array::from_fn(|i| rounded(sign * components[i + usize::from(i >= largest)]));
        Self { largest: largest as u8, others }
    }

    fn matrix(&self) -> DMat3 {
        let others = self.others.map(f64::from);
        let squares: f64 = others.iter().map(|other| other * other).sum();
        let (largest, length) = ((1.0 - squares).max(0.0).sqrt(), squares.max(1.0).sqrt());
        let at = usize::from(self.largest);
        let component = |i: usize| if i == at { largest } else { others[i - usize::from(i > at)] };
        DMat3::from_quat(DQuat::from_array(std::array::from_fn(component)) / length)
    }
}

impl LeafCopy {
    /// Vertices of the copy of `shape`; `pivots` are the shape's and the copy's. A shape of one
    /// colour takes `color`.
    pub(super) fn vertices(
        &self,
        shape: &[Vertex],
        pivots: [[f32; 3]; 2],
        color: [f32; 4],
    ) -> impl Iterator<Item = Vertex> {
        let turn = self.turn.matrix();
        let grown = turn * f64::from(self.size);
        let [from, to, shift] = [pivots[0], pivots[1], self.shift].map(|point| Vec3::from(point).as_dvec3());
        let is_even = has_one_color(shape);
        shape.iter().map(move |vertex| {
            let offset = Vec3::from(vertex.position).as_dvec3() - from;
            Vertex {
                position: (to + shift + grown * offset).as_vec3().to_array(),
                normal: (turn * Vec3::from(vertex.normal).as_dvec3()).as_vec3().to_array(),
                color: if is_even { color } else { vertex.color },
                ..*vertex
            }
        })
    }
}

/// Whether all vertices have the same colour, bit for bit.
pub(super) fn has_one_color(vertices: &[Vertex]) -> bool {
    let mut colors = vertices.iter().map(|vertex| vertex.color.map(f32::to_bits));
    let first = colors.next();
    colors.all(|color| Some(color) == first)
}
