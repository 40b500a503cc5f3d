//! Frontmost fragments of a view, laid out for finding what a leaf would show: of eight pixels in
//! one cache line, and the farthest depth of each small square.

use super::{
    depth::{LANES, StoredDepth},
    order::PixelOrder,
};
use wide::{CmpEq, i32x8};

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

impl Fronts {
    /// Pixels of a polygon, one bit for each.
    pub fn lanes_of(&self, polygon: u32) -> u32 {
        let polygons = i32x8::new(self.polygons.map(|polygon| polygon as i32));
        polygons.cmp_eq(i32x8::splat(polygon as i32)).move_mask() as u32
    }
}

/// Frontmost fragments of a view.
#[derive(Debug)]
pub struct Occlusion {
    order: PixelOrder,
    /// Number of squares in a row.
    columns: usize,
    /// Rows of each square, one square after another, padded with depth 0.
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
            order: PixelOrder::new(resolution as u32),
            columns,
            fronts: vec![none; squares * SIDE],
            farthest: vec![StoredDepth::new(0); squares],
            stale: Vec::new(),
            is_stale: vec![false; squares],
        }
    }

    /// Changes the frontmost fragment of a pixel.
    pub fn set(&mut self, pixel: u32, depth: u32, polygon: u32) {
        let [x, y] = self.order.pixel(pixel).map(|at| at as usize);
        let square = y / SIDE * self.columns + x / SIDE;
        let fronts = &mut self.fronts[square * SIDE + y % SIDE];
        fronts.polygons[x % LANES] = polygon;
        let stored = &mut fronts.depths[x % LANES];
        let has_moved = std::mem::replace(stored, StoredDepth::new(depth)) != *stored;
        if has_moved && !std::mem::replace(&mut self.is_stale[square], true) {
            self.stale.push(square as u32);
        }
    }

    /// Updates the farthest depths.
    pub fn refresh(&mut self) {
        for square in self.stale.drain(..) {
            let square = square as usize;
            let depths = self.fronts[square * SIDE..][..SIDE].iter().flat_map(|row| row.depths);
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
        &self.fronts[(y / SIDE * self.columns + column) * SIDE + y % SIDE]
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
            let at = |pixel: usize| PixelOrder::new(20).pixel(pixel as u32).map(|at| at as usize);
            let is_in = |pixel: &usize| at(*pixel).map(|at| at / SIDE) == square;
            let expected = (0..400).filter(is_in).all(|pixel| depths[pixel] < depth);
            prop_assert_eq!(occlusion.hides(square, depth), expected);
            for (pixel, &depth) in depths.iter().enumerate() {
                let [x, y] = at(pixel);
                let Fronts { depths, polygons } = occlusion.fronts(x / LANES, y);
                prop_assert_eq!((depths[x % LANES], polygons[x % LANES]), (StoredDepth::new(depth), depth));
            }
        }
    }
}
