"""Attacks with the machine: memory, signals, killed processes, flipped bits, folders in the way, two runs at once."""

import os
import shutil
import signal
import time

from .inputs import BLOCK, COLUMN
from .program import How, reasons, unreal_numbers, wait_until
from .texts import PLAIN, flipped, write

# Each step a checkpoint, so that there is one wherever a run is ended.
STEADY = [*PLAIN, "--set", "output.checkpoint.every=1", "--set", "output.snapshots.every=2"]

# Steps of a run that is to be ended on its way.
STEPS = 40


def sizes(bench, random, factor):
    """Scenes that do not fit into memory."""
    space = COLUMN.replace("plane_strain", "three_dimensional").replace("[4, 4]", "[60, 60, 60]")
    space = space.replace("0.0]", "0.0, 0.0]").replace("4.0]", "4.0, 4.0]").replace("3.0]", "3.0, 4.0]")
    space = space.replace("-1000.0]", "-1000.0, 0.0]").replace("[ux, uy, rz]", "[ux, uy, uz]")
    cells = lambda text: COLUMN.replace("cells: [4, 4]", f"cells: {text}")
    many = cells("[400, 400]").replace("points_per_cell: 2", "points_per_cell: 64")
    ring = "ring_sector: {centre: [2.0, 2.0], inner_radius: 1.9, outer_radius: 1.91, from_angle: 0.0, to_angle: 360.0}"
    thin = cells("[20000, 20000]").replace("box: {min: [0.0, 0.0], max: [4.0, 3.0]}", ring)
    refused = [cells("[40000, 40000]"), cells("[1000000000, 1]"), many, cells("[46000, 46000]"), thin]
    for number, text in enumerate(refused):
        for command in (["check"], []):
            folder = bench.folder()
            write(folder, "scene.yaml", text)
            how = How(codes=(2,), memory=4 << 30, ranks=1 + number % 2)
            bench.attack([*command, "scene.yaml"], folder, how)
    # Too small a limit for what comes later: MPI's own buffers, the matrix, the factors.
    for text in (cells("[200, 200]").replace("cell: 2", "cell: 1"), space):
        for megabytes in random.sample(range(300, 3000, 50), 2 * factor):
            folder = bench.folder()
            write(folder, "scene.yaml", text)
            how = How(codes=(0, 1, 2, 4), memory=megabytes << 20, ranks=1 + megabytes // 50 % 2, limit=60, may_go_on=True)
            bench.attack(["scene.yaml", *PLAIN], folder, how, note=f"{megabytes} MiB of address space")


def steady(bench, folder, ranks, steps=STEPS, more=()):
    """Starts a run of many steps; answers with its process and how it was started."""
    write(folder, "scene.yaml", COLUMN)
    how = How(ranks=ranks)
    arguments = ["scene.yaml", "--output", "o", "--set", f"stages.0.steps={steps}", *STEADY, *more]
    return bench.start(arguments, folder, how), how


def rows(folder):
    try:
        return (folder / "o" / "history.csv").read_bytes().count(b"\n")
    except OSError:
        return 0


def whole_history(bench, ranks):
    """The history of the run that nothing ends."""
    folder = bench.root / f"whole-{ranks}"
    folder.mkdir(exist_ok=True)
    if not (folder / "o" / "summary.json").exists():
        process, how = steady(bench, folder, ranks)
        bench.wait(process, folder, how)
    return (folder / "o" / "history.csv").read_bytes()


def restarted(bench, folder, ranks):
    """Goes on with an ended run; answers with what is wrong with the result."""
    process, how = steady(bench, folder, ranks, more=["--restart"])
    ended = bench.wait(process, folder, how)
    faults = reasons(ended, How(codes=(0,))) + unreal_numbers(folder)
    if ended.code == 0 and (folder / "o" / "history.csv").read_bytes() != whole_history(bench, ranks):
        faults.append("the history is not that of the whole run")
    return faults, ended


def signals(bench, random, factor):
    """Signals at random moments, then a restart."""
    for number in range(6 * factor):
        ranks = 1 + number // 2 % 2
        folder = bench.folder()
        # mpirun takes the others for its own end, whatever the ranks make of them.
        name = ["SIGTERM", "SIGINT", "SIGUSR1"][number % 3] if ranks == 1 else "SIGUSR1"
        process, how = steady(bench, folder, ranks)
        moment = random.uniform(0.1, 2.0)
        if number % 2:
            wait_until(lambda: rows(folder) > 3)
            moment = random.uniform(0.0, 0.2)
        time.sleep(moment)
        process.send_signal(getattr(signal, name))
        ended = bench.wait(process, folder, how)
        faults = reasons(ended, How(codes=(0, 4)))
        if ended.code == 4 and not faults and (folder / "o" / "checkpoint.h5").exists():
            faults, ended = restarted(bench, folder, ranks)
        bench.count(faults, ended, folder, note=f"{name} after {moment:.2f} s")


def kills(bench, random, factor):
    """SIGKILL at random moments, then a restart: the history is that of the whole run to the last bit."""
    for number in range(5 * factor):
        ranks = 1 + number % 2
        folder = bench.folder()
        process, how = steady(bench, folder, ranks)
        wait_until(lambda: (folder / "o" / "checkpoint.h5").exists())
        time.sleep(random.uniform(0.0, 0.6))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        wait_until(lambda: not alive(folder))
        faults, ended = restarted(bench, folder, ranks)
        bench.count(faults, ended, folder, note="killed")


def alive(folder):
    """Whether a process still works in the folder: ranks outlive a launcher that is killed by a moment."""
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            if os.readlink(f"/proc/{name}/cwd") == str(folder):
                os.kill(int(name), signal.SIGKILL)
                return True
        except OSError:
            continue
    return False


def bits(bench, random, factor):
    """Flipped bits and missing ends of checkpoint and snapshots: a message, or the right history."""
    source = bench.root / "stopped"
    source.mkdir()
    process, how = steady(bench, source, 1)
    wait_until(lambda: rows(source) > 20)
    process.send_signal(signal.SIGTERM)
    bench.wait(process, source, how)
    whole = whole_history(bench, 1)
    for number in range(20 * factor):
        folder = bench.folder()
        shutil.copytree(source, folder, dirs_exist_ok=True)
        name = ["checkpoint.h5", "points.vtkhdf", "history.csv", "convergence.csv"][number % 4]
        path = folder / "o" / name
        data = path.read_bytes()
        cut = random.random() < 0.3
        path.write_bytes(data[: random.randrange(len(data))] if cut else flipped(data, random, 1))
        process, how = steady(bench, folder, 1, more=["--restart"])
        ended = bench.wait(process, folder, how)
        faults = reasons(ended, How(codes=(0, 1, 2)))
        numbers = (folder / "o" / "history.csv").read_bytes()
        if ended.code == 0 and name != "convergence.csv" and numbers != whole:
            faults.append("the history is not that of the whole run")
        bench.count(faults, ended, folder, note=f"{name} {'cut' if cut else 'with one bit changed'}")


def folders(bench, random, factor):
    """Things in the way in the result folder."""
    names = ["history.csv", "convergence.csv", "summary.json", "points.vtkhdf", "checkpoint.h5", "config.yaml", "figures"]
    names += ["report.html", "summary.json.part", "checkpoint.h5.part"]
    for number, name in enumerate(names):
        for kind in ("folder", "pipe", "link", "text")[: 4 if factor > 1 or number % 2 else 2]:
            folder = bench.folder()
            write(folder, "scene.yaml", COLUMN)
            (folder / "o").mkdir()
            path = folder / "o" / name
            {
                "folder": lambda: (path / "inside").mkdir(parents=True),
                "pipe": lambda: os.mkfifo(path),
                "link": lambda: path.symlink_to(folder / "elsewhere"),
                "text": lambda: path.write_text("not what belongs here"),
            }[kind]()
            bench.attack(["scene.yaml", "--output", "o"], folder, How(ranks=1 + number % 2), note=f"{name} is a {kind}")
            folder.exists() and (folder / "elsewhere").exists() and print(f"  (wrote through the link {name})")


def two_at_once(bench, random, factor):
    """Two runs in one folder: one of them is refused, the results are those of the other."""
    for number in range(3 * factor):
        folder = bench.folder()
        first, how = steady(bench, folder, 1 + number % 2)
        wait_until(lambda: rows(folder) > 2)
        other = folder / "other"
        other.mkdir()
        write(other, "scene.yaml", COLUMN)
        arguments = ["scene.yaml", "--output", str(folder / "o"), "--set", "stages.0.steps=5", *STEADY]
        second = bench.run(arguments + (["--restart"] if number % 3 == 2 else []), other)
        ended = bench.wait(first, folder, how)
        faults = reasons(ended, How(codes=(0,))) + reasons(second, How(codes=(1, 2)))
        if not faults and (folder / "o" / "history.csv").read_bytes() != whole_history(bench, how.ranks):
            faults.append("the history is not that of the first run")
        bench.count(faults, second, folder)


KINDS = {
    "sizes": sizes,
    "signals": signals,
    "kills": kills,
    "bits": bits,
    "folders": folders,
    "two at once": two_at_once,
}
