//! The page: one HTML document that needs nothing but itself.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value as Json, json};

use super::bodies::{Bodies, Body};
use super::curves::{Abscissa, Figure};
use super::results::Results;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// All that the page shows.
#[derive(Debug)]
pub struct Page<'a> {
    pub results: &'a Results,
    pub abscissae: &'a [Abscissa],
    /// For each group of columns the charts over each abscissa.
    pub histories: &'a [Vec<Figure>],
    pub bodies: &'a Bodies,
    pub numerics: &'a [Figure],
    pub costs: &'a [Figure],
    pub warnings: &'a [String],
}

impl Page<'_> {
    /// The document.
    pub fn html(&self) -> String {
        let title = self.title();
        let sections: [(&str, &str, Markup); 5] = [
            ("scene", "Scene", self.facts()),
            ("history", "History", self.history()),
            ("body", "Deformed body", self.body()),
            (
                "numerics",
                "Convergence and steps",
                figures(self.numerics, "No step was recorded."),
            ),
            (
                "costs",
                "Time and memory",
                figures(self.costs, "summary.json does not tell."),
            ),
        ];
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    link rel="icon" href="data:,";
                    title { (title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header {
                        p.program { "mpm-petsc" }
                        h1 { (title) }
                        (self.status())
                        nav aria-label="Sections" {
                            @for (name, heading, _) in &sections { a href={ "#" (name) } { (heading) } }
                        }
                    }
                    main {
                        (self.warning_list())
                        @for (name, heading, content) in &sections {
                            section id=(name) { h2 { (heading) } (content) }
                        }
                    }
                    script type="application/json" id="data" { (embedded(&self.data())) }
                    script type="application/json" id="frames" { (embedded(&self.frames())) }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
        .into_string()
    }

    fn title(&self) -> String {
        let summary = self
            .results
            .summary
            .as_ref()
            .and_then(|summary| summary["title"].as_str());
        let title = summary.or_else(|| self.results.setting(&["title"])).unwrap_or_default();
        if title.is_empty() {
            "Results of a run".into()
        } else {
            title.to_owned()
        }
    }

    fn status(&self) -> Markup {
        let (word, code) = match &self.results.summary {
            Some(summary) => (
                summary["status"].as_str().unwrap_or("unknown"),
                summary["exit_code"].as_i64(),
            ),
            None => ("unfinished", None),
        };
        html! {
            p.status {
                span class={ "badge " (word) } { (word) }
                @if let Some(code) = code { " exit code " (code) }
                @if let Some(seconds) = self.number("wall_seconds") { " · " (duration(seconds)) }
                @if let Some(steps) = self.number("steps") { " · " (steps) " steps" }
                @if let Some(ranks) = self.number("ranks") { " · " (ranks) (if ranks == 1.0 { " rank" } else { " ranks" }) }
            }
        }
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.results.summary.as_ref()?[name].as_f64()
    }

    fn warning_list(&self) -> Markup {
        html! {
            @if !self.warnings.is_empty() {
                section.warnings id="warnings" {
                    h2 { "Warnings" }
                    ul { @for warning in self.warnings { li { (warning) } } }
                }
            }
        }
    }

    fn facts(&self) -> Markup {
        let setting = |path: &[&str]| self.results.setting(path).map(|text| text.replace('_', " "));
        let count = |name: &str| self.number(name).map(grouped);
        let versions = self
            .results
            .summary
            .as_ref()
            .and_then(|summary| summary["versions"].as_object());
        let scene = [
            ("Kinematics", setting(&["model", "kinematics"])),
            ("Continuum", setting(&["model", "continuum"])),
            ("Method", setting(&["model", "method"])),
            ("Basis", setting(&["grid", "basis"])),
            ("Grid", self.results.extent()),
            ("Cell size", self.results.list(&["grid", "cell_size"])),
            ("Materials", self.results.materials()),
            ("Stages", self.results.stages()),
        ];
        let run = [
            ("Material points", count("points").or_else(|| self.points())),
            ("Unknowns", count("dofs")),
            ("Active cells", count("active_cells")),
            ("Matrix entries", count("nonzeros")),
            ("Accepted steps", count("steps")),
            ("Attempts", count("attempts")),
            ("Newton iterations", count("newton_iterations")),
            (
                "Steps at round-off",
                count("steps_at_round_off").filter(|count| count != "0"),
            ),
            ("Ranks", count("ranks")),
            ("CPU time", self.number("cpu_seconds").map(duration)),
        ];
        let versions: Vec<(&str, Option<String>)> = versions
            .into_iter()
            .flatten()
            .map(|(name, version)| (name.as_str(), version.as_str().map(str::to_owned)))
            .collect();
        html! {
            div.cards {
                (card("Model", &scene))
                (card("Run", &run))
                (card("Versions", &versions))
            }
        }
    }

    fn points(&self) -> Option<String> {
        Some(grouped(self.results.snapshots.as_ref()?.points as f64))
    }

    fn history(&self) -> Markup {
        html! {
            @if self.histories.is_empty() || self.results.history.len() == 0 {
                p { "The history has no rows or no columns of its own." }
            } @else {
                p.controls {
                    label for="over" { "Drawn over " }
                    select id="over" {
                        @for (number, abscissa) in self.abscissae.iter().enumerate() {
                            option value=(number) { (abscissa.name.replace('_', " ")) }
                        }
                    }
                }
                div.figures {
                    @for charts in self.histories {
                        @for (number, figure) in charts.iter().enumerate() {
                            div.choice data-over=(number) hidden[number > 0] { (drawing(figure)) }
                        }
                    }
                }
            }
        }
    }

    fn body(&self) -> Markup {
        let last = self.bodies.times.len().saturating_sub(1);
        html! {
            @if self.bodies.bodies.is_empty() {
                p { "There are no snapshots with a field that varies." }
            } @else {
                p.controls {
                    label for="frame" { "Snapshot " }
                    input id="frame" type="range" min="0" max=(last) step="1" value=(last) disabled[last == 0];
                    output id="time" for="frame" { "time " (self.bodies.times[last]) }
                }
                p.note {
                    "Time counts stages: 0.5 is the middle of the first. The body of the start is grey. "
                    "One scale of colours holds for all snapshots."
                }
                div.figures { @for body in &self.bodies.bodies { (self.deformed(body)) } }
            }
        }
    }

    fn deformed(&self, body: &Body) -> Markup {
        let figure = &body.figure;
        html! {
            figure.body data-field=(body.field) {
                div role="img" aria-label={ (figure.title) " on the deformed body" } { (PreEscaped(&figure.svg)) }
                (caption(figure))
            }
        }
    }

    /// Numbers for readers of the page.
    fn data(&self) -> Json {
        let history = &self.results.history;
        let columns: serde_json::Map<String, Json> = history
            .names
            .iter()
            .cloned()
            .zip(history.columns.iter().map(|values| json!(values)))
            .collect();
        let ranges: serde_json::Map<String, Json> = self
            .bodies
            .bodies
            .iter()
            .map(|body| (body.field.to_owned(), json!([body.range.0, body.range.1])))
            .collect();
        json!({
            "title": self.title(),
            "summary": self.results.summary,
            "history": { "stage": history.stages, "columns": columns },
            "snapshots": { "times": self.bodies.times, "ranges": ranges },
            "warnings": self.warnings,
        })
    }

    fn frames(&self) -> Json {
        let bodies = self.bodies.bodies.iter();
        let frames: serde_json::Map<String, Json> =
            bodies.map(|body| (body.field.to_owned(), json!(body.frames))).collect();
        json!({ "times": self.bodies.times, "fields": frames })
    }
}

fn card(heading: &str, rows: &[(&str, Option<String>)]) -> Markup {
    html! {
        @if rows.iter().any(|row| row.1.is_some()) {
            div.card {
                h3 { (heading) }
                dl {
                    @for (name, value) in rows {
                        @if let Some(value) = value { dt { (name) } dd { (value) } }
                    }
                }
            }
        }
    }
}

fn figures(figures: &[Figure], otherwise: &str) -> Markup {
    html! {
        @if figures.is_empty() { p { (otherwise) } }
        @else { div.figures { @for figure in figures { (drawing(figure)) } } }
    }
}

fn drawing(figure: &Figure) -> Markup {
    html! {
        figure {
            div role="img" aria-label={ "Chart: " (figure.title) } { (PreEscaped(&figure.svg)) }
            (caption(figure))
        }
    }
}

fn caption(figure: &Figure) -> Markup {
    html! {
        figcaption {
            a href={ "figures/" (figure.name) ".svg" } title={ (figure.title) " as SVG" } { "SVG" } " "
            a href={ "figures/" (figure.name) ".png" } title={ (figure.title) " as PNG" } { "PNG" }
        }
    }
}

/// JSON that cannot end the element it stands in.
fn embedded(value: &Json) -> PreEscaped<String> {
    PreEscaped(value.to_string().replace('<', "\\u003c"))
}

/// Seconds for people.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{:.0} min {:.0} s", (s / 60.0).floor(), s % 60.0),
        s => format!("{:.0} h {:.0} min", (s / 3600.0).floor(), (s % 3600.0) / 60.0),
    }
}

/// A whole number with its digits in groups of three.
fn grouped(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{202F}');
        }
        text.push(digit);
    }
    text
}
