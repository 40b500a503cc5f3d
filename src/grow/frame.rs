//! Directions of a growing stem, turned with a trigonometry that gives the same bits on every machine.
//!
//! The standard library's sine differs between systems in the last bit, which is enough to move a twig to another place;
//! the `libm` crate is plain arithmetic. Only scalar vectors are used, since sums of SIMD ones may be ordered otherwise.

use glam::Vec3;

/// Sine and cosine of an angle in radians.
pub(super) fn sin_cos(angle: f32) -> (f32, f32) {
    libm::sincosf(angle)
}

/// `vector` turned about the unit `axis` by `angle` radians (Rodrigues' formula).
pub(super) fn turned(vector: Vec3, axis: Vec3, angle: f32) -> Vec3 {
    let (sin, cos) = sin_cos(angle);
    vector * cos + axis.cross(vector) * sin + axis * axis.dot(vector) * (1.0 - cos)
}

/// Where a stem grows and which way it bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    /// Unit direction of growth.
    pub heading: Vec3,
    /// Unit, perpendicular to `heading`: the axis about which the stem bends.
    pub side: Vec3,
}

impl Frame {
    /// Straight up.
    pub const UP: Self = Self { heading: Vec3::Y, side: Vec3::X };

    /// Bent about its side by `angle` radians.
    pub fn pitched(self, angle: f32) -> Self {
        self.turned(self.side, angle)
    }

    /// Twisted about its heading by `angle` radians.
    pub fn rolled(self, angle: f32) -> Self {
        self.turned(self.heading, angle)
    }

    /// Turned as a whole about the unit `axis` by `angle` radians; brought back to unit length and a right angle.
    pub fn turned(self, axis: Vec3, angle: f32) -> Self {
        let heading = turned(self.heading, axis, angle).normalize_or(self.heading);
        let side = turned(self.side, axis, angle);
        let side = (side - heading * side.dot(heading)).normalize_or(heading.any_orthonormal_vector());
        Self { heading, side }
    }

    /// Turned towards straight up by `angle` radians (away from it when negative), never past the vertical.
    pub fn lifted(self, angle: f32) -> Self {
        let axis = self.heading.cross(Vec3::Y);
        let sin_declination = axis.length();
        if sin_declination < 1e-4 {
            return self;
        }
        let declination = libm::atan2f(sin_declination, self.heading.y);
        self.turned(axis / sin_declination, angle.clamp(declination - std::f32::consts::PI, declination))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lifting_stops_at_the_vertical() {
        let level = Frame { heading: Vec3::X, side: Vec3::Z };
        assert!(level.lifted(10.0).heading.distance(Vec3::Y) < 1e-6);
        assert!(level.lifted(-10.0).heading.distance(-Vec3::Y) < 1e-6);
    }

    #[test]
    fn a_thousand_turns_leave_a_frame_orthonormal() {
        let mut frame = Frame::UP;
        for i in 0..1000 {
            frame = frame.pitched(0.3).rolled(i as f32);
        }
        assert!((frame.heading.length() - 1.0).abs() < 1e-5 && (frame.side.length() - 1.0).abs() < 1e-5);
        assert!(frame.heading.dot(frame.side).abs() < 1e-5);
    }
}
