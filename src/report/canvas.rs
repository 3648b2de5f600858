//! Where figures are drawn: an SVG document with a font of our own, and the same as a PNG picture.
//!
//! Machines that compute often have no fonts. The one of the figures is inside the program, so that texts are measured
//! and painted alike everywhere.

use std::fmt::{Display, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, IntoDrawingArea, RGBColor, SVGBackend, TextStyle, WHITE};
use plotters::style::{FontStyle, IntoFont, register_font};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg;

use super::error::ReportError;

/// Units of the drawing per pixel: the backend rounds coordinates to whole units, and curves would show it.
pub const UNITS: i32 = 8;
/// Pixels of a PNG per pixel of the drawing: 300 per inch for a figure 7.2 inches wide.
const PNG_SCALE: f32 = 3.0;
/// The family that the documents name; a browser takes its own.
const FAMILY: &str = "sans-serif";

/// Colours of everything that is no data. The page replaces them on a dark background.
pub const INK: RGBColor = RGBColor(0x26, 0x2B, 0x33);
pub const MUTED: RGBColor = RGBColor(0x5C, 0x64, 0x70);
pub const GRID: RGBColor = RGBColor(0xE3, 0xE6, 0xEA);

/// Area of an SVG document under way.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.load_font_data(dejavu::sans::bold().to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

static MEASURED: LazyLock<bool> = LazyLock::new(|| {
    register_font(FAMILY, FontStyle::Normal, dejavu::sans::regular()).is_ok()
        && register_font(FAMILY, FontStyle::Bold, dejavu::sans::bold()).is_ok()
});

/// The fonts that documents are painted with.
pub(super) fn fonts() -> Arc<usvg::fontdb::Database> {
    FONTS.clone()
}

/// Length in pixels as units of the drawing.
pub fn units(pixels: f64) -> i32 {
    (pixels * f64::from(UNITS)).round() as i32
}

/// A font of the given size [pixels] and colour.
pub fn text(pixels: f64, colour: &RGBColor) -> TextStyle<'static> {
    // The backend writes a font size that is smaller by this factor.
    (FAMILY, pixels * f64::from(UNITS) * 1.24).into_font().color(colour)
}

/// As [`text`], bold.
pub fn bold_text(pixels: f64, colour: &RGBColor) -> TextStyle<'static> {
    (FAMILY, pixels * f64::from(UNITS) * 1.24)
        .into_font()
        .style(FontStyle::Bold)
        .color(colour)
}

/// Width of a text [units].
pub fn text_width(area: &Area<'_>, text: &str, style: &TextStyle<'_>) -> i32 {
    let measured = area
        .estimate_text_size(text, style)
        .map_or(0, |(width, _)| width as i32);
    // The drawing library measures the ink of the letters in its own font size; what is drawn is up to a ninth wider.
    measured * 112 / 100
}

/// Draws a document of the given size [pixels] on white.
///
/// # Errors
/// What the drawing library refuses.
pub fn document<E: Display>(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<(), E>,
) -> Result<String, ReportError> {
    let refused = |error: &dyn Display| ReportError::Drawing(error.to_string());
    if !*MEASURED {
        return Err(ReportError::Drawing("the font of the figures cannot be read".into()));
    }
    let full = (size.0 * UNITS as u32, size.1 * UNITS as u32);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, full).into_drawing_area();
        area.fill(&WHITE).map_err(|error| refused(&error))?;
        draw(&area).map_err(|error| refused(&error))?;
        area.present().map_err(|error| refused(&error))?;
    }
    let drawn = format!("width=\"{}\" height=\"{}\"", full.0, full.1);
    Ok(svg.replacen(&drawn, &format!("width=\"{}\" height=\"{}\"", size.0, size.1), 1))
}

/// A document as a PNG picture, three pixels for one.
///
/// # Errors
/// A document that is no SVG, or a picture too large for memory.
pub fn png(svg: &str) -> Result<Vec<u8>, ReportError> {
    let refused = |error: &dyn Display| ReportError::Drawing(error.to_string());
    let options = usvg::Options {
        fontdb: fonts(),
        ..Default::default()
    };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| refused(&error))?;
    let size = tree.size().to_int_size();
    let pixels = |length: u32| (length as f32 * PNG_SCALE).round() as u32;
    let mut picture =
        Pixmap::new(pixels(size.width()), pixels(size.height())).ok_or_else(|| refused(&"the picture is too large"))?;
    resvg::render(
        &tree,
        Transform::from_scale(PNG_SCALE, PNG_SCALE),
        &mut picture.as_mut(),
    );
    picture.encode_png().map_err(|error| refused(&error))
}

/// Writes a document as `STEM.svg` and `STEM.png` into a folder; answers with the two paths.
///
/// # Errors
/// A file that cannot be written, and those of [`png`].
pub fn write(directory: &Path, stem: &str, svg: &str) -> Result<[PathBuf; 2], ReportError> {
    let paths = ["svg", "png"].map(|extension| directory.join(format!("{stem}.{extension}")));
    let written = |path: &Path, bytes: &[u8]| {
        std::fs::write(path, bytes).map_err(|error| ReportError::File(format!("{}: {error}", path.display())))
    };
    written(&paths[0], svg.as_bytes())?;
    written(&paths[1], &png(svg)?)?;
    Ok(paths)
}

/// A whole number as superscript, for powers of ten.
pub fn superscript(number: i32) -> String {
    let mut text = String::new();
    for digit in number.to_string().chars() {
        let raised = match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' => '⁰',
            other => char::from_u32('⁰' as u32 + other.to_digit(10).unwrap_or(0)).unwrap_or(other),
        };
        let _ = text.write_char(raised);
    }
    text
}
