//! Order of a view's pixels in memory: strips of eight rows, column after column within a strip, so
//! that the pixels of a leaf lie in few pages.

/// Number of rows in a strip; the last one may have fewer.
const ROWS: u32 = 8;

/// Order of the pixels of a square view.
#[derive(Debug, Clone, Copy)]
pub struct PixelOrder {
    side: u32,
}

impl PixelOrder {
    /// Order of a view of `side` x `side` pixels.
    pub fn new(side: u32) -> Self {
        Self { side }
    }

    fn rows(self, top: u32) -> u32 {
        ROWS.min(self.side - top)
    }

    /// Index of pixel (x, y).
    pub fn index(self, x: u32, y: u32) -> u32 {
        let top = y - y % ROWS;
        top * self.side + x * self.rows(top) + (y - top)
    }

    /// Index of a pixel that is numbered row by row.
    pub fn index_of(self, number: u32) -> u32 {
        self.index(number % self.side, number / self.side)
    }

    /// Pixel at an index, as (x, y).
    pub fn pixel(self, index: u32) -> [u32; 2] {
        let top = index / (ROWS * self.side) * ROWS;
        let (within, rows) = (index - top * self.side, self.rows(top));
        [within / rows, top + within % rows]
    }

    /// Arranges values that are given row by row.
    pub fn arranged(self, values: &[u32]) -> Vec<u32> {
        let value = |index| {
            let [x, y] = self.pixel(index);
            values[(y * self.side + x) as usize]
        };
        (0..values.len() as u32).map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_an_index_of_its_own() {
        for side in 1..20 {
            let order = PixelOrder::new(side);
            let numbers: Vec<u32> = (0..side * side).collect();
            for (index, number) in order.arranged(&numbers).into_iter().enumerate() {
                let [x, y] = order.pixel(index as u32);
                assert_eq!([number % side, number / side], [x, y]);
                assert_eq!([order.index(x, y), order.index_of(number)], [index as u32; 2]);
            }
        }
    }

    #[test]
    fn a_column_of_a_strip_is_contiguous() {
        let order = PixelOrder::new(20);
        assert_eq!([order.index(0, 0), order.index(0, 7), order.index(1, 0), order.index(19, 7)], [0, 7, 8, 159]);
        assert_eq!([order.index(0, 16), order.index(1, 16), order.index(19, 19)], [320, 324, 399]);
    }
}
