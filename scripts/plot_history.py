#!/usr/bin/env python3
"""Draws columns of history.csv over another column, of one or more runs, to a PNG file.

Usage: scripts/plot_history.py RESULTS_DIR .. --x COLUMN --y COLUMN [--scale-x S] [--scale-y S] [--output FILE.png]
Reads the history of each result folder and changes nothing there.
"""

import argparse
import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the way of drawing is chosen first


def read_columns(folder, names):
    """The columns of a history with these names."""
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for name in names:
        if name not in rows[0]:
            sys.exit(f"{folder}/history.csv has no column {name}; it has {', '.join(rows[0])}")
    return [[float(row[name]) for row in rows] for name in names]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, nargs="+", help="result folders")
    parser.add_argument("--x", default="load_factor", help="column of the horizontal axis")
    parser.add_argument("--y", required=True, help="column of the vertical axis")
    parser.add_argument("--scale-x", type=float, default=1.0, help="factor of the horizontal axis")
    parser.add_argument("--scale-y", type=float, default=1.0, help="factor of the vertical axis")
    parser.add_argument("--label-x", help="label of the horizontal axis; the column unless given")
    parser.add_argument("--label-y", help="label of the vertical axis; the column unless given")
    parser.add_argument("--names", nargs="+", help="names of the runs; their folders unless given")
    parser.add_argument("--output", type=Path, help="picture; history.png in the first result folder unless given")
    options = parser.parse_args()
    names = options.names or [folder.name for folder in options.results]
    if len(names) != len(options.results):
        parser.error("one name per result folder")

    figure, axes = plt.subplots(figsize=(6.0, 4.0), dpi=130, layout="constrained")
    for folder, name, line in zip(options.results, names, ["-", "--", "-.", ":"] * len(names)):
        try:
            x, y = read_columns(folder, [options.x, options.y])
        except OSError as error:
            sys.exit(f"cannot read the history: {error}")
        axes.plot([options.scale_x * value for value in x], [options.scale_y * value for value in y], line, label=name)
    axes.set_xlabel(options.label_x or options.x)
    axes.set_ylabel(options.label_y or options.y)
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    if len(names) > 1:
        axes.legend()
    output = options.output or options.results[0] / "history.png"
    figure.savefig(output)
    print(output)


if __name__ == "__main__":
    main()
