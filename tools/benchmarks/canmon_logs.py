"""canmon's log readers beside python-can's, whole verbs beside their peers, and their starts."""

from __future__ import annotations

import os
import random
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import can

from benchmarks.table import RUNS, row
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log

FRAMES = 1_000_000
PEER_FRAMES = 100_000
START_US = 1_436_509_052_000_000
CAN_IDS = (0x080, 0x181, 0x185, 0x281, 0x582, 0x602, 0x701)
LENGTHS = (0, 1, 2, 6, 8, 8, 8, 8)
CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    with TemporaryDirectory() as folder:
        log, part = Path(folder, "run.log"), Path(folder, "part.log")
        write(log, FRAMES)
        write(part, PEER_FRAMES)
        rates("candump log, columns with numpy", FRAMES, lambda: taken(read_columns(log)))
        rates("candump log, frame by frame", FRAMES, lambda: taken(read_log(log)))
        rates(
            "candump log, python-can's reader",
            PEER_FRAMES,
            lambda: taken(can.CanutilsLogReader(part)),
        )
        others(part)
        whole_programs(log)
        starts(log)


def others(part: Path) -> None:
    """Read other formats: python-can's readers alone, and below ours."""
    readers = {"blf": can.BLFReader, "asc": can.ASCReader}
    for suffix, reader in readers.items():
        log = part.with_suffix(f".{suffix}")
        writer = write_log(log)
        for record in read_log(part):
            writer.write(record)
        writer.close()
        rates(f"{suffix} log", PEER_FRAMES, lambda log=log: taken(read_log(log)))
        rates(
            f"{suffix} log, python-can's reader alone",
            PEER_FRAMES,
            lambda log=log, reader=reader: taken(reader(log)),
        )


READ_BLF = "import can, sys; sum(1 for _ in can.BLFReader(sys.argv[1]))"
DBC = """VERSION ""
BU_: A
BO_ 385 Motor: 8 A
 SG_ speed : 0|16@1- (0.125,0) [0|0] "rpm" A
 SG_ torque : 16|16@1- (0.1,-5) [0|0] "Nm" A
 SG_ count : 32|32@1+ (1,0) [0|0] "" A

BO_ 641 Position: 8 A
 SG_ position : 7|32@0- (0.001,0) [0|0] "m" A
 SG_ state : 32|4@1+ (1,0) [0|0] "" A

VAL_ 641 state 0 "off" 1 "on" 2 "fault" ;
"""


def whole_programs(log: Path) -> None:
    """Run verbs and their peers in turn, start to end, on the log of a million frames."""
    folder = log.parent
    blf, dbc = folder / "run.blf", folder / "run.dbc"
    subprocess.run([*CANMON, "conv", log, blf], check=True)
    dbc.write_text(DBC, "ascii")
    pair("stats of a BLF log", ("stats", blf), (sys.executable, "-c", READ_BLF, blf))
    pair("dump -r", ("dump", "-r", log), ("log2long",), log)
    pair("conv to ASC", ("conv", log, folder / "ours.asc"),
         ("log2asc", "can0", "-I", log, "-O", folder / "theirs.asc"))  # fmt: skip
    pair("dump --dbc", ("dump", log, "--dbc", dbc), ("cantools", "decode", dbc), log)
    pair("dump", ("dump", log), ("tshark", "-r", log, "-d", "can.subdissector,canopen"))


def pair(
    what: str, verb: Sequence[str | Path], peer: Sequence[str | Path], stdin: Path | None = None
) -> None:
    """Print the processor time of a verb as a multiple of its peer's, run by run."""
    if shutil.which(str(peer[0])) is None:
        print(f"| canmon {what} | {peer[0]} is not installed | |")
        return
    times = [(processor_s([*CANMON, *verb]), processor_s(peer, stdin)) for _ in range(RUNS)]
    row(f"canmon {what}, 1 M frames, start to end", [ours for ours, _ in times], "s of processor")
    name = "python-can reading" if peer[0] == sys.executable else str(peer[0])
    row(f"the same as a multiple of {name}", [ours / theirs for ours, theirs in times], "x")


def processor_s(command: Sequence[str | Path], stdin: Path | None = None) -> float:
    """Run a program; return its processor time."""
    with open(stdin or os.devnull, "rb") as file:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, stdin=file, stdout=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rates(what: str, frames: int, work: Callable[[], None]) -> None:
    """Print the frames of a second of processor time, which other programs do not change."""
    values = []
    for _ in range(RUNS):
        begin = time.process_time()
        work()
        values.append(frames / (time.process_time() - begin))
    row(what, values, "frames/s (CPU)")


def starts(log: Path) -> None:
    """Start verbs on a log of a million frames."""
    row("python -c pass", [start("-c", "pass") for _ in range(RUNS)], "ms")
    for words in (("info",), ("dump", "-n", "1", "--raw"), ("dump", "-n", "1")):
        times = [start(*CANMON[1:], *words, str(log)) for _ in range(RUNS)]
        row(f"canmon {' '.join(words)}, start to end", times, "ms")


def start(*words: str) -> float:
    """Run Python with these words; return milliseconds."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
    return (time.perf_counter() - begin) * 1e3


def write(path: Path, frames: int) -> None:
    """Write a log of a busy bus."""
    chance, at_us = random.Random(1), START_US
    with path.open("w", encoding="ascii") as file:
        for _ in range(frames):
            at_us += chance.randrange(50, 400)
            data = chance.randbytes(chance.choice(LENGTHS)).hex().upper()
            stamp = f"({at_us // 1_000_000:010d}.{at_us % 1_000_000:06d})"
            file.write(f"{stamp} can0 {chance.choice(CAN_IDS):03X}#{data}\n")


def taken(frames: Iterable[object] | object) -> None:
    """Take all frames; columns have them at once."""
    if isinstance(frames, Iterable):
        for _ in frames:
            pass
