//! The pages under docs and the README against what is there: links, commands, keys of the configuration, and the Python
//! code of the tour on the results of a short run.

#[path = "documentation/commands.rs"]
mod commands;
#[path = "documentation/keys.rs"]
mod keys;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The README and every page under docs.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![root().join("README.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("docs can be read") {
            let path = entry.expect("docs can be read").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(path);
            }
        }
    }
    assert!(pages.len() > 5, "the pages were not found");
    pages
}

/// Anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading
        .trim()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

/// Targets of the links and pictures of a page.
fn links(text: &str) -> Vec<String> {
    let mut links: Vec<String> = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next().map(str::to_owned))
        .collect();
    links.extend(
        text.split("src=\"")
            .skip(1)
            .filter_map(|rest| rest.split('"').next().map(str::to_owned)),
    );
    links
}

#[test]
fn links_lead_somewhere() {
    let mut checked = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).expect("the page was found");
        for link in links(&text).into_iter().filter(|link| !link.starts_with("http")) {
            let (file, heading) = link.split_once('#').unwrap_or((link.as_str(), ""));
            let target = if file.is_empty() {
                page.clone()
            } else {
                page.parent().expect("pages lie in folders").join(file)
            };
            assert!(target.exists(), "{}: {link} leads nowhere", page.display());
            if !heading.is_empty() {
                let text = fs::read_to_string(&target).expect("the target of an anchor is a page");
                let found = text
                    .lines()
                    .filter(|line| line.starts_with('#'))
                    .any(|line| anchor(line.trim_start_matches('#')) == heading);
                assert!(found, "{}: {link} has no such heading", page.display());
            }
            checked += 1;
        }
    }
    assert!(checked > 20, "only {checked} links were found");
}

/// Code blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let opening = format!("```{language}\n");
    text.split(&opening)
        .skip(1)
        .filter_map(|rest| rest.split("```").next().map(str::to_owned))
        .collect()
}

#[test]
fn commands_name_files_that_exist() {
    let mut checked = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).expect("the page was found");
        for word in blocks(&text, "sh").iter().flat_map(|block| block.split_whitespace()) {
            let word = word.trim_matches(['"', '\'', '`']).trim_start_matches("./");
            if word.starts_with("scripts/") || word.starts_with("configs/") {
                let word = word.split(':').next().unwrap_or(word);
                assert!(root().join(word).exists(), "{}: there is no {word}", page.display());
                checked += 1;
            }
        }
    }
    assert!(checked > 5, "only {checked} files were found in commands");
}

