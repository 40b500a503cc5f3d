//! The small picture that crowns are drawn on, from near to far.

use super::ROWS;

/// Fewest and most columns.
const COLUMNS: [f64; 2] = [16.0, 512.0];

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
}

impl Buffer {
    /// Number of columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.columns, ROWS]
    }

    /// Starts a picture with this ratio of width to height.
    pub(super) fn clear(&mut self, aspect: f64) {
        self.columns = columns(aspect);
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

    /// Draws an ellipse whose nearest part has a distance. Returns the number of its pixels in the
    /// picture and of those that show, or `None` if there are none.
    pub(super) fn draw(
        &mut self,
        [x, y]: [f32; 2],
        [wide, high]: [f32; 2],
        distance: f32,
        opacity: f32,
    ) -> Option<[f32; 2]> {
        let [mut area, mut shown] = [0.0, 0.0];
        for row in covered(y, high, ROWS) {
            let up = (row as f32 + 0.5 - y) / high;
            let across = wide * (1.0 - up * up).max(0.0).sqrt();
            for column in covered(x, across, self.columns) {
                let at = (row * self.columns + column) as usize;
                let passed = &mut self.transmittance[at];
                if self.front.get(at).is_none_or(|front| distance < *front) {
                    shown += *passed;
                }
                area += 1.0;
                *passed *= 1.0 - opacity;
            }
        }
        (area > 0.0).then_some([area, shown])
    }
}

fn columns(aspect: f64) -> u32 {
    (f64::from(ROWS) * aspect).clamp(COLUMNS[0], COLUMNS[1]).round() as u32
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
        let [area, shown] = buffer.draw([100.0, 60.0], [30.0, 20.0], 5.0, 0.75).unwrap();
        assert!((area / (std::f32::consts::PI * 600.0) - 1.0).abs() < 0.01 && shown == area);
        let [area, shown] = buffer.draw([100.0, 60.0], [10.0, 10.0], 6.0, 0.5).unwrap();
        assert_eq!(shown / area, 0.25);
        assert_eq!(buffer.draw([-50.0, 10.0], [20.0, 20.0], 7.0, 0.5), None);
        assert_eq!(buffer.draw([f32::NAN, 10.0], [20.0, 20.0], 7.0, 0.5), None);
        // A wall on the left half, at a distance of 10.
        buffer.set_opaque(Some(|[x, _]: [f32; 2]| if x < 0.0 { 10.0 } else { f32::INFINITY }), 2.0);
        buffer.clear(2.0);
        let middle = [ROWS as f32, 60.0];
        let shares = [9.0, 11.0].map(|distance| {
            let [area, shown] = buffer.draw(middle, [20.0, 20.0], distance, 0.0).unwrap();
            shown / area
        });
        assert_eq!(shares, [1.0, 0.5]);
        // Ground beside it, nearer.
        buffer.put(|[column, _]| if column < ROWS { 0.0 } else { 0.2 });
        assert_eq!(buffer.draw(middle, [20.0, 20.0], 6.0, 0.0).map(|[area, shown]| shown / area), Some(0.5));
        assert_eq!(buffer.draw(middle, [20.0, 20.0], 11.0, 0.0).map(|[_, shown]| shown), Some(0.0));
        // A narrower picture has it in the same place.
        buffer.clear(1.0);
        let [area, shown] = buffer.draw([0.5 * ROWS as f32, 60.0], [20.0, 20.0], 11.0, 0.0).unwrap();
        assert!((shown / area - 0.5).abs() < 0.05, "{shown} of {area}");
        buffer.set_opaque(None::<fn([f32; 2]) -> f32>, 2.0);
        buffer.clear(2.0);
        assert_eq!(buffer.draw(middle, [20.0, 20.0], 11.0, 0.0).map(|[area, shown]| shown / area), Some(1.0));
    }
}
