"""canmon's statistics, checks and `top`, beside python-can's reader, Notifier and can_viewer."""

from __future__ import annotations

import os
import random
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import can
import pexpect

from benchmarks.canmon_decode import seconds
from benchmarks.table import rates, row
from tickrig.host.canmon.model.check.column_check import ColumnChecker
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.columns.column_traffic import ColumnTraffic
from tickrig.host.canmon.model.columns.columns import Columns
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.top_model import TableView, TopModel, render
from tickrig.host.canmon.model.traffic import Traffic, TrafficSnapshot
from tickrig.host.canmon.sources.source import open_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.links.can_link import to_message
from tickrig.wire.can import CanFrame

FRAMES = 1_000_000
DIRTY = 10
"""Each tenth frame of the dirty log breaks a rule."""
LIVE = 100_000
IDS = 50
RUNS = 5
BIT_RATE = 1_000_000
CPU = "s of processor"
WORDS = ("-b", "1000000", "--max-load", "100", "--no-emcy", "--no-sdo-abort", "--nodes", "1-50")
RULES = parse_rules(
    {
        "max_load": 100,
        "no_emcy": True,
        "no_sdo_abort": True,
        "no_error_frames": True,
        "no_reboot": True,
        "nodes": "1-50",
        "heartbeat": [f"{node}=1125ms±20%" for node in range(1, 51)],
        "max_gap": [f"{0x180 + node:03X}=100ms" for node in range(1, 51)],
    }
)


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    with tempfile.TemporaryDirectory() as folder:
        clean, dirty = Path(folder, "clean.log"), Path(folder, "dirty.log")
        write_log(clean, dirty=False)
        write_log(dirty, dirty=True)
        whole("clean", clean)
        whole("dirty", dirty)
        python_can_reader(clean)
        growth(Path(folder, "part.log"))
    live()
    painting()
    first_paint()


def write_log(path: Path, *, dirty: bool, frames: int = FRAMES) -> None:
    """Write PDOs of 50 nodes at about 6,700 frames/s, a heartbeat each 1.1 s."""
    chance, at_us = random.Random(1), 1_700_000_000_000_000
    with path.open("w", encoding="ascii") as file:
        for n in range(frames):
            at_us += chance.randrange(100, 200)
            node = n % IDS + 1
            text = f"{0x180 + node:03X}#{n:08X}{chance.randrange(1 << 32):08X}"
            if n % 150 == 0:
                text = f"{0x700 + n // 150 % IDS + 1:03X}#05"
            if dirty and n % DIRTY == 0:
                text = f"{0x080 + node:03X}#3081110000000000"
            file.write(f"({at_us // 1_000_000}.{at_us % 1_000_000:06d}) can0 {text}\n")


def whole(what: str, path: Path) -> None:
    """Read, count and check a log of a million frames."""
    blocks = list(read_columns(path))
    found = checked(blocks)
    row(f"{what} log of 1 M frames: statistics", _cpu_s(lambda: counted(blocks)), CPU)
    row(
        f"{what} log of 1 M frames: checks, {found:,} findings",
        _cpu_s(lambda: checked(blocks)),
        CPU,
    )

    def all_of_it() -> None:
        found = list(read_columns(path))
        counted(found)
        checked(found)

    row(f"{what} log of 1 M frames: reading, statistics and checks", _cpu_s(all_of_it), CPU)
    seconds(f"canmon check, {what} log", ["canmon", "check", str(path), *WORDS])
    seconds(f"canmon stats, {what} log", ["canmon", "stats", str(path)])
    seconds(f"canopen-lens, {what} log", ["canopen-lens", str(path), "--lang", "en"])


def counted(blocks: Iterable[Columns]) -> TrafficSnapshot:
    """Return the statistics of a log."""
    traffic = ColumnTraffic()
    for block in blocks:
        traffic.take(block)
    return traffic.snapshot()


def checked(blocks: Iterable[Columns]) -> int:
    """Return how many findings a log has."""
    checker = ColumnChecker(RULES, BIT_RATE)
    return sum(len(checker.take(block)) for block in blocks) + len(checker.end())


