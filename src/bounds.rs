//! Bounding box and bounding sphere, in the plant's own units.

use glam::{DAffine3, DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Axis-aligned bounding box. Empty (`min > max`) until a point is added.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Minimum corner.
    pub min: [f32; 3],
    /// Maximum corner.
    pub max: [f32; 3],
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// Smallest box around `points`; [`Aabb::EMPTY`] if there are none.
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        let mut aabb = Self::EMPTY;
        for point in points {
            aabb.add(point);
        }
        aabb
    }

    /// Grows the box to contain `point`.
    pub fn add(&mut self, point: [f32; 3]) {
        for (axis, &value) in point.iter().enumerate() {
            self.min[axis] = self.min[axis].min(value);
            self.max[axis] = self.max[axis].max(value);
        }
    }

    /// Returns true if the box contains no point.
    pub fn is_empty(&self) -> bool {
        self.min[0] > self.max[0]
    }

    /// Centre of the box, computed in `f64` to stay accurate far from the origin. The origin if
    /// empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() {
            return DVec3::ZERO;
        }
        (Vec3::from(self.min).as_dvec3() + Vec3::from(self.max).as_dvec3()) * 0.5
    }

    /// Edge lengths; zero if empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { Vec3::from(self.max) - Vec3::from(self.min) }
    }
}

/// Bounding sphere, in `f64` because views are placed relative to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Centre.
    pub center: [f64; 3],
    /// Radius, at least 0.
    pub radius: f64,
}

impl Sphere {
    /// Bounding sphere of this one after `transform`; uneven scaling counts by its largest axis.
    pub fn transformed(&self, transform: &DAffine3) -> Self {
        let center = transform.transform_point3(self.center());
        Self { center: center.to_array(), radius: self.radius * largest_scale(transform) }
    }

    /// Sphere centred on the points' bounding box that reaches the farthest point.
    ///
    /// Its radius is at most 1.74 times that of the smallest enclosing sphere and does not depend
    /// on the order of the points. It is 0 for one point or none.
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]> + Clone) -> Self {
        let center = Aabb::of_points(points.clone()).center();
        let radius_squared =
            points.into_iter().map(|p| Vec3::from(p).as_dvec3().distance_squared(center)).fold(0.0, f64::max);
        Self { center: center.to_array(), radius: radius_squared.sqrt() }
    }

    /// Centre as a vector.
    pub fn center(&self) -> DVec3 {
        DVec3::from_array(self.center)
    }
}

/// Largest factor by which a transform scales lengths along its axes.
pub(crate) fn largest_scale(transform: &DAffine3) -> f64 {
    (0..3).map(|axis| transform.matrix3.col(axis).length_squared()).fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sphere_contains_every_point_far_from_the_origin() {
        let points = [[1e6, 0.0, 0.0], [1e6 + 2.0, 0.0, 0.0], [1e6 + 1.0, 0.5, 0.0]];
        let sphere = Sphere::of_points(points);
        assert_eq!(sphere.center, [1e6 + 1.0, 0.25, 0.0]);
        for point in points {
            assert!(Vec3::from(point).as_dvec3().distance(sphere.center()) <= sphere.radius);
        }
    }

    #[test]
    fn bounds_of_nothing_are_empty_and_have_radius_zero() {
        assert!(Aabb::of_points([]).is_empty());
        assert_eq!(Aabb::EMPTY.size(), Vec3::ZERO);
        assert_eq!(Sphere::of_points([]), Sphere { center: [0.0; 3], radius: 0.0 });
    }
}
