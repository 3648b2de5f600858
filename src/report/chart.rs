//! Line charts: curves and markers over linear or logarithmic axes, as SVG and PNG.

use std::path::{Path, PathBuf};

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::element::{Circle, PathElement, Rectangle, Text, TriangleMarker};
use plotters::prelude::{Cartesian2d, DrawingAreaErrorKind, RGBColor, SVGBackend};
use plotters::series::DashedLineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, ShapeStyle};

use super::axis::Fitted;
pub use super::axis::{Axis, Scale};
use super::canvas::{self, Area, GRID, INK, MUTED, UNITS, text_width, units};
use super::error::ReportError;

/// Colours of series, told apart by colour-blind readers too (Okabe and Ito 2008).
const PALETTE: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x7A, 0x7A, 0x7A),
];

/// Height of a row of the legend [pixels].
const LEGEND_ROW: f64 = 20.0;

/// Margin left of the title of the upright axis, which is drawn around the edge of the area of the labels [pixels].
pub(super) const LEFT_MARGIN: f64 = 18.0;

type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Fitted, Fitted>>;
type Refused = DrawingAreaErrorKind<std::io::Error>;

/// A chart: series over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChart {
    /// Above the chart; none if empty.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    /// Width and height [pixels].
    pub size: (u32, u32),
}

/// One curve or cloud of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend, which a chart has if any series has a name.
    pub name: String,
    /// Places x, y. One that is not finite, or not positive on a logarithmic axis, interrupts the line.
    pub points: Vec<(f64, f64)>,
    pub line: Line,
    pub marker: Marker,
    /// Number of the colour, for series that belong together; the place in the list unless set.
    pub colour: Option<usize>,
}

/// How the points of a series are joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Line {
    None,
    #[default]
    Solid,
    Dashed,
}

/// What stands at each point of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marker {
    #[default]
    None,
    Circle,
    Square,
    Triangle,
}

impl Series {
    /// A solid line without markers.
    pub fn new(name: &str, points: Vec<(f64, f64)>) -> Self {
        Series {
            name: name.into(),
            points,
            line: Line::Solid,
            marker: Marker::None,
            colour: None,
        }
    }

    /// The same with markers.
    pub fn marked(self, marker: Marker) -> Self {
        Series { marker, ..self }
    }

    /// The same, joined in another way.
    pub fn joined(self, line: Line) -> Self {
        Series { line, ..self }
    }

    /// The same in a colour of the palette; numbers past its end begin anew.
    pub fn coloured(self, colour: usize) -> Self {
        Series {
            colour: Some(colour),
            ..self
        }
    }
}

impl LineChart {
    /// A chart of 720 × 450 pixels.
    pub fn new(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        LineChart {
            title: title.into(),
            x,
            y,
            series,
            size: (720, 450),
        }
    }

    /// The chart as an SVG document.
    ///
    /// # Errors
    /// What the drawing library refuses.
    pub fn svg(&self) -> Result<String, ReportError> {
        let shown = self.series.iter().flat_map(|series| &series.points);
        let x = self.x.fit(shown.clone().map(|point| point.0));
        let y = self.y.fit(shown.map(|point| point.1));
        canvas::document(self.size, |area| self.draw(area, &x, &y))
    }

    /// Writes `STEM.svg` and `STEM.png` into a folder; answers with the two paths.
    ///
    /// # Errors
    /// A file that cannot be written, and those of [`LineChart::svg`].
    pub fn write(&self, directory: &Path, stem: &str) -> Result<[PathBuf; 2], ReportError> {
        canvas::write(directory, stem, &self.svg()?)
    }

