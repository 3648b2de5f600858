//! From a study to its runs: every combination of what is varied, each checked before the first is started.

use super::file::{ChartKeys, ReferenceKeys, ScalingName, Settings, SlurmKeys, StudyFile, VariantKeys, VaryKeys};
use super::measure::{History, Measure, Reference};
use super::outcome::Start;
use crate::config::arguments::RunArguments;
use crate::config::file::ScalarOr;
use crate::config::{Document, Input, KeyPath, did_you_mean, nearest};
use crate::problem::Problem;
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// Most runs of a study: more are a mistake.
const MAXIMUM_RUNS: usize = 10_000;

/// Most ranks of a run.
const MAXIMUM_RANKS: usize = 100_000;

/// Longest name of a folder that common file systems take [byte].
const LONGEST_NAME: usize = 255;

/// Name of the run that the others are compared with.
const REFERENCE: &str = "reference";

/// How a program is started on several ranks. Without `--bind-to none`, runs at the same time would share a core.
const LAUNCHER: [&str; 6] = ["mpirun", "--quiet", "--bind-to", "none", "-n", "{ranks}"];

/// A study whose runs can be started.
#[derive(Clone, Debug)]
pub struct Study {
    pub title: String,
    /// Where table, charts and runs go.
    pub folder: PathBuf,
    /// Names of what is varied.
    pub parameters: Vec<String>,
    /// The reference run first, where there is one.
    pub runs: Vec<Run>,
    pub measures: Vec<Measure>,
    pub reference: Reference,
    /// The parameter whose runs are joined by a line.
    pub along: Option<usize>,
    pub scaling: ScalingName,
    launcher: Vec<String>,
    pub slurm: SlurmKeys,
}

/// One run of a study.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of its folder.
    pub name: String,
    /// What it is for each parameter; empty for the reference run.
    pub labels: Vec<String>,
    /// The line of a chart that each of these belongs to, where it names one.
    pub lines: Vec<Option<String>>,
    pub ranks: usize,
    pub scene: String,
    /// `KEY.KEY=VALUE`
    pub overrides: Vec<String>,
    pub folder: PathBuf,
    /// The configuration as the run will write it to its folder.
    pub resolved: String,
    /// Files that the scene names.
    pub files: Vec<String>,
    /// Geometric mean of the edges of a cell [m]; a mesh of finite elements has none.
    pub cell_size: Option<f64>,
}

impl Run {
    /// Whether this is the run that the others are compared with.
    pub fn is_reference(&self) -> bool {
        self.name == REFERENCE
    }
}

impl Study {
    /// The words that start a run.
    pub fn command(&self, run: &Run, program: &str, start: Start) -> Vec<String> {
        let mut words = Vec::new();
        if run.ranks > 1 {
            let ranks = run.ranks.to_string();
            words.extend(self.launcher.iter().map(|word| word.replace("{ranks}", &ranks)));
        }
        words.extend([program.to_owned(), run.scene.clone()]);
        for assignment in &run.overrides {
            words.extend(["--set".to_owned(), assignment.clone()]);
        }
        words.extend(["--output".to_owned(), run.folder.to_string_lossy().into_owned()]);
        let option = match start {
            Start::Anew => None,
            Start::Replacing => Some("--overwrite"),
            Start::GoingOn => Some("--restart"),
        };
        words.extend(option.map(str::to_owned));
        words
    }
}

/// A key that a run sets, and where the study says so.
#[derive(Clone, Debug)]
struct Setting {
    key: String,
    text: String,
    place: KeyPath,
}

/// One of the things that a parameter can be.
#[derive(Clone, Debug, Default)]
struct Choice {
    label: String,
    line: Option<String>,
    scene: Option<(String, KeyPath)>,
    settings: Vec<Setting>,
    ranks: Option<usize>,
}

