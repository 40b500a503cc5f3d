//! Tables of what was measured of each method at each level: HTML and CSV.

use super::{
    markup::{cell, escaped},
    study::Row,
};
use foliage_lod::measure::Quality;
use std::fmt::Write;

/// Headings of [`quality_cells`].
const QUALITY_HEADS: [&str; 6] = ["rmse", "ssim", "flip", "coverage", "xor", "grain"];

/// Appends the table of all rows. `front` says which of `rows` are on the Pareto front; other rows
/// are not.
pub(super) fn run_time_table(page: &mut String, all: &[Row], rows: &[&Row], front: &[bool]) {
    let before = ["method", "level", "leaves", "triangles", "fragments", "pixels"];
    begin_table(page, "Run time", &[&before[..], &QUALITY_HEADS, &["frame ms", "extraction µs"]].concat());
    for row in all {
        let is_front = rows.iter().zip(front).any(|(other, &is_front)| std::ptr::eq(*other, row) && is_front);
        let _ = write!(page, "<tr{}>", if is_front { " class=\"front\"" } else { "" });
        let _ = write!(page, "<td>{}</td>{}", escaped(&row.method), cell(100.0 * row.level, 1, " %"));
        let [triangles, fragments] =
            [row.drawn.triangle_share, row.drawn.fragment_share].map(|share| cell(100.0 * share, 1, " %"));
        let _ = write!(page, "<td>{}</td>{triangles}{fragments}<td>{}</td>", row.leaves, row.pixels);
        page.push_str(&quality_cells(&row.quality));
        let [frame, extraction] = [cell(1e3 * row.frame_seconds, 2, ""), cell(1e6 * row.extraction_seconds, 1, "")];
        let _ = write!(page, "{frame}{extraction}</tr>");
    }
    page.push_str(
        "</tbody></table><p class=\"note\">Triangles and fragments are those of the leaves, over those of the full \
         plant's leaves. A fragment is a pixel that a triangle covers in one of the views, hidden or not, before the \
         alpha test.</p></details>",
    );
}

/// Appends the table of the qualities at matched sizes; `rows` has one row for each method and
/// level.
pub(super) fn matched_table(page: &mut String, rows: &[&Row]) {
    begin_table(page, "At the matched size", &[&["method", "level", "pixels"][..], &QUALITY_HEADS].concat());
    for row in rows {
        let _ = write!(page, "<tr><td>{}</td>{}", escaped(&row.method), cell(100.0 * row.level, 1, " %"));
        let _ = write!(page, "<td>{}</td>{}</tr>", row.matched.pixels, quality_cells(&row.matched.quality));
    }
    page.push_str(
        "</tbody></table><p class=\"note\">In pictures of 256 times the square root of the level, a drawn leaf is about \
         as large as one of the full plant is in a picture of 256 pixels: this is about how large the plant is on the \
         screen when the level is drawn.</p></details>",
    );
}

fn begin_table(page: &mut String, title: &str, heads: &[&str]) {
    let _ = write!(page, "<details open><summary>{title}</summary><table class=\"sorts\"><thead><tr>");
    heads.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
}

fn quality_cells(quality: &Quality) -> String {
    let Quality { rmse, ssim, flip, coverage, xor, grain } = *quality;
    let percent = |share: f64| cell(100.0 * share, 2, " %");
    let errors = [cell(rmse, 2, ""), cell(ssim, 4, ""), cell(flip, 4, "")];
    [errors.concat(), percent(coverage), percent(xor), cell(grain, 3, "")].concat()
}

/// Columns of the CSV.
const COLUMNS: &str = "plant,method,level,leaves,pixels,rmse,ssim,flip,coverage,xor,frame_seconds,extraction_seconds,\
     grain,triangles,leaf_share,triangle_share,fragment_share,matched_pixels,matched_rmse,matched_ssim,matched_flip,\
     matched_coverage,matched_xor,matched_grain";

/// All rows as comma-separated values, with a header; numbers that were not measured are empty.
pub fn csv<'a>(rows: impl IntoIterator<Item = &'a Row>) -> String {
    let mut csv = format!("{COLUMNS}\n");
    for row in rows {
        let (q, drawn) = (&row.quality, &row.drawn);
        let Quality { rmse, ssim, flip, coverage, xor, grain } = row.matched.quality;
        let first = [q.rmse, q.ssim, q.flip, q.coverage, q.xor, row.frame_seconds, row.extraction_seconds, q.grain];
        let shares = [drawn.leaf_share, drawn.triangle_share, drawn.fragment_share];
        let matched = [rmse, ssim, flip, coverage, xor, grain];
        let names = [&row.plant, &row.method].map(|name| quoted(name)).join(",");
        let _ = write!(csv, "{names},{},{},{},{}", row.level, row.leaves, row.pixels, numbers(&first));
        let _ = write!(csv, ",{},{}", drawn.triangles, numbers(&shares));
        let _ = writeln!(csv, ",{},{}", row.matched.pixels, numbers(&matched));
    }
    csv
}

fn numbers(numbers: &[f64]) -> String {
    let text = |value: &f64| if value.is_nan() { String::new() } else { format!("{value}") };
    numbers.iter().map(text).collect::<Vec<_>>().join(",")
}

/// Quotes a field as in RFC 4180.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::report::study::{Drawn, Matched};

    pub(in super::super) fn test_row() -> Row {
        let quality = Quality { rmse: 2.0, ssim: 0.5, flip: f64::NAN, coverage: 0.0, xor: 0.0, grain: 0.75 };
        Row {
            plant: "a, \"b\"".into(),
            method: "<m>".into(),
            level: 0.5,
            leaves: 10,
            drawn: Drawn { triangles: 24, leaf_share: 0.5, triangle_share: 0.6, fragment_share: 0.7 },
            pixels: 64,
            quality,
            matched: Matched { pixels: 181, quality: Quality { rmse: 3.0, ..quality } },
            frame_seconds: 1.0,
            extraction_seconds: f64::NAN,
        }
    }

    #[test]
    fn a_line_has_one_field_for_each_column() {
        let csv = csv([&test_row()]);
        let line = "\"a, \"\"b\"\"\",<m>,0.5,10,64,2,0.5,,0,0,1,,0.75,24,0.5,0.6,0.7,181,3,0.5,,0,0,0.75";
        assert_eq!(csv.lines().nth(1), Some(line));
        assert_eq!(line.matches(',').count() - 1, COLUMNS.matches(',').count(), "one comma is in the name");
    }

    #[test]
    fn a_row_of_a_table_has_one_cell_for_each_heading() {
        let row = test_row();
        let (mut run_time, mut matched) = (String::new(), String::new());
        run_time_table(&mut run_time, std::slice::from_ref(&row), &[&row], &[true]);
        matched_table(&mut matched, &[&row]);
        for table in [&run_time, &matched] {
            assert_eq!(table.matches("<th>").count(), table.matches("<td").count(), "{table}");
        }
        assert!(run_time.contains("70.0 %") && matched.contains("<td>181</td><td data-value=\"3\">3.00</td>"));
    }
}
