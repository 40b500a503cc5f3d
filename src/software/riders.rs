//! What vertices of the wood ride on in the wind: those that they slide between, on their limbs.

use crate::effects::{Limbs, Sway};
use glam::Vec3;

/// A vertex of the wood that another one is at or between.
#[derive(Debug)]
pub(super) struct Rider {
    pub(super) weight: f32,
    pub(super) stem: u32,
    pub(super) position: Vec3,
    pub(super) widened: Vec3,
    pub(super) across: Vec3,
    pub(super) normal: Vec3,
}

/// Riders of each vertex of wood at one error.
#[derive(Debug, Default)]
pub(super) struct Riders {
    /// Entry n: one past the last rider of vertex n.
    pub(super) ends: Vec<u32>,
    pub(super) all: Vec<Rider>,
}

/// What the wind does to a vertex of the wood.
#[derive(Default)]
pub(super) struct Blown {
    /// Displacement on the surface.
    pub(super) shift: Vec3,
    /// How far it is widened, [`Slid::across`](crate::wood::Slid::across), and normal.
    pub(super) widened: Vec3,
    pub(super) across: Vec3,
    pub(super) normal: Vec3,
}

impl Riders {
    /// What the wind does to a vertex.
    pub(super) fn blown(&self, vertex: usize, limbs: &Limbs, sway: &Sway) -> Blown {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        let mut blown = Blown::default();
        for rider in &self.all[start as usize..self.ends[vertex] as usize] {
            let carry = limbs.on_stem(rider.stem, rider.position, sway);
            blown.shift += rider.weight * carry.offset(rider.position);
            blown.widened += rider.weight * carry.turned(rider.widened);
            blown.across += rider.weight * carry.turned(rider.across);
            blown.normal += rider.weight * carry.turned(rider.normal);
        }
        blown
    }
}
