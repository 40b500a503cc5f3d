//! Cells, text and pictures of HTML tables, and which of their rows stand out.

use base64::{Engine, engine::general_purpose::STANDARD};
use foliage_lod::{Result, software::Image};

/// Table cell with a rounded number, and the exact one for sorting; empty if it was not measured.
pub(super) fn cell(value: f64, digits: usize, unit: &str) -> String {
    if value.is_nan() {
        return "<td data-value=\"-1\"></td>".into();
    }
    format!("<td data-value=\"{value}\">{value:.digits$}{unit}</td>")
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A picture within the page.
pub(super) fn embedded(image: &Image) -> Result<String> {
    let png = STANDARD.encode(image.encode_png()?);
    Ok(format!(
        "<img width=\"{}\" height=\"{}\" alt=\"\" src=\"data:image/png;base64,{png}\">",
        image.width, image.height
    ))
}

/// The picture with each pixel as a square, as wide as fits into `side` pixels.
pub(super) fn enlarged(image: &Image, side: u32) -> Image {
    let factor = (side / image.width.max(1)).max(1);
    let [width, height] = [image.width * factor, image.height * factor];
    let pixels = (0..width * height).flat_map(|i| image.pixel(i % width / factor, i / width / factor)).flatten();
    Image { width, height, rgba: pixels.collect() }
}

/// Which points are on the Pareto front: no other one is at most as large in both numbers, and
/// smaller in one. Points that were not measured are not.
pub(super) fn front(points: &[[f64; 2]]) -> Vec<bool> {
    let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    let is_measured = |point: &[f64; 2]| point.iter().all(|number| number.is_finite());
    points.iter().map(|point| is_measured(point) && !points.iter().any(|other| beats(other, point))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_become_squares() {
        let mut image = Image::filled(64, 64, [0; 4]);
        image.paste(&Image::filled(1, 1, [9; 4]), 5, 3);
        let shown = enlarged(&image, 128);
        assert_eq!(
            [shown.pixel(10, 6), shown.pixel(11, 7), shown.pixel(12, 7)],
            [Some([9; 4]), Some([9; 4]), Some([0; 4])]
        );
    }
}