def growth(path: Path) -> None:
    """Check dirty logs of three sizes: what a finding takes should stay the same."""
    for frames in (FRAMES // 16, FRAMES // 4, FRAMES):
        write_log(path, dirty=True, frames=frames)
        blocks = list(read_columns(path))
        found = checked(blocks)
        each = _cpu_s(partial(checked, blocks))
        what = f"{frames:,} dirty frames: {found:,} findings"
        row(what, [1e6 * value / found for value in each], "us a finding")
        seconds(
            f"canopen-lens, {frames:,} dirty frames", ["canopen-lens", str(path), "--lang", "en"]
        )


def python_can_reader(path: Path) -> None:
    """Read the same with python-can, which counts nothing; once, for it takes long."""
    start = time.process_time()
    with can.LogReader(path) as reader:
        count = sum(1 for _ in reader)
    assert count == FRAMES
    row("python-can: reading the clean log alone", [time.process_time() - start], CPU)


def live() -> None:
    """Count frames as they come."""
    chance = random.Random(2)
    records = [
        Record(
            n * 100, "can0", CanFrame(0x181 + n % IDS, n.to_bytes(4, "big") + chance.randbytes(4))
        )
        for n in range(LIVE)
    ]

    def model() -> None:
        traffic = Traffic()
        for record in records:
            traffic.take(record)

    rates("model, frame by frame, payloads that change", LIVE, "frames/s", model)
    messages = [
        to_message(record.frame) for record in records if isinstance(record.frame, CanFrame)
    ]
    rates("bus of python-can, thread, queue, statistics", LIVE, "frames/s", _through_us(messages))
    rates("python-can Notifier, a listener that counts", LIVE, "frames/s", _notified(messages))


def _through_us(messages: list[can.Message]) -> Callable[[], None]:
    def work() -> None:
        source = open_source(["virtual:bench-model"], BusOptions())
        model, sender = TopModel(), _sender(messages)
        count = 0
        while count + source.lost < LIVE:
            records = source.poll(100_000)
            count += len(records)
            model.take(records)
        sender.join()
        source.close()
        assert source.lost == 0

    return work


def _notified(messages: list[can.Message]) -> Callable[[], None]:
    def work() -> None:
        count, done = [0], threading.Event()

        def listener(message: can.Message) -> None:
            count[0] += 1
            if count[0] == LIVE:
                done.set()

        with can.Bus(interface="virtual", channel="bench-model") as bus:
            notifier = can.Notifier(bus, [listener])
            sender = _sender(messages)
            done.wait()
            sender.join()
            notifier.stop()

    return work


def _sender(messages: list[can.Message]) -> threading.Thread:
    def send() -> None:
        with can.Bus(interface="virtual", channel="bench-model") as bus:
            for message in messages:
                bus.send(message)

    thread = threading.Thread(target=send)
    thread.start()
    return thread


def painting() -> None:
    """Make a screen of 50 identifiers."""
    traffic = Traffic()
    for n in range(20_000):
        traffic.take(Record(n * 100, "can0", CanFrame(0x181 + n % IDS, n.to_bytes(8, "big"))))

    def work() -> None:
        for _ in range(100):
            render(traffic.snapshot(), TableView(styled=True), 0, 160, 60)

    rates("snapshot and screen of 50 identifiers", 100, "/s", work)


def first_paint() -> None:
    """Start in a terminal until the first screen is there."""
    top = [sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()", "top"]
    viewer = [sys.executable, "-m", "can.viewer", "-i", "virtual", "-c", "bench"]
    with tempfile.TemporaryDirectory() as folder:
        env = {**os.environ, "PYTHONPYCACHEPREFIX": folder}
        env.pop("PYTHONDONTWRITEBYTECODE", None)  # both compiled, as when installed
        row("canmon top: first paint", _painted([*top, "virtual:bench"], "lost 0", env), "s")
        row("can_viewer: first paint", _painted(viewer, "Count", env), "s")


def _painted(command: list[str], text: str, env: Mapping[str, str]) -> list[float]:
    values = []
    for _ in range(1 + RUNS):
        start = time.perf_counter()
        child = pexpect.spawn(
            command[0], command[1:], dimensions=(40, 120), env=dict(env), encoding="utf-8"
        )
        child.expect_exact(text, timeout=20)
        values.append(time.perf_counter() - start)
        child.sendintr()
        child.expect(pexpect.EOF, timeout=20)
        child.close()
    return values[1:]


def _cpu_s(work: Callable[[], object]) -> list[float]:
    """Return the processor's time: it does not count what others on the machine take."""
    values = []
    for _ in range(RUNS):
        start = time.process_time()
        work()
        values.append(time.process_time() - start)
    return values
