//! Cells and text of HTML tables.

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
