//! Offscreen cameras at the vertices of a regular solid around the plant, looking at its centre.
//!
//! After C. Gasch et al., "Multiresolution Foliage Rendering", section 4.1: cameras at the 20
//! vertices of a dodecahedron. Every number comes from additions, multiplications, divisions and
//! square roots in `f64`, which IEEE 754 rounds the same way on every machine, so the snapped
//! positions, and with them the whole pruning order, are the same everywhere.
//!
//! Spaces: *unit* space is the plant's, translated and scaled so that its bounding sphere is the
//! unit sphere. *Screen* positions are in 1/256 pixel from the centre of the top left pixel, x
//! right, y down.

use crate::{Error, Result, bounds::Sphere, edge::SUBPIXEL, error::check_range};
use glam::DVec3;

/// Distance of every camera from the centre, in sphere radii. At 3, the near side of the sphere
/// appears twice as large as the far side; nearer cameras would let front leaves hide more than
/// they do from afar.
pub const CAMERA_DISTANCE: f64 = 3.0;
/// Near plane, in sphere radii along a camera's axis. Only leaves that have grown far out of the
/// sphere come this close.
pub const NEAR: f64 = 0.1;
/// Largest resolution. Together with [`MAX_SCALE_LIMIT`](super::options::MAX_SCALE_LIMIT) it keeps
/// edge functions within `i64`.
pub const MAX_RESOLUTION: u32 = 2048;
/// Tangent of half the field of view that just contains the unit sphere:
/// `1 / sqrt(CAMERA_DISTANCE^2 - 1)`, where `sqrt(8) = 2 sqrt(2)`.
const HALF_FOV_TAN: f64 = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
/// Pixels by which snapping and rounding may move a corner, and more.
const SLACK: f64 = 1.0 / 128.0;
/// The golden ratio and its inverse: vertex coordinates of the dodecahedron and icosahedron.
const PHI: f64 = 1.618_033_988_749_895;
const INV_PHI: f64 = 0.618_033_988_749_895;

/// Supported numbers of views: the numbers of vertices of the tetrahedron, octahedron, cube,
/// icosahedron and dodecahedron.
pub const VIEW_COUNTS: [u32; 5] = [4, 6, 8, 12, 20];

/// Largest number of views.
pub const MAX_VIEWS: usize = VIEW_COUNTS[VIEW_COUNTS.len() - 1] as usize;

/// One camera: an orthonormal basis in unit space. It is at `CAMERA_DISTANCE * toward` and looks at
/// the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Screen right.
    pub right: DVec3,
    /// Screen up.
    pub up: DVec3,
    /// From the centre to the camera.
    pub toward: DVec3,
}

/// A projected point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScreenPoint {
    /// Horizontal position, increasing to the right, in 1/256 pixel from the centre of column 0.
    pub x: i64,
    /// Vertical position, increasing downwards, in 1/256 pixel from the centre of row 0.
    pub y: i64,
    /// 1 / distance along the axis, in inverse sphere radii; nearer is greater. At most `1 / NEAR`.
    pub inv_w: f64,
}

/// All views of a plant.
#[derive(Debug, Clone)]
pub struct ViewSet {
    center: DVec3,
    inv_radius: f64,
    first_rays: [(f64, f64); 2],
    /// Side of each view in pixels.
    pub resolution: u32,
    /// The cameras.
    pub views: Vec<View>,
}

impl ViewSet {
    /// Creates `count` cameras around `sphere`, each with `resolution` x `resolution` pixels.
    ///
    /// A sphere of radius 0 is treated as one of radius 1.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if `count` is not one of [`VIEW_COUNTS`] or `resolution` is not
    /// from 1 to [`MAX_RESOLUTION`].
    pub fn new(sphere: Sphere, resolution: u32, count: u32) -> Result<Self> {
        check_range("resolution", resolution, 1..=MAX_RESOLUTION)?;
        let inv_radius = if sphere.radius > 0.0 { 1.0 / sphere.radius } else { 1.0 };
        let views = solid(count)?.into_iter().map(View::looking_from).collect();
        let mut set = Self { center: sphere.center(), inv_radius, first_rays: [(0.0, 0.0); 2], resolution, views };
        set.first_rays = [0.0, 1.0].map(|at| set.ray(at, at));
        Ok(set)
    }

    /// The same cameras at another resolution, which must be in range.
    pub fn of_resolution(&self, resolution: u32) -> Self {
        let mut set = Self { resolution, ..self.clone() };
        set.first_rays = [0.0, 1.0].map(|at| set.ray(at, at));
        set
    }

    /// Some of these cameras.
    pub fn chosen(&self, views: &[usize]) -> Self {
        Self { views: views.iter().filter_map(|&view| self.views.get(view).copied()).collect(), ..self.clone() }
    }

