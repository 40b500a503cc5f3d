//! The page's section on small plants: plots, pictures side by side and a table.

use super::{
    impostors::{DIAMETERS, SmallRow, Way},
    markup::{cell, embedded, enlarged},
    plot::{Line, Plot},
};
use foliage_lod::Result;
use std::fmt::Write;

/// Width and height of a shown picture: pixels are enlarged to fill it.
const SHOWN_PX: u32 = 128;
const HEADS: [&str; 11] = [
    "method",
    "diameter",
    "leaves",
    "rmse",
    "ssim",
    "coverage",
    "xor",
    "colour",
    "change per degree",
    "frame ms",
    "MB",
];

/// Appends the section; nothing if there are no rows.
pub(super) fn impostor_section(page: &mut String, rows: &[SmallRow]) -> Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    page.push_str("<h3>Small on screen</h3><div class=\"plots\">");
    for plot in plots(rows) {
        page.push_str(&plot.svg()?);
    }
    page.push_str("</div>");
    pictures(page, rows)?;
    table(page, rows);
    Ok(())
}

fn plots(rows: &[SmallRow]) -> Vec<Plot<'static>> {
    let plot = |title, y_axis, value: &dyn Fn(&SmallRow) -> f64| {
        let line = |way: Way| {
            let own = rows.iter().filter(|row| row.way == way);
            let points = own.map(|row| [f64::from(row.diameter_px), value(row)]).filter(|point| point[1].is_finite());
            Line { name: way.name().into(), points: points.collect(), is_reference: way == Way::Full }
        };
        let lines = Way::ALL.map(line).into_iter().filter(|line| !line.points.is_empty()).collect();
        Plot { title, x_axis: "diameter (pixels)", y_axis, lines }
    };
    let plots = vec![
        plot("Error against diameter", "RMSE", &|row| row.quality.rmse),
        plot("Dissimilarity against diameter", "1 - SSIM", &|row| 1.0 - row.quality.ssim),
        plot("Coverage against diameter", "difference (%)", &|row| 100.0 * row.quality.coverage.abs()),
        plot("Change per degree of turning", "RMSE", &|row| row.change),
        plot("Frame of four plants", "ms", &|row| 1e3 * row.frame_seconds),
    ];
    plots.into_iter().filter(|plot| !plot.lines.is_empty()).collect()
}

fn pictures(page: &mut String, rows: &[SmallRow]) -> Result<()> {
    page.push_str("<table class=\"pictures\"><tr><td></td>");
    DIAMETERS.iter().for_each(|px| {
        let _ = write!(page, "<td>{px} px</td>");
    });
    for way in Way::ALL {
        let _ = write!(page, "</tr><tr><td>{}</td>", way.name());
        for row in rows.iter().filter(|row| row.way == way) {
            let _ = write!(page, "<td>{}</td>", embedded(&enlarged(&row.image, SHOWN_PX))?);
        }
    }
    page.push_str("</tr></table>");
    Ok(())
}

fn table(page: &mut String, rows: &[SmallRow]) {
    page.push_str("<details open><summary>Small on screen</summary><table class=\"sorts\"><thead><tr>");
    HEADS.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
    for row in rows {
        let quality = &row.quality;
        let _ = write!(page, "<tr><td>{}</td><td>{}</td><td>{}</td>", row.way.name(), row.diameter_px, row.leaves);
        page.push_str(&cell(quality.rmse, 2, ""));
        page.push_str(&cell(quality.ssim, 4, ""));
        page.push_str(&cell(100.0 * quality.coverage, 2, " %"));
        page.push_str(&cell(100.0 * quality.xor, 2, " %"));
        page.push_str(&cell(row.color, 1, ""));
        page.push_str(&cell(row.change, 2, ""));
        page.push_str(&cell(1e3 * row.frame_seconds, 2, ""));
        page.push_str(&cell(row.bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e6), 2, ""));
        page.push_str("</tr>");
    }
    page.push_str(
        "</tbody></table><p class=\"note\">The preset balanced, compared with every leaf at the same size from 16 views \
         that neither the simplification nor the impostor used, from level to 40 degrees above. The prefix has as \
         many leaves as the default policy draws, or the fewest with at most the impostor's RMSE; both is the middle \
         of the hand-over. The three levels are the model's own prefixes of 100, 30 and 5 %, as meshes without tone \
         and tiles; the crossed cards are three quads, as they are exported, with the impostor's pictures from the side, lit like leaves and \
         as bright as the plant on average. Colour is the largest difference of a channel of the mean on the sRGB \
         scale; change is the RMSE between views one degree apart, to be compared with that of every leaf; frames show \
         four plants. MB are buffers and textures on the GPU with their mip levels.</p></details>",
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use foliage_lod::{measure::Quality, software::Image};

    #[test]
    fn every_picture_is_shown_enlarged_and_every_row_has_one_cell_for_each_heading() {
        let quality = Quality { rmse: 2.5, ssim: 0.5, flip: f64::NAN, coverage: -0.01, xor: 0.0, grain: 0.75 };
        let row = |(way, diameter_px): (Way, u32)| SmallRow {
            way,
            diameter_px,
            leaves: 7,
            quality,
            color: 1.0,
            change: 3.0,
            frame_seconds: f64::NAN,
            bytes: None,
            image: Image::filled(diameter_px, diameter_px, [1, 2, 3, 255]),
        };
        let rows: Vec<SmallRow> = DIAMETERS.into_iter().flat_map(|px| Way::ALL.map(|way| (way, px))).map(row).collect();
        let mut page = String::new();
        impostor_section(&mut page, &rows).unwrap();
        assert_eq!(page.matches("width=\"128\" height=\"128\"").count(), 35);
        assert_eq!(page.matches("<svg").count(), 4, "no frames were timed");
        let table = &page[page.find("<tbody>").unwrap()..];
        assert_eq!(table.matches("<td").count(), 35 * HEADS.len());
        assert!(page.contains("-1.00 %"));
        let mut none = String::new();
        impostor_section(&mut none, &[]).unwrap();
        assert_eq!(none, "");
    }
}
