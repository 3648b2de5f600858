//! Material points from a CSV file.

use super::Check;
use crate::config::decode::number;
use crate::config::file::PointsKeys;
use crate::config::path::Path;
use crate::config::table::{LineProblem, Table};
use crate::config::tree::shorten;
use crate::points::seed::SeedPoint;
use crate::problem::{Problem, figure};
use crate::scene::GridSettings;
use csv::StringRecord;
use std::collections::HashMap;

/// A file with more wrong lines than this is wrong as a whole.
const MAXIMUM_PROBLEMS: usize = 10;

/// Points closer than this part of the smallest half-length are one point that was written twice.
const SAME_PLACE: f64 = 1e-3;

/// A volume that differs by less than this part from that of the domain differs by the digits of a file.
const SAME_VOLUME: f64 = 0.01;

/// A volume that differs by this factor an axis from that of the domain cannot be meant: full lengths stand in place of
/// halves, or the other way round.
const OTHER_LENGTH: f64 = 2.0;

/// Columns in the order of files without names, in the plane and in space.
const PLANE: [&str; 5] = ["x", "y", "volume", "lx", "ly"];
const SPACE: [&str; 7] = ["x", "y", "z", "volume", "lx", "ly", "lz"];

/// The points of a file, each with its line.
type NumberedPoints = Vec<(usize, SeedPoint)>;

impl Check<'_> {
    /// The points of a file; what is wrong with it is reported by its own name and line.
    pub(super) fn point_file(&mut self, path: &Path, keys: &PointsKeys) -> Option<Vec<SeedPoint>> {
        let name = self.files.resolve(&keys.file);
        let text = match self.files.text(&name) {
            Ok(text) => text,
            Err(reason) => {
                self.report(path, format!("{name}: {reason}"), "a readable CSV file of points");
                return None;
            }
        };
        let dimension = self.kinematics.dimension();
        let read = read_points(text, dimension, self.grid.as_ref());
        if !self.sound(path) {
            return None;
        }
        match read {
            Ok(points) => {
                let warning = doubtful_volumes(&points, dimension);
                self.findings
                    .warnings
                    .extend(warning.map(|warning| format!("{name}: {warning}")));
                Some(points.into_iter().map(|(_, point)| point).collect())
            }
            Err(problems) => {
                self.findings
                    .problems
                    .extend(problems.into_iter().map(|problem| Problem {
                        file: name.clone(),
                        place: Some((problem.line, 1)),
                        path: path.to_string(),
                        message: problem.message,
                        expected: problem.expected,
                    }));
                None
            }
        }
    }
}

/// Columns of a file of points.
fn quantities(dimension: usize) -> &'static [&'static str] {
    if dimension == 2 { &PLANE } else { &SPACE }
}

/// Index of the quantity that a column holds by its name, other usual names included.
fn find(dimension: usize, name: &str) -> Result<Option<usize>, String> {
    let other_names = [
        ("vol", "volume"),
        ("position_x", "x"),
        ("position_y", "y"),
        ("position_z", "z"),
        ("half_length_x", "lx"),
        ("half_length_y", "ly"),
        ("half_length_z", "lz"),
    ];
    let usual = other_names.iter().find(|(other, _)| *other == name);
    let name = usual.map_or(name, |(_, usual)| usual);
    let place = quantities(dimension).iter().position(|quantity| *quantity == name);
    if place.is_none() && SPACE.contains(&name) {
        return Err("plane strain has no third axis".to_owned());
    }
    Ok(place)
}

