//! Tables of numbers in files of text that other programs write: a line of names, then a line of numbers per row.
//!
//! Columns are separated by commas, semicolons or tabs, whichever the first lines have. Lines that begin with `#`, empty lines
//! and a byte-order mark are passed over, and so are columns without name and content at the end of all lines.

use super::decode::number;
use super::nearest::{did_you_mean, nearest};
use super::tree::shorten;
use csv::StringRecord;

/// What is wrong with a line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LineProblem {
    /// Counted from 1.
    pub line: usize,
    pub message: String,
    /// What is accepted.
    pub expected: String,
}

impl LineProblem {
    pub fn new(line: usize, message: impl Into<String>, expected: impl Into<String>) -> LineProblem {
        LineProblem {
            line,
            message: message.into(),
            expected: expected.into(),
        }
    }
}

/// What separates the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Comma,
    Semicolon,
    Tab,
}

impl Separator {
    /// That of a line; `None` where it has one column, or blanks between several.
    fn of(line: &str) -> Option<Separator> {
        // Blanks may follow a comma, and a tab is one; between the digits of one number there is none.
        let words = |separator| line.split(separator).all(|field| !field.trim().contains('\t'));
        match (line.contains(';'), line.contains('\t'), line.contains(',')) {
            (true, _, _) => Some(Separator::Semicolon),
            (_, true, true) if words(',') => Some(Separator::Comma),
            (_, true, _) => Some(Separator::Tab),
            (_, _, true) => Some(Separator::Comma),
            _ => None,
        }
    }

    fn letter(self) -> char {
        match self {
            Separator::Comma => ',',
            Separator::Semicolon => ';',
            Separator::Tab => '\t',
        }
    }

    fn name(self) -> &'static str {
        match self {
            Separator::Comma => "commas",
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
        }
    }
}

/// A file whose columns are known to be separated in one way.
#[derive(Clone, Debug)]
pub struct Table<'t> {
    text: &'t str,
    separator: Separator,
    /// Names in the first line, with its number; `None` where numbers stand there.
    names: Option<(usize, Vec<String>)>,
}

impl<'t> Table<'t> {
    /// Looks at the first lines of a text.
    ///
    /// # Errors
    /// Columns that are not separated by one of the known letters, or not in all lines by the same, and decimal commas.
    pub fn open(text: &'t str) -> Result<Table<'t>, LineProblem> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
        let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let first = lines.next();
        let separator = first.and_then(|(_, line)| Separator::of(line));
        let holds_number = |line: &str| match separator {
            Some(separator) => line.split(separator.letter()).any(is_numeric),
            None => line.split_whitespace().any(is_numeric),
        };
        let named = first.filter(|(_, line)| !holds_number(line));
        let row = if named.is_some() { lines.next() } else { first };
        if let Some((line, row)) = row {
            refuse_separators(line, row, first.and_then(|(_, line)| Separator::of(line)))?;
        }
        let separator = separator.unwrap_or(Separator::Comma);
        let names = named
            .and_then(|_| records(text, separator).next())
            .map(|(line, record)| {
                let names = record.iter().map(str::to_owned);
                (line, without_empty_end(names.collect()))
            });
        Ok(Table { text, separator, names })
    }

    /// Names of the columns, if the first line holds names.
    pub fn names(&self) -> Option<&[String]> {
        self.names.as_ref().map(|(_, names)| names.as_slice())
    }

    /// Number of the line of names, or of the first.
    pub fn line_of_names(&self) -> usize {
        self.names.as_ref().map_or(1, |(line, _)| *line)
    }

    /// Rows with the numbers of their lines.
    pub fn rows(&self) -> impl Iterator<Item = (usize, StringRecord)> {
        let width = self.names().map(<[String]>::len);
        let named = usize::from(width.is_some());
        records(self.text, self.separator)
            .skip(named)
            .map(move |(line, mut fields)| {
                if let Some(width) = width
                    && fields.iter().skip(width).all(str::is_empty)
                {
                    fields.truncate(width);
                }
                (line, fields)
            })
    }