/// Reads a study and every scene it needs. `output` replaces the result folder of the file.
///
/// # Errors
/// Everything that is wrong, in the study or in one of its runs.
pub fn read(file: &str, output: Option<&Path>) -> Result<Study, Vec<Problem>> {
    let document = Document::<StudyFile>::from_disk(file, "scene, vary, measure")?;
    let keys = document.content.clone();
    let path = Path::new(file);
    let stem = path
        .file_stem()
        .map_or_else(|| "study".into(), |stem| stem.to_string_lossy());
    let folder = output
        .map(Path::to_path_buf)
        .or_else(|| keys.output.as_ref().map(PathBuf::from))
        .unwrap_or_else(|| Path::new("results").join(&*stem));
    let mut planner = Planner {
        document,
        directory: path.parent().unwrap_or_else(|| Path::new("")).to_path_buf(),
        folder: folder.clone(),
    };
    let measures = planner.measures(&keys);
    let parameters = planner.parameters(&keys.vary, &measures);
    let choices: Vec<_> = (0..keys.vary.len())
        .map(|index| planner.choices(index, &keys.vary[index]))
        .collect();
    let along = planner.along(&keys.charts, &parameters);
    let launcher = planner.launcher(keys.launcher.as_deref());
    let reference = planner.reference(keys.reference.as_ref(), &measures);
    planner.slurm(&keys.slurm);
    let runs = planner.runs(&keys, &parameters, &choices, &measures);
    if !planner.document.valid() {
        return Err(planner.document.problems());
    }
    Ok(Study {
        title: if keys.title.is_empty() {
            stem.into_owned()
        } else {
            keys.title
        },
        folder,
        parameters,
        runs,
        measures,
        reference,
        along,
        scaling: keys.charts.scaling,
        launcher,
        slurm: keys.slurm,
    })
}

/// A study that is being read.
struct Planner {
    document: Document<StudyFile>,
    /// Folder of the study.
    directory: PathBuf,
    /// Result folder.
    folder: PathBuf,
}

impl Planner {
    fn require(
        &mut self,
        holds: bool,
        path: &KeyPath,
        message: impl Into<String>,
        expected: impl Into<String>,
    ) -> bool {
        if !holds {
            self.document.report(path, message, expected);
        }
        holds
    }

    fn measures(&mut self, keys: &StudyFile) -> Vec<Measure> {
        let section = KeyPath::root().key("measure");
        let mut measures: Vec<Measure> = Vec::new();
        for (index, entry) in keys.measure.iter().enumerate() {
            let path = section.index(index);
            match Measure::of(index, entry) {
                Ok(measure) => measures.push(measure),
                Err((message, expected)) => self.document.report(&path, message, expected),
            }
        }
        measures
    }

    /// Names of the parameters; they and the measures become columns of one table.
    fn parameters(&mut self, vary: &[VaryKeys], measures: &[Measure]) -> Vec<String> {
        let name_of = |keys: &VaryKeys| keys.name.clone().or_else(|| keys.key.clone()).unwrap_or_default();
        let names: Vec<String> = vary.iter().map(name_of).collect();
        let root = KeyPath::root();
        let mut seen: Vec<String> = super::table::FIXED_COLUMNS.iter().map(ToString::to_string).collect();
        for (index, name) in names.iter().enumerate() {
            let path = root.key("vary").index(index);
            self.require(
                !name.is_empty(),
                &path,
                "what is varied has no name",
                "`name`, or `key`",
            );
            self.require(
                !seen.contains(name),
                &path,
                format!("the name \"{name}\" is taken"),
                "a name of its own",
            );
            seen.push(name.clone());
        }
        for measure in measures {
            let path = root.key("measure").index(measure.entry).key("name");
            for column in measure.columns() {
                let message = format!("the name \"{column}\" is taken");
                self.require(!seen.contains(&column), &path, message, "a name of its own");
                seen.push(column);
            }
        }
        names
    }

    /// What an entry of `vary` offers.
    fn choices(&mut self, index: usize, keys: &VaryKeys) -> Vec<Choice> {
        let path = KeyPath::root().key("vary").index(index);
        let form = "`key` with `values`, or `variants` with a `name`";
        let choices: Vec<Choice> = match keys {
            VaryKeys {
                key: Some(key),
                values: Some(values),
                variants: None,
                ..
            } => {
                let choice = |(number, value): (usize, &crate::config::FlowText)| Choice {
                    label: value.0.clone(),
                    settings: vec![Setting {
                        key: key.clone(),
                        text: value.0.clone(),
                        place: path.key("values").index(number),
                    }],
                    ..Choice::default()
                };
                values.iter().enumerate().map(choice).collect()
            }
            VaryKeys {
                key: None,
                values: None,
                variants: Some(variants),
                ..
            } => {
                let at = |number: usize| path.key("variants").index(number);
                variants
                    .iter()
                    .enumerate()
                    .map(|(number, keys)| variant(keys, &at(number)))
                    .collect()
            }
            _ => {
                self.document.report(&path, "it is not clear what is varied", form);
                return Vec::new();
            }
        };
        self.require(
            !choices.is_empty(),
            &path,
            "there is nothing to choose from",
            "at least one value",
        );
        for (number, choice) in choices.iter().enumerate() {
            let twin = choices[..number]
                .iter()
                .any(|other| slug(&other.label) == slug(&choice.label));
            let place = path
                .key(if keys.key.is_some() { "values" } else { "variants" })
                .index(number);
            let message = format!("\"{}\" is there twice, or too like another one", choice.label);
            self.require(!twin, &place, message, "names that differ in letters or digits");
            self.ranks(&place.key("ranks"), choice.ranks);
        }
        choices
    }

