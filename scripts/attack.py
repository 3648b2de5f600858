#!/usr/bin/env python3
"""Attacks the program with wrong, damaged and hostile input, and counts what it survives.

Usage: attack.py [PROGRAM] [--long] [--seed N] [--only KIND ..] [--table FILE]
  PROGRAM   the program; that of `cargo build` unless given, whose debug assertions find more
  --long    ten times as many attacks: half an hour and more instead of a few minutes
  --seed    another sequence of random attacks; the same seed gives the same attacks
  --only    only these kinds, by the names in the table
  --table   write the table of counts, in Markdown, into this file

Survived means: exit code 0 to 4 (and one of those that the attack may have), no panic, no signal, no trace of Rust, PETSc
or Open MPI, a message that starts with "error:" wherever the code is not 0, none that is there twice, the end within a
limit of time, and no history with a number that is not finite. It ends with exit code 1 where an attack was not survived;
each of those is printed with its input, and its folder is kept. Environment: scripts/environment.sh.
"""

import argparse
import os
import random
import sys
import time
from pathlib import Path

from attacks import machine, texts
from attacks.inputs import ROOT
from attacks.program import Bench

KINDS = {**texts.KINDS, **machine.KINDS}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, nargs="?", default=ROOT / "target" / "debug" / "mpm-petsc")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=sorted(KINDS), metavar="KIND")
    parser.add_argument("--table", type=Path)
    return parser.parse_args()


def table(counts):
    """The counts in Markdown."""
    lines = ["| kind | tried | survived |", "|---|---|---|"]
    lines += [f"| {name} | {tried} | {survived} |" for name, (tried, survived) in counts.items()]
    tried, survived = (sum(column) for column in zip(*counts.values()))
    return "\n".join([*lines, f"| all | {tried} | {survived} |"]) + "\n"


def main():
    options = arguments()
    factor = 10 if options.long else 1
    counts = {}
    for name in options.only or KINDS:
        bench = Bench(options.program.resolve(), name)
        begin = time.monotonic()
        # Each kind has its own sequence, so that --only repeats what it does among the others.
        KINDS[name](bench, random.Random(f"{options.seed} {name}"), factor)
        counts[name] = (bench.tried, bench.tried - bench.failed)
        bench.leave()
        print(f"{name}: {bench.tried} tried, {bench.failed} not survived, {time.monotonic() - begin:.0f} s", flush=True)
    print(table(counts), end="")
    if options.table:
        options.table.write_text(table(counts))
    sys.exit(any(tried != survived for tried, survived in counts.values()))


if __name__ == "__main__":
    os.environ.pop("PETSC_OPTIONS", None)
    main()
