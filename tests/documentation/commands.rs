//! Commands of the program in the pages, and whether they do what the pages say.

use std::path::Path;
use std::process::Command;

/// Scenes that run to their end in a second or two.
const SHORT: [&str; 5] = [
    "configs/shear_layer.yaml",
    "configs/column_self_weight.yaml",
    "configs/plane_cantilever_a.yaml",
    "configs/curved_cantilever_2m.yaml",
    "configs/classical_shear_layer.yaml",
];

/// A call of the program on one rank.
pub struct Documented {
    words: Vec<String>,
    petsc: Vec<String>,
    /// Beginning of what it prints on failure, where the page shows that.
    error: Option<String>,
}

/// The calls of `mpm-petsc` and `scripts/run.sh` in the blocks of shell of a page.
pub fn of(page: &str) -> Vec<Documented> {
    let mut found = Vec::new();
    for part in page.split("```sh\n").skip(1) {
        let (block, after) = part.split_once("```").expect("a block ends");
        let mut calls: Vec<Documented> = block.lines().filter_map(call).collect();
        let shown = after
            .trim_start()
            .strip_prefix("```text\n")
            .and_then(|text| text.lines().next());
        if let Some((last, error)) = calls.last_mut().zip(shown.filter(|line| line.starts_with("error:"))) {
            last.error = Some(error.trim_end_matches("...)").to_owned());
        }
        found.extend(calls);
    }
    found
}

/// A line of shell as a call of the program; what the shell does around it is left out.
fn call(line: &str) -> Option<Documented> {
    let words = shlex::split(line)?;
    let program = |word: &String| word.ends_with("mpm-petsc") || word.ends_with("scripts/run.sh");
    let start = words.iter().position(program)?;
    let ends = |word: &String| ["||", "&&", "|", "&", ">"].contains(&word.as_str());
    let words: Vec<String> = words[start + 1..]
        .iter()
        .take_while(|word| !ends(word))
        .cloned()
        .collect();
    let split = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let petsc = words[split..].to_vec();
    let mut words = words[..split].to_vec();
    // What depends on the shell, or is an option of the script.
    if let Some(ranks) = words.iter().position(|word| word == "-n") {
        words.drain(ranks..ranks + 2);
    }
    if let Some(output) = words
        .windows(2)
        .position(|pair| pair[0] == "--output" && pair[1].starts_with('$'))
    {
        words.drain(output..output + 2);
    }
    words.retain(|word| !word.starts_with('$'));
    Some(Documented {
        words,
        petsc,
        error: None,
    })
}

impl Documented {
    /// Arguments of the program.
    pub fn arguments(&self) -> Vec<String> {
        self.words.iter().chain(&self.petsc).cloned().collect()
    }

    /// What is executed: the call itself where it is short.
    fn arguments_to_run(&self) -> Vec<String> {
        let first = self.words.first().map_or("", String::as_str);
        if first == "study" {
            let scene = self.words[1].clone();
            let slurm = self.words.iter().any(|word| word == "--slurm");
            return vec![
                "study".into(),
                scene,
                if slurm { "--slurm" } else { "--dry-run" }.into(),
            ];
        }
        let restarts = self.words.iter().any(|word| word == "--restart");
        if !first.ends_with(".yaml") || SHORT.contains(&first) && !restarts {
            return self.arguments();
        }
        let mut check = vec!["check".to_owned(), first.to_owned()];
        for pair in self.words.windows(2).filter(|pair| pair[0] == "--set") {
            check.extend_from_slice(pair);
        }
        check
    }

    /// Runs the call in a folder.
    ///
    /// # Panics
    /// Where it ends in another way than the page says.
    pub fn hold(&self, page: &str, program: &Path, folder: &Path) {
        let arguments = self.arguments_to_run();
        let mut command = Command::new("timeout");
        command
            .args(["-k", "5", "300"])
            .arg(program)
            .args(&arguments)
            .current_dir(folder);
        let output = command
            .env("OPENBLAS_NUM_THREADS", "1")
            .output()
            .expect("the program can be started");
        let (code, printed) = (output.status.code(), String::from_utf8_lossy(&output.stderr));
        match &self.error {
            Some(error) if !arguments.contains(&"check".to_owned()) || self.words[0] == "check" => {
                assert_ne!(code, Some(0), "{page}: {arguments:?} does not fail");
                assert!(
                    printed.contains(error),
                    "{page}: {arguments:?} prints {printed} instead of {error}"
                );
            }
            _ => assert_eq!(code, Some(0), "{page}: {arguments:?}: {printed}"),
        }
    }
}
