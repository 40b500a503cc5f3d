//! Coordinate frames of a growing stem, with trigonometry that is bit-identical on all machines.
//!
//! The sine of the standard library differs between systems in the last bit, which is enough to
//! move a twig elsewhere; the `libm` crate is plain arithmetic. Only scalar vectors are used
//! because SIMD vectors may be summed in another order.

use glam::Vec3;

/// Sine and cosine of an angle in radians.
pub(super) fn sin_cos(angle: f32) -> (f32, f32) {
    libm::sincosf(angle)
}

/// Rotates `vector` about the unit `axis` by `angle` radians (Rodrigues' formula).
pub(super) fn turned(vector: Vec3, axis: Vec3, angle: f32) -> Vec3 {
    let (sin, cos) = sin_cos(angle);
    vector * cos + axis.cross(vector) * sin + axis * axis.dot(vector) * (1.0 - cos)
}

/// Direction of growth of a stem, and the axis it bends about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    /// Unit direction of growth.
    pub heading: Vec3,
    /// Unit vector perpendicular to `heading`: the axis about which the stem bends.
    pub side: Vec3,
}

impl Frame {
    /// Straight up.
    pub const UP: Self = Self { heading: Vec3::Y, side: Vec3::X };

    /// Bends about `side` by `angle` radians.
    pub fn pitched(self, angle: f32) -> Self {
        self.turned(self.side, angle)
    }

    /// Twists about `heading` by `angle` radians.
    pub fn rolled(self, angle: f32) -> Self {
        self.turned(self.heading, angle)
    }

    /// Rotates about the unit `axis` by `angle` radians; restores unit length and the right angle.
    pub fn turned(self, axis: Vec3, angle: f32) -> Self {
        let heading = turned(self.heading, axis, angle).normalize_or(self.heading);
        let side = turned(self.side, axis, angle);
        let side = (side - heading * side.dot(heading)).normalize_or(heading.any_orthonormal_vector());
        Self { heading, side }
    }

    /// Turns towards straight up by `angle` radians (away if negative), never past the vertical.
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