/// Reads all points.
///
/// # Errors
/// Everything that is wrong, by line.
fn read_points(text: &str, dimension: usize, grid: Option<&GridSettings>) -> Result<NumberedPoints, Vec<LineProblem>> {
    let table = Table::open(text).map_err(|problem| vec![problem])?;
    let quantities = quantities(dimension);
    let columns = table.columns(quantities, &quantities.join(", "), |name| find(dimension, name))?;
    let lacking: Vec<_> = quantities
        .iter()
        .zip(&columns)
        .filter_map(|(quantity, column)| column.is_none().then_some(*quantity))
        .collect();
    if !lacking.is_empty() {
        let message = match lacking.as_slice() {
            [only] => format!("the column {only} is missing"),
            several => format!("the columns {} are missing", several.join(", ")),
        };
        return Err(vec![LineProblem::new(
            table.line_of_names(),
            message,
            quantities.join(", "),
        )]);
    }
    let width = table.names().map_or(quantities.len(), <[String]>::len);
    let order: Vec<usize> = if columns.is_empty() {
        (0..width).collect()
    } else {
        columns.into_iter().flatten().collect()
    };
    let (mut points, mut problems, mut uneven) = (Vec::new(), Vec::new(), Vec::new());
    for (line, fields) in table.rows() {
        if fields.len() != width {
            uneven.push((line, fields.len()));
            continue;
        }
        match read_point(&fields, &order, dimension, grid) {
            Ok(point) => points.push((line, point)),
            Err(message) => problems.push(LineProblem::new(line, message, quantities.join(", "))),
        }
        if problems.len() == MAXIMUM_PROBLEMS {
            break;
        }
    }
    problems.extend(uneven_rows(&uneven, width, quantities));
    if points.is_empty() && problems.is_empty() {
        problems.push(LineProblem::new(1, "the file holds no points", quantities.join(", ")));
    }
    if problems.is_empty() {
        problems.extend(duplicates(&points, dimension));
        problems.extend(impossible_volumes(&points, dimension));
    }
    problems.sort_by_key(|problem| problem.line);
    if problems.is_empty() { Ok(points) } else { Err(problems) }
}

fn read_point(
    fields: &StringRecord,
    order: &[usize],
    dimension: usize,
    grid: Option<&GridSettings>,
) -> Result<SeedPoint, String> {
    let quantities = quantities(dimension);
    let mut values = Vec::with_capacity(order.len());
    for (column, quantity) in order.iter().zip(quantities) {
        let field = &fields[*column];
        let message = || format!("\"{}\" is not a number, as {quantity}", shorten(field));
        values.push(number(field).ok_or_else(message)?);
    }
    if values[dimension] <= 0.0 {
        return Err(format!("the volume {} is not > 0", figure(values[dimension])));
    }
    if let Some(length) = values[dimension + 1..].iter().find(|length| **length <= 0.0) {
        return Err(format!("the half-length {} is not > 0", figure(*length)));
    }
    // The thickness of plane strain is 1 m.
    let mut point = SeedPoint {
        position: [0.0; 3],
        volume: values[dimension],
        half_lengths: [0.5; 3],
    };
    point.position[..dimension].copy_from_slice(&values[..dimension]);
    point.half_lengths[..dimension].copy_from_slice(&values[dimension + 1..]);
    for axis in 0..dimension {
        let bounds = grid.map(|grid| {
            (
                grid.min[axis],
                grid.min[axis] + grid.cells[axis] as f64 * grid.cell_size[axis],
            )
        });
        let at = point.position[axis];
        if let Some((min, max)) = bounds.filter(|(min, max)| at < *min || at > *max) {
            return Err(format!(
                "the point lies outside the grid: {} is not between {} and {}",
                figure(at),
                figure(min),
                figure(max)
            ));
        }
    }
    Ok(point)
}

/// ` (and 3 more lines)`, or nothing.
fn and_more(lines: usize) -> String {
    match lines {
        0 => String::new(),
        1 => " (and 1 more line)".to_owned(),
        lines => format!(" (and {lines} more lines)"),
    }
}

/// Lines, with their numbers of columns, that have another number than they should.
fn uneven_rows(rows: &[(usize, usize)], width: usize, quantities: &[&str]) -> Option<LineProblem> {
    let (line, count) = *rows.first()?;
    let decimal_commas = if count == 2 * width {
        ": are these decimal commas?"
    } else {
        ""
    };
    let more = and_more(rows.len() - 1);
    let message = format!("{count} columns instead of {width}{more}{decimal_commas}");
    Some(LineProblem::new(line, message, quantities.join(", ")))
}

