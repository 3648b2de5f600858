//! What a user may type in a study: its keys. `plan` decides what makes sense.

use crate::config::FlowText;
use crate::config::file::OneOrPerAxis;
use serde::Deserialize;
use std::collections::BTreeMap;

/// One value, or a list of them.
pub type OneOrSeveral<T> = OneOrPerAxis<T>;

/// Keys of a scene, as `grid.cells` or `bodies.0.points_per_cell`, with the values they get.
pub type Settings = BTreeMap<String, FlowText>;

/// A study.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// What the study is about; heads its page.
    #[serde(default)]
    pub title: String,
    /// The scene that is varied: a file, named relative to the study.
    pub scene: String,
    /// Result folder, relative to where the program is started; `results/NAME_OF_THE_FILE` unless set.
    pub output: Option<String>,
    /// Keys that every run sets.
    #[serde(default)]
    pub set: Settings,
    /// What is varied. Every combination of the entries is run; none: the scene alone.
    #[serde(default)]
    pub vary: Vec<VaryKeys>,
    /// Numbers of ranks; every combination is run on each. 1 unless set.
    pub ranks: Option<OneOrSeveral<usize>>,
    /// What the measures of the runs are compared with.
    pub reference: Option<ReferenceKeys>,
    /// What is read from the results of each run.
    #[serde(default)]
    pub measure: Vec<MeasureKeys>,
    /// Which runs belong on one line of a chart.
    #[serde(default)]
    pub charts: ChartKeys,
    /// Words that start a program on several ranks, `{ranks}` standing for their number;
    /// `[mpirun, --quiet, --bind-to, none, -n, "{ranks}"]` unless set.
    pub launcher: Option<Vec<String>>,
    /// For `--slurm`.
    #[serde(default)]
    pub slurm: SlurmKeys,
}

/// Something that is varied: a `key` with `values`, or `variants`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VaryKeys {
    /// Name in the table and the charts; the key unless set.
    pub name: Option<String>,
    /// A key of the scene, as `grid.cells`.
    pub key: Option<String>,
    /// The values that the key gets, at least one.
    pub values: Option<Vec<FlowText>>,
    /// Named sets of keys, at least one.
    pub variants: Option<Vec<VariantKeys>>,
}

/// Keys that change together.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VariantKeys {
    /// Name in the table and the charts.
    pub label: String,
    /// Name of the line that it belongs to in charts, where several lines lead through the variants.
    pub line: Option<String>,
    /// A scene of its own instead of the study's, named relative to the study.
    pub scene: Option<String>,
    /// Keys that it sets.
    #[serde(default)]
    pub set: Settings,
    /// Number of ranks of these runs, instead of the study's `ranks`.
    pub ranks: Option<usize>,
}

/// What to compare with: exactly one of the keys.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceKeys {
    /// One more run, whose measures count as exact.
    pub run: Option<ReferenceRunKeys>,
    /// Values by the name of the measure; a list where the measure has several columns.
    pub values: Option<BTreeMap<String, OneOrSeveral<f64>>>,
    /// A table (`.csv`, columns like those of `history.csv`), named relative to the study.
    pub file: Option<String>,
}

/// The run that counts as exact.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceRunKeys {
    /// A scene of its own instead of the study's, named relative to the study.
    pub scene: Option<String>,
    /// Keys that it sets, besides those of every run.
    #[serde(default)]
    pub set: Settings,
    /// Number of ranks; 1 unless set.
    pub ranks: Option<usize>,
}

/// Something that is measured: a `name`, and exactly one of the other keys.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureKeys {
    /// Name in the table and the charts.
    pub name: String,
    /// The last value of a column of the history; a list of columns counts as one vector.
    pub last: Option<OneOrSeveral<String>>,
    /// The largest value of a column of the history.
    pub max: Option<String>,
    /// The smallest value of a column of the history.
    pub min: Option<String>,
    /// A column of the history where another one first reaches a value.
    pub at: Option<AtKeys>,
    /// How far a curve of the history is from that of the reference; an error by itself.
    pub distance: Option<DistanceKeys>,
    /// A number of `summary.json`, as `nonzeros` or `phases.solve`.
    pub summary: Option<String>,
    /// A number of `summary.json` that is an error by itself, as `error_u`.
    pub error: Option<String>,
}

/// A column of the history where another one first reaches a value.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AtKeys {
    /// The column that is read, or several that count as one vector.
    pub column: OneOrSeveral<String>,
    /// The column that is looked up.
    pub when: String,
    /// The value that it reaches; between two rows, both columns are taken as straight.
    pub equals: f64,
}

/// A curve of the history: sqrt(integral of (y - reference)^2 dx / integral of reference^2 dx) over the common range.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DistanceKeys {
    /// Column along the curve; it may not turn back.
    pub x: String,
    /// Column of the values.
    pub y: String,
}

/// Which runs belong on one line of a chart.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChartKeys {
    /// Name of the entry of `vary` whose runs are joined by a line; the first unless set.
    pub along: Option<String>,
    /// Whether the work stays when ranks are added, or grows with them.
    #[serde(default)]
    pub scaling: ScalingName,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScalingName {
    /// The same work on more ranks.
    #[default]
    Strong,
    /// Work that grows with the ranks.
    Weak,
}

/// For the batch script of Slurm.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlurmKeys {
    /// Time limit of one run, as Slurm writes it; `01:00:00` unless set.
    pub time: Option<String>,
    /// More options of sbatch, as `--account=name`.
    #[serde(default)]
    pub options: Vec<String>,
    /// Lines of shell before the run, as `module load openmpi`.
    #[serde(default)]
    pub before: Vec<String>,
}