#[test]
fn paths_of_the_source_exist() {
    let mut checked = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).expect("the page was found");
        // Odd pieces stand between backticks.
        for word in text
            .split('`')
            .skip(1)
            .step_by(2)
            .filter(|word| !word.contains(char::is_whitespace))
        {
            let in_source = ["src/", "tests/", "scripts/", "configs/", "docs/", "crates/"];
            let source_file = word.ends_with(".rs") && word.contains('/') && !word.contains(['{', '*', '<']);
            if in_source.iter().any(|start| word.starts_with(start)) && !word.contains(['{', '*', '<']) {
                assert!(root().join(word).exists(), "{}: there is no {word}", page.display());
                checked += 1;
            } else if source_file {
                assert!(
                    root().join("src").join(word).exists(),
                    "{}: there is no {word}",
                    page.display()
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 20, "only {checked} paths were found");
}

/// `docs/config.md` below its hand-written head is what the doc comments say.
#[test]
fn the_page_of_keys_is_what_the_source_says() {
    let keys = keys::Keys(mpm_petsc::config::schema());
    let page = read("docs/config.md");
    let (head, _) = page.split_once("-->\n").expect("the page has a mark");
    let expected = format!("{head}-->\n{}", keys.page());
    if std::env::var_os("MPM_PETSC_WRITE_DOCS").is_some() {
        fs::write(root().join("docs/config.md"), &expected).expect("docs can be written");
    }
    let page = read("docs/config.md");
    let differing = page.lines().zip(expected.lines()).find(|(left, right)| left != right);
    assert!(
        page == expected,
        "docs/config.md is not what the source says (MPM_PETSC_WRITE_DOCS=1 writes it): {differing:?}"
    );
}

/// The schema that editors use is the one that `mpm-petsc schema` prints.
#[test]
fn the_schema_is_what_the_source_says() {
    let expected = format!("{:#}\n", mpm_petsc::config::schema());
    let file = "docs/scene.schema.json";
    if std::env::var_os("MPM_PETSC_WRITE_DOCS").is_some() {
        fs::write(root().join(file), &expected).expect("docs can be written");
    }
    assert!(
        read(file) == expected,
        "{file} is not what the source says (MPM_PETSC_WRITE_DOCS=1 cargo test --test documentation writes it)"
    );
}

/// An independent validator takes every configuration, whose first lines name the schema to editors, and refuses those with
/// unknown keys and values of the wrong kind.
#[test]
fn the_schema_takes_good_configurations_and_no_misspelled_ones() {
    let wrong = [
        "component_that_is_a_number",
        "key_of_another_section",
        "list_instead_of_keys",
        "misspelled_key",
        "stage_without_a_name",
        "shape_with_two_keys",
        "text_for_a_number",
        "unknown_section",
        "unknown_shape",
        "list_for_a_mapping",
    ];
    let mut check = Command::new(python());
    check
        .arg(root().join("tests/documentation/validate.py"))
        .arg("docs/scene.schema.json");
    let printed = finish(
        check.args(wrong.map(|name| format!("tests/bad_input/{name}.yaml"))),
        root(),
    );
    assert!(printed.contains("configurations are valid"), "{printed}");
}

/// Two sources of one truth: what serde accepts is what the page lists.
#[test]
fn every_accepted_key_stands_on_the_page() {
    let page = read("docs/config.md");
    let names = keys::Keys(mpm_petsc::config::schema()).names();
    assert!(names.len() > 100, "only {} keys were found", names.len());
    for name in names {
        assert!(
            page.contains(&format!("`{name}`")),
            "docs/config.md does not mention {name}"
        );
    }
    let mut unknown = mpm_petsc::config::read("keys.yaml", "nonsense: 1\n", &[]).expect_err("no such key");
    unknown.retain(|problem| problem.expected.contains("bodies"));
    let accepted = &unknown.first().expect("the top keys are listed").expected;
    for name in accepted.split(", ") {
        assert!(
            page.contains(&format!("| `{name}` |")),
            "docs/config.md does not list {name}"
        );
    }
}

/// The smallest version of Rust that the README names is the one of the package.
#[test]
fn the_version_of_rust_is_the_one_of_the_package() {
    let manifest = read("Cargo.toml");
    let version = manifest
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = "))
        .expect("the package names a version");
    let wanted = format!("Rust {} or newer", version.trim_matches('"'));
    assert!(read("README.md").contains(&wanted), "the README does not say: {wanted}");
}

/// Runs a command in a folder to its end; its standard output.
fn finish(command: &mut Command, folder: &Path) -> String {
    let output = command
        .current_dir(folder)
        .output()
        .expect("the command can be started");
    assert!(
        output.status.success(),
        "{command:?}: {}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The Python that results are read with.
fn python() -> PathBuf {
    let python = root().join(".venv/bin/python");
    assert!(
        python.exists(),
        "{} is missing; scripts/setup.sh makes it",
        python.display()
    );
    python
}

/// The scene of the tour in a few steps; then its Python code and the scripts that draw.
#[test]
fn the_python_code_of_the_tour_runs() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tour");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let mut run = Command::new("timeout");
    run.args(["-k", "5", "300", env!("CARGO_BIN_EXE_mpm-petsc")]);
    run.arg(root().join("configs/shear_layer.yaml"));
    run.args([
        "--quiet",
        "--output",
        "results/shear_layer",
        "--set",
        "stages.0.steps=20",
    ]);
    finish(&mut run, &folder);

    let python = python();
    let snippets = blocks(&read("docs/tour.md"), "python");
    assert_eq!(snippets.len(), 2, "the tour has two pieces of Python");
    let printed: String = snippets
        .iter()
        .map(|snippet| finish(Command::new(&python).args(["-c", snippet]), &folder))
        .collect();
    let pages = blocks(&read("docs/results.md"), "python");
    assert_eq!(pages.len(), 4, "h5py, pyvista, other viewers and the history");
    assert!(
        pages.iter().all(|snippet| snippet.lines().count() <= 12),
        "about ten lines each"
    );
    let read_back: String = pages
        .iter()
        .map(|snippet| finish(Command::new(&python).args(["-c", snippet]), &folder))
        .collect();
    for expected in [
        "144 points at 3 times",
        "largest chi at the end",
        "144 points, shear stress",
        "3 files, the last one at 1.0",
        "21 rows, last load",
    ] {
        assert!(read_back.contains(expected), "no \"{expected}\" in: {read_back}");
    }
    let series = fs::read_to_string(folder.join("results/shear_layer/points.pvd")).expect("the series is written");
    assert!(series.contains(r#"timestep="1.0" file="points_0002.vtu""#), "{series}");
    let picture = fs::read(folder.join("chi.png")).expect("the picture is drawn");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 2_000);
    for expected in ["peak 5.69", "3 snapshots of 144 points", "differ by up to"] {
        assert!(printed.contains(expected), "no \"{expected}\" in: {printed}");
    }
    let drawings: [(&str, &[&str]); 2] = [
        ("plot_points.py", &["--field", "stress", "--component", "xy"]),
        ("plot_history.py", &["--x", "displacement", "--y", "base_reaction"]),
    ];
    for (script, options) in drawings {
        let picture = folder.join(script).with_extension("png");
        let mut draw = Command::new(&python);
        draw.arg(root().join("scripts").join(script))
            .arg("results/shear_layer")
            .args(options);
        finish(draw.arg("--output").arg(&picture), &folder);
        let bytes = fs::read(&picture).expect("the picture is there");
        assert!(
            bytes.starts_with(b"\x89PNG") && bytes.len() > 5_000,
            "{script} draws nothing"
        );
    }
}

/// Every command of the pages: short ones are run as they stand, of the others the configuration is checked. What stands in a
/// block of text behind a command and begins with `error:` is what the command prints.
#[test]
fn commands_of_the_pages_do_what_they_say() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("commands");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    std::os::unix::fs::symlink(root().join("configs"), folder.join("configs")).expect("a link can be made");
    // The tour first: later pages read the results that it leaves.
    let pages = [
        "tour",
        "study",
        "results",
        "lean",
        "parallel",
        "cluster",
        "performance",
        "stability",
        "introduction",
    ];
    let pages = pages.map(|page| format!("docs/{page}.md"));
    let mut done = std::collections::HashSet::new();
    for page in pages.iter().map(String::as_str).chain(["README.md"]) {
        for command in commands::of(&read(page)) {
            if done.insert(command.arguments()) {
                command.hold(page, Path::new(env!("CARGO_BIN_EXE_mpm-petsc")), &folder);
            }
        }
    }
    assert!(done.len() > 25, "only {} commands were found", done.len());
}
