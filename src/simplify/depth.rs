//! Depth of fragments: 1/w as a plane in screen space, converted to 32-bit integers.

use super::views::NEAR;
use wide::{CmpLt, f64x4, i32x4};

/// Number of pixels of a row that are tested at once.
pub const LANES: usize = 8;

/// Depth plane in screen space: 1/w at pixel (x, y) is `x * per_x + y * per_y + at_origin`, clamped
/// to the leaf's range of depths.
#[derive(Debug, Clone, Copy)]
pub struct DepthPlane {
    /// Change of 1/w per column.
    pub per_x: f64,
    /// Change of 1/w per row.
    pub per_y: f64,
    /// 1/w at pixel (0, 0).
    pub at_origin: f64,
    /// Least and greatest 1/w.
    pub range: [f64; 2],
}

/// Depths in 32-bit steps, stored so that they convert to `f64` in one instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct StoredDepth(i32);

impl StoredDepth {
    /// Stores a depth.
    pub fn new(depth: u32) -> Self {
        Self((depth ^ (1 << 31)) as i32)
    }
}

/// Depth that [`StoredDepth`] stores as 0.
const STORED_ZERO: f64 = (1_u32 << 31) as f64;
/// Number of depth steps between 1/w = 0 and 1/w = 1.
const STEPS_PER_INV_W: f64 = NEAR * u32::MAX as f64;

impl DepthPlane {
    /// Depth of a pixel in steps of the 32-bit depth range, 0 nearest.
    pub fn depth(&self, x: i64, y: i64) -> u32 {
        let inv_w = x as f64 * self.per_x + y as f64 * self.per_y + self.at_origin;
        let inv_w = inv_w.max(self.range[0]).min(self.range[1]);
        ((1.0 / NEAR - inv_w) * STEPS_PER_INV_W) as u32
    }

    /// Lower bound of the depths within a rectangle of pixels, both corners included.
    pub fn nearest(&self, [left, top]: [i64; 2], [right, bottom]: [i64; 2]) -> u32 {
        // Each operation is monotone in x and y even when rounded.
        let x = if self.per_x > 0.0 { right } else { left };
        let y = if self.per_y > 0.0 { bottom } else { top };
        self.depth(x, y)
    }

    /// Compares [`LANES`] pixels of row `y`, beginning at column `x`, with `others`. Returns the
    /// pixels where the plane is nearer, and where it is nearer or as near, one bit for each.
    pub fn nearer(&self, x: i64, y: i64, others: &[StoredDepth; LANES]) -> [u32; 2] {
        let half = |first: i64| {
            let columns = f64x4::splat((x + first) as f64) + f64x4::new([0.0, 1.0, 2.0, 3.0]);
            // The same operations in the same order as for a single pixel.
            let inv_w = columns * f64x4::splat(self.per_x) + f64x4::splat(y as f64 * self.per_y);
            let inv_w = inv_w + f64x4::splat(self.at_origin);
            let inv_w = inv_w.fast_max(f64x4::splat(self.range[0])).fast_min(f64x4::splat(self.range[1]));
            let steps = (f64x4::splat(1.0 / NEAR) - inv_w) * f64x4::splat(STEPS_PER_INV_W);
            let others = i32x4::new(std::array::from_fn(|i| others[first as usize + i].0));
            let others = f64x4::from_i32x4(others) + f64x4::splat(STORED_ZERO);
            // A depth is cut off to a whole number, and the others are whole.
            let masks = [steps.cmp_lt(others), steps.cmp_lt(others + f64x4::splat(1.0))];
            masks.map(|mask| (mask.move_mask() as u32) << first)
        };
        let [low, high] = [half(0), half(4)];
        [low[0] | high[0], low[1] | high[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn planes() -> impl Strategy<Value = DepthPlane> {
        (-1e-3..1e-3, -1e-3..1e-3, 0.1..1.0_f64, 0.1..0.4_f64, 0.0..0.3_f64).prop_map(
            |(per_x, per_y, at_origin, least, size)| DepthPlane {
                per_x,
                per_y,
                at_origin,
                range: [least, least + size],
            },
        )
    }

    proptest! {
        #[test]
        fn eight_pixels_at_once_compare_as_one_by_one(
            plane in planes(), x in 0..2048_i64, y in 0..2048_i64, nudges in prop::array::uniform8(-2..=2_i64),
        ) {
            let others = std::array::from_fn(|i| {
                let depth = i64::from(plane.depth(x + i as i64, y));
                (depth + nudges[i]).clamp(0, u32::MAX.into()) as u32
            });
            let [nearer, as_near] = plane.nearer(x, y, &others.map(StoredDepth::new));
            for (i, other) in others.into_iter().enumerate() {
                let depth = plane.depth(x + i as i64, y);
                prop_assert_eq!(nearer >> i & 1 == 1, depth < other);
                prop_assert_eq!(as_near >> i & 1 == 1, depth <= other);
            }
        }

        #[test]
        fn no_pixel_of_a_rectangle_is_nearer_than_its_bound(
            plane in planes(), x in 0..2048_i64, y in 0..2048_i64, size in prop::array::uniform2(0..9_i64),
        ) {
            let bound = plane.nearest([x, y], [x + size[0], y + size[1]]);
            for (right, down) in (0..=size[0]).flat_map(|right| (0..=size[1]).map(move |down| (right, down))) {
                prop_assert!(plane.depth(x + right, y + down) >= bound);
            }
        }
    }
}
