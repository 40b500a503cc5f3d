//! Held-out views: measurements use views that the simplification does not use.
//!
//! By default, the simplification's cameras are at the vertices of a dodecahedron. The held-out
//! cameras are at the vertices of its dual, the icosahedron: the directions farthest from all of
//! the simplification's, 37 degrees from the nearest.

use crate::{LookAt, bounds::Sphere};
use glam::DVec3;

/// Vertical field of view in radians, in the middle of the range that viewers and games use for one
/// plant.
pub const FOV_Y: f64 = 0.7;
/// The golden ratio.
const PHI: f64 = 1.618_033_988_749_895;

/// Twelve square views of a plant; it fills each view.
pub fn cameras(sphere: &Sphere) -> Vec<LookAt> {
    directions().map(|direction| LookAt::framing(sphere, direction, FOV_Y, 1.0)).collect()
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
