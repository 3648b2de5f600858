"""Pictures of the page: curves with the reference over them, and deformed points."""

import sys
from dataclasses import dataclass, field
from typing import Optional

import matplotlib
import numpy

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the way of drawing is chosen first

from .runs import ROOT  # noqa: E402

sys.path.insert(0, str(ROOT / "scripts"))
import plot_points  # noqa: E402  a script beside this folder

FOLDER = ROOT / "docs" / "pictures" / "verification"
LARGEST = 120_000
LINES = ["-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1))]


@dataclass
class Curves:
    """Curves of runs as lines, those of references as marks. Each is a name and a function of the runs that gives
    abscissas and values; that of a reference takes nothing."""

    name: str
    about: str
    x: str
    y: str
    runs: list
    references: list = field(default_factory=list)
    logarithmic: bool = False
    # How many times lower a logarithmic scale begins than the lines, for the legend below them.
    room: float = 1.0

    def draw(self, runs):
        figure, axes = plt.subplots(figsize=(6.0, 4.0), dpi=100, layout="constrained")
        for place, (label, curve) in enumerate(self.runs):
            axes.plot(*curve(runs), linestyle=LINES[place % len(LINES)], color=f"C{place}", label=label, zorder=2)
        for place, (label, curve) in enumerate(self.references):
            mark = "os^Dv"[place % 5]
            axes.plot(*curve(), mark, color="black", fillstyle="none", markersize=4.5, label=label or None, zorder=3)
        axes.set_xlabel(self.x)
        axes.set_ylabel(self.y)
        if self.logarithmic:
            axes.set_xscale("log", base=2)
            axes.set_yscale("log")
            axes.set_ylim(bottom=axes.get_ylim()[0] / self.room)
        axes.grid(color="0.9")
        axes.set_axisbelow(True)
        axes.legend(fontsize="small", **({"loc": "lower left", "ncols": 2} if self.room > 1.0 else {}))
        return figure


@dataclass
class Points:
    """The points of one snapshot, coloured by a field; the first snapshot stands behind in grey."""

    name: str
    about: str
    scene: str
    field: str = "chi"
    component: str = "norm"
    time: Optional[float] = None

    def draw(self, runs):
        _, position, fields, initial = runs[self.scene].points(self.time)
        values, label = plot_points.choose(fields, self.field, self.component)
        if numpy.ptp(position[:, 2]) > 0.0:
            figure, axes, coloured = plot_points.draw_space(position, fields, initial, values)
            fit_space(axes, position, coloured)
            if numpy.ptp(position) < 1e-3:
                in_micrometres(axes)
            figure.colorbar(coloured, cax=figure.add_axes((0.87, 0.2, 0.025, 0.6)), label=label)
        else:
            figure, axes, coloured = plot_points.draw_plane(position, fields, initial, values)
            figure.colorbar(coloured, ax=axes, shrink=0.75, label=label)
        figure.suptitle(self.about)
        figure.set_dpi(90)
        return figure


@dataclass
class SymmetryPlane:
    """The points of a body in space that lie next to the plane x = 0, seen along x and coloured by a field."""

    name: str
    about: str
    scene: str
    field: str

    def draw(self, runs):
        _, position, fields, (places, sizes) = runs[self.scene].points()
        near = places[:, 0] < places[:, 0].min() + sizes[:, 0].min()
        turned = [1, 2, 0]
        values, label = plot_points.choose(fields, self.field, "norm")
        figure, axes, coloured = plot_points.draw_plane(
            position[near][:, turned],
            {"half_lengths": fields["half_lengths"][near][:, turned]},
            (places[near][:, turned], sizes[near][:, turned]),
            values[near],
        )
        axes.set_xlabel("y [m]")
        axes.set_ylabel("z [m]")
        figure.colorbar(coloured, ax=axes, shrink=0.75, label=label)
        figure.suptitle(self.about)
        figure.set_dpi(90)
        return figure


def fit_space(axes, position, dots):
    """Larger dots where there are few of them, and few numbers along the short sides of a long body."""
    dots.set_sizes([min(50.0, max(3.0, 20_000.0 / len(position)))])
    axes.set_position((0.02, 0.06, 0.72, 0.86))
    extents = numpy.ptp(position, axis=0)
    for axis, extent in zip((axes.xaxis, axes.yaxis, axes.zaxis), extents):
        if extent < 0.3 * extents.max():
            axis.set_major_locator(plt.NullLocator())
            axis.set_label_text("")
        elif axis.get_label_text() == "x [m]" and extent == extents.max() and extent > 3.0 * sorted(extents)[1]:
            # Along a slender body the numbers stand close to the edge of the picture.
            axis.labelpad = 22


def in_micrometres(axes):
    """Coordinates of a tiny body without powers of ten at the ends of the axes."""
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz"):
        axis.set_major_formatter(lambda value, _: f"{1e6 * value:.3g}")
        axis.set_label_text(f"{name} [um]")


def save(picture, runs):
    """Draws a picture to its file, and returns the file.

    Raises an error where it is larger than a page can bear.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{picture.name}.png"
    figure = picture.draw(runs)
    # Without the date and the version of the library the same picture is the same file.
    figure.savefig(path, dpi=figure.get_dpi(), metadata={"Software": None})
    plt.close(figure)
    if path.stat().st_size > LARGEST:
        raise RuntimeError(f"{path} has {path.stat().st_size} bytes, more than {LARGEST}")
    return path
