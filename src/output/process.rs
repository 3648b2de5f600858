//! What this process has used so far.

use std::fs;

use rustix::time::{ClockId, clock_gettime};

/// Processor time of this process in user and system mode, all threads [s].
pub fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Largest resident memory of this process so far [MiB]; `None` where the system does not tell.
pub fn peak_memory_mb() -> Option<f64> {
    peak_in(&fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_in(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_grows_with_work() {
        let before = cpu_seconds();
        let mut sum = 0.0_f64;
        while cpu_seconds() - before < 0.02 {
            sum = std::hint::black_box(sum + 1.0).sqrt();
        }
        assert!(cpu_seconds() >= before + 0.02 && sum.is_finite());
    }

    #[test]
    fn peak_memory_is_read_from_the_status_of_the_process() {
        assert_eq!(peak_in("Name:\tmpm\nVmPeak:\t  9 kB\nVmHWM:\t    2048 kB\n"), Some(2.0));
        assert_eq!(peak_in("Name:\tmpm\n"), None);
        let block = std::hint::black_box(vec![1_u8; 64 << 20]);
        assert!(peak_memory_mb().unwrap() >= 64.0, "{}", block.len());
    }
}
