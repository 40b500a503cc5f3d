//! How much of a picture triangles cover together: those behind others add nothing.

use glam::{Vec2, Vec3};

/// Width and height of a picture in pixels. Stems are thinner than a pixel: its middle stands for
/// it, so that of many the right share is hit.
const SIDE: usize = 512;
/// Directions that wood is seen from: level, all around.
const DIRECTIONS: [Vec3; 3] = [Vec3::new(0.28, 0.1, 0.95), Vec3::new(0.68, -0.1, -0.72), Vec3::new(-0.97, 0.05, 0.22)];

/// Orthographic pictures of wood in a ball.
pub(super) struct Union {
    middle: Vec3,
    /// Pixels over a unit of length.
    scale: f32,
    covered: Vec<Vec<bool>>,
}

impl Union {
    pub(super) fn new(middle: Vec3, radius: f32) -> Self {
        let covered = vec![vec![false; SIDE * SIDE]; DIRECTIONS.len()];
        Self { middle, scale: SIDE as f32 / (2.0 * radius), covered }
    }

    /// Number of pixels that are covered once triangles are drawn too, given those that are seen
    /// from a direction.
    pub(super) fn with<I: Iterator<Item = [Vec3; 3]>>(&mut self, triangles: impl Fn(Vec3) -> I) -> u64 {
        for (direction, covered) in DIRECTIONS.iter().zip(&mut self.covered) {
            let (right, up) = direction.normalize().any_orthonormal_pair();
            for corners in triangles(*direction) {
                let at = |corner: Vec3| {
                    let from_middle = (corner - self.middle) * self.scale;
                    Vec2::new(from_middle.dot(right), from_middle.dot(up)) + 0.5 * SIDE as f32
                };
                fill(covered, corners.map(at));
            }
        }
        self.covered.iter().flatten().filter(|&&is_covered| is_covered).count() as u64
    }
}

/// Covers the pixels whose middles are in a triangle.
fn fill(covered: &mut [bool], corners: [Vec2; 3]) {
    // The first of the steps, counted from their middles, at or above a place.
    let first = |at: f32| (at - 0.5).ceil().clamp(0.0, SIDE as f32) as usize;
    let [low, high] = corners
        .iter()
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], corner| [low.min(corner.y), high.max(corner.y)]);
    for row in first(low)..first(high) {
        let y = row as f32 + 0.5;
        let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
            let share = (y - a.y) / (b.y - a.y);
            if (0.0..=1.0).contains(&share) {
                let x = a.x + (b.x - a.x) * share;
                (left, right) = (left.min(x), right.max(x));
            }
        }
        let columns = first(left)..first(right).max(first(left));
        covered[row * SIDE..][columns].fill(true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_counted_once() {
        let mut union = Union::new(Vec3::ZERO, 1.0);
        // Half of a square that is turned towards the first direction and as wide as the picture.
        let (right, up) = DIRECTIONS[0].normalize().any_orthonormal_pair();
        let half = [-right - up, right - up, up - right];
        union.with(|_| [half].into_iter());
        let pixels = |union: &Union| union.covered[0].iter().filter(|&&is_covered| is_covered).count() as i64;
        let found = pixels(&union);
        assert!((found - (SIDE * SIDE / 2) as i64).abs() <= SIDE as i64, "{found}");
        let again = union.with(|_| [half, half.map(|corner| corner * 0.5)].into_iter());
        assert!(again >= found as u64 && pixels(&union) == found);
        // Far outside, without area, and not numbers.
        let odd = [
            half.map(|corner| corner + 9.0),
            [right; 3],
            [Vec3::NAN; 3],
            [Vec3::splat(1e30), half[0], -half[1] * 1e20],
        ];
        union.with(|_| odd[..3].iter().copied());
        assert_eq!(pixels(&union), found);
        union.with(|_| odd.into_iter());
    }
}