    /// Centre of the views, in the plant's units.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Converts a point from plant space to unit space.
    pub fn unit_from_plant(&self, point: DVec3) -> DVec3 {
        (point - self.center) * self.inv_radius
    }

    /// Converts a length from the plant's units to unit space.
    pub fn unit_length(&self, length: f64) -> f64 {
        length * self.inv_radius
    }

    /// Length in pixels of a length in the plant's units that faces a camera at the distance of the
    /// centre.
    pub fn pixels_of_length(&self, length: f64) -> f64 {
        self.unit_length(length) / CAMERA_DISTANCE * self.pixels_per_tan()
    }

    /// Number of pixels of one view.
    pub fn pixels(&self) -> usize {
        (self.resolution as usize).pow(2)
    }

    /// Projects a point in unit space. Returns `None` if it is closer than the near plane or behind
    /// the camera.
    ///
    /// Positions are rounded to 1/256 pixel, half to even.
    pub fn project(&self, view: &View, unit: DVec3) -> Option<ScreenPoint> {
        let w = CAMERA_DISTANCE - unit.dot(view.toward);
        if w <= NEAR {
            return None;
        }
        let pixels_per_tan = self.pixels_per_tan();
        let half = 0.5 * f64::from(self.resolution) - 0.5;
        let snap = |offset: f64| round_ties_even(offset * SUBPIXEL as f64) as i64;
        Some(ScreenPoint {
            x: snap(half + unit.dot(view.right) / w * pixels_per_tan),
            y: snap(half - unit.dot(view.up) / w * pixels_per_tan),
            inv_w: 1.0 / w,
        })
    }

    /// First and last pixel, as (x, y), of a rectangle that holds all pixels whose centres a
    /// surface within a sphere in unit space may cover; empty if there are none. Returns `None` if
    /// the sphere reaches the near plane.
    pub fn around(&self, view: &View, center: DVec3, radius: f64) -> Option<[[i64; 2]; 2]> {
        let w = CAMERA_DISTANCE - center.dot(view.toward);
        if w - radius <= NEAR {
            return None;
        }
        let pixels_per_tan = self.pixels_per_tan();
        let (near, far) = (pixels_per_tan / (w - radius), pixels_per_tan / (w + radius));
        let half = 0.5 * f64::from(self.resolution) - 0.5;
        let last = i64::from(self.resolution) - 1;
        let range = |at: f64| {
            let (low, high) = (at - radius, at + radius);
            let low = low * if low < 0.0 { near } else { far };
            let high = high * if high > 0.0 { near } else { far };
            // One more and one less, since conversion cuts off towards 0.
            let [low, end] = [half + low - SLACK + 1.0, half + high + SLACK + 1.0].map(|at| at.max(0.0) as i64);
            [low, (end - 1).min(last)]
        };
        let [left, right] = range(center.dot(view.right));
        let [top, bottom] = range(-center.dot(view.up));
        Some([[left, top], [right, bottom]])
    }

    /// Ray through the centre of a pixel: returns (x, y) such that the point at axial distance w is
    /// `w * x * right + w * y * up + (CAMERA_DISTANCE - w) * toward`.
    pub fn ray(&self, x: f64, y: f64) -> (f64, f64) {
        let half = 0.5 * f64::from(self.resolution) - 0.5;
        ((x - half) / self.pixels_per_tan(), (half - y) / self.pixels_per_tan())
    }

    /// [Rays](Self::ray) through the centres of pixels (0, 0) and (1, 1).
    pub fn first_rays(&self) -> [(f64, f64); 2] {
        self.first_rays
    }

    fn pixels_per_tan(&self) -> f64 {
        0.5 * f64::from(self.resolution) / HALF_FOV_TAN
    }
}

/// Rounds half to even. Twice as fast as the method of that name where the processor has no
/// instruction for it; correct below 2^51, far above any position.
fn round_ties_even(value: f64) -> f64 {
    const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
    (value + WHOLE) - WHOLE
}

impl View {
    fn looking_from(vertex: DVec3) -> Self {
        let toward = vertex / vertex.dot(vertex).sqrt();
        let across = DVec3::Y.cross(toward);
        let across = if across.dot(across) > 0.0 { across } else { DVec3::X };
        let right = across / across.dot(across).sqrt();
        Self { right, up: toward.cross(right), toward }
    }
}

/// Checks that `count` is one of [`VIEW_COUNTS`].
pub(super) fn check_view_count(count: u32) -> Result<()> {
    if VIEW_COUNTS.contains(&count) {
        return Ok(());
    }
    Err(Error::invalid("views", count, "4, 6, 8, 12 or 20 (the vertices of a regular solid)"))
}