/// Points in the place of an earlier one.
fn duplicates(points: &NumberedPoints, dimension: usize) -> Option<LineProblem> {
    let lengths = points.iter().flat_map(|(_, point)| &point.half_lengths[..dimension]);
    let distance = SAME_PLACE * lengths.copied().fold(f64::INFINITY, f64::min);
    let mut found: Vec<(usize, usize)> = Vec::new();
    // Two points that are near each other share a box of one of the lattices that are shifted by half a box.
    for shift in 0..1_u32 << dimension {
        let mut boxes = HashMap::with_capacity(points.len());
        for (line, point) in points {
            let index: [u64; 3] = std::array::from_fn(|axis| {
                let half = 0.5 * f64::from(shift >> axis & 1);
                // Zero has two signs.
                ((point.position[axis] / distance + half).floor() + 0.0).to_bits()
            });
            if let Some(first) = boxes.get(&index) {
                found.push((*line, *first));
            } else {
                boxes.insert(index, *line);
            }
        }
    }
    found.sort_unstable();
    found.dedup_by_key(|(line, _)| *line);
    let (line, first) = found.first()?;
    let more = and_more(found.len() - 1);
    let message = format!("the point lies where that of line {first} does{more}");
    Some(LineProblem::new(*line, message, "each point once"))
}

/// Volume over that of the domain.
fn share_of_domain(point: &SeedPoint, dimension: usize) -> f64 {
    let domain: f64 = point.half_lengths[..dimension].iter().map(|half| 2.0 * half).product();
    point.volume / domain
}

/// Volumes that cannot be those of the domains.
fn impossible_volumes(points: &NumberedPoints, dimension: usize) -> Option<LineProblem> {
    // Less than that factor by the digits of a file, too.
    let factor = (1.0 - SAME_VOLUME) * OTHER_LENGTH.powi(dimension as i32);
    let mut wrong = points
        .iter()
        .map(|(line, point)| (*line, share_of_domain(point, dimension)))
        .filter(|(_, share)| *share <= 1.0 / factor || *share >= factor);
    let (line, share) = wrong.next()?;
    let more = and_more(wrong.count());
    let message = format!("the volume is {} times that of the domain{more}", short(share));
    let expected = if dimension == 2 {
        "half-lengths of the domain, volume = 4 lx ly (a thickness of 1 m)"
    } else {
        "half-lengths of the domain, volume = 8 lx ly lz"
    };
    Some(LineProblem::new(line, message, expected))
}

