//! The report: what is on the page as a browser shows it, and what happens with folders that hold less or nothing.

use super::scenes;
use crate::common::launch::{Launch, Run};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// The page after its script has run, as Chromium sees it, and what it wrote to the console.
fn opened(page: &Path) -> (String, String) {
    let profile = page.with_extension("profile");
    let output = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--v=0",
        ])
        // Whatever the page asks the network for fails, and says so.
        .args([
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--virtual-time-budget=5000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("chromium starts (package chromium, see scripts/setup.sh)");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (text(output.stdout), text(output.stderr))
}

/// Text between two others.
fn between<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    let rest = text
        .split_once(before)
        .unwrap_or_else(|| panic!("{before} is not on the page"))
        .1;
    rest.split_once(after)
        .unwrap_or_else(|| panic!("{after} does not follow"))
        .0
}

/// The numbers that the page holds for readers.
fn data(page: &str) -> Value {
    let text = between(page, "<script type=\"application/json\" id=\"data\">", "</script>");
    serde_json::from_str(text).expect("the data of the page")
}

fn report_of(folder: &Path) -> Run {
    Launch::arguments(&["report", &folder.to_string_lossy()]).run()
}

#[test]
fn a_browser_shows_the_numbers_of_the_files() {
    let scene = scenes::bar(&[(6, 0.6)], 3).replace("Bar pulled", "Bar </script> & <b>pulled</b>");
    let run = Launch::text(&scene).with_report().ranks(2).run().completed();
    let (page, console) = opened(&run.file("report.html"));
    assert!(!console.contains("CONSOLE"), "{console}");

    let (data, history) = (data(&page), run.history());
    for name in ["root", "chi", "tip_x", "tip_y"] {
        let values = data["history"]["columns"][name].as_array().expect(name);
        assert_eq!(values.len(), history.rows.len());
        assert_eq!(
            values.last().and_then(Value::as_f64),
            Some(history.last(name)),
            "{name}"
        );
    }
    assert_eq!(data["summary"]["ranks"], 2);
    assert!(
        data["title"]
            .as_str()
            .unwrap()
            .starts_with("Bar </script> & <b>pulled</b>")
    );
    assert!(
        between(&page, "<h1>", "</h1>").contains("&lt;b&gt;pulled"),
        "the title is escaped"
    );

    // The first, every second, and the last of six steps; the script has set the text beside the slider.
    let times: Vec<f64> = data["snapshots"]["times"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert_eq!(times.len(), 4, "{times:?}");
    let slider = between(&page, "<input id=\"frame\"", ">");
    assert!(slider.contains("max=\"3\""), "{slider}");
    assert!(between(&page, "<output id=\"time\"", "</output>").ends_with("time 1"));
    let frames: Value = serde_json::from_str(between(
        &page,
        "<script type=\"application/json\" id=\"frames\">",
        "</script>",
    ))
    .unwrap();
    let stress = frames["fields"]["von_mises"].as_array().unwrap();
    assert_eq!(stress.len(), times.len());
    assert_ne!(stress[0], stress[3], "the body is coloured anew");
    assert!(
        page.contains("root [MN/m]") || page.contains("root [kN/m]"),
        "curves have units"
    );
    for address in ["http://", "https://", "src=\"//"] {
        let asked = page.replace("http://www.w3.org/", "").contains(address);
        assert!(!asked, "the page names {address}");
    }
    for figure in [
        "history_root",
        "history_tip",
        "body_von_mises",
        "convergence",
        "step_size",
        "time",
        "memory",
    ] {
        let png = std::fs::read(run.file(&format!("figures/{figure}.png"))).expect(figure);
        assert!(
            png.starts_with(b"\x89PNG") && png.len() > 4000,
            "{figure}: {} bytes",
            png.len()
        );
        assert!(
            run.read(&format!("figures/{figure}.svg")).starts_with("<svg"),
            "{figure}"
        );
    }
}

#[test]
fn a_run_that_could_not_go_on_has_a_report_that_says_why() {
    let run = Launch::text(&scenes::bar(&[(10, 1.0)], 1))
        .with_report()
        .run()
        .expect_code(3);
    let (page, console) = opened(&run.file("report.html"));
    assert!(!console.contains("CONSOLE"), "{console}");
    let data = data(&page);
    assert_eq!(
        (&data["summary"]["status"], &data["summary"]["exit_code"]),
        (&"stopped".into(), &3.into())
    );
    let warnings = between(&page, "<section class=\"warnings\"", "</section>");
    assert!(warnings.contains(run.summary().text("message")), "{warnings}");
    assert!(warnings.contains("attempts at a step were not solved"), "{warnings}");
    assert!(
        page.contains("not solved"),
        "the failed attempt is in the chart of convergence"
    );
}

#[test]
fn a_run_without_a_report_can_get_one_later_and_only_then() {
    let run = Launch::text(scenes::BLOCK).run().completed();
    assert!(!run.file("report.html").exists());
    let folder = run.file("");
    assert!(report_of(&folder).completed().stdout.contains("report.html"));
    let page = run.read("report.html");
    assert!(!page.contains("id=\"warnings\""), "nothing is wrong");
    // Chi is zero everywhere: there is nothing to show.
    assert!(!page.contains("data-field=\"chi\"") && page.contains("data-field=\"von_mises\""));
}

#[test]
fn what_a_killed_run_did_not_write_is_named() {
    let run = Launch::text(scenes::BLOCK).run().completed();
    let folder = run.file("");
    for name in ["summary.json", "points.vtkhdf", "convergence.csv"] {
        std::fs::remove_file(run.file(name)).unwrap();
        report_of(&folder).completed();
        let missing = format!("{name} is missing");
        assert!(
            between(&run.read("report.html"), "id=\"warnings\"", "</section>").contains(&missing),
            "{missing}"
        );
    }
    let header = run.read("history.csv").lines().next().unwrap().to_owned() + "\n";
    std::fs::write(run.file("history.csv"), header).unwrap();
    report_of(&folder).completed();
    assert!(run.read("report.html").contains("The history has no rows"));
}

#[test]
fn folders_without_results_and_damaged_files_are_refused() {
    let nothing = Launch::arguments(&["report", "results/misspelled"])
        .run()
        .expect_code(2);
    assert_eq!(
        nothing.complaints("results/misspelled: there is no such folder").len(),
        1,
        "{}",
        nothing.stderr
    );
    let other = report_of(nothing.working_folder()).expect_code(2);
    assert_eq!(
        other.complaints("this is no result folder").len(),
        1,
        "{}",
        other.stderr
    );

    let run = Launch::text(scenes::BLOCK).run().completed();
    let wrong = [
        (
            "history.csv",
            "step,stage,load_factor,step_size,newton_iterations,base\n0,shear,0.0,0.0,0,many\n",
            "line 2",
        ),
        ("history.csv", "step,stage\n", "load_factor"),
        ("convergence.csv", "step,attempt\n1,1\n", "convergence.csv"),
        ("summary.json", "{\"status\": ", "summary.json"),
        ("points.vtkhdf", "no HDF5", "points.vtkhdf"),
    ];
    for (name, text, part) in wrong {
        let kept = std::fs::read(run.file(name)).unwrap();
        std::fs::write(run.file(name), text).unwrap();
        let refused = report_of(&run.file("")).expect_code(1);
        std::fs::write(run.file(name), kept).unwrap();
        assert_eq!(refused.complaints("error:").len(), 1, "{}", refused.stderr);
        assert!(
            refused.stderr.contains(name) && refused.stderr.contains(part),
            "{}",
            refused.stderr
        );
        assert!(!refused.stderr.contains("panicked"), "{}", refused.stderr);
    }
}

/// What no run writes, but what a damaged file may hold.
#[test]
fn odd_snapshots_and_tables_give_a_message_or_a_report_and_no_panic() {
    let run = Launch::text(scenes::BLOCK).run().completed();
    let write = |table: &str, value: f64| {
        let file = hdf5::File::open_rw(run.file("points.vtkhdf")).unwrap();
        let dataset = file.dataset(&format!("VTKHDF/{table}")).unwrap();
        dataset.write_raw(&vec![value; dataset.size()]).unwrap();
    };
    let replace = |table: &str, shape: (usize, usize)| {
        let file = hdf5::File::open_rw(run.file("points.vtkhdf")).unwrap();
        file.unlink(&format!("VTKHDF/{table}")).unwrap();
        let dataset = file.new_dataset::<f64>().shape(shape);
        dataset.create(format!("VTKHDF/{table}").as_str()).unwrap();
    };
    let steps = |count: i64| {
        let file = hdf5::File::open_rw(run.file("points.vtkhdf")).unwrap();
        let attribute = file.group("VTKHDF/Steps").unwrap().attr("NSteps").unwrap();
        attribute.write_scalar(&count).unwrap();
    };
    let whole = std::fs::read(run.file("points.vtkhdf")).unwrap();
    let damages: [(&dyn Fn(), Option<&str>); 10] = [
        (&|| write("Points", 1e308), Some("cannot be drawn")),
        (&|| write("Points", f64::NAN), Some("cannot be drawn")),
        (&|| write("Points", 1e12), None),
        (&|| write("PointData/half_lengths", -1e308), Some("cannot be drawn")),
        (&|| write("PointData/chi", f64::INFINITY), None),
        (&|| write("Steps/PointOffsets", 1e18), Some("rows in a whole file")),
        (&|| write("NumberOfPoints", 1e18), Some("rows in a whole file")),
        (&|| write("Steps/Values", f64::NAN), Some("no time of a snapshot")),
        (&|| replace("Points", (400, 2)), Some("is of shape")),
        (&|| steps(i64::MAX), None),
    ];
    for (number, (damage, message)) in damages.into_iter().enumerate() {
        std::fs::write(run.file("points.vtkhdf"), &whole).unwrap();
        damage();
        let report = report_of(&run.file(""));
        match message {
            Some(message) => {
                let report = report.expect_code(1);
                assert_eq!(report.complaints(message).len(), 1, "{number}: {}", report.stderr);
                assert_eq!(report.complaints("error: ").len(), 1, "{number}: {}", report.stderr);
            }
            None => assert_eq!(report.completed().stderr, "", "{number}"),
        }
    }
    std::fs::write(run.file("points.vtkhdf"), &whole).unwrap();
    let history = run.read("history.csv");
    let head = history.lines().next().unwrap();
    let columns = head.split(',').count();
    for value in ["1e308", "5e-324", "NaN", "1e400"] {
        let row = |stage: &str| {
            (0..columns)
                .map(|k| if k == 1 { stage } else { value })
                .collect::<Vec<_>>()
                .join(",")
        };
        let text = format!("{head}\n{}\n{}\n{}\n", row("shear"), row("shear"), row("other"));
        std::fs::write(run.file("history.csv"), text).unwrap();
        let report = report_of(&run.file("")).completed();
        assert_eq!(report.stderr, "", "{value}");
    }
}

/// A report that cannot be drawn is a warning: the run is what it is.
#[test]
fn a_run_succeeds_without_room_for_its_report() {
    let first = Launch::text(scenes::BLOCK).run().completed();
    std::fs::write(first.file("figures"), "a file in the way").unwrap();
    let folder = first.file("").to_string_lossy().into_owned();
    let again = Launch::text(scenes::BLOCK)
        .output(&folder)
        .with_report()
        .run()
        .completed();
    assert!(again.stdout.contains("warning: no report"), "{}", again.stdout);
}
