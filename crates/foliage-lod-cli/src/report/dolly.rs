//! Popping while a camera backs away.
//!
//! The camera starts where the plant fills the picture and backs away to six times that distance,
//! in four seconds at 60 frames per second. The fraction of the leaves falls with the plant's area
//! on the screen. Both frames of a pair are rendered from the same camera, so only the change of
//! the level of detail is measured.
//!
//! Limits: methods that change with every frame are sampled at every eighth frame, discrete levels
//! at every switch.

use super::method::{Method, Reduced};
use foliage_lod::{
    LookAt, Result,
    bounds::{Aabb, Sphere},
    measure::{largest_change, measured},
    software::{DrawList, Image},
};
use glam::DVec3;
use rayon::prelude::*;

/// Number of frames.
const FRAMES: u32 = 240;
/// Farthest distance, as a multiple of the distance at which the plant fills the picture.
const FARTHEST: f64 = 6.0;
/// Sampling stride of methods that change with every frame.
const STRIDE: u32 = 8;
/// Side of the pictures in pixels.
const SIDE_PX: u32 = 128;

/// The camera path away from one plant.
pub struct Dolly {
    sphere: Sphere,
    crown: Aabb,
    from: DVec3,
    fov_y: f64,
}

impl Dolly {
    /// A path away from `sphere`; `from` points from the sphere to the camera.
    pub fn new(sphere: Sphere, crown: Aabb, from: DVec3, fov_y: f64) -> Self {
        Self { sphere, crown, from, fov_y }
    }

    /// Largest mean difference between a frame and the same view at the next frame's level of
    /// detail, on the sRGB scale of 0 to 255.
    ///
    /// # Errors
    /// Errors from the software renderer.
    pub fn largest_change(&self, method: &Method) -> Result<f64> {
        let frames: Vec<u32> = (0..FRAMES).filter(|&frame| is_looked_at(method, frame)).collect();
        let changes: Result<Vec<f64>> = frames.par_iter().map(|&frame| self.change(method, frame)).collect();
        Ok(changes?.into_iter().fold(0.0, f64::max))
    }

    fn change(&self, method: &Method, frame: u32) -> Result<f64> {
        let camera = LookAt::framing(&self.sphere, self.from, self.fov_y, distance(frame));
        let picture = |frame: u32| -> Result<Image> {
            let sample = method.at(level(frame));
            let list = DrawList { crown: self.crown, ..sample.reduced.draw_list() };
            sample.reduced.painter()?.draw(&list, &camera.camera(SIDE_PX), [SIDE_PX; 2], &measured(sample.tone))
        };
        largest_change(&[picture(frame)?, picture(frame + 1)?])
    }
}

fn distance(frame: u32) -> f64 {
    FARTHEST.powf(f64::from(frame) / f64::from(FRAMES))
}

/// Fraction of the leaves: the plant's area on the screen, relative to the first frame.
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
    use foliage_lod::{
        grow::{GrowOptions, Species, grow},
        simplify::{CpuFragments, Quiet, SimplifyOptions, simplify},
        stochastic::shuffled,
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
        let levels: Vec<(f64, Arc<foliage_lod::Plant>)> = [1.0, 0.3, 0.05]
            .map(|level| {
                let mut part = shuffled(&plant, 1).unwrap();
                part.leaves.truncate((800.0 * level) as usize);
                let last = part.leaves[part.leaves.len() - 1].clone();
                part.vertices.truncate(last.vertices[1] as usize);
                part.indices.truncate(last.indices[1] as usize);
                (level, Arc::new(part.to_plant()))
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
