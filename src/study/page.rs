//! `study.html`: charts, rates and table of a study on one page that needs nothing else.

use super::charts::Figure;
use super::plan::Study;
use super::rates::{self, Rate};
use super::table::{self, Row};
use crate::error::Error;
use crate::output::folder::write_atomically;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1100px;margin:2em auto;padding:0 1em}\
    figure{margin:2em 0}figcaption{color:#555}svg{max-width:100%;height:auto}.wide{overflow-x:auto}\
    table{border-collapse:collapse;font-size:13px}th,td{padding:.25em .7em;border-bottom:1px solid #ddd;text-align:right;\
    white-space:nowrap}th:first-child,td:first-child{text-align:left}tr.incomplete{color:#a30}";

/// Writes the page.
///
/// # Errors
/// A chart cannot be drawn or the file not be written.
pub fn write(study: &Study, rows: &[Row<'_>], rates: &[Rate], figures: &[Figure]) -> Result<(), Error> {
    let mut shown = Vec::new();
    for figure in figures {
        let svg = figure.chart.svg().map_err(|error| Error::System(error.to_string()))?;
        shown.push((svg, figure));
    }
    let completed = rows.iter().filter(|row| row.outcome.completed()).count();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                title { (study.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (study.title) }
                p { (completed) " of " (rows.len()) " runs completed. Numbers: study.csv." }
                @for (svg, figure) in &shown {
                    figure id=(figure.stem) {
                        (PreEscaped(svg))
                        figcaption { (figure.caption) }
                    }
                }
                @if !rates.is_empty() {
                    h2 { "Rates" }
                    ul { @for line in rates::text(rates).lines() { li { (line) } } }
                }
                h2 { "Runs" }
                (runs(study, rows))
            }
        }
    };
    write_atomically(&study.folder.join("study.html"), page.into_string().as_bytes())
}

fn runs(study: &Study, rows: &[Row<'_>]) -> Markup {
    html! {
        div.wide { table {
            tr { @for name in table::head(study) { th { (name) } } }
            @for row in rows {
                tr.incomplete[!row.outcome.completed()] {
                    @for cell in table::cells(study, row) { td { (rounded(&cell)) } }
                }
            }
        } }
    }
}

/// A number with four digits; anything else, and whole numbers, as they are.
fn rounded(cell: &str) -> String {
    match cell.parse::<f64>() {
        Ok(value) if cell.contains(['.', 'e']) && value.is_finite() => {
            let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 17) as usize;
            if (1e-3..1e6).contains(&value.abs()) {
                format!("{value:.digits$}")
            } else {
                format!("{value:.3e}")
            }
        }
        _ => cell.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn numbers_are_shown_with_four_digits() {
        let cells = ["0.0123456", "123.456789", "1.23456e-9", "17742", "[5, 9]", "", "-2.5"];
        assert_eq!(
            cells.map(rounded),
            ["0.01235", "123.5", "1.235e-9", "17742", "[5, 9]", "", "-2.500"]
        );
    }
}
