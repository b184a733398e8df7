"""What canmon takes of a log of ten million frames: processor and memory, beside other readers."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import tickrig
from benchmarks.canmon_model import DIRTY, IDS, WORDS
from benchmarks.table import row

FRAMES = 10_000_000
PEER_FRAMES = 1_000_000
RATE_HZ = 6_667
"""Frames of a second; a minute of them comes again and again, with its own time."""

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
PYTHON_CAN = (sys.executable, "-c", "import can, sys; sum(1 for _ in can.LogReader(sys.argv[1]))")
VERBS = (
    ("stats",),
    ("check", *WORDS),
    ("nodes",),
    ("top",),
    ("graph", "181[0:4]"),
)
RUNS = 3
START_S = 1_700_000_000
WAIT = """
import os, sys
null = [(os.POSIX_SPAWN_OPEN, fd, os.devnull, os.O_WRONLY, 0) for fd in (1, 2)]
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=null)
usage = os.wait4(child, 0)[2]
print(usage.ru_utime + usage.ru_stime, usage.ru_maxrss)
"""
"""A program that starts another: what this one holds would count as the peak of its children."""


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    with TemporaryDirectory() as folder:
        log = Path(folder, "run.log")
        write(log, FRAMES)
        for verb, *options in VERBS:
            spent(f"canmon {verb}", canmon(verb, log, options))
        write(log, FRAMES, dirty=True)
        for verb, *options in VERBS[:3]:
            spent(f"dirty log: canmon {verb}", canmon(verb, log, options))
        write(log, PEER_FRAMES)
        what = f"{PEER_FRAMES:,} frames:"
        spent(f"{what} canmon stats", canmon("stats", log))
        spent(f"{what} read by python-can", (*PYTHON_CAN, str(log)))
        spent(f"{what} written as ASC by log2asc", ("log2asc", "-I", str(log), "can0"))


def write(path: Path, frames: int, *, dirty: bool = False) -> None:
    """Write what `canmon_model` writes, at the pace of a disk: a minute of it comes again."""
    seconds = list(minute(dirty=dirty))
    with path.open("wb") as file:
        for second in range(-(-frames // RATE_HZ)):
            lines = seconds[second % len(seconds)][: max(0, frames - second * RATE_HZ)]
            text = b"".join(lines).replace(b"(", b"(%d." % (START_S + second))
            file.write(text)


def minute(*, dirty: bool) -> Iterator[list[bytes]]:
    """Yield the lines of each second, with the microseconds alone."""
    chance = random.Random(1)
    for second in range(60):
        lines = []
        for n in range(second * RATE_HZ, (second + 1) * RATE_HZ):
            node, micros = n % IDS + 1, n % RATE_HZ * 1_000_000 // RATE_HZ + chance.randrange(100)
            frame = f"{0x180 + node:03X}#{n:08X}{chance.randrange(1 << 32):08X}"
            if n % 150 == 0:
                frame = f"{0x700 + n // 150 % IDS + 1:03X}#05"
            if dirty and n % DIRTY == 0:
                frame = f"{0x080 + node:03X}#3081110000000000"
            lines.append(f"({micros:06d}) can0 {frame}\n".encode("ascii"))
        yield lines


def canmon(verb: str, log: Path, options: Sequence[str] = ()) -> tuple[str, ...]:
    """Return a command."""
    return (*CANMON, verb, str(log), *options)


def spent(what: str, command: Sequence[str]) -> None:
    """Print what a program takes of processor and memory; that it is not there, where so."""
    program = shutil.which(command[0])
    if program is None:
        print(f"| {what} | not installed | |")
        return
    seconds, mebibytes = zip(*(_once([program, *command[1:]]) for _ in range(RUNS)), strict=True)
    row(what, seconds, "s of processor")
    row(f"{what}: memory", mebibytes, "MiB")


def _once(command: list[str]) -> tuple[float, float]:
    """Return the processor time and the peak of the resident memory of a program."""
    env = {**os.environ, "PYTHONPATH": str(Path(tickrig.__file__).parents[1])}
    waiting = [sys.executable, "-c", WAIT, *command]
    said = subprocess.run(waiting, stdout=subprocess.PIPE, env=env, check=True, text=True).stdout
    seconds, kibibytes = map(float, said.split())
    return seconds, kibibytes / 1024