    fn draw<'a>(&self, area: &Area<'a>, x: &Fitted, y: &Fitted) -> Result<(), Refused> {
        let label_font = canvas::text(12.0, &INK);
        let widest = y.ticks.iter().map(|(_, label)| text_width(area, label, &label_font));
        let labels = widest.max().unwrap_or(0) + units(34.0);
        let left = labels + units(LEFT_MARGIN);
        let mut top = units(14.0);
        if !self.title.is_empty() {
            let style = canvas::bold_text(14.0, &INK).pos(Pos::new(HPos::Left, VPos::Top));
            area.draw(&Text::new(self.title.clone(), (left, top), style))?;
            top += units(26.0);
        }
        top = self.legend(area, left, top)?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(top)
            .margin_left(units(LEFT_MARGIN))
            .margin_right(units(22.0))
            .margin_bottom(units(8.0))
            .y_label_area_size(labels)
            .x_label_area_size(units(50.0))
            .build_cartesian_2d(x.clone(), y.clone())?;
        let axis_style = ShapeStyle::from(MUTED).stroke_width(units(1.0) as u32);
        chart
            .configure_mesh()
            .bold_line_style(ShapeStyle::from(GRID).stroke_width(units(1.0) as u32))
            .light_line_style(ShapeStyle::from(GRID).stroke_width(units(0.5) as u32))
            .axis_style(axis_style)
            .set_all_tick_mark_size(units(4.0))
            .label_style(label_font)
            .axis_desc_style(canvas::text(12.5, &INK))
            .x_desc(x.title.clone())
            .y_desc(y.title.clone())
            .draw()?;
        for (number, series) in self.series.iter().enumerate() {
            draw_series(&mut chart, series, colour(series, number), x, y)?;
        }
        Ok(())
    }

    /// Rows of names above the chart; answers with the height where the chart may begin.
    fn legend(&self, area: &Area<'_>, left: i32, top: i32) -> Result<i32, Refused> {
        let style = canvas::text(12.0, &INK).pos(Pos::new(HPos::Left, VPos::Center));
        let right = units(f64::from(self.size.0)) - units(22.0);
        let (sample, gap) = (units(24.0), units(18.0));
        let (mut column, mut row) = (left, top);
        let named = self
            .series
            .iter()
            .enumerate()
            .filter(|(_, series)| !series.name.is_empty());
        let mut any = false;
        for (number, series) in named {
            let width = sample + units(6.0) + text_width(area, &series.name, &style);
            if column > left && column + width > right {
                (column, row) = (left, row + units(LEGEND_ROW));
            }
            let middle = row + units(LEGEND_ROW) / 2;
            let colour = colour(series, number);
            match series.line {
                Line::None => {}
                Line::Solid => area.draw(&PathElement::new(
                    [(column, middle), (column + sample, middle)],
                    pen(colour),
                ))?,
                Line::Dashed => {
                    for (from, to) in [(0.0, 7.0), (10.0, 17.0), (20.0, 24.0)] {
                        let ends = [(column + units(from), middle), (column + units(to), middle)];
                        area.draw(&PathElement::new(ends, pen(colour)))?;
                    }
                }
            }
            draw_marker(area, series.marker, (column + sample / 2, middle), colour)?;
            area.draw(&Text::new(
                series.name.clone(),
                (column + sample + units(6.0), middle),
                style.clone(),
            ))?;
            column += width + gap;
            any = true;
        }
        Ok(if any { row + units(LEGEND_ROW + 4.0) } else { row })
    }
}

fn colour(series: &Series, number: usize) -> RGBColor {
    PALETTE[series.colour.unwrap_or(number) % PALETTE.len()]
}

fn pen(colour: RGBColor) -> ShapeStyle {
    ShapeStyle::from(colour).stroke_width(units(1.8) as u32)
}

fn draw_series(
    chart: &mut Chart<'_>,
    series: &Series,
    colour: RGBColor,
    x: &Fitted,
    y: &Fitted,
) -> Result<(), Refused> {
    let inside = |place: f64, range: (f64, f64)| range.0 <= place && place <= range.1;
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for &(at, value) in &series.points {
        match x.place(at).zip(y.place(value)) {
            Some(place) => pieces.last_mut().expect("never empty").push(place),
            None => pieces.push(Vec::new()),
        }
    }
    for piece in &pieces {
        let thinned = thinned(chart, piece);
        match series.line {
            Line::None => {}
            Line::Solid => chart.plotting_area().draw(&PathElement::new(thinned, pen(colour)))?,
            Line::Dashed => {
                let dashes = DashedLineSeries::new(thinned, units(7.0), units(4.0), pen(colour));
                chart.draw_series(dashes)?;
            }
        }
    }
    if series.marker == Marker::None {
        return Ok(());
    }
    let area = chart.plotting_area().strip_coord_spec();
    let base = area.get_base_pixel();
    for place in pieces.iter().flatten() {
        if inside(place.0, x.range) && inside(place.1, y.range) {
            let (right, down) = chart.backend_coord(place);
            draw_marker(&area, series.marker, (right - base.0, down - base.1), colour)?;
        }
    }
    Ok(())
}

/// Without the points that could not be told from the one before: a quarter of a pixel.
fn thinned(chart: &Chart<'_>, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (number, point) in points.iter().enumerate() {
        let (right, down) = chart.backend_coord(point);
        let near = last.is_some_and(|(x, y): (i32, i32)| 4 * (right - x).abs().max((down - y).abs()) < UNITS);
        if !near || number + 1 == points.len() {
            kept.push(*point);
            last = Some((right, down));
        }
    }
    kept
}

