//! Cells, text and pictures of HTML tables.

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
