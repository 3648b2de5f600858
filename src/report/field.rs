//! The deformed body, its points coloured by a field: axes and colour bar as lines, the points as a picture in between.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use plotters::chart::ChartBuilder;
use plotters::element::{PathElement, Rectangle, Text};
use plotters::prelude::{DrawingAreaErrorKind, RGBColor};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, ShapeStyle};
use resvg::tiny_skia::{Color as Fill, Paint, Pixmap, Rect, Transform};

use super::axis::{Axis, Fitted, is_drawn, scaled_unit};
use super::canvas::{self, Area, INK, MUTED, text_width, units};
use super::chart::LEFT_MARGIN;
use super::error::ReportError;

/// Pixels of a picture per pixel of the drawing.
const DENSITY: f64 = 1.5;
/// Room around the points [pixels]: left, top, right, bottom.
const MARGIN: [f64; 4] = [78.0, 40.0, 120.0, 54.0];

type Refused = DrawingAreaErrorKind<std::io::Error>;

/// A corner of the world as it is drawn: two coordinates, and how near it is.
type Seen = ([f64; 2], f64);

/// How positions become places in the picture.
#[derive(Clone, Debug)]
pub struct View {
    plane: bool,
    /// Of the body over all snapshots [m].
    min: [f64; 3],
    max: [f64; 3],
    /// Of the drawing [m].
    low: [f64; 2],
    high: [f64; 2],
    /// Pixels of the drawing per metre.
    scale: f64,
}

/// Points of one snapshot.
#[derive(Clone, Debug, Default)]
pub struct Cloud {
    pub positions: Vec<[f64; 3]>,
    pub half_lengths: Vec<[f64; 3]>,
}

/// What a body is coloured by.
#[derive(Clone, Debug)]
pub struct Colouring {
    pub unit: String,
    /// Ends of the colour bar.
    pub range: (f64, f64),
}

impl View {
    /// A view that holds all clouds, at equal scales along all axes.
    pub fn new(plane: bool, clouds: &[Cloud]) -> Self {
        let mut view = View {
            plane,
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
            scale: 1.0,
        };
        for cloud in clouds {
            for (position, half) in cloud.positions.iter().zip(&cloud.half_lengths) {
                for axis in 0..3 {
                    view.min[axis] = view.min[axis].min(position[axis] - half[axis]);
                    view.max[axis] = view.max[axis].max(position[axis] + half[axis]);
                }
            }
        }
        if !view.min.iter().chain(&view.max).all(|value| is_drawn(*value)) {
            (view.min, view.max) = ([0.0; 3], [1.0; 3]);
        }
        for corner in view.corners() {
            let (place, _) = view.seen(&corner);
            for (axis, value) in place.into_iter().enumerate() {
                view.low[axis] = view.low[axis].min(value);
                view.high[axis] = view.high[axis].max(value);
            }
        }
        let extent = [0, 1].map(|axis| view.high[axis] - view.low[axis]);
        let margin = (0.03 * extent[0].max(extent[1])).max(1e-12);
        for axis in 0..2 {
            view.low[axis] -= margin;
            view.high[axis] += margin;
        }
        view.scale = (520.0 / (extent[0] + 2.0 * margin)).min(440.0 / (extent[1] + 2.0 * margin));
        view
    }

    fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|k| {
            std::array::from_fn(|axis| {
                if k >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            })
        })
    }

    /// In space seen without perspective from the front, right and above.
    fn seen(&self, x: &[f64; 3]) -> Seen {
        if self.plane {
            return ([x[0], x[1]], 0.0);
        }
        let (azimuth, elevation) = (-58.0_f64.to_radians(), 22.0_f64.to_radians());
        let along = azimuth.cos() * x[0] + azimuth.sin() * x[1];
        let right = -azimuth.sin() * x[0] + azimuth.cos() * x[1];
        let up = elevation.cos() * x[2] - elevation.sin() * along;
        ([right, up], elevation.cos() * along + elevation.sin() * x[2])
    }

    /// Size of the plot [pixels of the drawing].
    fn size(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.scale * (self.high[axis] - self.low[axis])).max(24.0))
    }

    /// The points of a snapshot as a PNG picture, transparent where there are none; in grey without values.
    ///
    /// # Errors
    /// A picture that is too large.
    pub fn picture(&self, cloud: &Cloud, values: Option<(&[f64], (f64, f64))>) -> Result<Vec<u8>, ReportError> {
        let refused = |error: String| ReportError::Drawing(error);
        let [width, height] = self.size().map(|length| (DENSITY * length).round() as u32);
        let mut picture = Pixmap::new(width, height).ok_or_else(|| refused("no room for a picture".into()))?;
        let mut order: Vec<usize> = (0..cloud.positions.len()).collect();
        let seen: Vec<Seen> = cloud.positions.iter().map(|position| self.seen(position)).collect();
        if !self.plane {
            // Far points first, so that near ones hide them.
            order.sort_by(|&a, &b| seen[a].1.total_cmp(&seen[b].1));
        }
        let pixels = DENSITY * self.scale;
        for point in order {
            let ([x, y], half) = (seen[point].0, cloud.half_lengths[point]);
            let reach = if self.plane {
                [half[0], half[1]]
            } else {
                [(half[0] * half[1] * half[2]).abs().cbrt(); 2]
            };
            // Out to whole pixels: neighbours touch without a seam.
            let low = |value: f64| (pixels * value + 1e-6).floor() as f32;
            let high = |value: f64| (pixels * value - 1e-6).ceil() as f32;
            let (left, top) = (low(x - reach[0] - self.low[0]), low(self.high[1] - y - reach[1]));
            let right = high(x + reach[0] - self.low[0]).max(left + 1.0);
            let bottom = high(self.high[1] - y + reach[1]).max(top + 1.0);
            let mut paint = Paint {
                anti_alias: false,
                ..Default::default()
            };
            paint.set_color(match values {
                Some((values, range)) => fill(values[point], range),
                None => Fill::from_rgba8(0x80, 0x88, 0x94, 0x48),
            });
            if let Some(rectangle) = Rect::from_ltrb(left, top, right, bottom) {
                picture.fill_rect(rectangle, &paint, Transform::identity(), None);
            }
        }
        picture.encode_png().map_err(|error| refused(error.to_string()))
    }

    /// A figure with axes, colour bar, the body of the start in grey (`behind`) and a picture of its points.
    ///
    /// # Errors
    /// What the drawing library refuses.
    pub fn figure(
        &self,
        title: &str,
        colouring: &Colouring,
        behind: &[u8],
        front: &[u8],
    ) -> Result<String, ReportError> {
        let [width, height] = self.size();
        let full = [width + MARGIN[0] + MARGIN[2], height.max(150.0) + MARGIN[1] + MARGIN[3]];
        let size = (full[0].round() as u32, full[1].round() as u32);
        let svg = canvas::document(size, |area| {
            self.frame(area, title)?;
            self.colour_bar(area, colouring)
        })?;
        let place = format!(
            "x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\"",
            units(MARGIN[0]),
            units(MARGIN[1]),
            units(width),
            units(height)
        );
        let images = format!(
            "<image {place} href=\"{}\"/>\n<image class=\"points\" {place} href=\"{}\"/>\n",
            data_address(behind),
            data_address(front)
        );
        // The paper comes first in a document; the pictures lie upon it, and lines and texts upon them.
        let paper = svg
            .find("<rect")
            .and_then(|start| Some(start + svg[start..].find("/>\n")? + 3));
        let (below, above) = svg.split_at(paper.unwrap_or(svg.len()));
        Ok(format!("{below}{images}{above}"))
    }

    fn frame(&self, area: &Area<'_>, title: &str) -> Result<(), Refused> {
        let heading = canvas::bold_text(14.0, &INK).pos(Pos::new(HPos::Left, VPos::Top));
        area.draw(&Text::new(title.to_owned(), (units(MARGIN[0]), units(12.0)), heading))?;
        if !self.plane {
            return self.box_in_space(area);
        }
        let [width, height] = self.size();
        let largest = self
            .low
            .iter()
            .chain(&self.high)
            .fold(0.0, |most: f64, value| most.max(value.abs()));
        let (factor, unit) = scaled_unit(largest, "m");
        let axis = |label: &str, k: usize| {
            let range = Some((self.low[k] / factor, self.high[k] / factor));
            let axis = Axis {
                range,
                ..Axis::new(label, &unit)
            };
            let mut fitted = axis.fit(std::iter::empty());
            // Narrow bodies have no room for many numbers.
            let room = if k == 0 { width / 48.0 } else { height / 22.0 };
            let every = (fitted.ticks.len() as f64 / room.max(1.0)).ceil().max(1.0) as usize;
            fitted.ticks = fitted.ticks.into_iter().step_by(every).collect();
            fitted
        };
        let (x, y): (Fitted, Fitted) = (axis("x", 0), axis("y", 1));
        let dimensions = area.dim_in_pixel();
        ChartBuilder::on(area)
            .margin_top(units(MARGIN[1]))
            .margin_right(dimensions.0 as i32 - units(MARGIN[0] + width))
            .margin_bottom(dimensions.1 as i32 - units(MARGIN[1] + height + MARGIN[3] - 8.0))
            .margin_left(units(LEFT_MARGIN))
            .y_label_area_size(units(MARGIN[0] - LEFT_MARGIN))
            .x_label_area_size(units(MARGIN[3] - 8.0))
            .build_cartesian_2d(x.clone(), y.clone())?
            .configure_mesh()
            .disable_mesh()
            .axis_style(ShapeStyle::from(MUTED).stroke_width(units(1.0) as u32))
            .set_all_tick_mark_size(units(4.0))
            .label_style(canvas::text(12.0, &INK))
            .axis_desc_style(canvas::text(12.5, &INK))
            .x_desc(x.title.clone())
            .y_desc(y.title.clone())
            .draw()
    }

    /// Edges of the box around the body, with the coordinates of its ends.
    fn box_in_space(&self, area: &Area<'_>) -> Result<(), Refused> {
        let at = |corner: &[f64; 3]| {
            let ([x, y], _) = self.seen(corner);
            let right = MARGIN[0] + self.scale * (x - self.low[0]);
            (units(right), units(MARGIN[1] + self.scale * (self.high[1] - y)))
        };
        let corners = self.corners();
        let style = ShapeStyle::from(MUTED.mix(0.45)).stroke_width(units(0.8) as u32);
        for from in 0..8_usize {
            for axis in 0..3 {
                if from >> axis & 1 == 0 {
                    area.draw(&PathElement::new(
                        [at(&corners[from]), at(&corners[from | 1 << axis])],
                        style,
                    ))?;
                }
            }
        }
        let largest = self
            .min
            .iter()
            .chain(&self.max)
            .fold(0.0, |most: f64, value| most.max(value.abs()));
        let (factor, unit) = scaled_unit(largest, "m");
        // x and y along the lower front edges, z along the left one. Corner bits: 1 is far along x, 2 along y, 4 along z.
        for (axis, from, to) in [(0, 0, 1), (1, 1, 3), (2, 0, 4)] {
            let (a, b) = (at(&corners[from]), at(&corners[to]));
            let style = canvas::text(11.0, &INK);
            let (low, high) = (self.min[axis] / factor, self.max[axis] / factor);
            let text = format!("{}: {} … {} {unit}", ["x", "y", "z"][axis], short(low), short(high));
            let lowest = a.1.max(b.1) + units(14.0);
            let half = text_width(area, &text, &style) / 2;
            let centre = (a.0 + b.0) / 2;
            let place = if axis == 2 {
                (a.0 - units(20.0) + half, b.1 - units(10.0))
            } else {
                (centre.min(units(MARGIN[0] + self.size()[0] + 10.0) - half), lowest)
            };
            let place = (place.0.max(half + units(6.0)), place.1);
            area.draw(&Text::new(text, place, style.pos(Pos::new(HPos::Center, VPos::Center))))?;
        }
        Ok(())
    }

    fn colour_bar(&self, area: &Area<'_>, colouring: &Colouring) -> Result<(), Refused> {
        const STRIPS: usize = 128;
        let [width, height] = self.size();
        let height = height.max(150.0);
        let left = units(MARGIN[0] + width + 18.0);
        let (top, bottom) = (units(MARGIN[1] + 20.0), units(MARGIN[1] + height));
        let at = |share: f64| bottom - (f64::from(bottom - top) * share).round() as i32;
        for strip in 0..STRIPS {
            let share = |k: usize| k as f64 / STRIPS as f64;
            // The next strip covers what is too much of this one: no seams.
            let corners = [
                (left, at(share(strip + 2).min(1.0))),
                (left + units(14.0), at(share(strip))),
            ];
            let [red, green, blue] = viridis(share(strip));
            area.draw(&Rectangle::new(corners, RGBColor(red, green, blue).filled()))?;
        }
        let axis = Axis {
            range: Some(colouring.range),
            ..Axis::new("", &colouring.unit)
        };
        let fitted = axis.fit(std::iter::empty());
        let font = canvas::text(12.0, &INK);
        for (place, label) in &fitted.ticks {
            let share = (place - fitted.range.0) / (fitted.range.1 - fitted.range.0);
            let ends = [(left + units(14.0), at(share)), (left + units(18.0), at(share))];
            area.draw(&PathElement::new(
                ends,
                ShapeStyle::from(MUTED).stroke_width(units(1.0) as u32),
            ))?;
            let style = font.pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(label.clone(), (left + units(22.0), at(share)), style))?;
        }
        let unit = fitted.title.trim().to_owned();
        let style = font.pos(Pos::new(HPos::Left, VPos::Bottom));
        area.draw(&Text::new(unit, (left, top - units(6.0)), style))
    }
}

/// A picture inside a document.
pub fn data_address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

fn viridis(share: f64) -> [u8; 3] {
    let colour = colorous::VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}

fn fill(value: f64, (low, high): (f64, f64)) -> Fill {
    if !value.is_finite() {
        return Fill::from_rgba8(0xD5, 0x5E, 0x00, 0xFF);
    }
    // In steps, which the compression of the pictures likes and no eye sees.
    let share = ((value - low) / (high - low) * 255.0).round() / 255.0;
    let [red, green, blue] = viridis(share);
    Fill::from_rgba8(red, green, blue, 0xFF)
}

/// A number with three digits.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    let decimals = (2.0 - digits).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    text.replace('-', "−")
}
