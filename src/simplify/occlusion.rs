//! Frontmost fragments of a view, laid out for finding what a leaf would show: of eight pixels in
//! one cache line, and the farthest depth of each small square.

use super::depth::{LANES, StoredDepth};

/// Side of a square in pixels.
pub const SIDE: usize = LANES;

/// Frontmost fragments of part of a row of pixels.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct Fronts {
    /// Depth of each pixel.
    pub depths: [StoredDepth; LANES],
    /// Polygon of each pixel.
    pub polygons: [u32; LANES],
}

/// Frontmost fragments of a view.
#[derive(Debug)]
pub struct Occlusion {
    resolution: usize,
    /// Number of squares in a row.
    columns: usize,
    /// Each row of pixels, padded to whole squares with depth 0.
    fronts: Vec<Fronts>,
    /// Farthest depth of each square.
    farthest: Vec<StoredDepth>,
    /// Squares in which a depth changed since the last refresh, each once.
    stale: Vec<u32>,
    is_stale: Vec<bool>,
}

impl Occlusion {
    /// Creates the fronts of a square view of `pixels` pixels, to be [set](Self::set) one by one.
    pub fn new(pixels: usize) -> Self {
        let resolution = pixels.isqrt();
        let columns = resolution.div_ceil(SIDE);
        let squares = columns * columns;
        let none = Fronts { depths: [StoredDepth::new(0); LANES], polygons: [0; LANES] };
        Self {
            resolution,
            columns,
            fronts: vec![none; columns * resolution],
            farthest: vec![StoredDepth::new(0); squares],
            stale: Vec::new(),
            is_stale: vec![false; squares],
        }
    }

    /// Changes the frontmost fragment of a pixel.
    pub fn set(&mut self, pixel: u32, depth: u32, polygon: u32) {
        let (x, y) = (pixel as usize % self.resolution, pixel as usize / self.resolution);
        let fronts = &mut self.fronts[y * self.columns + x / LANES];
        fronts.polygons[x % LANES] = polygon;
        let stored = &mut fronts.depths[x % LANES];
        if std::mem::replace(stored, StoredDepth::new(depth)) != *stored {
            let square = y / SIDE * self.columns + x / SIDE;
            if !std::mem::replace(&mut self.is_stale[square], true) {
                self.stale.push(square as u32);
            }
        }
    }

    /// Updates the farthest depths.
    pub fn refresh(&mut self) {
        for square in self.stale.drain(..) {
            let square = square as usize;
            let (column, top) = (square % self.columns, square / self.columns * SIDE);
            let rows = top..(top + SIDE).min(self.resolution);
            let depths = rows.flat_map(|y| self.fronts[y * self.columns + column].depths);
            self.farthest[square] = depths.fold(StoredDepth::new(0), StoredDepth::max);
            self.is_stale[square] = false;
        }
    }

    /// Whether a fragment at `depth` is hidden wherever it lies in a square of this column and row
    /// of squares. Valid only after a refresh.
    pub fn hides(&self, [column, row]: [usize; 2], depth: u32) -> bool {
        self.farthest[row * self.columns + column] < StoredDepth::new(depth)
    }

    /// Part of pixel row `y` that lies in a column of squares.
    pub fn fronts(&self, column: usize, y: usize) -> &Fronts {
        &self.fronts[y * self.columns + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_square_hides_what_lies_behind_all_of_its_pixels(
            depths in prop::collection::vec(0..4_u32, 20 * 20),
            changes in prop::collection::vec((0..400_u32, 0..4_u32), 0..40),
            square in prop::array::uniform2(0..3_usize),
            depth in 0..5_u32,
        ) {
            let mut depths = depths;
            let mut occlusion = Occlusion::new(depths.len());
            depths.iter().zip(0..).for_each(|(&depth, pixel)| occlusion.set(pixel, depth, depth));
            occlusion.refresh();
            for (pixel, depth) in changes {
                depths[pixel as usize] = depth;
                occlusion.set(pixel, depth, depth);
            }
            occlusion.refresh();
            let is_in = |pixel: &usize| [pixel % 20 / SIDE, pixel / 20 / SIDE] == square;
            let expected = (0..400).filter(is_in).all(|pixel| depths[pixel] < depth);
            prop_assert_eq!(occlusion.hides(square, depth), expected);
            for (pixel, &depth) in depths.iter().enumerate() {
                let (x, y) = (pixel % 20, pixel / 20);
                let Fronts { depths, polygons } = occlusion.fronts(x / LANES, y);
                prop_assert_eq!((depths[x % LANES], polygons[x % LANES]), (StoredDepth::new(depth), depth));
            }
        }
    }
}
