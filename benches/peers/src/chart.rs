//! Charts of times with logarithmic axes, as SVG.

use crate::report::{OutputFormat, note, print};
use plotters::prelude::*;
use std::path::Path;

/// A chart.
pub(crate) struct LogLogChart {
    /// Text above the chart.
    pub(crate) title: &'static str,
    /// Label of the horizontal axis.
    pub(crate) x_axis: &'static str,
    /// Label of the vertical axis.
    pub(crate) y_axis: &'static str,
    /// Lines of the chart.
    pub(crate) series: Vec<ChartSeries>,
}

/// A line of a chart.
pub(crate) struct ChartSeries {
    /// Name in the legend.
    pub(crate) name: String,
    /// Points from left to right, with positive coordinates.
    pub(crate) points: Vec<(f64, f64)>,
}

/// Smallest plotted number. Smaller ones are drawn as this.
const MIN_PLOTTED: f64 = 0.01;
const CHART_SIZE: (u32, u32) = (760, 460);
const SERIES_COLORS: [RGBColor; 7] = [
    RGBColor(31, 122, 120),
    RGBColor(212, 112, 60),
    RGBColor(74, 90, 138),
    RGBColor(184, 64, 94),
    RGBColor(106, 168, 79),
    RGBColor(160, 130, 40),
    RGBColor(90, 90, 90),
];

impl LogLogChart {
    /// Writes the chart into the folder, if there is a folder and at least one point. A table in Markdown
    /// gets a link to it.
    pub(crate) fn write(
        &self,
        folder: Option<&Path>,
        name: &str,
        format: OutputFormat,
    ) -> Result<(), String> {
        let Some(folder) = folder else {
            return Ok(());
        };
        let all_points = || self.series.iter().flat_map(|series| &series.points);
        if all_points().count() == 0 {
            note(&format!("{name} would be empty"));
            return Ok(());
        }
        let path = folder.join(name);
        let write_error = |error: &dyn std::fmt::Display| {
            format!("{} cannot be written: {error}", path.display())
        };
        let mut text = String::new();
        self.draw(&mut text).map_err(|error| write_error(&error))?;
        std::fs::write(&path, text).map_err(|error| write_error(&error))?;
        if format == OutputFormat::Markdown {
            print(&format!("\n![{}]({})\n", self.title, path.display()))?;
        }
        Ok(())
    }

    fn draw(&self, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let points = || self.series.iter().flat_map(|series| series.points.iter());
        let range = |numbers: &mut dyn Iterator<Item = f64>| {
            let (low, high) = numbers.fold((f64::MAX, f64::MIN_POSITIVE), |(low, high), n| {
                (low.min(n), high.max(n))
            });
            let decade = |n: f64, round: fn(f64) -> f64| 10.0_f64.powf(round(n.log10()));
            let low = decade(low.max(MIN_PLOTTED), f64::floor);
            low..decade(high, f64::ceil).max(low * 10.0)
        };
        let root = SVGBackend::with_string(text, CHART_SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(self.title, ("sans-serif", 18))
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(
                range(&mut points().map(|point| point.0)).log_scale(),
                range(&mut points().map(|point| point.1)).log_scale(),
            )?;
        let plain_label = |n: &f64| format!("{n}");
        chart
            .configure_mesh()
            .x_desc(self.x_axis)
            .y_desc(self.y_axis)
            .x_label_formatter(&plain_label)
            .y_label_formatter(&plain_label)
            .max_light_lines(1)
            .light_line_style(RGBColor(238, 238, 238))
            .bold_line_style(RGBColor(205, 205, 205))
            .draw()?;
        for (series, color) in self.series.iter().zip(SERIES_COLORS.iter().cycle()) {
            let color = *color;
            let line = LineSeries::new(plotted_points(series), color.stroke_width(2));
            chart
                .draw_series(line.point_size(3))?
                .label(&series.name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2))
                });
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(RGBColor(205, 205, 205))
            .draw()?;
        root.present()?;
        Ok(())
    }
}

/// Returns a line's points, each at least [`MIN_PLOTTED`].
fn plotted_points(series: &ChartSeries) -> impl Iterator<Item = (f64, f64)> {
    let points = series.points.iter();
    points.map(|&(x, y)| (x.max(MIN_PLOTTED), y.max(MIN_PLOTTED)))
}
