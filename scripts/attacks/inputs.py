"""Texts that attacks begin with, and how they are spoiled."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# A column under its own weight: three steps of a fraction of a second.
COLUMN = """\
title: column
model: {kinematics: plane_strain, continuum: micropolar}
grid: {min: [0.0, 0.0], max: [4.0, 4.0], cells: [4, 4], basis: gimp}
materials:
  m: {law: elastic, youngs_modulus: 1.0e6, poisson_ratio: 0.2, coupling_modulus: 1.0e5, bending_length: 0.1, bounded_stiffness: true, density: 2000.0}
bodies:
  - {name: b, material: m, shape: {box: {min: [0.0, 0.0], max: [4.0, 3.0]}}, points_per_cell: 2}
boundary:
  - {face: y_min, fix: [ux, uy, rz], name: base}
loads:
  - {name: w, specific_weight: [0.0, -1000.0]}
stages:
  - {name: s, steps: 3}
output:
  history:
    - {name: top, min: displacement}
    - {name: r, reaction: {boundary: base, component: uy}}
"""

# The same with points from a file.
CLOUD = COLUMN.replace("box: {min: [0.0, 0.0], max: [4.0, 3.0]}}, points_per_cell: 2", "points: {file: cloud.csv}}")

# A small plastic block in space, one element of each other part of a configuration.
BLOCK = """\
title: block
model: {kinematics: three_dimensional, continuum: classical}
grid: {min: [0.0, 0.0, 0.0], max: [2.0, 2.0, 3.0], cell_size: 1.0, basis: linear, follow_face: z_max}
materials:
  soil: {law: drucker_prager, youngs_modulus: 20.0e6, poisson_ratio: 0.3, friction_angle: 25.0, dilatancy_angle: 5.0, cohesion: 10.0e3}
bodies:
  - {name: low, material: soil, shape: {all: [{box: {min: [0.0, 0.0, 0.0], max: [2.0, 2.0, 2.0]}}, {not: {ball: {centre: [2.0, 2.0, 2.0], radius: 0.6}}}]}, points_per_cell: 2}
  - {name: high, material: soil, shape: {box: {min: [0.0, 0.0, 2.0], max: [2.0, 2.0, 3.0]}}, points_per_cell: [1, 2, 1], placement: gauss}
regions:
  - {within: {cylinder: {axis: z, centre: [1.0, 1.0, 0.0], radius: 0.5, min: 0.0, max: 1.0}}, scale: {cohesion: 0.5}}
boundary:
  - {face: z_min, fix: [ux, uy, uz], name: base}
  - {face: z_max, move: {uz: -0.02}, stage: press, name: platen}
stages:
  - {name: press, steps: 2, max_halvings: 3}
solver: {force_tolerance: 1.0e-8, max_iterations: 12, method: direct}
stabilisation: {ghost: {translation: 1.0e4, scaling: stiffness}}
output:
  snapshots: {every: 1}
  checkpoint: {every: 1}
  history:
    - {name: force, reaction: {boundary: platen, component: uz}}
    - {name: chi, max: chi}
"""

POINT = """\
materials:
  soil: {law: drucker_prager, youngs_modulus: 20.0e6, poisson_ratio: 0.3, friction_angle: 25.0, dilatancy_angle: 5.0, cohesion: 10.0e3}
path: {material: soil, kinematics: three_dimensional, steps: 4, deformation_gradient: [[1.0, 0.02, 0.0], [0.0, 0.99, 0.0], [0.0, 0.0, 1.0]]}
"""

STUDY = """\
title: study
scene: scene.yaml
vary:
  - stages.0.steps: [2, 3]
measures:
  - {name: settlement, last: r}
reference: {values: {settlement: 3.0}}
charts:
  - {x: steps, y: error}
"""

# Four points for the column.
POINTS = "0.5,0.5,0.25,0.25,0.25\n1.5,0.5,0.25,0.25,0.25\n0.5,1.5,0.25,0.25,0.25\n1.5,1.5,0.25,0.25,0.25\n"

NUMBERS = [
    "0", "-1", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "nan", ".inf", "-.inf", "0x10", "1_000", "1e", "9" * 40,
    "2147483648", "4294967296", "18446744073709551616", "1.0000000001", "-0.0", "1,5", "~", "true", "''",
]

WORDS = ["x", "null", "[]", "{}", "&a", "*a", "!!binary", "\"\\e[31m\"", "ü", "|", ">", "%", "@", "..", "/", "-", ": :"]

LETTERS = "{}[]:,#&*!|>'\"%@`-?\t\n\\ \x00\x07\x1b\u202e\ufeff\U0001f4a5e0ax.:"


def scenes():
    """Scenes to spoil: the tiny ones, and all of the repository that a check takes little time for."""
    small = [path.read_text() for path in sorted((ROOT / "configs").glob("*.yaml")) if path.stat().st_size < 4000]
    return [COLUMN, BLOCK, *small]


def spoiled(text, random):
    """The text with a few random faults; YAML, CSV and JSON are all spoiled this way."""
    for _ in range(random.choice([1, 1, 1, 2, 3])):
        text = random.choice(FAULTS)(text, random)
    return text


def other_number(text, random):
    places = list(re.finditer(r"-?\d+(?:\.\d*)?(?:e-?\d+)?", text))
    if not places:
        return text
    place = random.choice(places)
    factor = lambda: f"{float(place.group()) * random.choice([-1, 0.5, 2, 10, 1e3, 1e-3, 1e9, 1e-9]):g}"
    return text[: place.start()] + random.choice([random.choice(NUMBERS), factor()]) + text[place.end() :]


def other_word(text, random):
    places = list(re.finditer(r"[A-Za-z_]+", text))
    if not places:
        return text
    place, other = random.choice(places), random.choice(places).group()
    return text[: place.start()] + random.choice([other, random.choice(WORDS), place.group()[:-1]]) + text[place.end() :]


def moved_line(text, random):
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    line = lines[random.randrange(len(lines))]
    where = random.randrange(len(lines))
    return random.choice(
        [
            lambda: "".join(lines[:where] + lines[where + 1 :]),
            lambda: "".join([*lines[:where], line, *lines[where:]]),
            lambda: "".join([*lines[:where], " ", *lines[where:]]),
        ]
    )()


def other_letters(text, random):
    where = random.randrange(len(text) + 1)
    removed = random.choice([0, 0, 1, 5])
    return text[:where] + random.choice(["", random.choice(LETTERS)]) + text[where + removed :]


def end_missing(text, random):
    return text[: random.randrange(len(text) + 1)]


FAULTS = [other_number, other_number, other_number, other_word, other_word, moved_line, other_letters, end_missing]
