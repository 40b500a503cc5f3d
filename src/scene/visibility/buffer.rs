//! The small picture that crowns are drawn on, from near to far.

use super::ROWS;

/// Fewest and most columns.
const COLUMNS: [f64; 2] = [16.0, 512.0];

/// Least opacity that counts where it is asked what shows: crowns that hide nothing show too.
const LEAST_OPACITY: f32 = 1.0 / 1024.0;

/// What light from afar passes at each pixel.
#[derive(Debug, Default)]
pub(super) struct Buffer {
    columns: u32,
    transmittance: Vec<f32>,
    /// Distance of what is opaque, in so many columns, none if there is nothing.
    opaque: Vec<f32>,
    opaque_columns: u32,
    /// Distance of what is opaque at each pixel of this picture, none if there is nothing.
    front: Vec<f32>,
    /// What one plant alone passes at each pixel: 1 between two plants.
    own: Vec<f32>,
}

impl Buffer {
    /// Number of columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.columns, ROWS]
    }

    /// Starts a picture with this ratio of width to height.
    pub(super) fn clear(&mut self, aspect: f64) {
        self.columns = columns(aspect);
        self.own.clear();
        self.transmittance.clear();
        self.transmittance.resize((self.columns * ROWS) as usize, 1.0);
        self.front.clear();
        if self.opaque_columns > 0 {
            // It may have another shape.
            let columns = (0..self.columns).map(|column| column * self.opaque_columns / self.columns);
            let rows = self.opaque.chunks_exact(self.opaque_columns as usize);
            self.front.extend(rows.flat_map(|row| columns.clone().map(|column| row[column as usize])));
        }
    }

    /// Puts something else that is opaque into the picture that was started: one over its distance
    /// at a pixel.
    pub(super) fn put(&mut self, nearness: impl Fn([u32; 2]) -> f32) {
        self.front.resize((self.columns * ROWS) as usize, f32::INFINITY);
        for (at, front) in (0..).zip(&mut self.front) {
            *front = front.min(1.0 / nearness([at % self.columns, at / self.columns]));
        }
    }

    /// See [`Visibility::set_opaque`](super::Visibility::set_opaque).
    pub(super) fn set_opaque(&mut self, distance: Option<impl FnMut([f32; 2]) -> f32>, aspect: f64) {
        self.opaque.clear();
        self.opaque_columns = 0;
        let Some(mut distance) = distance else { return };
        let columns = columns(aspect);
        self.opaque_columns = columns;
        let place = |at: u32, side: u32| (at as f32 + 0.5) / side as f32 * 2.0 - 1.0;
        for row in 0..ROWS {
            self.opaque.extend((0..columns).map(|column| distance([place(column, columns), place(row, ROWS)])));
        }
    }

    /// Number of pixels that ellipses of one plant cover together, each by what they take of its
    /// light.
    pub(super) fn covered(&mut self, ellipses: impl Iterator<Item = ([f32; 2], [f32; 2], f32)>) -> f32 {
        let [columns, rows] = self.size();
        self.own.resize((columns * rows) as usize, 1.0);
        let mut touched = [rows, 0];
        for ([x, y], [wide, high], opacity) in ellipses {
            for row in covered(y, high, rows) {
                touched = [touched[0].min(row), touched[1].max(row + 1)];
                let start = (row * columns) as usize;
                let across =
                    self.own[start..start + columns as usize].get_mut(across(row, [x, y], [wide, high], columns));
                across.into_iter().flatten().for_each(|passes| *passes *= 1.0 - opacity.max(LEAST_OPACITY));
            }
        }
        let mut taken = 0.0;
        for passes in
            self.own.get_mut((touched[0] * columns) as usize..(touched[1] * columns) as usize).into_iter().flatten()
        {
            taken += 1.0 - *passes;
            *passes = 1.0;
        }
        taken
    }

    /// Draws an ellipse whose nearest part has a distance. Returns the number of its pixels that
    /// show, each by what it takes of its light.
    pub(super) fn draw(&mut self, [x, y]: [f32; 2], [wide, high]: [f32; 2], distance: f32, opacity: f32) -> f32 {
        let mut shown = 0.0;
        for row in covered(y, high, ROWS) {
            for column in across(row, [x, y], [wide, high], self.columns) {
                let at = row as usize * self.columns as usize + column;
                let passed = &mut self.transmittance[at];
                if self.front.get(at).is_none_or(|front| distance < *front) {
                    shown += *passed;
                }
                *passed *= 1.0 - opacity;
            }
        }
        shown * opacity.max(LEAST_OPACITY)
    }
}

