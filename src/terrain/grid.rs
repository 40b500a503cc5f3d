//! Errors of the grid points: how far the ground may be from its triangles without them.

use super::height::HeightMap;

/// Largest depth: 4097 points on a side.
const MAX_DEPTH: u32 = 12;

/// A grid of 2^depth squares on a side over the area of a height map.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    depth: u32,
    /// Upper halves of the errors' bits, rounded up, row by row. 0 at the corners, which are always
    /// drawn.
    errors: Vec<u16>,
}

impl Grid {
    /// The grid with at least two squares for each texel, as far as its depth allows: heights are
    /// bilinear between texels, triangles are flat.
    pub(super) fn new(heights: &HeightMap) -> Self {
        let [width, height] = heights.map().size();
        let depth = (width.max(height).next_power_of_two().ilog2() + 1).min(MAX_DEPTH);
        let mut grid = Self { depth, errors: vec![0; ((1_usize << depth) + 1).pow(2)] };
        grid.measure(heights);
        grid
    }

    pub(super) fn depth(&self) -> u32 {
        self.depth
    }

    /// Squares on a side.
    pub(super) fn side(&self) -> u32 {
        1 << self.depth
    }

    /// Bound of the vertical distance between the ground and triangles that leave out this point
    /// and all that follow from it.
    pub(super) fn error(&self, [x, z]: [u32; 2]) -> f64 {
        f64::from(f32::from_bits(u32::from(self.errors[self.index([x, z])]) << 16))
    }

    fn index(&self, [x, z]: [u32; 2]) -> usize {
        z as usize * (self.side() as usize + 1) + x as usize
    }

    /// Measures errors from the finest points to the coarsest.
    fn measure(&mut self, heights: &HeightMap) {
        let side = self.side();
        let places = (0..=side).flat_map(|z| (0..=side).map(move |x| [x, z]));
        let share = |at: u32| f64::from(at) / f64::from(side);
        let height: Vec<f32> = places.map(|at| heights.height_at(at.map(share)) as f32).collect();
        let mut half = 1;
        while half < side {
            self.measure_edges(&height, half);
            self.measure_middles(&height, half);
            half *= 2;
        }
    }

    /// Middles of the sides of squares of two times `half`; they are followed by the middles of the
    /// squares beside them that are half as large.
    fn measure_edges(&mut self, height: &[f32], half: u32) {
        let (side, quarter) = (self.side(), half / 2);
        for z in (0..=side).step_by(half as usize) {
            let is_across = (z / half).is_multiple_of(2);
            let first = if is_across { half } else { 0 };
            for x in (first..=side).step_by(2 * half as usize) {
                let ends = if is_across { [[x - half, z], [x + half, z]] } else { [[x, z - half], [x, z + half]] };
                let around = [-1, 1].map(|dz| [-1, 1].map(|dx| [dx, dz]));
                self.set(height, [x, z], ends, around.as_flattened(), quarter);
            }
        }
    }

    /// Middles of squares of two times `half`; they are followed by the middles of the squares'
    /// sides. The long sides of the triangles run through the middle of the next larger square.
    fn measure_middles(&mut self, height: &[f32], half: u32) {
        let side = self.side();
        let odd = |at: u32| if (at - half) / (2 * half) % 2 == 1 { at - half } else { at + half };
        for z in (half..side).step_by(2 * half as usize) {
            for x in (half..side).step_by(2 * half as usize) {
                let from = if 2 * half == side { [0, 0] } else { [odd(x), odd(z)] };
                let ends = [from, [2 * x - from[0], 2 * z - from[1]]];
                self.set(height, [x, z], ends, &[[-1, 0], [1, 0], [0, -1], [0, 1]], half);
            }
        }
    }

    /// Sets the error of a point between two ends: its own, and the greatest of the points `step`
    /// away in some directions that lie in the grid; none if `step` is 0.
    fn set(&mut self, height: &[f32], at: [u32; 2], ends: [[u32; 2]; 2], followers: &[[i64; 2]], step: u32) {
        let [a, b] = ends.map(|end| height[self.index(end)]);
        let own = (height[self.index(at)] - 0.5 * (a + b)).abs();
        let inside = |direction: &[i64; 2]| {
            let [x, z] = [0, 1].map(|axis| u32::try_from(i64::from(at[axis]) + direction[axis] * i64::from(step)));
            x.ok().zip(z.ok()).filter(|&(x, z)| x.max(z) <= self.side()).map(|(x, z)| [x, z])
        };
        let followers = followers.iter().filter(|_| step > 0).filter_map(inside);
        let greatest = followers.map(|follower| self.error(follower)).fold(0.0, f64::max);
        let index = self.index(at);
        self.errors[index] = rounded_up((f64::from(own) + greatest) as f32);
    }
}

/// Upper half of the bits of the least number of that precision that is not below `error`.
fn rounded_up(error: f32) -> u16 {
    (error.to_bits().saturating_add(0xffff) >> 16) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Map;

    #[test]
    fn errors_never_fall_from_a_point_to_one_it_follows_from_and_flat_ground_has_none() {
        let texels = (0..40 * 23).map(|i: u32| (i.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
        let map = Map::new([40, 23], texels).unwrap();
        let heights = HeightMap::new(map, [0.0; 2], [80.0, 46.0], [0.0, 10.0]).unwrap();
        let grid = Grid::new(&heights);
        assert_eq!(grid.side(), 128);
        let mut half = 1;
        while 2 * half < grid.side() {
            for z in (half..grid.side()).step_by(2 * half as usize) {
                for x in (half..grid.side()).step_by(2 * half as usize) {
                    for around in [[x - half, z], [x + half, z], [x, z - half], [x, z + half]] {
                        assert!(grid.error([x, z]) >= grid.error(around), "{x} {z}");
                    }
                }
            }
            half *= 2;
        }
        let flat = Grid::new(&HeightMap::level(5.0).unwrap());
        assert!(flat.errors.iter().all(|&error| error == 0));
    }
}
