"""Writes docs/verification.md."""

import shlex
import textwrap

from .runs import ROOT

PAGE = ROOT / "docs" / "verification.md"
HEAD = """# Verification

Every example that the program claims to compute, run and compared. This page is written by

```sh
./scripts/verify.sh
```

from the runs themselves and from [scripts/verification/cases.py](../scripts/verification/cases.py), where the expected
numbers, the tolerances and the notes stand; `--quick` runs the examples of a few seconds only, `--study` those of
`configs/study` too. What was not run keeps its last numbers, with their date. References are described in
[tests/reference](../tests/reference); "independent implementation" means one of the same theory in
another language, written only for checking. **Bold** differences are larger than allowed; what is known about the
cause stands below the table. A check without a tolerance states a number for which there is nothing to compare with.

Processor times are those of `summary.json`, the sum over the ranks, measured on a machine that others used at the same
time: they say what order of time a run takes, no more.
"""


def overrides(scene):
    """Overrides of a scene's keys as the command line has them; they replace results of the scene as it is."""
    words = scene.split()[1:]
    return (" --overwrite" if words else "") + "".join(f" --set {shlex.quote(word)}" for word in words)


def shown(scene):
    """A scene as the table of runs names it."""
    return f"configs/{scene.split()[0]}.yaml" + "".join(f" {word}" for word in scene.split()[1:])


def paragraph(text):
    return textwrap.wrap(text, 118, break_long_words=False, break_on_hyphens=False)


def cell(text):
    return str(text).replace("|", "\\|")


def table_of_checks(rows):
    """Lines of the table, and notes of the numbers that are outside."""
    lines = ["| quantity | expected | source | obtained | difference | allowed |", "|---|---|---|---|---|---|"]
    notes, unexplained = [], []
    for row in rows:
        difference = row["difference"]
        if not row["holds"]:
            difference = f"**{difference}**"
            if not row["note"]:
                unexplained.append(f"{row['quantity']}: {row['obtained']}")
            elif row["note"] not in notes:
                notes.append(row["note"])
        entries = (row["quantity"], row["expected"], row["source"], row["obtained"], difference, row["allowed"])
        lines.append(f"| {' | '.join(cell(entry) for entry in entries)} |")
    return lines, notes, unexplained


def table_of_runs(runs):
    lines = [
        "| run | ranks | points | unknowns | steps | iterations | processor time | memory | ended | date | commit |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for run in runs:
        memory = ", ".join(f"{size:.0f}" for size in run["memory_mb"])
        ended = run["status"] if run["exit_code"] == 0 else f"{run['status']}, exit code {run['exit_code']}"
        lines.append(
            f"| `{shown(run['scene'])}` | {run['ranks']} | {run['points']} | "
            f"{run['unknowns']} | {run['steps']} | {run['newton_iterations']} | {run['cpu_seconds']:.1f} s | "
            f"{memory} MB | {ended} | {run['date']} | {run['commit']} |"
        )
    return lines


def section_lines(section, numbers):
    """The lines of a section, and its numbers outside without a note."""
    lines = ["", f"## {section.title}", "", f"Source: {section.source}.", "", *paragraph(section.setup), "", "```sh"]
    ranks = "" if section.ranks == 2 else f" -n {section.ranks}"
    for scene in section.scenes:
        lines.append(f"./scripts/run.sh configs/{scene.split()[0]}.yaml{ranks}{overrides(scene)}")
    lines += ["```", ""]
    if numbers is None:
        return [*lines, "Not run yet."], []
    checks, notes, unexplained = table_of_checks(numbers["rows"])
    lines += checks
    for note in notes:
        lines += ["", *paragraph(f"**Outside:** {note}")]
    if section.remark:
        lines += ["", *paragraph(section.remark)]
    for picture in section.pictures:
        lines += ["", f"![{picture.about}](pictures/verification/{picture.name}.png)"]
    lines += ["", *table_of_runs(numbers["runs"])]
    return lines, unexplained


def contents(sections, kept):
    """An overview: how many numbers of each section are inside."""
    lines = ["", "| example | compared | outside |", "|---|---|---|"]
    for section in sections:
        rows = kept.get(section.name, {"rows": []})["rows"]
        compared = [row for row in rows if row["difference"]]
        outside = sum(not row["holds"] for row in compared)
        anchor = "".join(letter for letter in section.title.lower() if letter.isalnum() or letter in " -_")
        shown = f"**{outside}**" if outside else "0"
        lines.append(f"| [{section.title}](#{anchor.replace(' ', '-')}) | {len(compared)} | {shown} |")
    return lines


def write(sections, kept):
    """Writes the page, and returns the numbers that are outside their tolerance without a note."""
    lines, unexplained = [*HEAD.splitlines(), *contents(sections, kept)], []
    for section in sections:
        own, without_note = section_lines(section, kept.get(section.name))
        lines += own
        unexplained += [f"{section.title}: {line}" for line in without_note]
    PAGE.write_text("\n".join(lines) + "\n")
    return unexplained
