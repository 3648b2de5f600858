"""Attacks with text: configurations, points, command lines, options for PETSc, studies, reports."""

import os

from .inputs import BLOCK, CLOUD, COLUMN, POINT, POINTS, STUDY, scenes, spoiled
from .program import How, reasons

# What a run needs not spend its time on.
PLAIN = ["--set", "output.report=false"]


def write(folder, name, text):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode(errors="surrogatepass"))


def checked_scenes(bench, random, factor):
    """Spoiled scenes through `check`."""
    bases = scenes()
    for number in range(60 * factor):
        folder = bench.folder()
        write(folder, "cloud.csv", POINTS)
        write(folder, "scene.yaml", spoiled(random.choice(bases), random))
        bench.attack(["check", "scene.yaml"], folder, How(codes=(0, 1, 2), ranks=1 + (number % 10 == 0)))


def run_scenes(bench, random, factor):
    """Spoiled tiny scenes through a run; one that goes on is asked to stop."""
    for number in range(12 * factor):
        folder = bench.folder()
        write(folder, "cloud.csv", POINTS)
        write(folder, "scene.yaml", spoiled(random.choice([COLUMN, BLOCK, CLOUD]), random))
        how = How(ranks=[1, 1, 1, 2, 4][number % 5], limit=30, may_go_on=True)
        bench.attack(["scene.yaml", *PLAIN], folder, how)


def points(bench, random, factor):
    """Files of points."""
    known = [
        b"\xef\xbb\xbf" + POINTS.encode(),
        POINTS.encode("utf-16"),
        POINTS.replace(",", ";").encode(),
        POINTS.replace(",", "\t").encode(),
        POINTS.replace("\n", "\r\n").encode(),
        POINTS.replace("\n", "\r").encode(),
        b"x,y,volume,lx,ly\n" + POINTS.encode(),
        b"",
        b"\n" * 1000,
        b"# nothing\n",
        b"\x00" * 100,
        POINTS.encode() * 2,
        b"1e308,1e308,1e308,1e308,1e308\n",
        b"0.5,0.5,-0.25,0.25,0.25\n",
        b"0.5,0.5,0.25,0,0.25\n",
        b"," * 100000 + b"\n",
        b"5" * 1000000 + b"\n",
    ]
    texts = known + [spoiled(POINTS, random).encode(errors="surrogatepass") for _ in range(15 * factor)]
    for number, text in enumerate(texts):
        folder = bench.folder()
        write(folder, "cloud.csv", text)
        write(folder, "scene.yaml", CLOUD)
        bench.attack(["check", "scene.yaml"], folder, How(codes=(0, 2), ranks=1 + (number % 8 == 0)))


def drivers(bench, random, factor):
    """Spoiled paths of one material."""
    for _ in range(10 * factor):
        folder = bench.folder()
        write(folder, "scene.yaml", spoiled(POINT, random))
        bench.attack(["point", "scene.yaml"], folder, How(codes=(0, 1, 2, 3)))


def command_lines(bench, random, factor):
    """Words in an order that nobody meant."""
    commands = ["run", "check", "point", "report", "study", "schema", "init", "completions"]
    known = [[command, "scene.yaml", "--foo"] for command in commands]
    known += [[command, "--set"] for command in commands]
    known += [["scene.yaml", "--output", name] for name in (b"caf\xe9", "a\x1b[2J", "a\nb", "", "/dev/null", "x" * 5000)]
    known += [[b"\xff.yaml"], ["chek", "scene.yaml"], ["--quiet", "check", "scene.yaml"], ["--jobs", "2"], ["-"], ["--"]]
    known += [["scene.yaml", "-ksp_type", "gmres"], ["completions", "csh"], ["init", "../x"], ["init", "\x1b[31m"]]
    known += [["study", "scene.yaml", "--jobs", "99999999999999999999"], ["check", "scene.yaml", "--set", "a" * 100000]]
    known += [["check", "scene.yaml", "--set", word] for word in ("title=[[[", "grid.cells=9e9", ".=1", "stages.7=1", "=")]
    words = [*commands, "scene.yaml", "--set", "title=x", "--output", "o", "--quiet", "--restart", "--", "-log_view", "--x"]
    known += [random.sample(words, random.randint(1, 5)) for _ in range(15 * factor)]
    for number, line in enumerate(known):
        folder = bench.folder()
        write(folder, "scene.yaml", COLUMN)
        bench.attack(line, folder, How(ranks=1 + (number % 6 == 5 and "study" not in line)), note=repr(line)[:200])


