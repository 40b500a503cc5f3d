//! Coarse occlusion test: small squares of pixels, each with the depth of its farthest frontmost
//! fragment.

/// Side of a square in pixels.
const SIDE: usize = 8;

/// Bounds of a leaf in a view: a rectangle of pixels and the nearest depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// First column and row; may lie outside the view.
    pub low: [i64; 2],
    /// Last column and row; may lie outside the view.
    pub high: [i64; 2],
    /// Lower bound of the depth of any fragment.
    pub nearest: u32,
}

/// Farthest frontmost depth of each square of a view.
#[derive(Debug)]
pub struct Farthest {
    resolution: usize,
    /// Number of squares in a row.
    columns: usize,
    depths: Vec<u32>,
    /// Squares in which a frontmost fragment changed since the last refresh, each once.
    stale: Vec<u32>,
    is_stale: Vec<bool>,
}

impl Farthest {
    /// Creates the squares of a square view of `pixels` pixels, all of them stale.
    pub fn new(pixels: usize) -> Self {
        let resolution = pixels.isqrt();
        let columns = resolution.div_ceil(SIDE);
        let squares = columns * columns;
        let stale = (0..squares as u32).collect();
        Self { resolution, columns, depths: vec![u32::MAX; squares], stale, is_stale: vec![true; squares] }
    }

    /// Marks the square of a pixel whose frontmost fragment changed as stale.
    pub fn touch(&mut self, pixel: u32) {
        let (x, y) = (pixel as usize % self.resolution, pixel as usize / self.resolution);
        let square = y / SIDE * self.columns + x / SIDE;
        if !std::mem::replace(&mut self.is_stale[square], true) {
            self.stale.push(square as u32);
        }
    }

    /// Updates the stale squares; `depth(pixel)` returns the depth of a pixel's frontmost fragment.
    pub fn refresh(&mut self, depth: impl Fn(usize) -> u32) {
        for square in self.stale.drain(..) {
            let square = square as usize;
            let (left, top) = (square % self.columns * SIDE, square / self.columns * SIDE);
            let rows = top..(top + SIDE).min(self.resolution);
            let right = (left + SIDE).min(self.resolution);
            let row_farthest = |y: usize| (left..right).map(|x| depth(y * self.resolution + x)).max();
            self.depths[square] = rows.filter_map(row_farthest).max().unwrap_or(0);
            self.is_stale[square] = false;
        }
    }

    /// Whether everything within `extent` is hidden. Valid only after a refresh; conservative,
    /// since whole squares are tested.
    pub fn hides(&self, extent: &Extent) -> bool {
        let last = self.resolution as i64 - 1;
        let [left, top] = extent.low.map(|low| (low.clamp(0, last + 1) as usize) / SIDE);
        let [right, bottom] = extent.high.map(|high| high.clamp(-1, last));
        if right < 0 || bottom < 0 || extent.low.iter().any(|&low| low > last) {
            return true;
        }
        let (right, bottom) = (right as usize / SIDE, bottom as usize / SIDE);
        (top..=bottom).all(|y| (left..=right).all(|x| self.depths[y * self.columns + x] < extent.nearest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_extent_is_hidden_where_every_pixel_of_its_squares_is_nearer(
            depths in prop::collection::vec(0..4_u32, 20 * 20),
            changes in prop::collection::vec((0..400_u32, 0..4_u32), 0..40),
            corners in prop::array::uniform4(-12..32_i64),
            nearest in 0..5_u32,
        ) {
            let mut depths = depths;
            let mut farthest = Farthest::new(depths.len());
            farthest.refresh(|pixel| depths[pixel]);
            for (pixel, depth) in changes {
                depths[pixel as usize] = depth;
                farthest.touch(pixel);
            }
            farthest.refresh(|pixel| depths[pixel]);
            let [x, other_x, y, other_y] = corners;
            let (low, high) = ([x.min(other_x), y.min(other_y)], [x.max(other_x), y.max(other_y)]);
            let is_in = |at: i64, axis: usize| {
                (0..20).any(|inside: i64| inside / 8 == at / 8 && (low[axis]..=high[axis]).contains(&inside))
            };
            let mut within = (0..400_i64).filter(|&pixel| is_in(pixel % 20, 0) && is_in(pixel / 20, 1));
            let expected = within.all(|pixel| depths[pixel as usize] < nearest);
            prop_assert_eq!(farthest.hides(&Extent { low, high, nearest }), expected);
        }
    }
}
