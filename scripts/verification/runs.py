"""Runs of scenes: starting them, and reading their results."""

import csv
import datetime
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results" / "verification"
SCENES = ROOT / "configs"
# Exit codes with which there are results: completed, stopped before the end.
WITH_RESULTS = (0, 3)

sys.path.insert(0, str(ROOT / "scripts"))
import plot_points  # noqa: E402  a script beside this folder


def path_of(scene):
    """File of a scene, which is named as under configs and without .yaml; overrides of its keys may follow, each after
    a blank."""
    return SCENES / f"{scene.split()[0]}.yaml"


def options_of(scene):
    """Options of the program for the overrides of a scene."""
    return [word for override in scene.split()[1:] for word in ("--set", override)]


def name_of(scene):
    """Name of a scene's results."""
    return re.sub(r"[^\w.]+", "_", " ".join([Path(scene.split()[0]).name, *scene.split()[1:]]))


def folder_of(scene):
    """Result folder of a scene."""
    return RESULTS / name_of(scene)


def scene_as_run(scene):
    """Copy of the scene beside its results, by which a changed scene is known."""
    return RESULTS / f"{name_of(scene)}.yaml"


def run_scene(program, scene, ranks):
    """Runs a scene; the results replace those of before."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    scene_as_run(scene).unlink(missing_ok=True)
    path = path_of(scene)
    launcher = ["mpirun", "--quiet", "-n", str(ranks)] if ranks > 1 else []
    command = [*launcher, str(program), str(path), "--output", str(folder_of(scene)), "--overwrite", "--quiet"]
    command += options_of(scene)
    print(f"{scene} on {ranks} rank{'s' if ranks > 1 else ''}", flush=True)
    code = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL).returncode
    if code not in WITH_RESULTS:
        sys.exit(f"{scene} ended with exit code {code}")
    scene_as_run(scene).write_bytes(path.read_bytes())


def has_results(scene):
    """Whether there are results of the scene as it is now, of whatever commit."""
    kept, path = scene_as_run(scene), path_of(scene)
    complete = kept.is_file() and (folder_of(scene) / "summary.json").is_file()
    return complete and kept.read_bytes() == path.read_bytes()


def has_current_results(scene, commit):
    """Whether there are results of the scene as it is now by the program as it is now."""
    return has_results(scene) and Run(scene).summary["versions"]["commit"] == commit


class Run:
    """Results of a scene."""

    def __init__(self, scene):
        self.scene = scene
        self.folder = folder_of(scene)
        self.summary = json.loads((self.folder / "summary.json").read_text())
        with open(self.folder / "history.csv", newline="") as file:
            self.rows = list(csv.DictReader(file))

    def __getitem__(self, column):
        """A column of the history."""
        return numpy.array([float(row[column]) for row in self.rows])

    def last(self, column):
        return self[column][-1]

    def at(self, column, abscissa, value):
        """A column where another one, which grows, has a value; between two steps by interpolation."""
        return numpy.interp(value, self[abscissa], self[column])

    def points(self, time=None):
        """Time, positions, fields and (positions, half-lengths) of the first of the snapshots nearest to a time."""
        return plot_points.read_snapshot(self.folder / "points.vtkhdf", time)

    def facts(self):
        """What the page says about the run itself."""
        summary = self.summary
        day = datetime.date.fromtimestamp((self.folder / "summary.json").stat().st_mtime)
        return {
            "scene": self.scene,
            "status": summary["status"],
            "exit_code": summary["exit_code"],
            "ranks": summary["ranks"],
            "points": summary["points"],
            "unknowns": summary["dofs"],
            "steps": summary["steps"],
            "newton_iterations": summary["newton_iterations"],
            "cpu_seconds": summary["cpu_seconds"],
            "memory_mb": summary["peak_memory_mb"],
            "commit": summary["versions"]["commit"],
            "date": day.isoformat(),
        }
