//! How much wood is widened to cover as much as it does without collapses.

use super::{
    order::{WIDENING, WoodOrder, widened},
    slide::Slides,
};
use crate::plant::Wood;
use glam::Vec3;

/// Errors, as fractions of the size of the wood, that coverage is measured at: half a pixel of
/// plants of 64 to 512 pixels.
const ERRORS: [f32; 4] = [1.0 / 1024.0, 1.0 / 512.0, 1.0 / 256.0, 1.0 / 128.0];
/// Swell that the change of coverage is measured with.
const TRIED: f32 = 0.25;

impl WoodOrder {
    /// Sets `swell` so that the stems that are wider than the error, and `widening` so that all
    /// cover as much as they do without collapses, on average over some errors.
    pub(super) fn balance(&mut self, wood: &Wood, widths: &[f32]) {
        let low = wood.vertices.iter().map(|vertex| Vec3::from(vertex.position)).reduce(Vec3::min).unwrap_or_default();
        let high = wood.vertices.iter().map(|vertex| Vec3::from(vertex.position)).reduce(Vec3::max).unwrap_or_default();
        let errors = ERRORS.map(|share| share * (high - low).length());
        let wide = Coverage { wood, order: self, widths, errors, is_wide: true };
        let full = wide.at(None);
        let share = |full: f64, bare: f64, more: f64| {
            let share = ((full - bare) / (more - bare)) as f32;
            if share.is_finite() { share } else { 0.0 }
        };
        let swell = TRIED * share(full, wide.at(Some([0.0, 0.0])), wide.at(Some([0.0, TRIED])));
        let all = Coverage { is_wide: false, ..wide };
        let [bare, more] = [0.5, 1.5].map(|times| all.at(Some([times * WIDENING, swell])));
        let widening = WIDENING * (0.5 + share(all.at(None), bare, more));
        (self.swell, self.widening) = (swell.clamp(-0.5, 0.5), widening.clamp(0.0, 4.0 * WIDENING));
    }
}

/// What wood covers on average from all sides.
struct Coverage<'a> {
    wood: &'a Wood,
    order: &'a WoodOrder,
    widths: &'a [f32],
    errors: [f32; 4],
    /// Whether only stems count that are wider than the error.
    is_wide: bool,
}

impl Coverage<'_> {
    /// Sum over the errors, each over what is covered without collapses. `None` gives that sum
    /// itself.
    fn at(&self, widening: Option<[f32; 2]>) -> f64 {
        let covered = |error: &f32| {
            let full = self.covered(0.0, *error, [0.0; 2]);
            widening.map_or(1.0, |widening| self.covered(*error, *error, widening) / full)
        };
        self.errors.iter().map(covered).filter(|share| share.is_finite()).sum()
    }

    fn covered(&self, error: f32, least: f32, widening: [f32; 2]) -> f64 {
        let slides = Slides { vertices: &self.wood.vertices, order: self.order };
        let mut stems = vec![(0.0_f64, 0_u32); self.widths.len()];
        for (corners, &stem) in self.wood.indices.chunks_exact(3).zip(&self.order.triangle_stems) {
            let width = self.widths[stem as usize];
            if width == f32::MAX || self.is_wide && width < least {
                continue;
            }
            let [a, b, c] = [0, 1, 2].map(|i| slides.at(corners[i], error));
            if a.position == b.position || b.position == c.position || c.position == a.position {
                continue;
            }
            let [a, b, c] = [a, b, c].map(|slid| slid.position + slid.normal * widened(widening, width, error));
            let stem = &mut stems[stem as usize];
            *stem = (stem.0 + f64::from((b - a).cross(c - a).length()), stem.1 + 1);
        }
        // One triangle is seen from both sides, a tube of several on one side only.
        stems.iter().map(|&(area, triangles)| if triangles == 1 { 2.0 * area } else { area }).sum()
    }
}