    fn ranks(&mut self, path: &KeyPath, ranks: impl IntoIterator<Item = usize>) {
        for ranks in ranks {
            let holds = (1..=MAXIMUM_RANKS).contains(&ranks);
            let message = format!("{ranks} is out of bounds");
            self.require(
                holds,
                path,
                message,
                format!("a whole number from 1 to {MAXIMUM_RANKS}"),
            );
        }
    }

    fn along(&mut self, keys: &ChartKeys, parameters: &[String]) -> Option<usize> {
        let Some(name) = &keys.along else {
            return (!parameters.is_empty()).then_some(0);
        };
        let found = parameters.iter().position(|parameter| parameter == name);
        let hint = did_you_mean(nearest(name, parameters.iter().map(String::as_str)));
        let message = format!("nothing named \"{name}\" is varied{hint}");
        let path = KeyPath::root().key("charts").key("along");
        self.require(found.is_some(), &path, message, parameters.join(", "));
        found
    }

    fn launcher(&mut self, words: Option<&[String]>) -> Vec<String> {
        let Some(words) = words else {
            return LAUNCHER.map(str::to_owned).to_vec();
        };
        let holds = words.iter().any(|word| word.contains("{ranks}"));
        let expected = "words, one of them with {ranks}: [srun, -n, \"{ranks}\"]";
        let path = KeyPath::root().key("launcher");
        self.require(holds, &path, "the number of ranks is not passed on", expected);
        words.to_vec()
    }

    /// Texts that become lines of a batch script.
    fn slurm(&mut self, keys: &SlurmKeys) {
        let section = KeyPath::root().key("slurm");
        if let Some(time) = &keys.time {
            let words = ["UNLIMITED", "INFINITE"];
            let holds = words.contains(&time.to_uppercase().as_str())
                || time.starts_with(|letter: char| letter.is_ascii_digit())
                    && time
                        .chars()
                        .all(|letter| letter.is_ascii_digit() || ":-".contains(letter));
            let message = format!("\"{}\" is no time limit of Slurm", time.escape_debug());
            self.require(holds, &section.key("time"), message, "MINUTES, HH:MM:SS, DAYS-HH:MM:SS");
        }
        for (index, option) in keys.options.iter().enumerate() {
            let holds = option.starts_with('-') && !option.contains(char::is_control);
            let message = format!("\"{}\" is no option of sbatch", option.escape_debug());
            let path = section.key("options").index(index);
            self.require(holds, &path, message, "one line that begins with -, as --account=name");
        }
    }

    fn reference(&mut self, keys: Option<&ReferenceKeys>, measures: &[Measure]) -> Reference {
        let path = KeyPath::root().key("reference");
        let Some(keys) = keys else {
            for measure in measures.iter().filter(|measure| measure.needs_curve()) {
                let path = KeyPath::root().key("measure").index(measure.entry);
                self.document.report(
                    &path,
                    "there is no curve to be distant from",
                    "a `reference` with run or file",
                );
            }
            return Reference::None;
        };
        match keys {
            ReferenceKeys {
                run: Some(_),
                values: None,
                file: None,
            } => Reference::Run,
            ReferenceKeys {
                run: None,
                values: Some(values),
                file: None,
            } => {
                for (name, value) in values {
                    let path = path.key("values").key(name);
                    self.reference_value(&path, name, value, measures);
                }
                let list = |value: &ScalarOr<f64, Vec<f64>>| match value {
                    ScalarOr::Scalar(value) => vec![*value],
                    ScalarOr::Collection(values) => values.clone(),
                };
                Reference::Values(values.iter().map(|(name, value)| (name.clone(), list(value))).collect())
            }
            ReferenceKeys {
                run: None,
                values: None,
                file: Some(file),
            } => self.reference_table(&path.key("file"), file, measures),
            _ => {
                self.document.report(
                    &path,
                    "it is not clear what is compared with",
                    "exactly one of run, values, file",
                );
                Reference::None
            }
        }
    }

