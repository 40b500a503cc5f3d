//! What accuracy costs in a scene: each rule of a budget along the camera's path.

use super::markup::{cell, embedded, escaped, front};
use foliage_lod::{Result, measure::Quality, software::Image};
use std::fmt::Write;

/// One rule at one budget.
pub struct BudgetRow {
    /// Name of the rule.
    pub rule: String,
    /// Budget, as a fraction of all leaves in view; NaN for rules without one.
    pub share: f64,
    /// Leaves drawn, mean over the frames.
    pub leaves: f64,
    /// Frame times in seconds: median, 95th and 99th percentile.
    pub seconds: [f64; 3],
    /// Pictures against those of every leaf.
    pub quality: Quality,
    /// Largest mean change from one frame to the next, over that of every leaf at the same place.
    pub change: f64,
    /// Picture of the first frame.
    pub image: Image,
}

/// Table and pictures of the rules, if they were measured. `bytes` is what the models take on the
/// GPU.
///
/// # Errors
/// Errors from encoding pictures.
pub(super) fn budget_section(page: &mut String, rows: &[BudgetRow], bytes: u64) -> Result<()> {
    let Some(first) = rows.first() else { return Ok(()) };
    page.push_str("<h3>What accuracy costs in time</h3><table class=\"sorts\"><thead><tr>");
    let heads = ["rule", "budget", "leaves", "p50 ms", "p95 ms", "p99 ms", "RMSE", "SSIM", "FLIP", "largest change"];
    heads.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
    let points: Vec<[f64; 2]> = rows.iter().map(|row| [row.seconds[0], row.quality.rmse]).collect();
    for (row, is_front) in rows.iter().zip(front(&points)) {
        let _ = write!(
            page,
            "<tr{}><td>{}</td>{}{}{}{}{}{}{}{}{}</tr>",
            if is_front { " class=\"front\"" } else { "" },
            escaped(&row.rule),
            cell(100.0 * row.share, 0, " %"),
            cell(row.leaves, 0, ""),
            cell(1e3 * row.seconds[0], 1, ""),
            cell(1e3 * row.seconds[1], 1, ""),
            cell(1e3 * row.seconds[2], 1, ""),
            cell(row.quality.rmse, 2, ""),
            cell(row.quality.ssim, 3, ""),
            cell(row.quality.flip, 3, ""),
            cell(row.change, 2, ""),
        );
    }
    let _ = write!(
        page,
        "</tbody></table><p class=\"note\">Pairs of frames a sixtieth of a second apart, at places along the scene's \
         camera path, without effects. A budget is a fraction of the leaves of all plants in view, on average along \
         the path. Times are from the first command to the picture in memory; all rules use the same buffers \
         ({:.1} MB). Errors are against pictures with every leaf, RMSE on the sRGB scale of 0 to 255; the largest \
         change from one frame of a pair to the next is over that of every leaf at the same place. Green rows are on \
         the Pareto front: no other row is both faster at the median and of less RMSE.</p><div class=\"plots\">",
        bytes as f64 / 1e6,
    );
    let least = rows.iter().map(|row| row.share).fold(f64::INFINITY, f64::min);
    for row in rows.iter().filter(|row| std::ptr::eq(*row, first) || row.share == least) {
        let _ =
            write!(page, "<figure>{}<figcaption>{}</figcaption></figure>", embedded(&row.image)?, escaped(&row.rule));
    }
    page.push_str("</div>");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(rule: &str, share: f64, seconds: f64, rmse: f64) -> BudgetRow {
        let quality = Quality { rmse, ssim: 0.5, flip: f64::NAN, coverage: 0.0, xor: 0.0, grain: 1.0 };
        let image = Image::filled(2, 2, [1; 4]);
        BudgetRow { rule: rule.into(), share, leaves: 9.0, seconds: [seconds; 3], quality, change: 1.0, image }
    }

    #[test]
    fn rows_that_are_slower_and_worse_than_another_are_not_on_the_front() {
        let rows = [row("every leaf", f64::NAN, 3.0, 0.0), row("a<b", 0.1, 1.0, 5.0), row("cook", 0.1, 1.5, 6.0)];
        let mut page = String::new();
        budget_section(&mut page, &rows, 1_500_000).unwrap();
        assert_eq!(page.matches("class=\"front\"").count(), 2);
        assert!(page.contains("a&lt;b") && page.contains("1.5 MB"));
        assert_eq!(page.matches("<figure>").count(), 3);
    }

    #[test]
    fn nothing_is_shown_of_scenes_that_were_not_measured() {
        let mut page = String::new();
        budget_section(&mut page, &[], 0).unwrap();
        assert_eq!(page, "");
    }
}