fn draw_marker(area: &Area<'_>, marker: Marker, at: (i32, i32), colour: RGBColor) -> Result<(), Refused> {
    let half = units(3.2);
    match marker {
        Marker::None => Ok(()),
        Marker::Circle => area.draw(&Circle::new(at, half, colour.filled())),
        Marker::Square => {
            let corners = [(at.0 - half, at.1 - half), (at.0 + half, at.1 + half)];
            area.draw(&Rectangle::new(corners, colour.filled()))
        }
        Marker::Triangle => area.draw(&TriangleMarker::new(at, half * 5 / 4, colour.filled())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resvg::tiny_skia::Pixmap;
    use resvg::usvg;

    fn example() -> LineChart {
        let curve = (0..200)
            .map(|k| f64::from(k) * 1e-4)
            .map(|u| (u, -4e5 * (1.0 - (-300.0 * u).exp())));
        let series = vec![
            Series::new("cells of 5 mm", curve.clone().collect()),
            Series::new(
                "reference <a & b>",
                curve.step_by(20).map(|(u, f)| (u, 1.02 * f)).collect(),
            )
            .joined(Line::Dashed)
            .marked(Marker::Triangle),
        ];
        LineChart::new("Force", Axis::new("displacement", "m"), Axis::new("force", "N"), series)
    }

    #[test]
    fn labels_legend_and_curves_are_in_the_document() {
        let svg = example().svg().unwrap();
        for text in [
            "displacement [mm]",
            "force [kN]",
            "cells of 5 mm",
            "reference &lt;a &amp; b&gt;",
            "−300",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(svg.contains("width=\"720\" height=\"450\" viewBox=\"0 0 5760 3600\""));
        assert!(svg.contains("stroke=\"#0072B2\"") && svg.contains("fill=\"#D55E00\""));
    }

    #[test]
    fn the_picture_shows_curves_and_texts_without_fonts_of_the_machine() {
        let picture = Pixmap::decode_png(&canvas::png(&example().svg().unwrap()).unwrap()).unwrap();
        assert_eq!((picture.width(), picture.height()), (2160, 1350));
        let count = |wanted: RGBColor| {
            let same = |p: &&resvg::tiny_skia::PremultipliedColorU8| {
                (p.red(), p.green(), p.blue()) == (wanted.0, wanted.1, wanted.2)
            };
            picture.pixels().iter().filter(same).count()
        };
        assert!(count(PALETTE[0]) > 2000, "pixels of the first curve");
        assert!(count(PALETTE[1]) > 500, "pixels of the second");
        assert!(count(INK) > 2000, "pixels of texts");
    }

    /// Boxes left, top, right, bottom of all texts [pixels].
    fn text_boxes(group: &usvg::Group, boxes: &mut Vec<[f32; 4]>) {
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => text_boxes(group, boxes),
                usvg::Node::Text(text) => {
                    let found = text.abs_bounding_box();
                    boxes.push([found.left(), found.top(), found.right(), found.bottom()]);
                }
                _ => {}
            }
        }
    }

    #[test]
    fn texts_stay_on_the_canvas_and_keep_a_distance() {
        let names = ["bspline2, 200 steps", "GIMPM, 50 steps", "MPM", "FEM 64 × 1 × 1"];
        let points = vec![(1.0, 0.02), (20.0, 0.3)];
        let series = names.map(|name| Series::new(name, points.clone()).marked(Marker::Circle));
        let y = Axis::new("error of force_curve", "").log();
        let chart = LineChart::new("Title", Axis::new("processor time", "s").log(), y, series.to_vec());
        let options = usvg::Options {
            fontdb: canvas::fonts(),
            ..Default::default()
        };
        let tree = usvg::Tree::from_str(&chart.svg().unwrap(), &options).unwrap();
        let mut boxes = Vec::new();
        text_boxes(tree.root(), &mut boxes);
        assert!(boxes.len() > 10, "{} texts", boxes.len());
        for (number, one) in boxes.iter().enumerate() {
            assert!(
                one[0] > 1.0 && one[1] > 1.0 && one[2] < 719.0 && one[3] < 449.0,
                "{one:?}"
            );
            for other in &boxes[..number] {
                let apart = (one[0] - other[2]).max(other[0] - one[2]);
                let above = (one[1] - other[3]).max(other[1] - one[3]);
                assert!(apart > 4.0 || above > 0.0, "{one:?} touches {other:?}");
            }
        }
    }

    #[test]
    fn a_chart_without_data_and_one_with_gaps_can_be_drawn() {
        let mut chart = example();
        chart.series[0].points[50].1 = f64::NAN;
        assert!(
            chart.svg().unwrap().matches("<polyline").count() > example().svg().unwrap().matches("<polyline").count()
        );
        chart.series.clear();
        assert!(chart.svg().unwrap().contains("force"));
        chart
            .series
            .push(Series::new("one", vec![(1.0, 0.0)]).marked(Marker::Circle));
        chart.y = Axis::new("residual", "").log();
        let legend_only = chart.svg().unwrap().matches("<circle").count();
        assert_eq!(legend_only, 1, "zero has no logarithm");
    }

    #[test]
    fn both_files_are_written_and_a_missing_folder_is_named() {
        let folder = std::env::temp_dir().join(format!("mpm_petsc_chart_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [svg, png] = example().write(&folder, "force").unwrap();
        assert!(std::fs::read_to_string(svg).unwrap().starts_with("<svg"));
        assert!(std::fs::read(png).unwrap().starts_with(b"\x89PNG"));
        let error = example().write(&folder.join("none"), "force").unwrap_err();
        assert!(error.to_string().contains("force.svg"), "{error}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
