//! Boxes in the cells of a grid, to find the nearest of them.

use glam::{IVec3, Vec3};

/// Most cells along one axis.
const MOST_CELLS: f32 = 256.0;
/// Boxes that a cell holds on average, if they were spread evenly over the cells.
const BOXES_PER_CELL: f32 = 0.25;

/// Boxes by the cells that they reach into.
pub(super) struct Grid {
    low: Vec3,
    cell: f32,
    cells: IVec3,
    /// Entry n: the first of the cell's `items`.
    starts: Vec<u32>,
    /// Numbers of boxes, cell after cell.
    items: Vec<u32>,
}

impl Grid {
    /// Sorts boxes, each with its lowest and highest corner, into cells.
    pub(super) fn new(boxes: &[[Vec3; 2]]) -> Self {
        let low = boxes.iter().map(|of| of[0]).reduce(Vec3::min).unwrap_or_default();
        let high = boxes.iter().map(|of| of[1]).reduce(Vec3::max).unwrap_or_default();
        let size = (high - low).max_element().max(f32::MIN_POSITIVE);
        // A plant fills a part of its box.
        let wanted = (boxes.len() as f32 / BOXES_PER_CELL).sqrt().clamp(1.0, MOST_CELLS);
        let cell = size / wanted;
        let cells =
            ((high - low) / cell).floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(MOST_CELLS as i32 - 1)) + 1;
        let mut grid =
            Self { low, cell, cells, starts: vec![0; cells.element_product() as usize + 1], items: Vec::new() };
        let mut starts = std::mem::take(&mut grid.starts);
        boxes.iter().for_each(|of| grid.each_cell(of, |cell| starts[cell + 1] += 1));
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts.last().copied().unwrap_or_default() as usize];
        for (number, of) in (0..).zip(boxes) {
            grid.each_cell(of, |cell| {
                items[next[cell] as usize] = number;
                next[cell] += 1;
            });
        }
        (grid.starts, grid.items) = (starts, items);
        grid
    }

    /// Finds the item with the least value by `value`, which gives `None` for items that do not
    /// count, and is at least the distance between `point` and the item's box less `slack`. Of
    /// equal ones the first counts.
    pub(super) fn least(&self, point: Vec3, slack: f32, value: impl Fn(u32) -> Option<f32>) -> Option<(f32, u32)> {
        let center = self.cell_of(point);
        let outside = (point - point.clamp(self.low, self.low + self.cells.as_vec3() * self.cell)).length();
        let mut best: Option<(f32, u32)> = None;
        for shell in 0..=self.cells.max_element() {
            // Everything in this shell and beyond is at least so far away.
            let distance = ((shell - 1) as f32 * self.cell).max(outside) - slack;
            if best.is_some_and(|(least, _)| least < distance) {
                break;
            }
            self.each_of_shell(center, shell, |cell| {
                for &item in &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                    let found = value(item).map(|value| (value, item));
                    let is_less = |(value, item): (f32, u32)| best.is_none_or(|best| (value, item) < best);
                    if found.is_some_and(is_less) {
                        best = found;
                    }
                }
            });
        }
        best
    }

    fn cell_of(&self, point: Vec3) -> IVec3 {
        ((point - self.low) / self.cell).floor().as_ivec3().clamp(IVec3::ZERO, self.cells - 1)
    }

    fn number(&self, cell: IVec3) -> usize {
        ((cell.z * self.cells.y + cell.y) * self.cells.x + cell.x) as usize
    }

    fn each_cell(&self, [low, high]: &[Vec3; 2], mut visit: impl FnMut(usize)) {
        let [low, high] = [self.cell_of(*low), self.cell_of(*high)];
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    visit(self.number(IVec3::new(x, y, z)));
                }
            }
        }
    }

    /// Visits the cells whose greatest distance along an axis from `center` is `shell` cells.
    fn each_of_shell(&self, center: IVec3, shell: i32, mut visit: impl FnMut(usize)) {
        let [low, high] = [(center - shell).max(IVec3::ZERO), (center + shell).min(self.cells - 1)];
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let is_face = (z - center.z).abs() == shell || (y - center.y).abs() == shell;
                let step = if is_face { 1 } else { (2 * shell).max(1) };
                let mut x = if is_face { low.x } else { center.x - shell };
                while x <= high.x {
                    if x >= low.x {
                        visit(self.number(IVec3::new(x, y, z)));
                    }
                    x += step;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_many_points_is_found() {
        let mut state = 1_u32;
        let mut unit = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = || Vec3::new(10.0 * unit(), 2.0 * unit(), 5.0 * unit());
        let points: Vec<Vec3> = (0..500).map(|_| point()).collect();
        let boxes: Vec<[Vec3; 2]> = points.iter().map(|&point| [point; 2]).collect();
        let grid = Grid::new(&boxes);
        for i in 0..200 {
            let from = point() * if i % 3 == 0 { 2.0 } else { 1.0 } - 1.0;
            let counts = |item: u32| item % 2 == i % 2;
            let value = |item: u32| counts(item).then(|| points[item as usize].distance(from));
            let expected = (0..500).filter_map(|item| Some((value(item)?, item)));
            let expected = expected.min_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(grid.least(from, 0.0, value), expected, "{from}");
        }
        assert_eq!(Grid::new(&[]).least(Vec3::ONE, 0.0, |_| Some(0.0)), None);
        assert_eq!(Grid::new(&[[Vec3::ONE; 2]]).least(Vec3::X, 0.0, |_| Some(1.0)), Some((1.0, 0)));
    }
}
