//! Seamlessly tiling bark, from value noise on a periodic lattice.

use super::{mixed, shaded, smooth, unit_color};
use crate::grow::species::{BarkPattern, BarkStyle};
use crate::random::Random;

/// Side length in texels.
pub(super) const SIDE: u32 = 256;
/// Number of lenticels (dark horizontal marks) on papery bark.
const LENTICELS: u32 = 90;
/// Number of dark branch scars on papery bark.
const SCARS: u32 = 2;

/// RGB bytes, rows from the top.
pub(super) fn paint(style: &BarkStyle, seed: u64) -> Vec<u8> {
    let (light, dark) = (unit_color(style.color), unit_color(style.color_dark));
    let marks = Marks::new(seed);
    let color = |x: f32, y: f32| match style.pattern {
        BarkPattern::Furrowed => mixed(dark, light, furrowed(x, y, seed)),
        BarkPattern::Scaly => mixed(dark, light, scaly(x, y, seed)),
        BarkPattern::Papery => papery(x, y, seed, &marks, light, dark),
    };
    let texel = |i: u32| ((i % SIDE) as f32 / SIDE as f32, (i / SIDE) as f32 / SIDE as f32);
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    (0..SIDE * SIDE).map(texel).flat_map(|(x, y)| color(x, y).map(byte)).collect()
}

/// Upright furrows that part and meet: 0 in a furrow, 1 on a ridge.
fn furrowed(x: f32, y: f32, seed: u64) -> f32 {
    let bend = 0.05 * (noise(x, y, [4, 5], seed ^ 1) - 0.5);
    let ridge = (noise(x + bend, y, [18, 3], seed) - 0.5).abs() * 2.0;
    let crack = (noise(x + bend, y, [26, 12], seed ^ 2) - 0.5).abs() * 2.0;
    let grain = noise(x, y, [96, 40], seed ^ 3);
    let tone = noise(x, y, [9, 7], seed ^ 4);
    smooth(0.0, 0.5, ridge) * (0.55 + 0.45 * smooth(0.0, 0.35, crack)) * (0.55 + 0.25 * grain + 0.2 * tone)
}

/// Narrow flat ridges, broken crosswise into scales: 0 in a furrow, 1 on a ridge.
fn scaly(x: f32, y: f32, seed: u64) -> f32 {
    let bend = 0.05 * (noise(x, y, [5, 6], seed ^ 1) - 0.5);
    let ridge = (noise(x + bend, y, [16, 5], seed) - 0.5).abs() * 2.0;
    let across = (noise(x, y + bend, [14, 22], seed ^ 2) - 0.5).abs() * 2.0;
    let grain = noise(x, y, [110, 48], seed ^ 3);
    let tone = noise(x, y, [10, 8], seed ^ 4);
    smooth(0.0, 0.35, ridge) * (0.65 + 0.35 * smooth(0.0, 0.3, across)) * (0.5 + 0.25 * grain + 0.25 * tone)
}

/// A mark: x and y of its middle, half width, half height.
type Mark = [f32; 4];

/// The dark marks of papery bark.
struct Marks {
    /// Short horizontal lines.
    lenticels: Vec<Mark>,
    /// Triangles below branches.
    scars: Vec<Mark>,
}

impl Marks {
    fn new(seed: u64) -> Self {
        let random = &mut Random::new(seed ^ 5);
        let mut mark = |half_width: f32, half_height: f32| {
            let size = 0.4 + random.unit();
            [random.unit(), random.unit(), half_width * size, half_height * size.sqrt()]
        };
        let lenticels = (0..LENTICELS).map(|_| mark(0.035, 0.0035)).collect();
        let scars = (0..SCARS).map(|_| mark(0.15, 0.07)).collect();
        Self { lenticels, scars }
    }

    /// Darkness of the marks at a point, 0 to 1.
    fn darkness(&self, x: f32, y: f32) -> f32 {
        let lenticel = |mark: &Mark| {
            let [across, along] = from_middle(x, y, mark);
            1.0 - smooth(0.5, 1.0, across * across + along * along)
        };
        let scar = |mark: &Mark| {
            let [across, along] = from_middle(x, y, mark);
            // An apex above, a ragged lower edge.
            let inside = 0.5 + 0.5 * along - across.abs();
            if along < 1.0 { smooth(0.0, 0.15, inside) * smooth(1.0, 0.6, along) } else { 0.0 }
        };
        let lenticels = self.lenticels.iter().map(lenticel);
        lenticels.chain(self.scars.iter().map(scar)).fold(0.0, f32::max)
    }
}

fn papery(x: f32, y: f32, seed: u64, marks: &Marks, light: [f32; 3], dark: [f32; 3]) -> [f32; 3] {
    let tone = 0.86 + 0.1 * noise(x, y, [4, 10], seed) + 0.06 * noise(x, y, [24, 64], seed ^ 1);
    mixed(shaded(light, tone), dark, 0.85 * marks.darkness(x, y))
}

/// Offset from the middle of a mark across and down, in units of its half sizes; wraps around the
/// edges of the texture.
fn from_middle(x: f32, y: f32, &[mark_x, mark_y, half_width, half_height]: &Mark) -> [f32; 2] {
    let wrapped = |distance: f32| distance - distance.round();
    [wrapped(x - mark_x) / half_width, wrapped(y - mark_y) / half_height]
}

/// Value noise from 0 to 1 with `cells` lattice cells per repeat, interpolated smoothly.
fn noise(x: f32, y: f32, cells: [u32; 2], seed: u64) -> f32 {
    let (across, up) = (x.rem_euclid(1.0) * cells[0] as f32, y.rem_euclid(1.0) * cells[1] as f32);
    let (column, row) = (across as u32, up as u32);
    let corner = |i: u32, j: u32| {
        let cell = u64::from((row + j) % cells[1]) << 32 | u64::from((column + i) % cells[0]);
        Random::of_part(seed, cell).unit()
    };
    let (s, t) = (smooth(0.0, 1.0, across.fract()), smooth(0.0, 1.0, up.fract()));
    let low = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * s;
    let high = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * s;
    low + (high - low) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_meets_itself_over_the_edge() {
        for i in 0..20 {
            let y = i as f32 / 20.0;
            assert!((noise(0.0, y, [7, 5], 3) - noise(1.0 - 1e-6, y, [7, 5], 3)).abs() < 1e-4);
        }
    }
}