    /// A table of numbers, which has the columns of every curve that is compared with it.
    fn reference_table(&mut self, place: &KeyPath, file: &str, measures: &[Measure]) -> Reference {
        let table = match History::read(&self.directory.join(file)) {
            Ok(table) => table,
            Err(message) => {
                let expected = "a CSV file with a line of names, then numbers";
                self.document.report(place, message, expected);
                return Reference::None;
            }
        };
        let curves = measures.iter().filter(|measure| measure.needs_curve());
        let lacking = curves
            .flat_map(Measure::history_columns)
            .find(|name| table.column(name).is_none());
        if let Some(name) = lacking {
            let known: Vec<&str> = table.names().collect();
            let hint = did_you_mean(nearest(name, known.iter().copied()));
            let message = format!("{file} has no column \"{name}\" of numbers{hint}");
            self.document.report(place, message, known.join(", "));
        }
        Reference::Table(table)
    }

    /// A value that a measure is compared with: as many numbers as the measure has, not all of them zero.
    fn reference_value(&mut self, path: &KeyPath, name: &str, value: &ScalarOr<f64, Vec<f64>>, measures: &[Measure]) {
        let Some(measure) = measures.iter().find(|measure| measure.name == name) else {
            let names: Vec<&str> = measures.iter().map(|measure| measure.name.as_str()).collect();
            let hint = did_you_mean(nearest(name, names.iter().copied()));
            self.document.report(
                path,
                format!("nothing named \"{name}\" is measured{hint}"),
                names.join(", "),
            );
            return;
        };
        let (count, zero) = match value {
            ScalarOr::Scalar(value) => (1, *value == 0.0),
            ScalarOr::Collection(values) => (values.len(), values.iter().all(|value| *value == 0.0)),
        };
        let expected = measure.size();
        let message = format!("{count} numbers for a measure that has {expected}");
        self.require(count == expected, path, message, format!("{expected} numbers"));
        self.require(
            !zero,
            path,
            "an error relative to zero has no meaning",
            "a value other than zero",
        );
    }

    /// Every combination, the last parameter changing fastest, then the ranks.
    fn runs(
        &mut self,
        keys: &StudyFile,
        parameters: &[String],
        choices: &[Vec<Choice>],
        measures: &[Measure],
    ) -> Vec<Run> {
        let root = KeyPath::root();
        let ranks = match &keys.ranks {
            None => vec![1],
            Some(ScalarOr::Scalar(ranks)) => vec![*ranks],
            Some(ScalarOr::Collection(ranks)) => ranks.clone(),
        };
        self.ranks(&root.key("ranks"), ranks.iter().copied());
        let distinct = (1..ranks.len()).all(|index| !ranks[..index].contains(&ranks[index])) && !ranks.is_empty();
        self.require(
            distinct,
            &root.key("ranks"),
            "these are not different numbers",
            "numbers of ranks, each once",
        );
        let own_ranks = choices.iter().flatten().any(|choice| choice.ranks.is_some());
        let twice = own_ranks && keys.ranks.is_some();
        self.require(
            !twice,
            &root.key("ranks"),
            "variants set the ranks too",
            "ranks here or in the variants",
        );
        let count = choices
            .iter()
            .try_fold(ranks.len(), |count, choices| count.checked_mul(choices.len()));
        let few = count.is_some_and(|count| count <= MAXIMUM_RUNS);
        let message = "there are too many combinations";
        if !self.require(few, &root.key("vary"), message, format!("at most {MAXIMUM_RUNS} runs")) {
            return Vec::new();
        }
        let mut runs = Vec::new();
        if let Some(reference) = keys.reference.as_ref().and_then(|reference| reference.run.as_ref()) {
            let path = root.key("reference").key("run");
            self.ranks(&path.key("ranks"), reference.ranks);
            let choice = Choice {
                scene: reference.scene.clone().map(|scene| (scene, path.key("scene"))),
                settings: settings(&reference.set, &path.key("set")),
                ranks: reference.ranks,
                ..Choice::default()
            };
            let ranks = reference.ranks.unwrap_or(1);
            runs.extend(self.run(REFERENCE.to_owned(), &[&choice], ranks, keys, measures));
        }
        for combination in combinations(choices) {
            for &ranks in &ranks {
                let own = combination.iter().rev().find_map(|choice| choice.ranks);
                let ranks = own.unwrap_or(ranks);
                let name = run_name(parameters, &combination, (keys.ranks.is_some()).then_some(ranks));
                if !self.short(&name) {
                    return Vec::new();
                }
                runs.extend(self.run(name, &combination, ranks, keys, measures));
            }
        }
        runs
    }