def petsc_options(bench, random, factor):
    """Options for PETSc: dangerous ones, wrong ones, and files of them that are none."""
    known = """-fp_trap|-start_in_debugger|-start_in_debugger noxterm|-stop_for_debugger|-on_error_attach_debugger
    -on_error_abort|-on_error_mpiabort|-mpi_linear_solver_server|-python|-options_file .|-options_file /dev/zero
    -options_file pipe|-options_file absent|-options_file broken|-options_file trap|-options_file|-options_file_yaml .
    -options_string_yaml a:b|-prefix_pop|-prefix_push a|-ksp_type foo|-pc_type foo|-mat_type foo|-snes_type foo
    -snes_max_it -5|-ksp_monitor draw|-log_view :/absent/x|-snes_monitor ascii:/absent/x|-snes_linesearch_type foo
    -malloc_debug|-ksp_max_it x|gmres|-1|-ksp_rtol nan|-mat_mumps_icntl_7 99|-pc_factor_mat_solver_type foo
    -mat_mumps_icntl_14 -50|-snes_atol 1e308|-snes_divergence_tolerance 1e-300|-ksp_type cg -pc_type none -ksp_max_it 1"""
    known = [option.strip() for line in known.splitlines() for option in line.split("|")]
    for number, option in enumerate(known):
        folder = bench.folder()
        os.mkfifo(folder / "pipe")
        write(folder, "broken", "this is no option\n")
        write(folder, "trap", "-ksp_view\n-fp_trap\n")
        write(folder, "scene.yaml", COLUMN)
        how = How(ranks=1 + number % 2)
        if number % 3 == 2 and "\n" not in option:
            how.environment = {"PETSC_OPTIONS": option}
            bench.attack(["scene.yaml", "--quiet", *PLAIN], folder, how, note=f"PETSC_OPTIONS={option}")
        else:
            bench.attack(["scene.yaml", "--quiet", *PLAIN, "--", *option.split()], folder, how)


def studies(bench, random, factor):
    """Spoiled studies, listed and collected; references without an end."""
    for name in ("pipe", "/dev/zero", ".", "scene.yaml", "absent.csv"):
        folder = bench.folder()
        os.mkfifo(folder / "pipe")
        write(folder, "scene.yaml", COLUMN)
        write(folder, "study.yaml", STUDY.replace("{values: {settlement: 3.0}}", f"{{file: {name}}}"))
        bench.attack(["study", "study.yaml", "--dry-run"], folder, How(codes=(0, 1, 2)), note=f"reference {name}")
    for number in range(10 * factor):
        folder = bench.folder()
        write(folder, "scene.yaml", COLUMN)
        write(folder, "study.yaml", spoiled(STUDY, random))
        option = ["--dry-run", "--collect", "--slurm"][number % 3]
        bench.attack(["study", "study.yaml", option], folder, How(codes=(0, 1, 2, 3)))
    folder = bench.folder()
    write(folder, "scene.yaml", COLUMN)
    write(folder, "study.yaml", STUDY)
    bench.attack(["study", "study.yaml"], folder, How(ranks=2, codes=(2,)))


def reports(bench, random, factor):
    """Reports of damaged results."""
    results = bench.root / "results"
    (bench.root / "block.yaml").write_text(BLOCK)
    made = bench.run(["block.yaml", "--output", str(results), "--quiet"], bench.root)
    if made.code != 0:
        bench.count([f"the run ends with {made.code}: no results to damage"], made, bench.folder())
        return
    names = ["history.csv", "convergence.csv", "summary.json", "config.yaml", "points.vtkhdf"]
    for number in range(20 * factor):
        folder = bench.folder()
        name = names[number % len(names)]
        for file in names:
            (folder / file).write_bytes((results / file).read_bytes())
        whole = (results / name).read_bytes()
        if name == "points.vtkhdf":
            write(folder, name, flipped(whole, random, random.choice([1, 1, 20])))
        else:
            write(folder, name, spoiled(whole.decode(), random))
        how = How(codes=(0, 1, 2))
        ended = bench.run(["report", "."], folder, how)
        bench.count(reasons(ended, how), ended, folder, note=f"damaged {name}")
    for name in names:
        folder = bench.folder()
        write(folder, "history.csv", (results / "history.csv").read_bytes())
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name) if name != "summary.json" else (folder / name).mkdir()
        bench.attack(["report", "."], folder, How(codes=(0, 1, 2)), note=f"{name} is no file")


def flipped(data, random, count):
    """The data with a few bits changed."""
    data = bytearray(data)
    for _ in range(count):
        data[random.randrange(len(data))] ^= 1 << random.randrange(8)
    return bytes(data)


def files(bench, random, factor):
    """What is no file, or no folder, in the place of one."""
    for name in ("pipe", "/dev/zero", "/dev/null", ".", "loop", "absent", "/proc/self/mem", "unreadable"):
        for arguments in (["check", name], [name], ["report", name], ["point", name], ["scene.yaml", "--output", name]):
            folder = bench.folder()
            os.mkfifo(folder / "pipe")
            (folder / "loop").symlink_to("loop")
            write(folder, "unreadable", COLUMN)
            (folder / "unreadable").chmod(0)
            write(folder, "scene.yaml", COLUMN)
            bench.attack([*arguments, *(PLAIN if "scene.yaml" in arguments else [])], folder)
        folder = bench.folder()
        os.mkfifo(folder / "pipe")
        write(folder, "scene.yaml", CLOUD.replace("cloud.csv", name))
        bench.attack(["check", "scene.yaml"], folder, How(codes=(0, 2)), note=f"points from {name}")


KINDS = {
    "configuration, check": checked_scenes,
    "configuration, run": run_scenes,
    "points": points,
    "point": drivers,
    "command line": command_lines,
    "PETSc options": petsc_options,
    "study": studies,
    "report": reports,
    "files": files,
}
