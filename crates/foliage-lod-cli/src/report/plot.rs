//! Line plots as SVG.

use foliage_lod::{Error, Result};
use plotters::prelude::*;

/// Width and height of a plot in pixels.
const SIZE: (u32, u32) = (720, 420);
/// Factor applied to the range of the y axis, which leaves room for the legend.
const HEADROOM: f64 = 1.4;

/// A named polyline.
pub(super) struct Line {
    pub(super) name: String,
    pub(super) points: Vec<[f64; 2]>,
    /// Whether the line is thin, as a reference for the others.
    pub(super) is_reference: bool,
}

/// A plot with both axes starting at 0.
pub(super) struct Plot<'a> {
    pub(super) title: &'a str,
    pub(super) x_axis: &'a str,
    pub(super) y_axis: &'a str,
    pub(super) lines: Vec<Line>,
}

impl Plot<'_> {
    /// The plot as an SVG document.
    pub(super) fn svg(&self) -> Result<String> {
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, SIZE).into_drawing_area()).map_err(|error| Error::Unreadable {
            path: self.title.into(),
            reason: format!("plot cannot be drawn: {}", error.to_string().replace('\n', " ")),
            fix: "this is a bug in foliage-lod".into(),
        })?;
        Ok(svg)
    }

    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
    ) -> std::result::Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let largest = |axis: usize| {
            let values = self.lines.iter().flat_map(|line| &line.points).map(|point| point[axis]);
            values.filter(|value| value.is_finite()).fold(f64::MIN_POSITIVE, f64::max)
        };
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..largest(0), 0.0..largest(1) * HEADROOM)?;
        chart.configure_mesh().light_line_style(WHITE).x_desc(self.x_axis).y_desc(self.y_axis).draw()?;
        for (i, line) in self.lines.iter().enumerate() {
            let style = ShapeStyle {
                color: Palette99::pick(i).to_rgba(),
                filled: true,
                stroke_width: if line.is_reference { 1 } else { 2 },
            };
            let points = line.points.iter().map(|&[x, y]| (x, y));
            let key = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style);
            chart.draw_series(LineSeries::new(points, style).point_size(2))?.label(&line.name).legend(key);
        }
        let mut legend = chart.configure_series_labels();
        legend
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        area.present()
    }
}