    /// Whether a name can be that of a folder; one that is too long is reported, and is not the only one.
    fn short(&mut self, name: &str) -> bool {
        let message = format!(
            "the folder of a run would have a name of {} letters, {}...",
            name.len(),
            &name[..40.min(name.len())]
        );
        let expected = format!("shorter names and labels: at most {LONGEST_NAME} letters for all of a run together");
        self.require(
            name.len() <= LONGEST_NAME,
            &KeyPath::root().key("vary"),
            message,
            expected,
        )
    }

    /// One run, if its scene is valid and writes what is measured.
    fn run(
        &mut self,
        name: String,
        choices: &[&Choice],
        ranks: usize,
        keys: &StudyFile,
        measures: &[Measure],
    ) -> Option<Run> {
        let own_scene = choices.iter().rev().find_map(|choice| choice.scene.clone());
        let (scene, scene_place) = own_scene.unwrap_or_else(|| (keys.scene.clone(), KeyPath::root().key("scene")));
        if !self.document.sound(&scene_place) {
            return None;
        }
        let mut all = settings(&keys.set, &KeyPath::root().key("set"));
        all.extend(choices.iter().flat_map(|choice| choice.settings.iter().cloned()));
        let scene = self.directory.join(&scene).to_string_lossy().into_owned();
        let folder = self.folder.join("runs").join(&name);
        let arguments = RunArguments {
            config: scene.clone(),
            output: Some(folder.clone()),
            // A report of each run would stand in the times that are compared; what the study sets comes later and holds.
            set: std::iter::once("output.report=false".to_owned())
                .chain(all.iter().map(|setting| format!("{}={}", setting.key, setting.text)))
                .collect(),
            restart: false,
            overwrite: false,
            quiet: false,
            petsc_options: Vec::new(),
        };
        let input = match Input::from_disk(&scene, &arguments.overrides()) {
            Ok(input) => input,
            Err(problems) => {
                let message = problems
                    .iter()
                    .map(|problem| problem.message.as_str())
                    .collect::<Vec<_>>()
                    .join(", ");
                self.document
                    .report(&scene_place, format!("{scene}: {message}"), "the file of a scene");
                return None;
            }
        };
        let valid = match input.scene() {
            Ok((valid, _)) => valid,
            Err(problems) => {
                problems
                    .into_iter()
                    .for_each(|problem| self.report_in_scene(problem, &all, &scene));
                return None;
            }
        };
        self.columns(measures, &valid, &scene);
        Some(Run {
            labels: if name == REFERENCE {
                Vec::new()
            } else {
                choices.iter().map(|choice| choice.label.clone()).collect()
            },
            lines: choices.iter().map(|choice| choice.line.clone()).collect(),
            name,
            ranks,
            scene,
            overrides: arguments.set,
            folder,
            resolved: valid.output.resolved.clone(),
            files: input.named_files(),
            cell_size: cell_size(&valid),
        })
    }

    /// A problem of a scene: where the study sets the key that is wrong, or else where the scene has it.
    fn report_in_scene(&mut self, problem: Problem, settings: &[Setting], scene: &str) {
        let path = KeyPath::parse(&problem.path);
        let meant = |setting: &&Setting| {
            let key = KeyPath::parse(&setting.key);
            key.contains(&path) || path.contains(&key)
        };
        // A key that nobody knows is reported with the path above it.
        let named = |setting: &&Setting| {
            let last = setting.key.rsplit('.').next().unwrap_or_default();
            problem.message.contains(&format!("\"{last}\""))
        };
        let candidates: Vec<&Setting> = settings.iter().rev().filter(meant).collect();
        let setting = candidates.iter().copied().find(named).or(candidates.first().copied());
        match setting.filter(|_| problem.file == "--set") {
            Some(setting) => {
                let message = format!("{scene}: {}: {}", problem.path, problem.message);
                self.document.report(&setting.place, message, problem.expected);
            }
            None => self.document.add(problem),
        }
    }

