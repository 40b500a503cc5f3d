//! The report as one self-contained HTML page: SVG plots, embedded pictures and sortable tables.
//!
//! Limits: the script only sorts tables; without it the page is still complete.

use super::{
    budget_section::{BudgetRow, budget_section},
    far::{FarRow, Seen},
    impostor_section::impostor_section,
    impostors::SmallRow,
    markup::{cell, embedded, escaped, front},
    offline::{LEVEL, OfflineRow},
    plot::{Line, Plot},
    rows::{matched_table, run_time_table},
    scene_costs::Cost,
    study::{Row, Shown},
    wood::WoodRow,
    wood_section::wood_section,
};
use foliage_lod::{Result, effects::Count, software::Image};
use std::fmt::Write;

/// Measurements of one plant.
pub struct PlantReport {
    /// The plant's name.
    pub plant: String,
    /// Leaves of the full plant.
    pub leaves: u32,
    /// Measurements of each method at each level.
    pub rows: Vec<Row>,
    /// Popping of each method while a camera backs away, on the sRGB scale of 0 to 255.
    pub pops: Vec<(String, f64)>,
    /// Measurements of each simplification.
    pub offline: Vec<OfflineRow>,
    /// Coverage and colour of the full plant far away; empty if they were not measured.
    pub far: Vec<FarRow>,
    /// The plant at small sizes, by leaves, impostor and others; empty if they were not asked for.
    pub small: Vec<SmallRow>,
    /// The wood with less detail; empty if it was not asked for, or if there is no wood.
    pub wood: Vec<WoodRow>,
    /// Picture of the full plant.
    pub full: Image,
    /// Pictures of the shown methods at each level.
    pub shown: Vec<Shown>,
}

