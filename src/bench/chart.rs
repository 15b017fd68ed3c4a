//! Charts of cost against error, both axes logarithmic, as SVG.

use plotters::prelude::*;

/// A chart.
pub(crate) struct Chart {
    /// Its title.
    pub(crate) title: String,
    /// Quantity of the horizontal axis.
    pub(crate) x_label: &'static str,
    /// Quantity of the vertical axis.
    pub(crate) y_label: &'static str,
    /// The plotted series.
    pub(crate) series: Vec<Series>,
}

/// The settings of one engine.
pub(crate) struct Series {
    /// Its name in the legend.
    pub(crate) name: &'static str,
    /// Cost and error of each.
    pub(crate) points: Vec<ChartPoint>,
}

/// A setting.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChartPoint {
    /// Its cost.
    pub(crate) cost: f64,
    /// Its error.
    pub(crate) error: f64,
    /// True on the Pareto front, which is drawn as a line.
    pub(crate) on_front: bool,
    /// True for the default, which has a ring around it and a label.
    pub(crate) is_default: bool,
}

/// Minimum plotted number, which replaces smaller ones.
const MIN_PLOTTED: f64 = 1e-9;
const SIZE: (u32, u32) = (760, 420);
const COLORS: [RGBColor; 3] = [
    RGBColor(31, 122, 120),
    RGBColor(212, 112, 60),
    RGBColor(74, 90, 138),
];
const GREY: RGBColor = RGBColor(205, 205, 205);
const LIGHT_GREY: RGBColor = RGBColor(238, 238, 238);

impl ChartPoint {
    fn position(&self) -> (f64, f64) {
        (self.cost.max(MIN_PLOTTED), self.error.max(MIN_PLOTTED))
    }
}

impl Chart {
    /// Returns the SVG; an empty text without points.
    pub(crate) fn svg(&self) -> Result<String, String> {
        let all_points = || self.series.iter().flat_map(|series| &series.points);
        if all_points().all(|point| !is_finite(point)) {
            return Ok(String::new());
        }
        let mut text = String::new();
        self.draw(&mut text).map_err(|error| error.to_string())?;
        Ok(text)
    }

    fn draw(&self, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let positions = || {
            let points = self.series.iter().flat_map(|series| &series.points);
            points
                .filter(|point| is_finite(point))
                .map(ChartPoint::position)
        };
        let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 17))
            .margin(14)
            .x_label_area_size(42)
            .y_label_area_size(66)
            .build_cartesian_2d(
                range(&mut positions().map(|position| position.0)).log_scale(),
                range(&mut positions().map(|position| position.1)).log_scale(),
            )?;
        chart
            .configure_mesh()
            .x_desc(self.x_label)
            .y_desc(self.y_label)
            .x_label_formatter(&|n| short_number(*n))
            .y_label_formatter(&|n| short_number(*n))
            .max_light_lines(1)
            .light_line_style(LIGHT_GREY)
            .bold_line_style(GREY)
            .draw()?;
        for (series, color) in self.series.iter().zip(COLORS.iter().cycle()) {
            let color = *color;
            let points = || series.points.iter().filter(|point| is_finite(point));
            let mut front: Vec<(f64, f64)> = points()
                .filter(|point| point.on_front)
                .map(ChartPoint::position)
                .collect();
            front.sort_by(|a, b| a.0.total_cmp(&b.0));
            chart
                .draw_series(LineSeries::new(front, color.stroke_width(2)))?
                .label(series.name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, color.filled()));
            chart.draw_series(points().map(|point| {
                let style = if point.on_front {
                    color.filled()
                } else {
                    color.mix(0.35).filled()
                };
                Circle::new(point.position(), 3, style)
            }))?;
            let defaults = || points().filter(|point| point.is_default);
            chart.draw_series(
                defaults().map(|point| Circle::new(point.position(), 7, color.stroke_width(2))),
            )?;
            let font = ("sans-serif", 12).into_font().color(&color);
            chart.draw_series(defaults().map(|point| {
                EmptyElement::at(point.position()) + Text::new("default", (10, -14), font.clone())
            }))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .border_style(GREY)
            .draw()?;
        root.present()?;
        drop(chart);
        drop(root);
        Ok(())
    }
}

/// Formats a number beside an axis. The steps of an axis are powers with rounding errors, so the number is
/// rounded to three digits.
fn short_number(n: f64) -> String {
    let n = format!("{n:.2e}").parse().unwrap_or(n);
    if (0.01..10_000.0).contains(&n) {
        format!("{n}")
    } else {
        format!("{n:e}")
    }
}

fn is_finite(point: &ChartPoint) -> bool {
    point.cost.is_finite() && point.error.is_finite()
}

/// Returns an axis that contains all numbers with a margin at both ends, and at least two powers of ten: those have
/// labels.
fn range(numbers: &mut dyn Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = numbers.fold((f64::MAX, MIN_PLOTTED), |(low, high), number| {
        (low.min(number), high.max(number))
    });
    let (mut start, mut end) = (low.log10() - 0.1, high.log10() + 0.1);
    while end.floor() - start.ceil() < 1.0 {
        // The nearer power beyond an end; a little more, so that it is inside.
        let (below, above) = ((start - 1e-9).floor(), (end + 1e-9).ceil());
        if start - below < above - end {
            start = below - 1e-3;
        } else {
            end = above + 1e-3;
        }
    }
    10.0_f64.powf(start)..10.0_f64.powf(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beside_an_axis_are_short() {
        let texts = [9.999_999_999_999_999e-6, 0.1 + 0.2, 20.0, 0.001, 123_456.0].map(short_number);
        assert_eq!(texts, ["1e-5", "0.3", "20", "1e-3", "1.23e5"]);
    }

    fn chart(points: Vec<ChartPoint>) -> Chart {
        Chart {
            title: "a < b".to_owned(),
            x_label: "cost",
            y_label: "error",
            series: vec![Series {
                name: "cpu",
                points,
            }],
        }
    }

    #[test]
    fn the_default_and_the_front_are_drawn() {
        let point = |cost, error, on_front, is_default| ChartPoint {
            cost,
            error,
            on_front,
            is_default,
        };
        let svg = chart(vec![
            point(1.0, 1e-3, true, false),
            point(2.0, 0.0, true, true),
            point(3.0, 1e-2, false, false),
            point(f64::NAN, 1.0, false, false),
        ])
        .svg()
        .expect("it is drawn");
        assert!(svg.starts_with("<svg"), "{svg}");
        assert_eq!(svg.matches("http").count(), 1, "its namespace: {svg}");
        assert!(svg.contains("<polyline"), "{svg}");
        // Three points, a ring, and the legend's.
        assert_eq!(svg.matches("<circle").count(), 5, "{svg}");
        assert_eq!(svg.matches("default").count(), 1, "{svg}");
    }

    #[test]
    fn without_points_there_is_no_chart() {
        assert_eq!(chart(vec![]).svg(), Ok(String::new()));
    }

    #[test]
    fn every_axis_has_two_labels() {
        for numbers in [vec![5.0], vec![1.0], vec![120.0, 480.0], vec![1e-9, 3.0]] {
            let range = range(&mut numbers.iter().copied());
            assert!(range.start < numbers[0] && numbers[numbers.len() - 1] < range.end);
            let powers = (-12..12).filter(|n| range.contains(&10.0_f64.powi(*n)));
            assert!(powers.count() >= 2, "{numbers:?}: {range:?}");
        }
    }
}
