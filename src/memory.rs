//! Memory that this process may still take, as its system tells.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use rustix::process::{Resource, getrlimit};

/// Where control groups are mounted.
const GROUPS: &str = "/sys/fs/cgroup";

/// What sets a bound to the memory of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    Machine,
    /// Of a container or a job.
    Group,
    AddressSpace,
}

impl fmt::Display for Bound {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Bound::Machine => "free memory of the machine",
            Bound::Group => "memory limit of the container or job",
            Bound::AddressSpace => "limit of the address space, ulimit -v",
        })
    }
}

/// Bytes that this process may still take, and what bounds them; `sharers` processes like it share the machine. `None` where
/// the system does not tell.
pub fn available(sharers: usize) -> Option<(u64, Bound)> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let machine = read("/proc/meminfo");
    let shared = |free: u64| free / sharers.max(1) as u64;
    let free = kibibytes(&machine, "MemAvailable:").map(|free| free + kibibytes(&machine, "SwapFree:").unwrap_or(0));
    let address_space = getrlimit(Resource::As).current;
    let bounds = [
        (free.map(shared), Bound::Machine),
        (
            group_free(&read("/proc/self/cgroup"), Path::new(GROUPS)).map(shared),
            Bound::Group,
        ),
        (
            address_space.map(|most| most.saturating_sub(taken())),
            Bound::AddressSpace,
        ),
    ];
    let known = bounds.into_iter().filter_map(|(free, bound)| Some((free?, bound)));
    known.min_by_key(|&(free, _)| free)
}

/// Bytes of addresses that this process has taken, libraries included.
pub fn taken() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    kibibytes(&status, "VmSize:").unwrap_or(0)
}

/// The value of a line `NAME value kB` in bytes.
fn kibibytes(table: &str, name: &str) -> Option<u64> {
    let line = table.lines().find_map(|line| line.strip_prefix(name))?;
    let number: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(number * 1024)
}

/// Bytes that the control groups of this process leave, those above them included: each may have a limit.
fn group_free(membership: &str, mount: &Path) -> Option<u64> {
    let free = membership.lines().flat_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next().unwrap_or(""), parts.next().unwrap_or("/"));
        let first = controllers.split(',').any(|name| name == "memory");
        let (root, files) = if first {
            (mount.join("memory"), FIRST_VERSION)
        } else if controllers.is_empty() {
            (mount.to_path_buf(), SECOND_VERSION)
        } else {
            return Vec::new();
        };
        let own = PathBuf::from(path.trim_start_matches('/'));
        own.ancestors()
            .filter_map(|group| free_of(&root.join(group), &files))
            .collect()
    });
    free.min()
}

/// Files of a group: its limit, what it uses, and the name of the line of `memory.stat` with pages that can be had back.
type Files = [&'static str; 3];

const FIRST_VERSION: Files = ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"];

const SECOND_VERSION: Files = ["memory.max", "memory.current", "inactive_file"];

fn free_of(group: &Path, [limit, usage, reclaimable]: &Files) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    let statistics = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
    let reclaimable = statistics
        .lines()
        .filter_map(|line| line.split_once(' '))
        .find(|(name, _)| name == reclaimable)
        .and_then(|(_, value)| value.trim().parse().ok())
        .unwrap_or(0);
    let used = number(usage)?.saturating_sub(reclaimable);
    Some(number(limit)?.saturating_sub(used))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_machine_tells_what_it_has() {
        let (alone, _) = available(1).expect("Linux tells");
        assert!((1 << 20..1 << 50).contains(&alone), "{alone}");
        assert!(available(1000).expect("Linux tells").0 < alone);
    }

    #[test]
    fn lines_of_tables_are_found_by_name() {
        let table = "MemTotal:  20 kB\nMemAvailable:      7 kB\nHugePages_Total:  3\n";
        assert_eq!(kibibytes(table, "MemAvailable:"), Some(7 * 1024));
        assert_eq!(kibibytes(table, "HugePages_Total:"), None);
        assert_eq!(kibibytes(table, "SwapFree:"), None);
    }

    #[test]
    fn the_tightest_group_counts_in_both_versions() {
        let mount = std::env::temp_dir().join(format!("mpm-petsc-groups-{}", std::process::id()));
        let write = |group: &str, files: &[(&str, &str)]| {
            fs::create_dir_all(mount.join(group)).unwrap();
            for (name, text) in files {
                fs::write(mount.join(group).join(name), text).unwrap();
            }
        };
        // Of the second version the root has no limit, a job has one, and its step has none.
        write("slurm/job", &[("memory.max", "1000\n"), ("memory.current", "700\n")]);
        write("slurm/job", &[("memory.stat", "anon 500\ninactive_file 100\n")]);
        write(
            "slurm/job/step",
            &[("memory.max", "max\n"), ("memory.current", "700\n")],
        );
        assert_eq!(group_free("0::/slurm/job/step\n", &mount), Some(400));
        assert_eq!(group_free("0::/elsewhere\n", &mount), None);
        let limits = [("memory.limit_in_bytes", "900\n"), ("memory.usage_in_bytes", "850\n")];
        write("memory/box", &limits);
        let membership = "5:devices:/\n4:memory,other:/box\n0::/slurm/job\n";
        assert_eq!(group_free(membership, &mount), Some(50));
        fs::remove_dir_all(&mount).unwrap();
    }
}
