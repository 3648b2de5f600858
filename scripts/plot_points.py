#!/usr/bin/env python3
"""Draws the material points of one snapshot, coloured by a field, to a PNG file.

Usage: scripts/plot_points.py RESULTS_DIR [--field chi] [--component norm] [--time T] [--output FILE.png]
Reads points.vtkhdf of a result folder and changes nothing there. In plane strain the domains of the points are drawn as
rectangles of their current size, in space the points as dots; the first snapshot stands behind in grey.
"""

import argparse
import sys
from pathlib import Path

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the way of drawing is chosen first
from matplotlib.collections import PolyCollection  # noqa: E402

UNITS = {
    "displacement": "m",
    "volume": "m³",
    "half_lengths": "m",
    "stress": "Pa",
    "pressure": "Pa",
    "von_mises": "Pa",
    "couple_stress": "N/m",
    "wryness": "1/m",
    "rotation": "rad",
}
VECTOR = ["x", "y", "z"]
TENSOR = [row + column for row in VECTOR for column in VECTOR]


def read_snapshot(path, time):
    """Time, positions, and fields by name of the snapshot nearest to a time; of the last one without.

    Also the positions and half-lengths of the first snapshot.
    """
    with h5py.File(path, "r") as file:
        root = file["VTKHDF"]
        times = root["Steps/Values"][:]
        step = len(times) - 1 if time is None else int(numpy.argmin(abs(times - time)))
        count = int(root["NumberOfPoints"][0])
        rows = slice(step * count, (step + 1) * count)
        fields = {name: data[rows] for name, data in root["PointData"].items()}
        initial = root["Points"][:count], root["PointData/half_lengths"][:count]
        return times[step], root["Points"][rows], fields, initial


def choose(fields, name, component):
    """Numbers to colour by, and what to call them."""
    if name not in fields:
        sys.exit(f"there is no field {name}; there are {', '.join(sorted(fields))}")
    values = fields[name]
    unit = f" [{UNITS[name]}]" if name in UNITS else ""
    label = name.replace("_", " ")
    if values.ndim == 1:
        return values, label + unit
    if component == "norm":
        return numpy.linalg.norm(values, axis=1), f"|{label}|{unit}"
    names = VECTOR if values.shape[1] == 3 else TENSOR
    if component not in names:
        sys.exit(f"{name} has the components norm, {', '.join(names)}")
    return values[:, names.index(component)], f"{label} {component}{unit}"


def rectangles(centres, half_lengths, **style):
    """The domains as a drawing."""
    signs = numpy.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = centres[:, None, :2] + signs[None] * half_lengths[:, None, :2]
    return PolyCollection(corners, edgecolor="face", linewidths=0.3, **style)


def draw_plane(position, fields, initial, values):
    """The figure, its axes and what the colours belong to."""
    everything = numpy.vstack([initial[0], position])
    width, height = numpy.ptp(everything, axis=0)[:2]
    aspect = min(max(width / max(height, 1e-12), 0.4), 2.5)
    size = (4.6 * aspect + 2.2, 5.4) if aspect < 1.2 else (7.0, 5.0 / aspect + 1.6)
    figure, axes = plt.subplots(figsize=size, dpi=130, layout="constrained")
    axes.add_collection(rectangles(*initial, facecolor="0.88"))
    domains = rectangles(position, fields["half_lengths"], array=values, cmap="viridis")
    axes.add_collection(domains)
    axes.set_aspect("equal")
    axes.margins(0.04)
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.locator_params(axis="x", nbins=4)
    return figure, axes, domains


def draw_space(position, fields, initial, values):
    """The figure, its axes and what the colours belong to."""
    figure = plt.figure(figsize=(6.6, 5.4), dpi=130)
    axes = figure.add_axes((0.02, 0.06, 0.78, 0.86), projection="3d")
    everything = numpy.vstack([initial[0], position])
    axes.scatter(*initial[0].T, s=1.0, color="0.75", linewidths=0, depthshade=False)
    dots = axes.scatter(*position.T, c=values, s=5.0, cmap="viridis", linewidths=0, depthshade=False)
    axes.set_box_aspect(numpy.maximum(numpy.ptp(everything, axis=0), 1e-12), zoom=0.98)
    for axis, label in zip((axes.xaxis, axes.yaxis, axes.zaxis), ("x [m]", "y [m]", "z [m]")):
        axis.set_label_text(label)
        axis.labelpad = 8
        axis.set_major_locator(plt.MaxNLocator(4))
    axes.view_init(elev=22, azim=-58)
    return figure, axes, dots


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="result folder")
    parser.add_argument("--field", default="chi", help="field to colour by")
    parser.add_argument("--component", default="norm", help="norm, x, y, z, or xx to zz of a tensor")
    parser.add_argument("--time", type=float, help="stages done and share of the next; the last snapshot unless given")
    parser.add_argument("--title", help="title of the picture")
    parser.add_argument("--output", type=Path, help="picture; FIELD.png in the result folder unless given")
    options = parser.parse_args()

    try:
        time, position, fields, initial = read_snapshot(options.results / "points.vtkhdf", options.time)
    except OSError as error:
        sys.exit(f"cannot read the snapshots: {error}")
    values, label = choose(fields, options.field, options.component)
    in_space = numpy.ptp(position[:, 2]) > 0.0
    draw = draw_space if in_space else draw_plane
    figure, axes, coloured = draw(position, fields, initial, values)
    if in_space:
        figure.colorbar(coloured, cax=figure.add_axes((0.87, 0.2, 0.025, 0.6)), label=label)
    else:
        figure.colorbar(coloured, ax=axes, shrink=0.75, label=label)
    figure.suptitle(options.title or f"{label}, time {time:g}")
    output = options.output or options.results / f"{options.field}.png"
    figure.savefig(output)
    print(output)


if __name__ == "__main__":
    main()
