#!/usr/bin/env python3
"""Runs the examples and writes docs/verification.md and its pictures from the results.

Usage: verify.py PROGRAM [--quick] [--study] [--reuse] [--only SECTION ..]; scripts/verify.sh calls it.
The examples and what is expected of them stand in scripts/verification/cases.py.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

from verification import page, pictures
from verification.cases import SECTIONS
from verification.runs import ROOT, Run, has_current_results, has_results, run_scene

# Numbers of the last run of every section, for those that are not run this time.
KEPT = ROOT / "scripts" / "verification" / "kept.json"


def commit_of(program):
    """Commit of which the program was built, as it writes it into its summaries."""
    shown = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    return next((word.strip("(),") for word in shown.split() if len(word.strip("(),")) == 12), "")


def is_wanted(section, options):
    """Whether the scenes of a section are to be run this time."""
    if options.only:
        return section.name in options.only
    if any(scene.startswith("study/") for scene in section.scenes):
        return options.study
    return section.quick or not options.quick


def evaluate(section):
    """The numbers of a section from the results of its scenes; its pictures are drawn."""
    runs = {scene: Run(scene) for scene in section.scenes}
    for picture in section.pictures:
        pictures.save(picture, runs)
    return {
        "rows": [check.row(runs) for check in section.checks],
        "runs": [run.facts() for run in runs.values()],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--quick", action="store_true", help="only examples of a few seconds")
    parser.add_argument("--study", action="store_true", help="the long scenes too")
    parser.add_argument("--reuse", action="store_true", help="keep results of unchanged scenes and program")
    parser.add_argument("--only", nargs="+", choices=[section.name for section in SECTIONS], metavar="SECTION")
    options = parser.parse_args()

    commit = commit_of(options.program)
    fresh = set()
    for section in (section for section in SECTIONS if is_wanted(section, options)):
        for scene in section.scenes:
            if scene not in fresh and not (options.reuse and has_current_results(scene, commit)):
                run_scene(options.program, scene, section.ranks)
            fresh.add(scene)

    kept = json.loads(KEPT.read_text()) if KEPT.is_file() else {}
    for section in SECTIONS:
        if all(has_results(scene) for scene in section.scenes):
            kept[section.name] = evaluate(section)
    KEPT.write_text(json.dumps(kept, indent=1) + "\n")
    unexplained = page.write(SECTIONS, kept)
    for line in unexplained:
        print(f"outside its tolerance: {line}", file=sys.stderr)
    sys.exit(1 if unexplained else 0)


if __name__ == "__main__":
    main()