/// Three digits of a number.
fn short(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

/// Volumes that differ from those of the domains as far as can be meant.
fn doubtful_volumes(points: &NumberedPoints, dimension: usize) -> Option<String> {
    let mut doubtful = points
        .iter()
        .map(|(line, point)| (*line, share_of_domain(point, dimension)))
        .filter(|(_, share)| (share - 1.0).abs() > SAME_VOLUME);
    let (line, share) = doubtful.next()?;
    let more = and_more(doubtful.count());
    Some(format!(
        "line {line}: the volume is {} times that of the domain{more}; weights follow the volume, shape functions of gimp and \
         surfaces the half-lengths",
        short(share)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &str, dimension: usize) -> Vec<SeedPoint> {
        let read = read_points(text, dimension, None).unwrap();
        read.into_iter().map(|(_, point)| point).collect()
    }

    fn problems(text: &str, dimension: usize) -> Vec<(usize, String)> {
        let problems = read_points(text, dimension, None).unwrap_err();
        problems
            .into_iter()
            .map(|problem| (problem.line, problem.message))
            .collect()
    }

    #[test]
    fn points_are_read_after_names_and_comments() {
        let points = points("# one cell\nx, y, volume, lx, ly\n\n1, 2, 0.25, 0.25, 0.25\n", 2);
        assert_eq!(points.len(), 1);
        assert_eq!(points[0].position, [1.0, 2.0, 0.0]);
        assert_eq!(points[0].half_lengths, [0.25, 0.25, 0.5]);
    }

    #[test]
    fn columns_are_found_by_their_names() {
        for text in [
            "1, 2, 0.5, 0.25, 0.5",
            "ly,lx,volume,y,x\n0.5,0.25,0.5,2,1",
            "Half-length X [m];half length y (m);VOL;Position_X;y\n0.25;0.5;0.5;1;2",
            "\u{feff}X\tY\tVolume\tLx\tLy\n1\t2\t0.5\t0.25\t0.5\n",
        ] {
            let points = points(text, 2);
            assert_eq!((points[0].position, points[0].volume), ([1.0, 2.0, 0.0], 0.5), "{text}");
            assert_eq!(points[0].half_lengths, [0.25, 0.5, 0.5], "{text}");
        }
        let points = points("lz,x,y,z,lx,ly,volume\n3,4,5,6,1,2,48", 3);
        assert_eq!(
            (points[0].position, points[0].half_lengths),
            ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])
        );
    }

    #[test]
    fn names_that_do_not_fit_are_told_once() {
        for (text, dimension, message) in [
            (
                "x,y,volum,lx,ly\n1,2,1,1,1",
                2,
                "unknown column \"volum\", did you mean \"volume\"?",
            ),
            ("x,y,volume,lx\n1,2,1,1", 2, "the column ly is missing"),
            ("x,y,lx,ly\n1,2,1,1", 3, "the columns z, volume, lz are missing"),
            (
                "x,y,z,volume,lx,ly\n1,2,0,1,1,1",
                2,
                "column \"z\": plane strain has no third axis",
            ),
            ("x,y,x,lx,ly\n1,2,0,1,1", 2, "the column \"x\" appears twice"),
        ] {
            assert_eq!(problems(text, dimension), [(1, message.to_owned())], "{text}");
        }
    }

    #[test]
    fn wrong_lines_are_all_reported() {
        let found = problems("1,2,1,1\n1,2,0,1,1\n1,a,1,1,1\n1,2,1,-1,1\n", 2);
        let lines: Vec<_> = found.iter().map(|problem| problem.0).collect();
        assert_eq!(lines, [1, 2, 3, 4], "{found:?}");
        assert!(problems("x,y,volume,lx,ly\n", 2)[0].1.contains("no points"));
        assert_eq!(problems(&"1,2,0,1,1\n".repeat(1000), 2).len(), MAXIMUM_PROBLEMS);
    }

    #[test]
    fn what_is_wrong_in_all_lines_is_one_message() {
        let found = problems(&"0,5,0,5,1,0,0,5,0,5\n".repeat(20), 2);
        let message = "10 columns instead of 5 (and 19 more lines): are these decimal commas?";
        assert_eq!(found, [(1, message.to_owned())]);
        let found = problems(&"0,5;0,5;1,0;0,5;0,5\n".repeat(20), 2);
        assert_eq!(found.len(), 1);
    }

    #[test]
    fn the_same_point_twice_is_an_error() {
        let found = problems("1,2,4,1,1\n3,2,4,1,1\n# \n1.0001,1.9999,4,1,1\n3,2.0,4,1,1\n", 2);
        assert_eq!(
            found,
            [(
                4,
                "the point lies where that of line 1 does (and 1 more line)".to_owned()
            )]
        );
        // A lattice has no neighbours that near, whatever side of zero.
        let lattice =
            (-20..20).flat_map(|i| (-20..20).map(move |j| format!("{}e-3,{}e-3,4e-6,1e-3,1e-3\n", 2 * i, 2 * j)));
        assert_eq!(points(&lattice.collect::<String>(), 2).len(), 1600);
    }

    #[test]
    fn volumes_are_those_of_the_domains() {
        let message = |factor: &str| format!("the volume is {factor} times that of the domain (and 1 more line)");
        let found = problems("1,1,1,1,1\n3,1,4,1,1\n5,1,1,1,1\n", 2);
        assert_eq!(found, [(1, message("0.25"))]);
        let found = problems("1,1,1,64,1,1,1\n9,1,1,64,1,1,1\n", 3);
        assert_eq!(found, [(1, message("8"))]);
        let warning = |text: &str| doubtful_volumes(&read_points(text, 2, None).unwrap(), 2);
        assert_eq!(warning("1,1,4.0001,1,1\n"), None);
        assert!(
            warning("1,1,4,1,1\n3,1,2,1,1\n")
                .unwrap()
                .contains("line 2: the volume is 0.5 times")
        );
    }
}
