//! Bounding box and bounding sphere, in the plant's own units.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Axis-aligned box. Empty (`min > max`) until a point is added.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Least corner.
    pub min: [f32; 3],
    /// Greatest corner.
    pub max: [f32; 3],
}

impl Aabb {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// The smallest box around `points`; [`Aabb::EMPTY`] for none.
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

    /// True when no point was added.
    pub fn is_empty(&self) -> bool {
        self.min[0] > self.max[0]
    }

    /// The middle, computed in `f64` so that boxes far from the origin keep it; the origin when empty.
    pub fn center(&self) -> DVec3 {
        if self.is_empty() {
            return DVec3::ZERO;
        }
        (Vec3::from(self.min).as_dvec3() + Vec3::from(self.max).as_dvec3()) * 0.5
    }

    /// Edge lengths; zero when empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { Vec3::from(self.max) - Vec3::from(self.min) }
    }
}

/// Sphere, in `f64` because views are placed from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Middle.
    pub center: [f64; 3],
    /// Radius, at least 0.
    pub radius: f64,
}

impl Sphere {
    /// The sphere about the centre of the points' box that reaches the farthest point.
    ///
    /// At most 1.74 times larger than the smallest sphere and independent of the order of the points. Radius 0 for one
    /// point or none.
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]> + Clone) -> Self {
        let center = Aabb::of_points(points.clone()).center();
        let radius_squared =
            points.into_iter().map(|p| Vec3::from(p).as_dvec3().distance_squared(center)).fold(0.0, f64::max);
        Self { center: center.to_array(), radius: radius_squared.sqrt() }
    }

    /// The middle as a vector.
    pub fn center(&self) -> DVec3 {
        DVec3::from_array(self.center)
    }
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
