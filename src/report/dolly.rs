//! How much pops while a camera backs away.
//!
//! The camera backs away from a plant that fills the picture to where it fills a sixth of it, in four seconds of 60 frames,
//! and the share of the leaves falls with the plant's area. From one frame to the next only the level of detail changes
//! here: what the camera's own motion changes is not counted.
//!
//! Limits: methods that change with every frame are sampled at every eighth; those that switch, at every switch.

use super::{
    method::{Method, Reduced, measured},
    metrics::largest_change,
};
use crate::{
    Result,
    bounds::{Aabb, Sphere},
    render::{camera::Camera, image::Image, software::DrawList},
};
use glam::DVec3;
use rayon::prelude::*;

/// Frames of the dolly, and how far it goes, in distances at which the plant fills the picture.
const FRAMES: u32 = 240;
const FARTHEST: f64 = 6.0;
/// Every so many frames are looked at.
const STRIDE: u32 = 8;
/// Side of the pictures.
const SIDE_PX: u32 = 128;

/// The dolly past one plant.
pub struct Dolly {
    sphere: Sphere,
    crown: Aabb,
    from: DVec3,
    fov_y: f64,
}

impl Dolly {
    /// Away from `sphere` in direction `from`.
    pub fn new(sphere: Sphere, crown: Aabb, from: DVec3, fov_y: f64) -> Self {
        Self { sphere, crown, from, fov_y }
    }

    /// Largest mean difference between a frame and the same frame at the next one's level, in sRGB bytes over the picture.
    ///
    /// # Errors
    /// Those of the drawing.
    pub fn largest_change(&self, method: &Method) -> Result<f64> {
        let frames: Vec<u32> = (0..FRAMES).filter(|&frame| is_looked_at(method, frame)).collect();
        let changes: Result<Vec<f64>> = frames.par_iter().map(|&frame| self.change(method, frame)).collect();
        Ok(changes?.into_iter().fold(0.0, f64::max))
    }

    fn change(&self, method: &Method, frame: u32) -> Result<f64> {
        let camera = Camera::framing(&self.sphere, self.from, self.fov_y, distance(frame));
        let picture = |frame: u32| -> Result<Image> {
            let sample = method.at(level(frame));
            let list = DrawList { crown: self.crown, ..sample.reduced.draw_list() };
            sample.reduced.painter()?.draw(&list, &camera, [SIDE_PX; 2], &measured(sample.tone))
        };
        largest_change(&[picture(frame)?, picture(frame + 1)?])
    }
}

fn distance(frame: u32) -> f64 {
    FARTHEST.powf(f64::from(frame) / f64::from(FRAMES))
}

/// Share of the leaves: that of the plant's area.
fn level(frame: u32) -> f64 {
    distance(frame).powi(-2)
}

fn is_looked_at(method: &Method, frame: u32) -> bool {
    match [frame, frame + 1].map(|frame| method.at_if_given(level(frame))) {
        [Some(Reduced::Whole(now)), Some(Reduced::Whole(next))] => !std::sync::Arc::ptr_eq(&now, &next),
        _ => frame.is_multiple_of(STRIDE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grow::{GrowOptions, Species, grow},
        simplify::{Quiet, SimplifyOptions, raster::CpuFragments, simplify},
        stochastic::order::shuffled,
    };
    use std::sync::Arc;

    #[test]
    fn three_levels_pop_more_than_leaf_by_leaf_and_a_still_plant_does_not() {
        let species = Species::embedded("betula-populifolia").unwrap();
        let plant = grow(&species, &GrowOptions { leaves: Some(800), ..GrowOptions::default() }).unwrap();
        let options = SimplifyOptions { resolution: 64, ..SimplifyOptions::balanced() };
        let model = simplify(&plant, &options, &mut CpuFragments::new(), &mut Quiet).unwrap().model;
        let crown = Aabb::of_points(plant.vertices.iter().map(|vertex| vertex.position));
        let dolly = Dolly::new(plant.sphere(), crown, DVec3::Z, 0.6);
        let levels: Vec<(f64, Arc<crate::Plant>)> = [1.0, 0.3, 0.05]
            .map(|level| {
                let mut part = shuffled(&plant, 1).unwrap();
                part.leaves.truncate((800.0 * level) as usize);
                let last = part.leaves[part.leaves.len() - 1].clone();
                part.vertices.truncate(last.vertices[1] as usize);
                part.indices.truncate(last.indices[1] as usize);
                (level, Arc::new(part.plant()))
            })
            .into();
        let still = vec![(1.0, Arc::new(plant.clone()))];
        let change = |method: Method| dolly.largest_change(&method).unwrap();
        let leaf_by_leaf = change(Method::of_model("model", model));
        let three = change(Method::given("three", levels));
        assert!(leaf_by_leaf > 0.0 && three > 5.0 * leaf_by_leaf, "{three} against {leaf_by_leaf}");
        assert_eq!(change(Method::given("still", still)), 0.0);
    }
}
