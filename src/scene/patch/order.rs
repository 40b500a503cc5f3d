//! The cells of a patch from far to near, computed instead of sorted.
//!
//! After D. McNabb, *Foliage Patch* (Intel, 2013): rows of cells along the axis that the camera
//! looks along, the farthest first; in each row the cells to the left and to the right of the
//! camera in turn, from the outside to the middle. Each of both sides goes through the whole row
//! and leaves out the cells of the other.
//!
//! Differs: rows may also lie along the diagonals. At 45 degrees to an axis the published rows
//! have a fourth of the neighbours in the wrong order.

/// Tangent of 22.5 degrees: directions nearer to a diagonal than to an axis.
const HALF_OCTANT: f64 = 0.414_213_562_373_095_03;

/// Directions in which rows of cells may follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sweep {
    /// Along both axes, as published.
    Axes,
    /// Along both axes and both diagonals.
    #[default]
    Octants,
}

/// Order of the cells of a square.
#[derive(Debug, Clone, Copy)]
pub struct CellOrder {
    cells: u32,
    /// Signs of the direction in which rows follow each other.
    towards: [i32; 2],
    look: [f64; 2],
    eye: [f64; 2],
}

impl CellOrder {
    /// Order of `cells` x `cells` cells for a camera that looks along `look`, x and z of any
    /// length; `eye` is its place in cells from the corner with the least x and z.
    pub fn new(cells: u32, look: [f64; 2], eye: [f64; 2], sweep: Sweep) -> Self {
        let [along, across] = look.map(f64::abs);
        let is_diagonal = sweep == Sweep::Octants && along.min(across) > HALF_OCTANT * along.max(across);
        let sign = |value: f64| if value > 0.0 { 1 } else { -1 };
        let towards = match is_diagonal {
            true => look.map(sign),
            false if along > across => [sign(look[0]), 0],
            false => [0, sign(look[1])],
        };
        Self { cells, towards, look, eye }
    }

    /// Number of render indices: at least twice that of the cells, since each index of the other
    /// side has none.
    pub fn len(&self) -> u32 {
        2 * self.cells * self.rows()
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.cells == 0
    }

    /// Column and row of the cell that is drawn at a render index. Each cell is drawn at one.
    pub fn sorted_index(&self, render_index: u32) -> Option<[u32; 2]> {
        let (side, step) = (render_index & 1, render_index >> 1);
        let (column, row) = (step % self.cells, step / self.cells);
        let last = self.cells - 1;
        let far = self.rows().checked_sub(1 + row)?;
        let rises = side == 1;
        let [x, z] = match self.towards {
            // The place across rows rises with z if rows follow x, and falls with x if they follow
            // z.
            [towards, 0] => [along(far, towards, last), along(column, if rises { towards } else { -towards }, last)],
            [0, towards] => [along(column, if rises { -towards } else { towards }, last), along(far, towards, last)],
            [right, up] => {
                let x = if rises == (right * up > 0) { last - column } else { column };
                let z = far.checked_sub(x).filter(|z| *z <= last)?;
                [along(x, right, last), along(z, up, last)]
            }
        };
        let offset = [f64::from(x) + 0.5 - self.eye[0], f64::from(z) + 0.5 - self.eye[1]];
        let across = self.look[0] * offset[1] - self.look[1] * offset[0];
        ((across <= 0.0) == rises).then_some([x, z])
    }

    fn rows(&self) -> u32 {
        if self.towards.contains(&0) { self.cells } else { (2 * self.cells).saturating_sub(1) }
    }
}

/// A place counted along an axis or against it.
fn along(place: u32, towards: i32, last: u32) -> u32 {
    if towards > 0 { place } else { last - place }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(order: &CellOrder) -> Vec<[u32; 2]> {
        (0..order.len()).filter_map(|index| order.sorted_index(index)).collect()
    }

    fn look(degrees: f64) -> [f64; 2] {
        [libm::cos(degrees.to_radians()), libm::sin(degrees.to_radians())]
    }

    /// Share of neighbours in the order whose second is farther along the look.
    fn misordered(degrees: f64, sweep: Sweep) -> f64 {
        let [x, z] = look(degrees);
        // From the middle of the side that the camera looks away from, 40 cells behind it.
        let eye = [64.0 - 104.0 * x, 64.0 - 104.0 * z];
        let ordered = cells(&CellOrder::new(128, [x, z], eye, sweep));
        let far = |cell: [u32; 2]| libm::hypot(f64::from(cell[0]) + 0.5 - eye[0], f64::from(cell[1]) + 0.5 - eye[1]);
        ordered.windows(2).filter(|pair| far(pair[1]) > far(pair[0])).count() as f64 / ordered.len() as f64
    }

    #[test]
    fn each_cell_comes_once_in_every_direction() {
        for sweep in [Sweep::Axes, Sweep::Octants] {
            for (degrees, eye) in
                (0..72).map(|i| f64::from(i) * 5.0).zip([[8.0, 8.0], [-3.0, 20.0], [5.5, 1.0]].into_iter().cycle())
            {
                let mut ordered = cells(&CellOrder::new(17, look(degrees), eye, sweep));
                ordered.sort_unstable();
                ordered.dedup();
                assert_eq!(ordered.len(), 17 * 17, "{degrees} {sweep:?}");
            }
        }
        assert!(cells(&CellOrder::new(0, [1.0, 0.0], [0.0; 2], Sweep::Axes)).is_empty());
    }

    #[test]
    fn rows_come_from_far_to_near_and_cells_from_the_outside_to_the_middle() {
        let ordered = cells(&CellOrder::new(4, [1.0, 0.0], [-2.0, 2.0], Sweep::Axes));
        assert_eq!(ordered[..4], [[3, 3], [3, 0], [3, 2], [3, 1]]);
        let ordered = cells(&CellOrder::new(3, [1.0, 1.0], [-2.0, -2.0], Sweep::Octants));
        assert_eq!(ordered[0], [2, 2]);
        assert_eq!(*ordered.last().unwrap(), [0, 0]);
    }

    #[test]
    fn diagonal_rows_more_than_halve_what_is_out_of_order() {
        let table = [0.0, 10.0, 22.0, 45.0]
            .map(|degrees| [Sweep::Axes, Sweep::Octants].map(|sweep| misordered(degrees, sweep)));
        println!("neighbours out of order at 0, 10, 22, 45 degrees, by axes and by octants: {table:.3?}");
        assert!(table[3][1] < 0.5 * table[3][0], "{table:?}");
        assert!(table.iter().all(|[axes, octants]| octants <= axes));
    }
}
