//! Material points from a CSV file.

use super::Check;
use crate::config::decode::number;
use crate::config::file::PointsKeys;
use crate::config::path::Path;
use crate::points::seed::SeedPoint;
use crate::problem::Problem;
use crate::scene::GridSettings;

/// A file with more wrong lines than this is wrong as a whole.
const MAXIMUM_PROBLEMS: usize = 10;

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
        let (points, problems) = read_points(text, self.kinematics.dimension(), self.grid.as_ref());
        if !self.sound(path) {
            return None;
        }
        let right = problems.is_empty();
        for (line, message, expected) in problems {
            let (file, place, path) = (name.clone(), Some((line, 1)), path.to_string());
            self.findings.problems.push(Problem {
                file,
                place,
                path,
                message,
                expected,
            });
        }
        right.then_some(points)
    }
}

type LineProblem = (usize, String, String);

/// Reads all points, and what is wrong by line.
fn read_points(text: &str, dimension: usize, grid: Option<&GridSettings>) -> (Vec<SeedPoint>, Vec<LineProblem>) {
    let columns = if dimension == 2 {
        "x, y, volume, lx, ly"
    } else {
        "x, y, z, volume, lx, ly, lz"
    };
    let mut points = Vec::new();
    let mut problems = Vec::new();
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    for (position, (number, line)) in lines.enumerate() {
        // Names of columns, if any, come first.
        if position == 0 && line.split(',').all(|field| self::number(field.trim()).is_none()) {
            continue;
        }
        match read_point(line, dimension, grid) {
            Ok(point) => points.push(point),
            Err(message) => problems.push((number, message, columns.to_owned())),
        }
        if problems.len() == MAXIMUM_PROBLEMS {
            return (points, problems);
        }
    }
    if points.is_empty() && problems.is_empty() {
        problems.push((1, "the file holds no points".to_owned(), columns.to_owned()));
    }
    (points, problems)
}

fn read_point(line: &str, dimension: usize, grid: Option<&GridSettings>) -> Result<SeedPoint, String> {
    let fields: Vec<_> = line.split(',').map(str::trim).collect();
    if fields.len() != 2 * dimension + 1 {
        return Err(format!("{} columns instead of {}", fields.len(), 2 * dimension + 1));
    }
    let mut values = Vec::with_capacity(fields.len());
    for field in fields {
        values
            .push(number(field).ok_or_else(|| format!("\"{}\" is not a number", crate::config::tree::shorten(field)))?);
    }
    if values[dimension] <= 0.0 {
        return Err(format!("the volume {} is not > 0", values[dimension]));
    }
    if let Some(length) = values[dimension + 1..].iter().find(|length| **length <= 0.0) {
        return Err(format!("the half-length {length} is not > 0"));
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
                "the point lies outside the grid: {at} is not between {min} and {max}"
            ));
        }
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read_after_names_and_comments() {
        let (points, problems) = read_points("# one cell\nx, y, volume, lx, ly\n\n1, 2, 0.25, 0.25, 0.25\n", 2, None);
        assert_eq!(problems, []);
        assert_eq!(points.len(), 1);
        assert_eq!(points[0].position, [1.0, 2.0, 0.0]);
        assert_eq!(points[0].half_lengths, [0.25, 0.25, 0.5]);
    }

    #[test]
    fn wrong_lines_are_all_reported() {
        let (_, problems) = read_points("1,2,1,1\n1,2,0,1,1\n1,a,1,1,1\n1,2,1,-1,1\n", 2, None);
        let lines: Vec<_> = problems.iter().map(|problem| problem.0).collect();
        assert_eq!(lines, [1, 2, 3, 4], "{problems:?}");
        assert!(read_points("x,y\n", 2, None).1[0].1.contains("no points"));
        assert_eq!(read_points(&"1,2\n".repeat(1000), 2, None).1.len(), MAXIMUM_PROBLEMS);
    }
}
