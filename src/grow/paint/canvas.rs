//! A canvas for leaf cards: several samples per texel are averaged into colour and coverage.

use glam::Vec2;

/// Number of samples along each side of a texel.
const SAMPLES: u32 = 3;

/// Colour samples of a card. In canvas coordinates, y runs from 0 at the lower edge to 1 at the
/// upper edge, and x to the right from the middle, in the same unit.
pub(super) struct Canvas {
    width: u32,
    height: u32,
    samples: Vec<Option<[f32; 3]>>,
}

impl Canvas {
    /// An empty canvas of `width` by `height` texels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, samples: vec![None; (width * height * SAMPLES * SAMPLES) as usize] }
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Half the width in canvas coordinates.
    pub fn half_width(&self) -> f32 {
        0.5 * self.width as f32 / self.height as f32
    }

    /// Paints every sample within `reach` of `middle`, along each axis, for which `color` returns a
    /// colour.
    pub fn stamp(&mut self, middle: Vec2, reach: f32, color: impl Fn(Vec2) -> Option<[f32; 3]>) {
        let (columns, rows) = (self.width * SAMPLES, self.height * SAMPLES);
        let per_unit = rows as f32;
        let center = Vec2::new((middle.x + self.half_width()) * per_unit, (1.0 - middle.y) * per_unit);
        let span = |at: f32, end: u32| {
            let clamp = |value: f32| value.clamp(0.0, end as f32) as u32;
            clamp(at - reach * per_unit)..clamp(at + reach * per_unit + 1.0)
        };
        for row in span(center.y, rows) {
            for column in span(center.x, columns) {
                let x = (column as f32 + 0.5) / per_unit - self.half_width();
                let y = 1.0 - (row as f32 + 0.5) / per_unit;
                if let Some(painted) = color(Vec2::new(x, y)) {
                    self.samples[(row * columns + column) as usize] = Some(painted);
                }
            }
        }
    }

    /// RGBA bytes, rows from the top: coverage in alpha, colour extended into transparent texels.
    pub fn finish(self) -> Vec<u8> {
        let texels: Vec<[f32; 4]> = (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| self.texel(x, y))
            .collect();
        let colors = spread(&texels, self.width as usize, self.height as usize);
        let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let alphas = texels.iter().map(|texel| byte(texel[3]));
        colors.iter().zip(alphas).flat_map(|(c, alpha)| [byte(c[0]), byte(c[1]), byte(c[2]), alpha]).collect()
    }

    /// Colour, premultiplied by coverage, and coverage of a texel: averages over all its samples.
    fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        let mut sum = [0.0; 4];
        for sample in 0..SAMPLES * SAMPLES {
            let row = y * SAMPLES + sample / SAMPLES;
            let column = x * SAMPLES + sample % SAMPLES;
            if let Some(color) = self.samples[(row * self.width * SAMPLES + column) as usize] {
                (0..3).for_each(|i| sum[i] += color[i]);
                sum[3] += 1.0;
            }
        }
        sum.map(|value| value / (SAMPLES * SAMPLES) as f32)
    }
}

/// Colour of every texel: its own if it is partly covered, otherwise that of the finest downsampled
/// level where the texel is covered ("pull-push").
fn spread(texels: &[[f32; 4]], width: usize, height: usize) -> Vec<[f32; 3]> {
    let own = |texel: &[f32; 4]| [texel[0] / texel[3], texel[1] / texel[3], texel[2] / texel[3]];
    if (width, height) == (1, 1) || texels.iter().all(|texel| texel[3] > 0.0) {
        return texels.iter().map(|texel| if texel[3] > 0.0 { own(texel) } else { [0.0; 3] }).collect();
    }
    let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
    let mut half = vec![[0.0; 4]; half_width * half_height];
    for (i, texel) in texels.iter().enumerate() {
        let sum = &mut half[i / width / 2 * half_width + i % width / 2];
        (0..4).for_each(|channel| sum[channel] += texel[channel]);
    }
    let coarse = spread(&half, half_width, half_height);
    let at = |i: usize| coarse[i / width / 2 * half_width + i % width / 2];
    texels.iter().enumerate().map(|(i, texel)| if texel[3] > 0.0 { own(texel) } else { at(i) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparent_texels_carry_the_colour_of_the_leaf() {
        let mut canvas = Canvas::new(12, 20);
        canvas.stamp(Vec2::new(0.0, 0.5), 0.1, |_| Some([0.2, 0.6, 0.0]));
        let bytes = canvas.finish();
        assert!(bytes.chunks(4).any(|texel| texel[3] == 0) && bytes.chunks(4).any(|texel| texel[3] == 255));
        assert!(bytes.chunks(4).all(|texel| texel[..3] == [51, 153, 0]));
    }
}