    /// For each of some quantities the column that holds it; `find` gives the index of a quantity by the name of a column in
    /// lower case without unit, or says why the file cannot have such a column. `accepted` names them for messages. Empty
    /// where there are no names.
    ///
    /// # Errors
    /// Names that stand for nothing or for the same twice.
    pub fn columns(
        &self,
        quantities: &[&str],
        accepted: &str,
        find: impl Fn(&str) -> Result<Option<usize>, String>,
    ) -> Result<Vec<Option<usize>>, Vec<LineProblem>> {
        let Some((line, names)) = &self.names else {
            return Ok(Vec::new());
        };
        let mut columns = vec![None; quantities.len()];
        let mut problems = Vec::new();
        let mut refuse = |message: String, expected: String| problems.push(LineProblem::new(*line, message, expected));
        for (column, typed) in names.iter().enumerate() {
            let plain = plain_name(typed);
            match find(&plain) {
                Ok(Some(quantity)) if columns[quantity].is_none() => columns[quantity] = Some(column),
                Ok(Some(quantity)) => refuse(
                    format!("the column \"{}\" appears twice", quantities[quantity]),
                    "each column once".to_owned(),
                ),
                Ok(None) => {
                    let hint = did_you_mean(nearest(&plain, quantities.iter().copied()));
                    let message = format!("unknown column \"{}\"{hint}", shorten(typed));
                    refuse(message, accepted.to_owned());
                }
                Err(reason) => refuse(format!("column \"{}\": {reason}", shorten(typed)), accepted.to_owned()),
            }
        }
        if problems.is_empty() {
            Ok(columns)
        } else {
            Err(problems)
        }
    }
}

/// Lines that count, cut into fields.
fn records(text: &str, separator: Separator) -> impl Iterator<Item = (usize, StringRecord)> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator.letter() as u8)
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    std::iter::from_fn(move || {
        loop {
            let mut record = StringRecord::new();
            // Text in memory that is UTF-8, with rows of any length, has nothing that could fail.
            if !reader.read_record(&mut record).unwrap_or(false) {
                return None;
            }
            // The reader stands behind the line; where the record began it does not know of lines passed over.
            let end = reader.position();
            let ended = text.as_bytes()[..end.byte() as usize].ends_with(b"\n");
            let line = end.line() as usize - usize::from(ended);
            let first = record.get(0).unwrap_or_default();
            let empty = record.len() == 1 && first.is_empty();
            if !empty && !first.starts_with('#') {
                return Some((line, record));
            }
        }
    })
}

/// Refuses a first row of numbers whose columns cannot be told apart, or are separated otherwise than the names.
fn refuse_separators(line: usize, row: &str, of_names: Option<Separator>) -> Result<(), LineProblem> {
    let separator = Separator::of(row);
    let accepted = "numbers with decimal points; commas, semicolons or tabs between columns, the same in all lines";
    let refuse = |message: &str| Err(LineProblem::new(line, message, accepted));
    let decimal = |field: &str| field.contains(',') && is_numeric(field);
    match separator {
        Some(Separator::Semicolon | Separator::Tab)
            if separator.is_some_and(|s| row.split(s.letter()).any(decimal)) =>
        {
            refuse("the numbers have decimal commas")
        }
        None if row.split_whitespace().nth(1).is_some() => refuse("the columns are separated by blanks"),
        _ if separator == of_names => Ok(()),
        _ => {
            let name = |separator: Option<Separator>| separator.map_or("nothing", Separator::name);
            let message = format!(
                "this line is separated by {}, the names by {}",
                name(separator),
                name(of_names)
            );
            refuse(&message)
        }
    }
}

/// Whether a field holds a number, with a decimal point or comma.
fn is_numeric(field: &str) -> bool {
    number(&field.trim().replace(',', ".")).is_some()
}

