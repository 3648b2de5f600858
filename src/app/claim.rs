//! Whether a run may write its result folder: nobody else writes it, and no results are lost.

use super::checkpoint;
use crate::config::{Change, changes_of_scene, read_back};
use crate::error::Error;
use crate::file;
use crate::output::checkpoint::no_checkpoint;
use crate::output::folder::results_in;
use crate::output::lock::{FolderLock, Writer};
use crate::parallel::World;
use crate::scene::OutputSettings;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Longest text of an earlier run that is looked at [byte].
const LONGEST: u64 = 1 << 30;

/// What a run does with results that lie in its folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intent {
    /// Begins where nothing is lost.
    Begin,
    /// Begins, whatever it replaces.
    Overwrite,
    /// Goes on from the checkpoint.
    Restart,
}

/// The right of this run to write its folder, which no other run has while it lives.
#[derive(Debug)]
pub struct Claim {
    /// On the root.
    _lock: Option<FolderLock>,
    /// What the user should know, a line each; on the root.
    pub notes: Vec<String>,
}

impl Claim {
    /// Collective. Locks the result folder, and looks at what lies there.
    ///
    /// # Errors
    /// The same on every rank: another run writes the folder, or results would be lost; there is no checkpoint to go on
    /// from.
    pub fn take(world: &World, output: &OutputSettings, intent: Intent) -> Result<Self, Error> {
        let own = if world.is_root() {
            take_alone(output, intent)
        } else {
            Ok((None, Vec::new()))
        };
        let (lock, notes) = as_on_the_root(world, own)?;
        Ok(Claim { _lock: lock, notes })
    }
}

/// What the root found, on every rank.
#[derive(Serialize, Deserialize)]
enum Verdict {
    Granted,
    Refused(String),
    Failed(String),
}

/// Collective. Makes a failure of the root one of every rank, of the same kind.
fn as_on_the_root<T>(world: &World, own: Result<T, Error>) -> Result<T, Error> {
    let verdict = match &own {
        Ok(_) => Verdict::Granted,
        Err(Error::Command(message)) => Verdict::Refused(message.clone()),
        Err(error) => Verdict::Failed(error.to_string()),
    };
    let text = serde_json::to_string(&verdict).expect("texts can be written");
    let verdict = serde_json::from_str(&world.broadcast_text(&text));
    match verdict.expect("what was just written can be read") {
        Verdict::Granted => own,
        Verdict::Refused(message) => Err(Error::Command(message)),
        Verdict::Failed(message) => Err(Error::System(message)),
    }
}

fn take_alone(output: &OutputSettings, intent: Intent) -> Result<(Option<FolderLock>, Vec<String>), Error> {
    let folder = &output.directory;
    let checkpoint = checkpoint::path_in(folder);
    let missing = || Error::System(no_checkpoint(&checkpoint));
    if intent == Intent::Restart && !folder.exists() {
        return Err(missing());
    }
    let lock = FolderLock::take(folder, Writer::Run)?;
    if intent == Intent::Restart && !checkpoint.exists() {
        return Err(missing());
    }
    let mut notes: Vec<String> = lock
        .warning()
        .map(|text| format!("warning: {text}"))
        .into_iter()
        .collect();
    if intent != Intent::Restart
        && let Some(earlier) = Earlier::find(folder, &output.resolved)
    {
        notes.push(earlier.make_room(folder, intent)?);
    }
    Ok((Some(lock), notes))
}

/// What an earlier run left in a folder.
struct Earlier {
    title: String,
    /// `status` of its summary; none where it left no word of its end.
    status: Option<String>,
    /// Accepted steps.
    steps: Option<u64>,
    has_checkpoint: bool,
    /// What makes its scene another one; `None` where its configuration cannot be read.
    changes: Option<Vec<Change>>,
}

