//! Thousands of mutated configurations: each is accepted or refused with a reason, without a panic, within a second or so.

use mpm_petsc::config::Input;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

const MUTATIONS: usize = 4000;

/// A configuration of a few kilobytes takes milliseconds; a machine that is busy takes longer.
const LIMIT: Duration = Duration::from_secs(20);

/// A generator of numbers that need not be good, only the same every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % bound.max(1)
    }
}

fn yaml_files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(folder).expect("a folder of configurations");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "yaml"));
    files.sort();
    files
}

/// Good configurations, without their comments.
fn samples() -> Vec<String> {
    let files = ["configs", "configs/templates", "tests/good_input"]
        .into_iter()
        .flat_map(yaml_files);
    let mut samples: Vec<String> = files
        .map(|path| {
            let text = std::fs::read_to_string(path).expect("a readable configuration");
            text.lines()
                .filter(|line| !line.starts_with('#'))
                .map(|line| format!("{line}\n"))
                .collect()
        })
        .collect();
    let path = "path: {material: m, kinematics: plane_strain, steps: 3, deformation_gradient: [[1, 0.1], [0, 1]], rotation: 0.2}";
    samples.push(format!(
        "materials: {{m: {{law: elastic, youngs_modulus: 1.0, poisson_ratio: 0.2}}}}\n{path}\n"
    ));
    samples
}

const NUMBERS: [&str; 14] = [
    "0",
    "-0.0",
    "-1",
    "1e308",
    "1e-308",
    "1e400",
    "-5e-324",
    ".nan",
    ".inf",
    "0x10",
    "4294967295",
    "4294967296",
    "18446744073709551616",
    "1_000",
];

/// Where tokens begin and end: words, numbers and single marks.
fn tokens(text: &str) -> Vec<&str> {
    text.split_inclusive([' ', ',', ':', '{', '}', '[', ']', '\n'])
        .collect()
}

/// One mutation of the text by tokens or lines.
fn mutate(text: &str, other: &str, numbers: &mut Numbers) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let line = numbers.below(lines.len());
    let mut parts: Vec<String> = tokens(text).into_iter().map(str::to_owned).collect();
    let part = numbers.below(parts.len());
    match numbers.below(13) {
        0 => drop(lines.remove(line)),
        1 => lines.insert(line, lines[line].clone()),
        2 => {
            let second = numbers.below(lines.len());
            lines.swap(line, second);
        }
        3 => lines[line].insert_str(0, &" ".repeat(1 + numbers.below(5))),
        4 => lines[line] = lines[line].trim_start().to_owned(),
        5 => lines[line].insert(0, '\t'),
        6 => drop(parts.remove(part)),
        7 => parts.insert(part, parts[part].clone()),
        8 => {
            let foreign = tokens(other);
            parts[part] = foreign[numbers.below(foreign.len())].to_owned();
        }
        9 => {
            // A number, most likely in the place of a number.
            let begins_number = |text: &String| text.starts_with(|letter: char| letter.is_ascii_digit());
            let at = parts[part..]
                .iter()
                .position(begins_number)
                .map_or(part, |found| part + found);
            let ending: String = parts[at].chars().filter(|letter| " ,}]\n".contains(*letter)).collect();
            parts[at] = NUMBERS[numbers.below(NUMBERS.len())].to_owned() + &ending;
        }
        10 => {
            let depth = 1 + numbers.below(3000);
            parts[part] = ["[", "{a: ", "- "][numbers.below(3)].repeat(depth) + "\n";
        }
        11 => parts.insert(
            part,
            ["&a ", "*a ", "<<: *a\n", "!!map ", "? ", "| \n"][numbers.below(6)].to_owned(),
        ),
        _ => {
            let letters = numbers.below(text.len());
            return text.chars().take(letters).collect();
        }
    }
    let (by_lines, by_parts) = (lines.join("\n") + "\n", parts.concat());
    if by_parts == text { by_lines } else { by_parts }
}

/// Reads a text as a scene and as a path; what is wrong with how that ended.
fn read(text: &str) -> Result<bool, String> {
    let input = Input::from_text("configs/a.yaml", text, &[]);
    let outcome = catch_unwind(AssertUnwindSafe(|| (input.scene().map(drop), input.point().map(drop))));
    let (scene, path) = outcome.map_err(|_| "it panics".to_owned())?;
    for result in [&scene, &path] {
        if let Err(problems) = result
            && (problems.is_empty()
                || problems.len() > 250
                || problems.iter().any(|problem| problem.message.is_empty()))
        {
            return Err(format!("refused with {} reasons", problems.len()));
        }
    }
    Ok(scene.is_ok() || path.is_ok())
}

/// What the worker is about to read, then how it went.
enum Message {
    Begin(String),
    End(Result<bool, String>),
}

fn work(sender: &Sender<Message>) {
    let samples = samples();
    let mut numbers = Numbers(20_261_122);
    for round in 0..MUTATIONS {
        let other = samples[numbers.below(samples.len())].clone();
        let mut text = samples[round % samples.len()].clone();
        for _ in 0..=numbers.below(3) {
            text = mutate(&text, &other, &mut numbers);
            if text.trim().is_empty() {
                break;
            }
        }
        let _ = sender.send(Message::Begin(text.clone()));
        let _ = sender.send(Message::End(read(&text)));
    }
}

#[test]
fn mutated_configurations_are_accepted_or_refused_in_time() {
    let (sender, receiver) = channel();
    let worker = std::thread::Builder::new()
        .stack_size(2 << 20)
        .spawn(move || work(&sender))
        .expect("a thread");
    let (mut accepted, mut refused, mut current) = (0, 0, String::new());
    loop {
        match receiver.recv_timeout(LIMIT) {
            Ok(Message::Begin(text)) => current = text,
            Ok(Message::End(Ok(true))) => accepted += 1,
            Ok(Message::End(Ok(false))) => refused += 1,
            Ok(Message::End(Err(what))) => panic!("{what}:\n{current}"),
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => break,
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => panic!("no answer in {LIMIT:?}:\n{current}"),
        }
    }
    worker.join().expect("the worker ends");
    assert_eq!(accepted + refused, MUTATIONS);
    assert!(
        accepted > MUTATIONS / 50 && refused > MUTATIONS / 4,
        "{accepted} accepted, {refused} refused"
    );
}

/// Any bytes may stand in a file: what is no text is refused with its line.
#[test]
fn mutated_bytes_are_refused_with_their_line_or_read() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz");
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    let file = folder.join("bytes.yaml");
    let sample = samples().swap_remove(0);
    let mut numbers = Numbers(7);
    let mut no_text = 0;
    for _ in 0..500 {
        let mut bytes = sample.clone().into_bytes();
        for _ in 0..=numbers.below(4) {
            let at = numbers.below(bytes.len());
            bytes[at] = numbers.below(256) as u8;
        }
        std::fs::write(&file, &bytes).expect("the file can be written");
        match Input::from_disk(&file.to_string_lossy(), &[]) {
            Ok(input) => assert!(input.scene().err().is_none_or(|problems| !problems.is_empty())),
            Err(problems) => {
                assert!(problems[0].message.contains("is not UTF-8 text"), "{}", problems[0]);
                no_text += 1;
            }
        }
    }
    assert!((50..450).contains(&no_text), "{no_text}");
}
