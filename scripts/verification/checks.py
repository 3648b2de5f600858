"""Comparisons of a number from runs with what is expected of it."""

import json
from dataclasses import dataclass
from typing import Callable, Optional

from .runs import ROOT


def reference(name):
    """A file of tests/reference."""
    return json.loads((ROOT / "tests" / "reference" / f"{name}.json").read_text())


# What a check is compared with where there is no reference.
ROADS = "second road in this program"
# Shares below this are round-off, which differs from machine to machine.
ROUND_OFF = 1e-8


def percent(share, sign=""):
    """A share for the page."""
    return f"{100.0 * share:{sign}.2g} %" if abs(share) > ROUND_OFF else f"below {100.0 * ROUND_OFF:.0e} %"


@dataclass
class Check:
    """A quantity of the runs of a section.

    `obtained` takes the runs by scene. What is expected is a number with a tolerance, of its size or absolute, or with
    that of a measure given in `of` (of the length of a displacement, say), or a range from `low` to `high`, either of
    which may be absent; without any the number is stated only. `note` says what is known of a larger difference.
    """

    quantity: str
    obtained: Callable
    source: str = ""
    expected: Optional[float] = None
    relative: Optional[float] = None
    absolute: Optional[float] = None
    of: Optional[float] = None
    low: Optional[float] = None
    high: Optional[float] = None
    unit: str = ""
    scale: float = 1.0
    digits: int = 5
    note: str = ""

    def number(self, value):
        if self.unit == "%" and 0.0 < abs(value) <= ROUND_OFF:
            return f"below {100.0 * ROUND_OFF:.0e}"
        return f"{value * self.scale:.{self.digits}g}"

    def row(self, runs):
        """A row of the table of the page."""
        value = float(self.obtained(runs))
        unit = f" {self.unit}" if self.unit else ""
        row = {
            "quantity": self.quantity,
            "obtained": self.number(value) + unit,
            "source": self.source,
            "note": self.note,
        }
        if self.expected is not None:
            return row | self.against_number(value, unit)
        if self.low is not None or self.high is not None:
            return row | self.against_range(value, unit)
        return row | {"expected": "", "difference": "", "allowed": "", "holds": True}

    def against_number(self, value, unit):
        difference = value - self.expected
        expected = {"expected": self.number(self.expected) + unit}
        if self.absolute is not None:
            shown, allowed = f"{difference * self.scale:+.2g}{unit}", f"{self.absolute * self.scale:.3g}{unit}"
            return expected | {"difference": shown, "allowed": allowed, "holds": bool(abs(difference) <= self.absolute)}
        share = difference / abs(self.of or self.expected)
        measure = " of the length" if self.of else ""
        return expected | {
            "difference": percent(share, "+"),
            "allowed": f"{100 * self.relative:.3g} %{measure}",
            "holds": bool(abs(share) <= self.relative),
        }

    def against_range(self, value, unit):
        low = -float("inf") if self.low is None else self.low
        high = float("inf") if self.high is None else self.high
        if self.low is None:
            expected = f"at most {self.number(high)}{unit}"
        elif self.high is None:
            expected = f"at least {self.number(low)}{unit}"
        else:
            expected = f"{self.number(low)} to {self.number(high)}{unit}"
        beyond = max(low - value, value - high, 0.0)
        shown = "inside" if beyond == 0.0 else f"{beyond * self.scale:.2g}{unit} outside"
        return {"expected": expected, "difference": shown, "allowed": "", "holds": bool(beyond == 0.0)}


def largest_difference(quantity, obtained, listed, source, relative, note=""):
    """Check of a whole curve: the largest difference from listed values, each over the listed one.

    `obtained` takes the runs and gives values at the abscissas of the listed ones.
    """

    def difference(runs):
        return max(abs(own - other) / abs(other) for own, other in zip(obtained(runs), listed, strict=True))

    name = f"{quantity}: largest difference at {len(listed)} places"
    return Check(name, difference, source, high=relative, unit="%", scale=100.0, digits=2, note=note)


def second_road(quantity, obtained, first, second, allowed, road, note=""):
    """Check of a number without a reference: what another set-up of the same problem in this program gives.

    `obtained` takes a run; `first` and `second` are scenes, `road` says how the second differs, and the difference is
    over the number of the first.
    """

    def difference(runs):
        return obtained(runs[second]) / obtained(runs[first]) - 1.0

    name = f"{quantity}, {road}: change"
    return Check(name, difference, ROADS, 0.0, absolute=allowed, unit="%", scale=100.0, digits=2, note=note)
