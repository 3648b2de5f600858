//! Bar charts of shares: where time or memory went.

use plotters::element::{Rectangle, Text};
use plotters::prelude::{DrawingAreaErrorKind, RGBColor};
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::canvas::{self, INK, text_width, units};
use super::error::ReportError;

const BAR: RGBColor = RGBColor(0x00, 0x72, 0xB2);
const ROW: f64 = 26.0;

/// Horizontal bars with a name on their left and a value on their right, as an SVG document.
///
/// # Errors
/// What the drawing library refuses.
pub fn bars(title: &str, rows: &[(String, f64, String)]) -> Result<String, ReportError> {
    let height = (48.0 + ROW * rows.len() as f64) as u32;
    canvas::document(
        (720, height),
        |area| -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
            let font = canvas::text(12.0, &INK);
            let widest = |texts: &mut dyn Iterator<Item = &String>| {
                texts.map(|text| text_width(area, text, &font)).max().unwrap_or(0)
            };
            let left = widest(&mut rows.iter().map(|row| &row.0)) + units(18.0);
            let right = units(720.0 - 20.0) - widest(&mut rows.iter().map(|row| &row.2)) - units(8.0);
            let largest = rows.iter().map(|row| row.1).fold(f64::MIN_POSITIVE, f64::max);
            let heading = canvas::bold_text(14.0, &INK).pos(Pos::new(HPos::Left, VPos::Top));
            area.draw(&Text::new(title.to_owned(), (units(10.0), units(12.0)), heading))?;
            for (number, (name, value, shown)) in rows.iter().enumerate() {
                let top = units(40.0 + ROW * number as f64);
                let middle = top + units(ROW) / 2;
                let end = left + (f64::from(right - left) * (value / largest).clamp(0.0, 1.0)) as i32;
                let corners = [
                    (left, top + units(4.0)),
                    (end.max(left + units(1.0)), top + units(ROW - 4.0)),
                ];
                area.draw(&Rectangle::new(corners, BAR.filled()))?;
                let named = font.pos(Pos::new(HPos::Right, VPos::Center));
                area.draw(&Text::new(name.clone(), (left - units(8.0), middle), named))?;
                let valued = font.pos(Pos::new(HPos::Left, VPos::Center));
                area.draw(&Text::new(shown.clone(), (end + units(8.0), middle), valued))?;
            }
            Ok(())
        },
    )
}
