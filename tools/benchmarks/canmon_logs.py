"""canmon's log readers beside python-can's, whole verbs beside their peers, and their starts."""

from __future__ import annotations

import os
import random
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count, islice
from pathlib import Path
from tempfile import TemporaryDirectory

import can

from benchmarks.table import RUNS, row
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.wire.canopen.sdo_frame import crc16

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
    pair("dump", ("dump", log), ("tshark", "-r", log, *DISSECTOR))
    for what, frames in TRAFFIC.items():
        part = folder / "part.log"
        write_frames(part, islice(frames(), FRAMES))
        pair(f"dump, {what}", ("dump", part), ("tshark", "-r", part, *DISSECTOR))


DISSECTOR = ("-d", "can.subdissector,canopen")
MAPPING = (
    *("605#2F001A0000000000", "585#60001A0000000000"),
    *("605#23001A0110004160", "585#60001A0100000000"),
    *("605#23001A0220006460", "585#60001A0200000000"),
    *("605#2F001A0002000000", "585#60001A0000000000"),
)
"""The TPDO of node 5 has a statusword and a position."""
POLLED = ("4160", "6460", "6C60", "7760", "0020", "6160")
WORDS = POLLED[0], POLLED[3]
EMCIES = ("3081110700000000", "0000000000000000", "10231100000000FF")
DOMAIN = 14_000


def tpdos() -> Iterator[str]:
    """Yield TPDOs of a configured node."""
    yield from MAPPING
    yield from (f"185#3702{n.to_bytes(4, 'little').hex().upper()}" for n in count())


def polled(polls: int = 1, every: int = 8) -> Iterator[str]:
    """Yield TPDOs, and expedited uploads of objects of four nodes, values by chance."""
    chance, rest = random.Random(1), tpdos()
    yield from islice(rest, len(MAPPING))
    for number in count():
        yield from islice(rest, every)
        for _ in range(polls):
            node, index = 5 + number % 4, POLLED[number % len(POLLED)]
            yield f"{0x600 + node:03X}#40{index}0000000000"
            size = 2 if index in WORDS else 4
            value = chance.randbytes(size).ljust(4, b"\0").hex().upper()
            yield f"{0x580 + node:03X}#{0x43 | 4 - size << 2:02X}{index}00{value}"


def downloads() -> Iterator[str]:
    """Yield segmented and block downloads, long and short ones."""
    chance = random.Random(1)
    while True:
        yield from segmented(5, chance.randbytes(DOMAIN // 2))
        yield from block(6, chance.randbytes(DOMAIN))
        for number in range(20):
            yield from segmented(7, b"hello %d" % (number % 5))


def segmented(node: int, data: bytes) -> Iterator[str]:
    """Yield the frames of a segmented download."""
    asks, answers = f"{0x600 + node:03X}#", f"{0x580 + node:03X}#"
    yield f"{asks}21501F01{len(data).to_bytes(4, 'little').hex().upper()}"
    yield f"{answers}60501F0100000000"
    for at in range(0, len(data), 7):
        part, toggle = data[at : at + 7], at // 7 % 2 << 4
        head = toggle | 7 - len(part) << 1 | (at + 7 >= len(data))
        yield f"{asks}{head:02X}{part.ljust(7, bytes(1)).hex().upper()}"
        yield f"{answers}{0x20 | toggle:02X}00000000000000"


def block(node: int, data: bytes) -> Iterator[str]:
    """Yield the frames of a block download, of whole segments."""
    asks, answers = f"{0x600 + node:03X}#", f"{0x580 + node:03X}#"
    yield f"{asks}C6501F01{len(data).to_bytes(4, 'little').hex().upper()}"
    yield f"{answers}A4501F017F000000"
    parts = [data[at : at + 7] for at in range(0, len(data), 7)]
    for begin in range(0, len(parts), 127):
        for number, part in enumerate(parts[begin : begin + 127], 1):
            yield f"{asks}{number | (begin + number == len(parts)) << 7:02X}{part.hex().upper()}"
        yield f"{answers}A2{number:02X}7F0000000000"
    yield f"{asks}C1{crc16(data).to_bytes(2, 'little').hex().upper()}0000000000"
    yield f"{answers}A100000000000000"


def beats() -> Iterator[str]:
    """Yield heartbeats of 39 nodes, EMCY of a third of them, NMT and SYNC."""
    chance = random.Random(1)
    while True:
        for node in range(1, 40):
            yield f"{0x700 + node:03X}#05"
            if chance.random() < 0.3:
                yield f"{0x80 + node:03X}#{chance.choice(EMCIES)}"
        yield from ("000#0100", "080#")


TRAFFIC: dict[str, Callable[[], Iterator[str]]] = {
    "TPDOs": tpdos,
    "a fifth SDO uploads": polled,
    "SDO uploads alone": lambda: polled(every=0),
    "SDO downloads": downloads,
    "heartbeats and EMCY": beats,
}


def write_frames(path: Path, frames: Iterable[str]) -> None:
    """Write a log of these frames."""
    chance, at_us = random.Random(1), START_US
    with path.open("w", encoding="ascii") as file:
        for frame in frames:
            at_us += chance.randrange(100, 300)
            file.write(f"({at_us // 1_000_000:010d}.{at_us % 1_000_000:06d}) can0 {frame}\n")


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
