//! The deformed body at chosen snapshots, once for each field.

use super::axis::is_drawn;
use super::curves::Figure;
use super::error::ReportError;
use super::field::{Cloud, Colouring, View, data_address};
use super::snapshots::Snapshots;

/// Most snapshots in a page.
const MOST_FRAMES: usize = 25;
/// Most base64 text of all pictures [byte]: the page stays below 10 MB.
const MOST_TEXT: usize = 7_000_000;
/// Fields that are shown where the points have them, with what they are called.
const FIELDS: [(&str, &str, &str); 4] = [
    ("chi", "Equivalent plastic strain χ", ""),
    ("rotation", "Rotation", "rad"),
    ("von_mises", "Von Mises stress", "Pa"),
    ("pressure", "Mean stress (tension positive)", "Pa"),
];

/// A field at all chosen snapshots.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name of the field in the snapshots.
    pub field: &'static str,
    /// The last snapshot.
    pub figure: Figure,
    /// Each chosen snapshot as an address that holds its picture.
    pub frames: Vec<String>,
    /// Smallest and largest value over the chosen snapshots.
    pub range: (f64, f64),
}

/// The bodies, and the times of their snapshots.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    pub times: Vec<f64>,
    pub bodies: Vec<Body>,
}

/// Draws all fields that vary.
///
/// # Errors
/// A file of snapshots that is damaged, and what the drawing library refuses.
pub fn draw(snapshots: &Snapshots, plane: bool) -> Result<Bodies, ReportError> {
    let mut most = MOST_FRAMES;
    loop {
        let drawn = draw_chosen(snapshots, plane, &snapshots.chosen(most))?;
        let text: usize = drawn.bodies.iter().flat_map(|body| &body.frames).map(String::len).sum();
        if text <= MOST_TEXT || most <= 2 {
            return Ok(drawn);
        }
        most = (most * MOST_TEXT / text).clamp(2, most - 1);
    }
}

fn draw_chosen(snapshots: &Snapshots, plane: bool, chosen: &[usize]) -> Result<Bodies, ReportError> {
    let Some(&first) = chosen.first() else {
        return Ok(Bodies::default());
    };
    let cloud = |&snapshot: &usize| -> Result<Cloud, ReportError> {
        let cloud = Cloud {
            positions: snapshots.positions(snapshot)?,
            half_lengths: snapshots.vector("half_lengths", snapshot)?,
        };
        let numbers = cloud.positions.iter().chain(&cloud.half_lengths).flatten();
        match numbers.copied().find(|number| !is_drawn(*number)) {
            Some(odd) => Err(snapshots.odd(snapshot, odd)),
            None => Ok(cloud),
        }
    };
    let clouds = chosen.iter().map(cloud).collect::<Result<Vec<_>, _>>()?;
    let initial = if first == 0 { clouds[0].clone() } else { cloud(&0)? };
    let view = View::new(plane, &clouds);
    let behind = view.picture(&initial, None)?;
    let mut bodies = Vec::new();
    for (field, title, unit) in FIELDS.into_iter().filter(|(field, _, _)| snapshots.has(field)) {
        let values = |&snapshot: &usize| values_of(snapshots, field, plane, snapshot);
        let values = chosen.iter().map(values).collect::<Result<Vec<_>, _>>()?;
        let known = values.iter().flatten().filter(|value| value.is_finite());
        let range = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
        // A field that is the same everywhere and always says nothing.
        if range.0 >= range.1 || range.1 - range.0 <= 1e-12 * range.0.abs().max(range.1.abs()) {
            continue;
        }
        let pictures = clouds
            .iter()
            .zip(&values)
            .map(|(cloud, values)| view.picture(cloud, Some((values, range))));
        let pictures = pictures.collect::<Result<Vec<_>, _>>()?;
        let colouring = Colouring {
            unit: unit.into(),
            range,
        };
        let svg = view.figure(title, &colouring, &behind, pictures.last().map_or(&[], Vec::as_slice))?;
        bodies.push(Body {
            field,
            figure: Figure {
                name: format!("body_{field}"),
                title: title.into(),
                svg,
            },
            frames: pictures.iter().map(|picture| data_address(picture)).collect(),
            range,
        });
    }
    Ok(Bodies {
        times: chosen.iter().map(|&snapshot| snapshots.times[snapshot]).collect(),
        bodies,
    })
}

/// One number per point: in plane strain the angle about z, in space the size of the rotation vector.
fn values_of(snapshots: &Snapshots, field: &str, plane: bool, snapshot: usize) -> Result<Vec<f64>, ReportError> {
    if field != "rotation" {
        return snapshots.scalar(field, snapshot);
    }
    let vectors = snapshots.vector(field, snapshot)?;
    let size = |v: &[f64; 3]| if plane { v[2] } else { v[0].hypot(v[1]).hypot(v[2]) };
    Ok(vectors.iter().map(size).collect())
}
