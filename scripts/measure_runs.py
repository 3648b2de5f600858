#!/usr/bin/env python3
"""Runs scenes repeatedly and prints processor time, wall time, memory and the split into phases.

Processor time is user plus system time of mpirun and all ranks as the kernel counts it, waiting in MPI included.
Usage: measure_runs.py PROGRAM REPEATS SCENE:RANKS ..; scripts/bench.sh calls it.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def measure(program, scene, ranks):
    """One run: (numbers by name, wall seconds by phase)."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["mpirun", "--quiet", "-n", str(ranks)] if ranks > 1 else []
        begin = time.monotonic()
        process = subprocess.Popen([*command, program, scene, "--output", folder, "--quiet"])
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.monotonic() - begin
        code = os.waitstatus_to_exitcode(status)
        if code != 0:
            sys.exit(f"{scene} on {ranks} ranks ended with exit code {code}")
        summary = json.loads(Path(folder, "summary.json").read_text())
    numbers = {
        "processor time [s]": usage.ru_utime + usage.ru_stime,
        "wall time [s]": wall,
        "memory, all ranks [MiB]": sum(summary["peak_memory_mb"]),
        "Newton iterations": summary["newton_iterations"],
    }
    return numbers, summary["phases"]


def print_table(rows):
    print(f"  {'':<26}{'min':>12}{'median':>12}{'max':>12}")
    for name in rows[0]:
        values = [row[name] for row in rows]
        print(f"  {name:<26}{min(values):>12.3f}{statistics.median(values):>12.3f}{max(values):>12.3f}")


def main():
    program, repeats, scenes = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    for entry in scenes:
        scene, _, ranks = entry.rpartition(":")
        if not scene or not ranks.isdigit():
            sys.exit(f"{entry}: a scene is given as FILE:RANKS")
        runs = [measure(program, scene, int(ranks)) for _ in range(repeats)]
        print(f"{scene}, ranks {ranks}, {repeats} runs")
        print_table([numbers for numbers, _ in runs])
        print_table([{f"phase {name} [s]": seconds for name, seconds in phases.items()} for _, phases in runs])


if __name__ == "__main__":
    main()
