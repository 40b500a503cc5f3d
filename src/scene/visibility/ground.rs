//! How near the ground is at each pixel of the small picture.

use super::ROWS;
use crate::{
    Camera,
    terrain::{HeightMap, Horizon},
};
use glam::DVec3;

/// Pixels between two rays.
const APART: usize = 2;

/// Ground, and one over its distance at places two pixels apart; 0 where there is none.
#[derive(Debug)]
pub(super) struct Ground {
    horizon: Horizon,
    /// Places in a row.
    width: usize,
    places: Vec<f32>,
}

impl Ground {
    pub(super) fn new(heights: &HeightMap) -> Self {
        Self { horizon: Horizon::new(heights), width: 0, places: Vec::new() }
    }

    /// Looks at the ground, on a picture of so many columns.
    pub(super) fn look(&mut self, camera: &Camera, columns: u32) {
        let (world_from_clip, eye) = (camera.clip_from_world.inverse(), camera.eye);
        let Self { horizon, width, places } = self;
        let [across, up] = [columns, ROWS].map(|side| (side as usize).div_ceil(APART) + 1);
        let place = |at: usize, side: u32| (APART * at) as f64 / f64::from(side) * 2.0 - 1.0;
        horizon.look_from(eye);
        *width = across;
        places.clear();
        for row in 0..up {
            places.extend((0..across).map(|column| {
                let seen = DVec3::new(place(column, columns), place(row, ROWS), 0.5);
                horizon.nearness(world_from_clip.project_point3(seen) - eye)
            }));
        }
    }

    /// One over the distance at a pixel: the least of those around it.
    pub(super) fn nearness(&self, [column, row]: [u32; 2]) -> f32 {
        let at = (row as usize / APART) * self.width + column as usize / APART;
        let [below, above] = [at, at + self.width].map(|at| self.places[at].min(self.places[at + 1]));
        below.min(above)
    }
}
