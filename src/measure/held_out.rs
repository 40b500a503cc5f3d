//! Held-out views: measurements use views that neither the simplification nor an impostor uses.
//!
//! By default, the simplification's cameras are at the vertices of a dodecahedron. The held-out
//! cameras are at the vertices of its dual, the icosahedron: the directions farthest from all of
//! the simplification's, 37 degrees from the nearest.

use crate::{Camera, LookAt, bounds::Sphere};
use glam::DVec3;

/// Vertical field of view in radians, in the middle of the range that viewers and games use for one
/// plant.
pub const FOV_Y: f64 = 0.7;
/// The same for small plants: a sphere that fills such a view is 60 pixels wide on a screen of a
/// thousand rows that shows 50 degrees.
const FAR_FOV_Y: f64 = 0.05;
/// Number of views of small plants, and the steepest of them in degrees.
const FAR_VIEWS: u32 = 16;
const FAR_STEEPEST_DEG: f64 = 40.0;
/// Turn from one of them to the next in radians: the golden angle.
const FAR_TURN: f64 = 2.399_963_229_728_653;
/// The golden ratio.
const PHI: f64 = 1.618_033_988_749_895;

/// Twelve square views of a plant; it fills each view.
pub fn cameras(sphere: &Sphere) -> Vec<LookAt> {
    directions().map(|direction| LookAt::framing(sphere, direction, FOV_Y, 1.0)).collect()
}

/// Sixteen views of a plant from afar, all around it and from level to 40 degrees above, for square
/// pictures that show its bounding sphere `diameter_px` wide and one pixel more on each side. None
/// of the directions is that of an impostor's frame.
pub fn far_cameras(sphere: &Sphere, diameter_px: u32) -> Vec<Camera> {
    let camera = |i: u32| {
        let height = FAR_STEEPEST_DEG.to_radians() * (f64::from(i) + 0.5) / f64::from(FAR_VIEWS);
        let turn = 0.2 + f64::from(i) * FAR_TURN;
        far_camera(sphere, [turn, height], diameter_px)
    };
    (0..FAR_VIEWS).map(camera).collect()
}

/// A camera as of [`far_cameras`] in another direction: its turn from +Z towards +X and its height
/// above the horizon, in radians.
pub fn far_camera(sphere: &Sphere, [turn, height]: [f64; 2], diameter_px: u32) -> Camera {
    let direction = DVec3::new(turn.sin() * height.cos(), height.sin(), turn.cos() * height.cos());
    let side_px = diameter_px + 2;
    let margin = f64::from(side_px) / f64::from(diameter_px.max(1));
    LookAt::framing(sphere, direction, FAR_FOV_Y, margin).camera(side_px)
}

fn directions() -> impl Iterator<Item = DVec3> {
    let signs = [1.0, -1.0];
    signs.into_iter().flat_map(move |s| {
        signs.into_iter().flat_map(move |t| {
            let [a, b] = [s * PHI, t];
            [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]
        })
    })
}

#[cfg(all(test, feature = "simplify"))]
mod tests {
    use super::*;
    use crate::simplify::views::ViewSet;

    #[test]
    fn no_held_out_view_is_near_one_of_the_simplifications() {
        let sphere = Sphere { center: [0.0; 3], radius: 1.0 };
        let views = ViewSet::new(sphere, 16, 20).unwrap();
        let cameras = cameras(&sphere);
        assert_eq!(cameras.len(), 12);
        for camera in cameras {
            let toward = camera.eye.normalize();
            let nearest = views.views.iter().map(|view| view.toward.angle_between(toward)).fold(f64::MAX, f64::min);
            assert!(nearest.to_degrees() > 37.0, "{}", nearest.to_degrees());
        }
    }
}
