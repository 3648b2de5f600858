//! A test runner for what needs MPI, which starts once per process: cases run one after the other.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs named cases in order and ends the process; the closing line counts them. With a word on the command line only
/// the cases whose name holds it run.
pub fn run(cases: &[(&str, &dyn Fn())]) -> ! {
    let filter: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let chosen = cases
        .iter()
        .filter(|(name, _)| filter.iter().all(|word| name.contains(word.as_str())));
    let (mut passed, mut failed) = (0, 0);
    for (name, case) in chosen {
        let ok = catch_unwind(AssertUnwindSafe(case)).is_ok();
        println!("test {name} ... {}", if ok { "ok" } else { "FAILED" });
        passed += usize::from(ok);
        failed += usize::from(!ok);
    }
    println!("\n{passed} passed, {failed} failed");
    std::process::exit(i32::from(failed > 0 || passed == 0));
}
