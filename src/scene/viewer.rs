//! Who looks at a scene, and what lies within the picture.

use glam::{DMat4, DVec3, DVec4};

/// One frame's camera, as culling and levels of detail need it. World units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewer {
    /// Where the camera stands.
    pub eye: DVec3,
    /// From the world to clip space; any depth range will do, since only x, y and w are used.
    pub clip_from_world: DMat4,
    /// Vertical field of view in radians, between 0 and pi.
    pub fov_y: f32,
    /// Height of the picture in pixels.
    pub height_px: f32,
}

impl Viewer {
    /// The same eye without the sides of its picture: everything is in view, at the level of detail that it has for this eye.
    pub fn all_around(self) -> Self {
        Self { clip_from_world: DMat4::ZERO, ..self }
    }
}

/// The four sides of the picture and the plane of the eye, each as (unit normal inwards, distance from the origin).
///
/// Near and far planes are left out: depth conventions differ, and the near one hides next to nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frustum {
    planes: [(DVec3, f64); PLANES],
}

/// Planes of a frustum.
const PLANES: usize = 5;
/// One bit for each plane that something may still cross.
pub(super) type Crossed = u8;
/// Every plane may be crossed.
pub(super) const ALL_PLANES: Crossed = (1 << PLANES) - 1;

impl Frustum {
    /// The frustum of `viewer` in coordinates relative to `anchor`. A plane that is not a number hides nothing.
    pub(super) fn new(viewer: &Viewer, anchor: DVec3) -> Self {
        let matrix = viewer.clip_from_world;
        let [x, y, w] = [matrix.row(0), matrix.row(1), matrix.row(3)];
        let planes = [w + x, w - x, w + y, w - y, w].map(|plane: DVec4| {
            let length = plane.truncate().length();
            let (normal, distance) = (plane.truncate() / length, plane.w / length);
            let is_sound = normal.is_finite() && distance.is_finite();
            if is_sound { (normal, distance + normal.dot(anchor)) } else { (DVec3::ZERO, f64::INFINITY) }
        });
        Self { planes }
    }

    /// Which of the planes `crossed` a box crosses; `None` when it lies outside one of them.
    pub(super) fn crossed_by_box(&self, crossed: Crossed, min: DVec3, max: DVec3) -> Option<Crossed> {
        let (center, half_size) = ((min + max) * 0.5, (max - min) * 0.5);
        self.crossed(crossed, |normal| (normal.dot(center), normal.abs().dot(half_size)))
    }

    /// Whether a sphere lies at least partly inside the planes `crossed`.
    pub(super) fn meets_sphere(&self, crossed: Crossed, center: DVec3, radius: f64) -> bool {
        self.crossed(crossed, |normal| (normal.dot(center), radius)).is_some()
    }

    /// `along(normal)` gives a body's middle along a normal and how far it reaches to either side.
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
