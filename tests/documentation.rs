//! The pages under docs and the README against what is there: links, commands, keys of the configuration.

#[path = "documentation/keys.rs"]
mod keys;

use std::fs;
use std::path::{Path, PathBuf};

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
            if in_source.iter().any(|start| word.starts_with(start)) && !word.contains(['{', '*', '<', 'X']) {
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
    let keys = keys::Keys::read(&[&read("src/config/file.rs"), &read("src/material/spec.rs")]);
    let page = read("docs/config.md");
    let (head, _) = page.split_once("-->\n").expect("the page has a mark");
    let expected = format!("{head}-->\n{}", keys.page("ConfigFile"));
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

/// Two sources of one truth: what serde accepts is what the page lists.
#[test]
fn every_accepted_key_stands_on_the_page() {
    let page = read("docs/config.md");
    let keys = keys::Keys::read(&[&read("src/config/file.rs"), &read("src/material/spec.rs")]);
    let names = keys.names();
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
