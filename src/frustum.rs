//! The view frustum, for culling.

use crate::Camera;
use glam::{DVec3, DVec4};

/// View frustum: the four side planes and the plane through the eye, each as (inward unit normal,
/// distance from the origin).
///
/// The near and far planes are left out: depth conventions differ, and the near plane culls next to
/// nothing.
#[derive(Debug, Clone, Copy)]
pub struct Frustum {
    planes: [(DVec3, f64); PLANES],
}

/// Number of planes of a frustum.
const PLANES: usize = 5;
/// Bit set of the planes that a volume may still cross.
pub(crate) type Crossed = u8;
/// All planes.
pub(crate) const ALL_PLANES: Crossed = (1 << PLANES) - 1;

impl Frustum {
    /// The frustum of `camera` in coordinates relative to `anchor`, in world units. A non-finite
    /// plane culls nothing.
    pub fn new(camera: &Camera, anchor: DVec3) -> Self {
        let matrix = camera.clip_from_world;
        let [x, y, w] = [matrix.row(0), matrix.row(1), matrix.row(3)];
        let planes = [w + x, w - x, w + y, w - y, w].map(|plane: DVec4| {
            let length = plane.truncate().length();
            let (normal, distance) = (plane.truncate() / length, plane.w / length);
            let is_sound = normal.is_finite() && distance.is_finite();
            if is_sound { (normal, distance + normal.dot(anchor)) } else { (DVec3::ZERO, f64::INFINITY) }
        });
        Self { planes }
    }

    /// The planes of `crossed` that a box crosses; `None` if it lies outside one of them.
    #[cfg(feature = "scene")]
    pub(crate) fn crossed_by_box(&self, crossed: Crossed, min: DVec3, max: DVec3) -> Option<Crossed> {
        let (center, half_size) = ((min + max) * 0.5, (max - min) * 0.5);
        self.crossed(crossed, |normal| (normal.dot(center), normal.abs().dot(half_size)))
    }

    /// Whether a sphere lies at least partly inside the planes `crossed`.
    #[cfg(feature = "scene")]
    pub(crate) fn meets_sphere(&self, crossed: Crossed, center: DVec3, radius: f64) -> bool {
        self.crossed(crossed, |normal| (normal.dot(center), radius)).is_some()
    }

    /// Whether a sphere, relative to the anchor, may lie at least partly in the picture: true for
    /// all that do, and for some beside its corners.
    pub fn may_see(&self, center: DVec3, radius: f64) -> bool {
        self.crossed(ALL_PLANES, |normal| (normal.dot(center), radius)).is_some()
    }

    /// Whether a sphere that moves by `sweep` may come to lie at least partly inside: false if it
    /// stays outside one of the planes.
    pub(crate) fn meets_swept_sphere(&self, center: DVec3, radius: f64, sweep: DVec3) -> bool {
        let (middle, half) = (center + 0.5 * sweep, 0.5 * sweep);
        self.crossed(ALL_PLANES, |normal| (normal.dot(middle), normal.dot(half).abs() + radius)).is_some()
    }

    /// Tests a volume against the planes; `along(normal)` returns its centre and half extent along
    /// a normal.
    fn crossed(&self, crossed: Crossed, along: impl Fn(DVec3) -> (f64, f64)) -> Option<Crossed> {
        let mut still_crossed = 0;
        for (i, &(normal, distance)) in self.planes.iter().enumerate().filter(|(i, _)| crossed >> i & 1 == 1) {
            let (middle, reach) = along(normal);
            if middle + distance < -reach {
                return None;
            }
            still_crossed |= Crossed::from(middle + distance < reach) << i;
        }
        Some(still_crossed)
    }
}