/// Measurements of one scene.
pub struct SceneReport {
    /// Name of the scene.
    pub name: String,
    /// Number of plants.
    pub plants: usize,
    /// Cost of each case.
    pub costs: Vec<Cost>,
    /// Each rule of a budget; empty if they were not asked for.
    pub budgets: Vec<BudgetRow>,
    /// What its models take on the GPU.
    pub gpu_bytes: u64,
}

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:1500px;padding:0 1rem;color:#222}
h1{margin-bottom:0}h2{margin-top:3rem;border-bottom:1px solid #ccc}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.15rem .6rem;text-align:right;white-space:nowrap}th:first-child,td:first-child{text-align:left}
table.sorts th{cursor:pointer;background:#eee;position:sticky;top:0}table.sorts tr.front{background:#e6f3df}
tr:hover{background:#f4f4f4}.plots{display:flex;flex-wrap:wrap}.plots svg{max-width:100%;height:auto}
.pictures td{text-align:center;padding:2px}.pictures img{display:block}.note{color:#666;max-width:60rem}
td.wraps{white-space:normal;max-width:16rem}details{margin:1rem 0}summary{cursor:pointer;font-weight:600}";

const SCRIPT: &str = "for(const table of document.querySelectorAll('table.sorts'))
table.querySelectorAll('th').forEach((head,column)=>head.addEventListener('click',()=>{
const body=table.tBodies[0],up=head.dataset.up=head.dataset.up==='1'?'0':'1';
const key=row=>row.cells[column].dataset.value??row.cells[column].textContent;
const order=(a,b)=>{const[x,y]=[parseFloat(a),parseFloat(b)];return isNaN(x)||isNaN(y)?a.localeCompare(b):x-y};
[...body.rows].sort((a,b)=>(up==='1'?1:-1)*order(key(a),key(b))).forEach(row=>body.append(row))}));";

/// Renders the page. `adapter` names the GPU adapter that rendered the timed frames.
///
/// # Errors
/// Errors from drawing plots and encoding pictures.
pub fn html(reports: &[PlantReport], scenes: &[SceneReport], adapter: Option<&str>) -> Result<String> {
    let mut page = format!(
        "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>foliage-lod report</title>\
         <style>{STYLE}</style></head><body><h1>Accuracy and cost</h1><p class=\"note\">Each method is compared \
         with the full plant at several fractions of the leaves, from 12 views that no method saw. RMSE is on \
         the sRGB scale of 0 to 255; XOR and coverage are relative to the area of the full plant's silhouette. Grain \
         is the mean absolute gradient of the luma over that of the full plant's picture: 1 is as fine, less means \
         few large leaves in the place of many small ones, and strong edges of large leaves raise it. {}. \
         Click a column heading to sort. Green rows are on the Pareto front of the largest size: no other row of \
         that size is both cheaper (in frame time or, if no frames were timed, in leaves) and closer to the full \
         plant.</p>",
        adapter
            .map_or("No frames were timed".into(), |adapter| format!("Frames were rendered by {}", escaped(adapter))),
    );
    for report in reports {
        section(&mut page, report)?;
    }
    for scene in scenes {
        scene_section(&mut page, scene)?;
    }
    let _ = write!(page, "<script>{SCRIPT}</script></body></html>");
    Ok(page)
}

fn section(page: &mut String, report: &PlantReport) -> Result<()> {
    let _ = write!(page, "<h2>{}: {} leaves</h2>", escaped(&report.plant), report.leaves);
    let largest = report.rows.iter().map(|row| row.pixels).max().unwrap_or(0);
    let rows: Vec<&Row> = report.rows.iter().filter(|row| row.pixels == largest).collect();
    let front = pareto(&rows);
    page.push_str("<div class=\"plots\">");
    for plot in run_time_plots(&rows, &front) {
        page.push_str(&plot.svg()?);
    }
    page.push_str("</div>");
    picture_table(page, report)?;
    run_time_table(page, &report.rows, &rows, &front);
    matched_table(page, &rows);
    pop_table(page, &report.pops);
    far_table(page, &report.far);
    impostor_section(page, &report.small)?;
    wood_section(page, &report.wood)?;
    offline(page, &report.offline)
}

/// Coverage and mean colour of the drawers far away, against the reference.
fn far_table(page: &mut String, rows: &[FarRow]) {
    if rows.is_empty() {
        return;
    }
    page.push_str("<h3>Far away</h3><table><thead><tr><th>radii</th><th>coverage</th>");
    for drawer in ["CPU", "GPU, 1 sample", "GPU, 4 samples"] {
        let _ = write!(page, "<th>{drawer}</th><th>colour</th>");
    }
    page.push_str("</tr></thead><tbody>");
    for row in rows {
        let _ = write!(page, "<tr><td>{}</td>{}", row.distance, cell(row.truth.coverage_px, 1, " px"));
        let gpu = row.gpu.map_or([None; 2], |seen| seen.map(Some));
        for seen in [Some(row.cpu), gpu[0], gpu[1]] {
            let error = |of: fn(&Seen, &Seen) -> f64| seen.as_ref().map_or(f64::NAN, |seen| of(seen, &row.truth));
            page.push_str(&cell(100.0 * error(Seen::coverage_error), 1, " %"));
            page.push_str(&cell(error(Seen::color_error), 1, ""));
        }
        page.push_str("</tr>");
    }
    page.push_str(
        "</tbody></table><p class=\"note\">Every leaf is drawn, at these distances in radii, 512 pixels wide. \
         Coverage is compared with that of a picture of 64 samples per pixel that tests the full textures; colour \
         is the largest difference of a channel of the mean, on the sRGB scale of 0 to 255. Pictures are averaged \
         over 16 offsets within a pixel.</p>",
    );
}

fn scene_section(page: &mut String, scene: &SceneReport) -> Result<()> {
    let _ = write!(
        page,
        "<h2>Scene {}: {} plants</h2><table class=\"sorts\"><thead><tr>",
        escaped(&scene.name),
        scene.plants
    );
    let heads = [
        "case",
        "frame ms",
        "relative to first",
        "plants",
        "leaves",
        "wood triangles",
        "effects MB",
        "simulated",
        "skipped",
    ];
    heads.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
    for cost in &scene.costs {
        let counts = |of: &dyn Fn(Count) -> u64| {
            let told: Vec<String> = cost.effects.named().map(|(name, count)| format!("{name} {}", of(count))).collect();
            told.join(", ")
        };
        let _ = write!(
            page,
            "<tr><td>{}</td>{}{}<td>{}</td><td>{}</td><td>{}</td>{}<td class=\"wraps\">{}</td><td class=\"wraps\">{}</td></tr>",
            escaped(&cost.name),
            cell(1e3 * cost.frame_seconds, 1, ""),
            cell(cost.ratio, 3, ""),
            cost.plants,
            cost.leaves,
            cost.wood_triangles,
            cell(cost.effect_bytes as f64 / 1e6, 2, ""),
            counts(&|count| count.simulated),
            counts(&|count| count.skipped),
        );
    }
    page.push_str(
        "</tbody></table><p class=\"note\">The cases were rendered in turn, frame by frame, along the scene's \
         camera path; times are medians. Simulated and skipped are counts in the first frame: leaves for fade, \
         pictures for sky, plants for the other effects. Motion vectors are shown as colours: grey is no motion, \
         red is rightward and green is downward motion, saturated at four pixels per frame.</p><div \
         class=\"plots\">",
    );
    for (number, cost) in scene.costs.iter().enumerate() {
        // Shows the frame with the effect beside the same frame without it.
        let off = scene.costs.get(1).filter(|_| number > 1);
        let (shown, caption) = match off {
            Some(off) => (&Image::side_by_side(&[off.image.clone(), cost.image.clone()], 4), "off and on"),
            None => (&cost.image, ""),
        };
        let caption = format!("{} {caption}", cost.name);
        let _ =
            write!(page, "<figure>{}<figcaption>{}</figcaption></figure>", embedded(shown)?, escaped(caption.trim()));
    }
    page.push_str("</div>");
    budget_section(page, &scene.budgets, scene.gpu_bytes)
}

/// Whether each row is on the Pareto front of cost and RMSE. The cost is the frame time, or the
/// number of leaves if no frames were timed.
fn pareto(rows: &[&Row]) -> Vec<bool> {
    let is_timed = rows.iter().any(|row| row.frame_seconds.is_finite());
    let cost = |row: &Row| if is_timed { row.frame_seconds } else { f64::from(row.leaves) };
    front(&rows.iter().map(|row| [cost(row), row.quality.rmse]).collect::<Vec<_>>())
}

fn run_time_plots(rows: &[&Row], front: &[bool]) -> Vec<Plot<'static>> {
    let plot = |title, x_axis, y_axis, point: &dyn Fn(&Row) -> [f64; 2]| Plot {
        title,
        x_axis,
        y_axis,
        lines: lines(rows, point),
    };
    let leaves = "leaves (% of the full plant)";
    let mut plots = vec![
        plot("Error against leaves drawn", leaves, "RMSE", &|row| [100.0 * row.level, row.quality.rmse]),
        plot("Silhouettes against leaves drawn", leaves, "XOR (%)", &|row| {
            [100.0 * row.level, 100.0 * row.quality.xor]
        }),
        plot("Error at the matched size against leaves drawn", leaves, "RMSE", &|row| {
            [100.0 * row.level, row.matched.quality.rmse]
        }),
        plot("Grain against leaves drawn", leaves, "grain", &|row| [100.0 * row.level, row.quality.grain]),
        plot("Error against fragments drawn, up to 150 %", "fragments (% of the full plant)", "RMSE", &|row| {
            // Leaves scaled by 1 / lambda take twenty times as many as the full plant.
            let share = Some(row.drawn.fragment_share).filter(|share| *share <= 1.5);
            [100.0 * share.unwrap_or(f64::NAN), row.quality.rmse]
        }),
    ];
    if rows.iter().any(|row| row.frame_seconds.is_finite()) {
        let mut timed = plot("Error against frame time", "ms per frame", "RMSE", &|row| {
            [1e3 * row.frame_seconds, row.quality.rmse]
        });
        let mut points: Vec<[f64; 2]> = rows
            .iter()
            .zip(front)
            .filter(|(_, is_front)| **is_front)
            .map(|(row, _)| [1e3 * row.frame_seconds, row.quality.rmse])
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        timed.lines.push(Line { name: "Pareto front".into(), points, is_reference: true });
        plots.push(timed);
        let extraction = |row: &Row| [100.0 * row.level, 1e6 * row.extraction_seconds];
        plots.push(plot("Extraction time from all leaves", leaves, "microseconds", &extraction));
    }
    plots
}

/// One line per method, through its measured points.
fn lines(rows: &[&Row], point: &dyn Fn(&Row) -> [f64; 2]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for row in rows.iter().filter(|row| point(row).iter().all(|value| value.is_finite())) {
        match lines.iter_mut().find(|line| line.name == row.method) {
            Some(line) => line.points.push(point(row)),
            None => lines.push(Line { name: row.method.clone(), points: vec![point(row)], is_reference: false }),
        }
    }
    lines
}

fn picture_table(page: &mut String, report: &PlantReport) -> Result<()> {
    let full = embedded(&report.full)?;
    let _ =
        write!(page, "<h3>Side by side</h3><table class=\"pictures\"><tr><td>full</td><td>{full}</td></tr></table>");
    page.push_str("<table class=\"pictures\">");
    let mut method = None;
    for shown in &report.shown {
        if method.replace(&shown.method) != Some(&shown.method) {
            let _ = write!(page, "</tr><tr><td>{}</td>", escaped(&shown.method));
        }
        let percent = (1000.0 * shown.level).round() / 10.0;
        let _ = write!(page, "<td>{}{percent} %</td>", embedded(&shown.image)?);
    }
    page.push_str("</tr></table>");
    Ok(())
}

fn pop_table(page: &mut String, pops: &[(String, f64)]) {
    page.push_str("<details open><summary>Popping</summary><table class=\"sorts\"><thead><tr><th>method</th>");
    page.push_str("<th>largest change</th></tr></thead><tbody>");
    for (method, change) in pops {
        let _ = write!(page, "<tr><td>{}</td>{}</tr>", escaped(method), cell(*change, 3, ""));
    }
    page.push_str(
        "</tbody></table><p class=\"note\">A camera backs away to six times its first distance in four seconds, and \
         the number of leaves falls with the plant's area on the screen. The table lists the largest mean change \
         from one frame to the next that the level of detail causes, on the sRGB scale of 0 to 255. Each frame \
         uses the discrete level whose fraction is closest to the wanted one.</p></details>",
    );
}

/// Plots of time, memory and error against resolution, and of time against views; the models on one
/// line differ in nothing else.
fn cost_plots(rows: &[OfflineRow]) -> Vec<Plot<'static>> {
    let memory = |row: &OfflineRow| row.peak_bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e6);
    let by_resolution = |row: &OfflineRow| f64::from(row.resolution);
    let by_views = |row: &OfflineRow| f64::from(row.views);
    let plot = |title, x_axis, y_axis, x: &dyn Fn(&OfflineRow) -> f64, y: &dyn Fn(&OfflineRow) -> f64| {
        let mut lines: Vec<Line> = Vec::new();
        for row in rows {
            let rule = format!("{}+{}{}", row.criterion, row.compensate, if row.cascade { ", cascade" } else { "" });
            let name = if x_axis == "views" {
                format!("{rule}, {0} x {0}", row.resolution)
            } else {
                format!("{rule}, {} views", row.views)
            };
            match lines.iter_mut().find(|line| line.name == name) {
                Some(line) => line.points.push([x(row), y(row)]),
                None => lines.push(Line { name, points: vec![[x(row), y(row)]], is_reference: false }),
            }
        }
        lines.retain(|line| line.points.len() > 1);
        lines.iter_mut().for_each(|line| line.points.sort_by(|a, b| a[0].total_cmp(&b[0])));
        Plot { title, x_axis, y_axis, lines }
    };
    let plots = [
        plot("Time against resolution", "resolution", "seconds", &by_resolution, &|row| row.seconds),
        plot("Memory against resolution", "resolution", "peak MB", &by_resolution, &memory),
        plot("Error against resolution", "resolution", "RMSE at 15 % of the leaves", &by_resolution, &|row| {
            row.quality.rmse
        }),
        plot("Time against views", "views", "seconds", &by_views, &|row| row.seconds),
    ];
    plots.into_iter().filter(|plot| !plot.lines.is_empty()).collect()
}

fn offline(page: &mut String, rows: &[OfflineRow]) -> Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    let mut lines: Vec<Line> = Vec::new();
    for row in rows {
        let preset = row.preset.trim_end_matches('*').to_string();
        let point = [row.seconds, row.quality.rmse];
        let name = format!("{} {}+{} {}", preset, row.criterion, row.compensate, row.resolution);
        lines.push(Line { name, points: vec![point], is_reference: false });
    }
    let (title, x_axis, y_axis) = ("Error against simplification time", "seconds", "RMSE at 15 % of the leaves");
    let _ =
        write!(page, "<h3>Simplification</h3><div class=\"plots\">{}", Plot { title, x_axis, y_axis, lines }.svg()?);
    for plot in cost_plots(rows) {
        page.push_str(&plot.svg()?);
    }
    page.push_str("</div>");
    page.push_str("<table class=\"sorts\"><thead><tr>");
    let heads = [
        "preset",
        "criterion",
        "compensate",
        "resolution",
        "views",
        "cascade",
        "seconds",
        "peak MB",
        "rmse",
        "ssim",
        "coverage",
        "xor",
    ];
    heads.iter().for_each(|head| {
        let _ = write!(page, "<th>{head}</th>");
    });
    page.push_str("</tr></thead><tbody>");
    for row in rows {
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{}{}{}{}{}{}</tr>",
            escaped(&row.preset),
            row.criterion,
            row.compensate,
            row.resolution,
            row.views,
            if row.cascade { "yes" } else { "" },
            cell(row.seconds, 2, ""),
            cell(row.peak_bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e6), 0, ""),
            cell(row.quality.rmse, 2, ""),
            cell(row.quality.ssim, 4, ""),
            cell(100.0 * row.quality.coverage, 2, " %"),
            cell(100.0 * row.quality.xor, 2, " %"),
        );
    }
    let _ = write!(
        page,
        "</tbody></table><p class=\"note\">Quality at {} % of the leaves. A * marks a preset with one option changed.</p>",
        100.0 * LEVEL
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{super::rows::tests::test_row, *};
    use foliage_lod::measure::Quality;

    fn row(frame_seconds: f64, rmse: f64) -> Row {
        let row = test_row();
        Row { frame_seconds, quality: Quality { rmse, ..row.quality }, ..row }
    }

    #[test]
    fn on_the_pareto_front_nothing_is_both_faster_and_closer() {
        let rows = [row(1.0, 9.0), row(2.0, 9.0), row(2.0, 4.0), row(3.0, 5.0), row(4.0, 1.0), row(f64::NAN, 0.5)];
        let rows: Vec<&Row> = rows.iter().collect();
        assert_eq!(pareto(&rows), [true, false, true, false, true, false]);
    }

    #[test]
    fn names_cannot_break_the_page_or_the_table() {
        let image = Image::filled(2, 2, [9; 4]);
        let shown = vec![Shown { method: "<m>".into(), level: 0.5, image: image.clone() }];
        let seen = |coverage_px| Seen { coverage_px, color: glam::Vec3::ONE };
        let reports = [PlantReport {
            plant: "<p>".into(),
            leaves: 10,
            rows: vec![row(1.0, 2.0)],
            pops: vec![("<m>".into(), 0.5)],
            offline: Vec::new(),
            far: vec![FarRow { distance: 6.0, truth: seen(200.0), cpu: seen(190.0), gpu: None }],
            small: Vec::new(),
            wood: Vec::new(),
            full: image,
            shown,
        }];
        let page = html(&reports, &[], Some("<a>")).unwrap();
        assert!(["<p>:", "<m>", "<a>"].iter().all(|name| !page.contains(name)), "{page}");
        assert!(page.contains("-5.0 %"), "the CPU covers 190 of 200 pixels");
    }
}