    /// Reports columns that are measured but that the history of a scene will not have.
    fn columns(&mut self, measures: &[Measure], scene: &Scene, file: &str) {
        let mut known: Vec<String> = ["step", "load_factor", "step_size", "newton_iterations"]
            .map(str::to_owned)
            .into();
        known.extend(
            scene
                .output
                .history
                .iter()
                .flat_map(|column| column.column_names(scene.kinematics)),
        );
        for measure in measures {
            for column in measure.history_columns() {
                let hint = did_you_mean(nearest(column, known.iter().map(String::as_str)));
                let message = format!("the history of {file} has no column \"{column}\"{hint}");
                let path = KeyPath::root().key("measure").index(measure.entry);
                self.require(
                    known.iter().any(|name| name == column),
                    &path,
                    message,
                    known.join(", "),
                );
            }
        }
    }
}

fn variant(keys: &VariantKeys, path: &KeyPath) -> Choice {
    Choice {
        label: keys.label.clone(),
        line: keys.line.clone(),
        scene: keys.scene.clone().map(|scene| (scene, path.key("scene"))),
        settings: settings(&keys.set, &path.key("set")),
        ranks: keys.ranks,
    }
}

fn settings(set: &Settings, path: &KeyPath) -> Vec<Setting> {
    let setting = |(key, text): (&String, &crate::config::FlowText)| Setting {
        key: key.clone(),
        text: text.0.clone(),
        place: path.key(key),
    };
    set.iter().map(setting).collect()
}

/// Every way to take one of each list, the last list changing fastest.
fn combinations(choices: &[Vec<Choice>]) -> Vec<Vec<&Choice>> {
    choices.iter().fold(vec![Vec::new()], |combinations, choices| {
        let extended = |combination: Vec<_>| {
            choices.iter().map(move |choice| {
                let mut longer = combination.clone();
                longer.push(choice);
                longer
            })
        };
        combinations.into_iter().flat_map(extended).collect()
    })
}

/// Name of the folder of a run: it depends on nothing but what the run is, so that a study can grow.
fn run_name(parameters: &[String], choices: &[&Choice], ranks: Option<usize>) -> String {
    let part = |(parameter, choice): (&String, &&Choice)| {
        let short = parameter.rsplit('.').next().unwrap_or(parameter);
        format!("{}-{}", slug(short), slug(&choice.label))
    };
    let mut parts: Vec<String> = parameters.iter().zip(choices).map(part).collect();
    parts.extend(ranks.map(|ranks| format!("ranks-{ranks}")));
    if parts.is_empty() {
        "scene".to_owned()
    } else {
        parts.join("_")
    }
}

/// A text as part of the name of a folder.
fn slug(text: &str) -> String {
    let kept = |letter: char| {
        if letter.is_ascii_alphanumeric() || ".-+".contains(letter) {
            letter
        } else {
            ' '
        }
    };
    let words: String = text.chars().map(kept).collect();
    words.split_whitespace().collect::<Vec<_>>().join("-")
}

fn cell_size(scene: &Scene) -> Option<f64> {
    if scene.is_on_a_mesh() {
        return None;
    }
    let dimension = scene.kinematics.dimension();
    let volume: f64 = scene.grid.cell_size[..dimension].iter().product();
    Some(volume.powf(1.0 / dimension as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(label: &str) -> Choice {
        Choice {
            label: label.to_owned(),
            ..Choice::default()
        }
    }

    #[test]
    fn combinations_are_a_product_with_the_last_changing_fastest() {
        let choices = [
            vec![choice("a"), choice("b")],
            vec![choice("1"), choice("2"), choice("3")],
        ];
        let labels: Vec<String> = combinations(&choices)
            .iter()
            .map(|combination| combination.iter().map(|choice| choice.label.as_str()).collect())
            .collect();
        assert_eq!(labels, ["a1", "a2", "a3", "b1", "b2", "b3"]);
        assert_eq!(combinations(&[]).len(), 1, "nothing varied: the scene alone");
        assert!(combinations(&[Vec::new()]).is_empty());
    }

    #[test]
    fn folders_have_names_that_any_file_system_takes() {
        let choices = [choice("[5, 9]"), choice("GIMP / even")];
        let choices: Vec<&Choice> = choices.iter().collect();
        let parameters = ["grid.cells".to_owned(), "basis".to_owned()];
        assert_eq!(
            run_name(&parameters, &choices, Some(2)),
            "cells-5-9_basis-GIMP-even_ranks-2"
        );
        assert_eq!(run_name(&[], &[], None), "scene");
    }
}
