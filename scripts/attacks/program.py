"""Starts the program and judges how it ends."""

import math
import os
import resource
import shlex
import shutil
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

# What no user may see: traces of Rust, of Open MPI's signal handler, of PETSc, of Python, and of the C++ library.
TRACES = [
    "panicked at",
    "stack backtrace",
    "RUST_BACKTRACE",
    "*** Process received signal",
    "PETSC ERROR",
    "terminate called",
    "Traceback (most recent call last)",
    "AddressSanitizer",
    "memory allocation of",
]

# How long a program may take to end after SIGUSR1 [s].
GRACE = 20


@dataclass
class Ended:
    """How a process ended."""

    command: list
    code: int | None
    out: str
    err: str
    late: bool


@dataclass
class How:
    """How the program is started, and what is right for it to do."""

    ranks: int = 1
    # Seconds; on a machine with other work to do everything takes several times as long.
    limit: float = 180.0
    # Most bytes of address space of each process.
    memory: int | None = None
    environment: dict | None = None
    codes: tuple = (0, 1, 2, 3, 4)
    # Whether a run that goes on beyond its limit is asked to stop, and must end with exit code 4.
    may_go_on: bool = False


class Bench:
    """Folder, counts and failures of one kind of attacks."""

    def __init__(self, program, kind):
        self.program = str(program)
        self.kind = kind
        self.root = Path(tempfile.mkdtemp(prefix=f"attack-{kind.replace(' ', '-')}-"))
        self.tried = 0
        self.failed = 0

    def folder(self):
        """A new folder for one attack."""
        path = self.root / f"{self.tried:05d}"
        path.mkdir()
        return path

    def leave(self):
        """Removes what is not needed to look at a failure."""
        if self.failed == 0:
            shutil.rmtree(self.root, ignore_errors=True)

    def command(self, arguments, how):
        launcher = ["mpirun", "--quiet", "-n", str(how.ranks)] if how.ranks > 1 else []
        return [*launcher, self.program, *arguments]

    def start(self, arguments, folder, how):
        def limited():
            if how.memory:
                resource.setrlimit(resource.RLIMIT_AS, (how.memory, how.memory))

        return subprocess.Popen(
            self.command(arguments, how),
            cwd=folder,
            env={**os.environ, **(how.environment or {})},
            stdin=subprocess.DEVNULL,
            stdout=open(folder / "stdout.txt", "wb"),
            stderr=open(folder / "stderr.txt", "wb"),
            start_new_session=True,
            preexec_fn=limited,
        )

    def wait(self, process, folder, how):
        """Waits for the end of a process that `start` gave; ends it where it takes too long."""
        late = False
        try:
            code = process.wait(timeout=how.limit)
        except subprocess.TimeoutExpired:
            late = True
            # mpirun passes this one on, and ends with the code of the ranks.
            process.send_signal(signal.SIGUSR1)
            try:
                code = process.wait(timeout=GRACE)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                code = None
        read = lambda name: (folder / name).read_bytes().decode(errors="replace")
        return Ended(process.args, code, read("stdout.txt"), read("stderr.txt"), late)

    def run(self, arguments, folder, how=How()):
        return self.wait(self.start(arguments, folder, how), folder, how)

    def attack(self, arguments, folder, how=How(), note=""):
        """Runs the program, judges it and counts. Returns how it ended."""
        ended = self.run(arguments, folder, how)
        self.count(reasons(ended, how) + unreal_numbers(folder), ended, folder, note)
        return ended

    def count(self, faults, ended, folder, note=""):
        """Counts an attack with what is wrong in the answer to it."""
        self.tried += 1
        if not faults:
            shutil.rmtree(folder, ignore_errors=True)
            return
        self.failed += 1
        words = " ".join(shlex.quote(os.fsdecode(word)) for word in ended.command)
        print(f"NOT SURVIVED: {self.kind}: {'; '.join(faults)}\n  {words}\n  {note}\n  in {folder}", flush=True)
        for line in ended.err.splitlines()[:6]:
            print(f"  | {line[:200]}", flush=True)


def reasons(ended, how):
    """What is wrong with the end of a process."""
    faults = []
    if ended.late and not (how.may_go_on and ended.code in (0, 3, 4)):
        faults.append(f"did not end within {how.limit:.0f} s (code {ended.code} after SIGUSR1)")
    elif ended.code not in how.codes:
        faults.append(f"exit code {ended.code}, accepted {how.codes}")
    faults += [f"prints '{trace}'" for trace in TRACES if trace in ended.out + ended.err]
    lines = [line for line in ended.err.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("error: ")]
    if ended.code in (1, 2, 3) and not errors:
        faults.append("no message that starts with 'error:'")
    if len(set(errors)) != len(errors):
        faults.append("a message that is there twice")
    if any(letter < " " and letter not in "\n\t\r" or "\x7f" <= letter <= "\x9f" for letter in ended.err):
        faults.append("control characters on standard error")
    return faults


def unreal_numbers(folder):
    """Histories with a number that is not finite."""
    faults = []
    for path in folder.rglob("history.csv"):
        if not path.is_file():
            continue
        for line in path.read_text(errors="replace").splitlines()[1:]:
            if any(not finite(cell) for cell in line.split(",")):
                faults.append(f"{path.name} holds a number that is not finite: {line[:80]}")
                break
    return faults


def finite(cell):
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return True


def wait_until(condition, seconds=60.0):
    """Waits for something to be so; answers whether it came to be."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
