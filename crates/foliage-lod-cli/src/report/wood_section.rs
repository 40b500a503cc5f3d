//! The page's section on wood: plots, pictures side by side and a table.

use super::{
    markup::{cell, embedded, enlarged},
    plot::{Line, Plot},
    wood::{DIAMETERS, ERROR_PX, WAYS, WoodRow},
};
use foliage_lod::{Result, measure::Quality};
use std::fmt::Write;

/// Width and height of a shown picture: pixels are enlarged to fill it.
const SHOWN_PX: u32 = 256;
const HEADS: [&str; 14] = [
    "method",
    "diameter",
    "triangles",
    "rmse",
    "ssim",
    "coverage",
    "xor",
    "frame ms",
    "leaves",
    "rmse, with leaves",
    "ssim",
    "coverage",
    "xor",
    "frame ms",
];

/// Appends the section; nothing if there are no rows.
pub(super) fn wood_section(page: &mut String, rows: &[WoodRow]) -> Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    page.push_str("<h3>Wood</h3><div class=\"plots\">");
    for plot in plots(rows) {
        page.push_str(&plot.svg()?);
    }
    page.push_str("</div>");
    for (number, title) in ["Wood alone", "With leaves"].into_iter().enumerate() {
        pictures(page, rows, number, title)?;
    }
    table(page, rows);
    Ok(())
}

/// Names of all ways, each once.
fn ways(rows: &[WoodRow]) -> Vec<&'static str> {
    rows.iter().take_while(|row| row.diameter_px == rows[0].diameter_px).map(|row| row.way).collect()
}

fn plots(rows: &[WoodRow]) -> Vec<Plot<'static>> {
    let plot = |title, y_axis, value: &dyn Fn(&WoodRow) -> f64| {
        let line = |way: &'static str| {
            let own = rows.iter().filter(|row| row.way == way);
            let points = own.map(|row| [f64::from(row.diameter_px), value(row)]).filter(|point| point[1].is_finite());
            Line { name: way.into(), points: points.collect(), is_reference: way == WAYS[0] }
        };
        let lines = ways(rows).into_iter().map(line).filter(|line| !line.points.is_empty()).collect();
        Plot { title, x_axis: "diameter (pixels)", y_axis, lines }
    };
    let plots = vec![
        plot("Triangles of the wood against diameter", "triangles", &|row| row.triangles as f64),
        plot("Error of the wood alone against diameter", "RMSE", &|row| row.alone.rmse),
        plot("Silhouettes of the wood alone against diameter", "XOR (%)", &|row| 100.0 * row.alone.xor),
        plot("Silhouettes with leaves against diameter", "XOR (%)", &|row| 100.0 * row.with_leaves.xor),
        plot("Frame of four plants, wood alone", "ms", &|row| 1e3 * row.frame_seconds[0]),
    ];
    plots.into_iter().filter(|plot| !plot.lines.is_empty()).collect()
}

/// Appends the pictures with this number.
fn pictures(page: &mut String, rows: &[WoodRow], number: usize, title: &str) -> Result<()> {
    let _ = write!(page, "<table class=\"pictures\"><tr><td>{title}</td>");
    DIAMETERS.iter().for_each(|px| {
        let _ = write!(page, "<td>{px} px</td>");
    });
    for way in ways(rows) {
        let _ = write!(page, "</tr><tr><td>{way}</td>");
        for row in rows.iter().filter(|row| row.way == way) {
            let picture = embedded(&enlarged(&row.images[number], SHOWN_PX))?;
            let _ = write!(page, "<td>{picture}{} triangles</td>", row.triangles);
        }
    }
    page.push_str("</tr></table>");
    Ok(())
}

fn table(page: &mut String, rows: &[WoodRow]) {
    page.push_str("<details open><summary>Wood</summary><table class=\"sorts\"><thead><tr>");
    HEADS.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
    for row in rows {
        let _ = write!(page, "<tr><td>{}</td><td>{}</td><td>{}</td>", row.way, row.diameter_px, row.triangles);
        let [alone, with_leaves] = row.frame_seconds.map(|seconds| cell(1e3 * seconds, 2, ""));
        page.push_str(&quality_cells(&row.alone));
        let _ = write!(page, "{alone}<td>{}</td>{}{with_leaves}</tr>", row.leaves, quality_cells(&row.with_leaves));
    }
    let peers = match cfg!(feature = "peers") {
        true => {
            "meshopt is meshoptimizer on the wood of each material as one mesh, with as many triangles as the order \
                 draws or as few as it gets to."
        }
        false => "This command was built without the feature <code>peers</code>: meshoptimizer is not compared.",
    };
    let _ = write!(
        page,
        "</tbody></table><p class=\"note\">The preset balanced, compared with all of its wood at the same size from 16 \
         views that the simplification did not use, from level to 40 degrees above: the wood alone, and with as many \
         leaves as the default policy draws. The order is drawn at an error of {ERROR_PX} pixels; of stems by width, \
         those thinner than that are drawn with the probability at which they cover as much, as wide as that. {peers} \
         Frames show four plants.</p></details>",
    );
}

fn quality_cells(quality: &Quality) -> String {
    let percent = |share: f64| cell(100.0 * share, 2, " %");
    [cell(quality.rmse, 2, ""), cell(quality.ssim, 4, ""), percent(quality.coverage), percent(quality.xor)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use foliage_lod::software::Image;

    #[test]
    fn every_picture_is_shown_enlarged_and_every_row_has_one_cell_for_each_heading() {
        let quality = Quality { rmse: 2.5, ssim: 0.5, flip: f64::NAN, coverage: -0.01, xor: 0.02, grain: 0.75 };
        let row = |(diameter_px, way): (u32, &'static str)| WoodRow {
            way,
            diameter_px,
            triangles: 1234,
            alone: quality,
            leaves: 7,
            with_leaves: quality,
            frame_seconds: [f64::NAN; 2],
            images: [0, 1].map(|_| Image::filled(diameter_px, diameter_px, [1, 2, 3, 255])),
        };
        let rows: Vec<WoodRow> = DIAMETERS.into_iter().flat_map(|px| WAYS.map(|way| (px, way))).map(row).collect();
        let mut page = String::new();
        wood_section(&mut page, &rows).unwrap();
        assert_eq!(page.matches("width=\"256\" height=\"256\"").count(), 3 * 3 * 2);
        assert_eq!(page.matches("width=\"240\" height=\"240\"").count(), 3 * 2, "48 pixels, five times as large");
        assert_eq!(page.matches("<svg").count(), 4, "no frames were timed");
        let table = &page[page.find("<tbody>").unwrap()..];
        assert_eq!(table.matches("<td").count(), 12 * HEADS.len());
        assert_eq!(page.contains("without the feature"), !cfg!(feature = "peers"));
        let mut none = String::new();
        wood_section(&mut none, &[]).unwrap();
        assert_eq!(none, "");
    }
}