fn columns(aspect: f64) -> u32 {
    (f64::from(ROWS) * aspect).clamp(COLUMNS[0], COLUMNS[1]).round() as u32
}

/// Columns of an ellipse in a row.
fn across(row: u32, [x, y]: [f32; 2], [wide, high]: [f32; 2], columns: u32) -> std::ops::Range<usize> {
    let up = (row as f32 + 0.5 - y) / high;
    let columns = covered(x, wide * (1.0 - up * up).max(0.0).sqrt(), columns);
    columns.start as usize..columns.end as usize
}

/// Pixels whose middles are within a distance of a place.
fn covered(middle: f32, half: f32, side: u32) -> std::ops::Range<u32> {
    let at = |place: f32| (place + 0.5).floor().clamp(0.0, side as f32) as u32;
    at(middle - half)..at(middle + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipses_have_their_area_and_take_their_share() {
        let mut buffer = Buffer::default();
        buffer.clear(2.0);
        assert_eq!(buffer.size(), [2 * ROWS, ROWS]);
        let alone =
            |buffer: &mut Buffer, middle, half, opacity| buffer.covered(std::iter::once((middle, half, opacity)));
        let area = alone(&mut buffer, [100.0, 60.0], [30.0, 20.0], 0.75);
        assert!((area / (0.75 * std::f32::consts::PI * 600.0) - 1.0).abs() < 0.01);
        assert_eq!(buffer.draw([100.0, 60.0], [30.0, 20.0], 5.0, 0.75), area);
        let area = alone(&mut buffer, [100.0, 60.0], [10.0, 10.0], 0.5);
        assert_eq!(buffer.draw([100.0, 60.0], [10.0, 10.0], 6.0, 0.5) / area, 0.25);
        for nowhere in [[-50.0, 10.0], [f32::NAN, 10.0]] {
            assert_eq!(alone(&mut buffer, nowhere, [20.0, 20.0], 0.5), 0.0);
            assert_eq!(buffer.draw(nowhere, [20.0, 20.0], 7.0, 0.5), 0.0);
        }
        // Two halves of a plant, one before the other, take no more than there is.
        let half = ([60.0, 60.0], [8.0, 8.0], 0.5);
        let both = buffer.covered([half; 2].into_iter());
        assert!((both / alone(&mut buffer, half.0, half.1, 0.75) - 1.0).abs() < 1e-5);
        let shown = [5.0, 6.0].map(|distance| buffer.draw(half.0, half.1, distance, 0.5));
        assert!(((shown[0] + shown[1]) / both - 1.0).abs() < 1e-5);
        // A wall on the left half, at a distance of 10.
        buffer.set_opaque(Some(|[x, _]: [f32; 2]| if x < 0.0 { 10.0 } else { f32::INFINITY }), 2.0);
        buffer.clear(2.0);
        let middle = [ROWS as f32, 60.0];
        let share = |buffer: &mut Buffer, middle, distance| {
            let area = alone(buffer, middle, [20.0, 20.0], 0.0);
            buffer.draw(middle, [20.0, 20.0], distance, 0.0) / area
        };
        let near = |share: f32, wanted: f32| (share - wanted).abs() < 1e-3;
        assert!(near(share(&mut buffer, middle, 9.0), 1.0) && near(share(&mut buffer, middle, 11.0), 0.5));
        // Ground beside it, nearer.
        buffer.put(|[column, _]| if column < ROWS { 0.0 } else { 0.2 });
        assert!(near(share(&mut buffer, middle, 6.0), 0.5) && share(&mut buffer, middle, 11.0) == 0.0);
        // A narrower picture has it in the same place.
        buffer.clear(1.0);
        let shown = share(&mut buffer, [0.5 * ROWS as f32, 60.0], 11.0);
        assert!((shown - 0.5).abs() < 0.05, "{shown}");
        buffer.set_opaque(None::<fn([f32; 2]) -> f32>, 2.0);
        buffer.clear(2.0);
        assert!(near(share(&mut buffer, middle, 11.0), 1.0));
    }
}