/// Names up to the last that is not empty.
fn without_empty_end(mut names: Vec<String>) -> Vec<String> {
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    names
}

/// A name in lower case, without a unit in brackets, with `_` between its words.
pub fn plain_name(name: &str) -> String {
    let without_unit = name.split(['[', '(']).next().unwrap_or_default();
    without_unit.trim().to_lowercase().replace([' ', '-'], "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<(usize, StringRecord)> {
        Table::open(text).unwrap().rows().collect()
    }

    #[test]
    fn separators_line_ends_and_marks_do_not_matter() {
        for text in [
            "a,b\n1,2\n3,4\n",
            "a;b\n1;2\n3;4\n",
            "a\tb\n1\t2\n3\t4",
            "\u{feff}a, b\r\n1, 2\r\n3, 4\r\n",
            "a,\tb\n1,\t2\n3,\t4\n",
            "a,b,\n1,2,\n3,4,\n",
            "\"a\",\"b\"\n\"1\",\"2\"\n\"3\",\"4\"\n",
        ] {
            let table = Table::open(text).unwrap();
            assert_eq!(
                table.names(),
                Some(["a".to_owned(), "b".to_owned()].as_slice()),
                "{text}"
            );
            let fields: Vec<_> = table.rows().map(|(_, fields)| fields).collect();
            assert_eq!(fields, [vec!["1", "2"], vec!["3", "4"]], "{text}");
        }
        assert_eq!(Table::open("1,2\n").unwrap().names(), None);
        assert!(rows("").is_empty() && rows("# nothing\n\n").is_empty());
    }

    #[test]
    fn lines_are_counted_with_all_that_is_passed_over() {
        for end in ["\n", "\r\n"] {
            let text = ["# first", "", "a,b", "  # inner", "1,2", "", "   ", "#", "3,4"].join(end);
            for text in [text.clone(), text + end] {
                let lines: Vec<_> = rows(&text).iter().map(|row| row.0).collect();
                assert_eq!(lines, [5, 9], "{text:?}");
            }
        }
    }

    #[test]
    fn columns_that_cannot_be_told_apart_are_refused_once() {
        for (text, line, message) in [
            ("a;b\n0,5;1,5\n", 2, "decimal commas"),
            ("a, b\n0,5;1,5\n", 2, "decimal commas"),
            ("a\tb\n0,5\t1\n", 2, "decimal commas"),
            ("0,5;1,5\n", 1, "decimal commas"),
            ("a b\n1 2\n", 2, "separated by blanks"),
            ("1 2\n", 1, "separated by blanks"),
            ("a,b\n1;2\n", 2, "separated by semicolons, the names by commas"),
        ] {
            let problem = Table::open(text).unwrap_err();
            assert_eq!(problem.line, line, "{text}: {problem:?}");
            assert!(problem.message.contains(message), "{text}: {problem:?}");
        }
    }

    #[test]
    fn names_are_found_in_any_order_and_wrong_ones_are_named() {
        let known = ["x", "length"];
        let find = |name: &str| match name {
            "z" => Err("there is no z".to_owned()),
            name => Ok(known.iter().position(|other| *other == name)),
        };
        let columns = |text: &str| Table::open(text).unwrap().columns(&known, "x, length", find);
        assert_eq!(columns("Length [m], X\n"), Ok(vec![Some(1), Some(0)]));
        assert_eq!(columns("x\n"), Ok(vec![Some(0), None]));
        assert_eq!(columns("1,2\n"), Ok(Vec::new()));
        for (text, message) in [
            ("x, lenght\n", "unknown column \"lenght\", did you mean \"length\"?"),
            ("x, x\n", "the column \"x\" appears twice"),
            ("x, z\n", "column \"z\": there is no z"),
        ] {
            let problems = columns(text).unwrap_err();
            assert_eq!(problems.len(), 1, "{problems:?}");
            assert_eq!(problems[0].message, message);
        }
    }
}