/// Vertices of the regular solid with `count` vertices, not normalised, in a fixed order.
fn solid(count: u32) -> Result<Vec<DVec3>> {
    check_view_count(count)?;
    let v = DVec3::new;
    let signs = [1.0, -1.0];
    let cube = || signs.into_iter().flat_map(move |x| signs.map(|y| signs.map(|z| v(x, y, z)))).flatten();
    // The cyclic permutations of (0, ±a, ±b).
    let rectangles = |a: f64, b: f64| {
        signs.into_iter().flat_map(move |s| {
            signs.into_iter().flat_map(move |t| [v(0.0, s * a, t * b), v(s * a, t * b, 0.0), v(t * b, 0.0, s * a)])
        })
    };
    Ok(match count {
        4 => vec![v(1.0, 1.0, 1.0), v(1.0, -1.0, -1.0), v(-1.0, 1.0, -1.0), v(-1.0, -1.0, 1.0)],
        6 => [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]).collect(),
        8 => cube().collect(),
        12 => rectangles(1.0, PHI).collect(),
        20 => cube().chain(rectangles(INV_PHI, PHI)).collect(),
        _ => Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNIT: Sphere = Sphere { center: [0.0; 3], radius: 1.0 };

    #[test]
    fn vertices_of_each_solid_are_distinct_and_balanced() {
        for count in VIEW_COUNTS {
            let set = ViewSet::new(UNIT, 64, count).unwrap();
            assert_eq!(set.views.len() as u32, count);
            let sum: DVec3 = set.views.iter().map(|view| view.toward).sum();
            assert!(sum.length() < 1e-12, "{count} views lean to {sum}");
            for (i, a) in set.views.iter().enumerate() {
                assert!(set.views[..i].iter().all(|b| a.toward.dot(b.toward) < 0.9));
                assert!((a.right.cross(a.up) - a.toward).length() < 1e-15);
            }
        }
    }

    #[test]
    fn the_unit_sphere_fills_every_view_and_stays_inside() {
        let set = ViewSet::new(UNIT, 256, 20).unwrap();
        let mut greatest = 0.0_f64;
        for view in &set.views {
            for i in 0..400 {
                let angle = f64::from(i) * 0.1;
                let (latitude, longitude) = ((f64::from(i) / 200.0 - 1.0).asin(), angle);
                let unit =
                    DVec3::new(latitude.cos() * longitude.cos(), latitude.sin(), latitude.cos() * longitude.sin());
                let point = set.project(view, unit).unwrap();
                let offset = (point.x as f64 / 256.0 - 127.5).abs().max((point.y as f64 / 256.0 - 127.5).abs());
                assert!(offset <= 128.0);
                greatest = greatest.max(offset);
            }
        }
        assert!(greatest > 127.0);
    }

    #[test]
    fn a_ray_meets_the_point_that_projects_to_its_pixel() {
        let set = ViewSet::new(UNIT, 128, 20).unwrap();
        let view = &set.views[13];
        let (x, y) = set.ray(40.0, 90.0);
        let w = 2.6;
        let unit = view.right * (w * x) + view.up * (w * y) + view.toward * (CAMERA_DISTANCE - w);
        let point = set.project(view, unit).unwrap();
        assert_eq!((point.x, point.y), (40 * 256, 90 * 256));
        assert!((point.inv_w - 1.0 / w).abs() < 1e-14);
    }

    proptest! {
        #[test]
        fn the_rectangle_around_a_sphere_holds_every_point_in_it(
            center in prop::array::uniform3(-1.5..1.5_f64), radius in 0.0..0.5_f64,
            direction in prop::array::uniform3(-1.0..1.0_f64), view in 0..20_usize,
        ) {
            let set = ViewSet::new(UNIT, 64, 20).unwrap();
            let (view, center, direction) = (&set.views[view], DVec3::from(center), DVec3::from(direction));
            prop_assume!(direction.length() > 0.0);
            if let Some([low, high]) = set.around(view, center, radius) {
                let point = set.project(view, center + direction.normalize() * radius).unwrap();
                for (axis, at) in [point.x, point.y].into_iter().enumerate() {
                    let (first, last) = ((at + 255).div_euclid(256), at.div_euclid(256));
                    prop_assert!(low[axis] <= first.max(0) && last.min(63) <= high[axis], "{low:?} {high:?} {point:?}");
                }
            } else {
                prop_assert!(center.dot(view.toward) + radius >= CAMERA_DISTANCE - NEAR);
            }
        }
    }

    #[test]
    fn a_point_behind_the_camera_is_not_seen() {
        let set = ViewSet::new(UNIT, 128, 20).unwrap();
        let view = &set.views[0];
        assert_eq!(set.project(view, view.toward * 2.95), None);
        assert!(set.project(view, view.toward * 2.5).is_some());
    }

    #[test]
    fn other_view_counts_and_resolutions_are_refused() {
        for (resolution, count) in [(0, 20), (4096, 20), (128, 7)] {
            assert!(matches!(ViewSet::new(UNIT, resolution, count), Err(Error::InvalidOption { .. })));
        }
    }
}