impl Earlier {
    fn find(folder: &Path, configuration: &str) -> Option<Self> {
        if results_in(folder).is_empty() {
            return None;
        }
        let before = text_of(folder, "config.yaml").and_then(|text| read_back(&text));
        let now = read_back(configuration);
        let mut changes = before
            .as_ref()
            .zip(now.as_ref())
            .map(|(before, now)| changes_of_scene(before, now));
        if let (Some(changes), Some(now)) = (&mut changes, &now) {
            changes.extend(newer_files(folder, now));
        }
        let summary: Value = text_of(folder, "summary.json")
            .and_then(|text| serde_json::from_str(&text).ok())
            .unwrap_or_default();
        let title = before.as_ref().and_then(|before| before["title"].as_str());
        Some(Earlier {
            title: title.unwrap_or_default().to_owned(),
            status: summary["status"].as_str().map(str::to_owned),
            steps: summary["steps"]
                .as_u64()
                .or_else(|| rows(&text_of(folder, "history.csv")?)),
            has_checkpoint: checkpoint::path_in(folder).exists(),
            changes,
        })
    }

    fn is_of_this_scene(&self) -> bool {
        self.changes.as_ref().is_some_and(Vec::is_empty)
    }

    fn has_completed(&self) -> bool {
        self.status.as_deref() == Some("completed")
    }

    /// A line that says what is replaced.
    ///
    /// # Errors
    /// More would be lost than running the scene once more gives back.
    fn make_room(&self, folder: &Path, intent: Intent) -> Result<String, Error> {
        let spent = self.has_completed() || !self.has_checkpoint;
        if intent == Intent::Overwrite || self.is_of_this_scene() && spent {
            let which = if self.is_of_this_scene() {
                "this scene"
            } else {
                "another scene"
            };
            return Ok(format!(
                "replaces a run of {which} in {}: {}",
                folder.display(),
                self.describe()
            ));
        }
        Err(Error::Command(self.refusal(folder)))
    }

    fn refusal(&self, folder: &Path) -> String {
        let (folder, what) = (folder.display(), self.describe());
        let ways = "another folder with --output DIR, or --overwrite to replace it";
        if self.is_of_this_scene() {
            return format!(
                "{folder} holds a run of this scene that is not at its end: {what}; accepted: --restart to go on with it, {ways}"
            );
        }
        let difference = match self.changes.as_deref() {
            None => "its config.yaml is missing or cannot be read".to_owned(),
            Some([]) => String::new(),
            Some([first, rest @ ..]) => {
                let more = match rest.len() {
                    0 => String::new(),
                    count => format!(" (and {count} more)"),
                };
                format!("{} was {}, and is {} now{more}", first.path, first.before, first.now)
            }
        };
        let restart = if self.has_checkpoint && !self.has_completed() {
            "; --restart with the scene as it was goes on with it"
        } else {
            ""
        };
        format!("{folder} holds results of another scene: {what}; {difference}; accepted: {ways}{restart}")
    }

    /// Title, end and steps.
    fn describe(&self) -> String {
        let end = match self.status.as_deref() {
            Some("completed") => "completed",
            Some("stopped") => "stopped without equilibrium",
            Some("interrupted") => "interrupted by a signal",
            Some(_) => "failed",
            None => "ended without a word, as when it is killed",
        };
        let steps = self
            .steps
            .map_or(String::new(), |steps| format!(" after {steps} steps"));
        let checkpoint = match self.has_checkpoint && !self.has_completed() {
            true => ", with a checkpoint",
            false => "",
        };
        format!("\"{}\", {end}{steps}{checkpoint}", self.title)
    }
}

fn text_of(folder: &Path, name: &str) -> Option<String> {
    file::read_text(&folder.join(name), LONGEST).ok()
}

/// Rows of a history without that of the initial state.
fn rows(history: &str) -> Option<u64> {
    (history.lines().count() as u64).checked_sub(2)
}

/// Files with points that were changed since the earlier run began.
fn newer_files(folder: &Path, configuration: &Value) -> Vec<Change> {
    let modified = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    let begun = modified(&folder.join("config.yaml"));
    let bodies = configuration["bodies"].as_array();
    let names = bodies
        .into_iter()
        .flatten()
        .filter_map(|body| body["shape"]["points"]["file"].as_str());
    let newer = names.filter(|name| modified(Path::new(name)) > begun);
    let change = |name: &str| Change {
        path: name.to_owned(),
        before: "older than the results".to_owned(),
        now: "newer".to_owned(),
    };
    newer.map(change).collect()
}
