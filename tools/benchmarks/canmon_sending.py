"""canmon's sending verbs and graphs, beside python-can's MessageSync."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import can

from benchmarks.table import percentiles, row
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.plot import render, svg
from tickrig.host.canmon.model.graph.series import Series, View
from tickrig.host.canmon.model.sequence import SequenceRun, TomlSequence
from tickrig.host.canmon.output.listening import Pace
from tickrig.host.canmon.verbs.play import ReplayPlan
from tickrig.host.links.can_link import to_message
from tickrig.wire.can import CanFrame

FRAMES_S = 2_600
SETTLE_S = 0.5
RUNS = 5
FOREVER = '[[step]]\nrepeat = "forever"\nsteps = [{ send = "080#" }, { wait = "1ms" }]\n'


def run(seconds: float) -> None:
    """Print the rows of this suite; each replay lasts so long."""
    replays(seconds)
    sequences()
    pictures()


def replays(seconds: float) -> None:
    """Replay a log as `canmon play` does, and at the same time as python-can does."""
    with ProcessPoolExecutor(len(PEERS)) as pool:
        replayed = list(pool.map(replay, PEERS, [seconds] * len(PEERS)))
    for who, (late_us, cpu) in zip(PEERS, replayed, strict=True):
        percentiles(f"{who}, {FRAMES_S} frames/s for {seconds:.0f} s: late", late_us, "us")
        first, last = (statistics.median(part) for part in (late_us[:1_000], late_us[-1_000:]))
        row(f"{who}: drift, last 1,000 frames against the first", [last - first], "us")
        row(f"{who}: processor", [100 * cpu], "% of a core")


def replay(who: str, seconds: float) -> tuple[list[float], float]:
    """Return how late the frames of a log go out on a bus that nobody hears, and the load.

    Time counts from when the first frame is asked for: then the clocks of both start.
    """
    log = [
        Record(n * 1_000_000 // FRAMES_S, "can0", CanFrame(0x181 + n % 50, n.to_bytes(8, "little")))
        for n in range(int(FRAMES_S * seconds))
    ]
    late_us: list[float] = []
    with can.Bus(interface="virtual", channel="bench") as bus:
        messages = PEERS[who](log)
        time.sleep(SETTLE_S)
        cpu_s, start_ns = time.process_time(), time.monotonic_ns()
        for message in messages:
            late_us.append((time.monotonic_ns() - start_ns) / 1_000 - log[len(late_us)].at_us)
            bus.send(message)
        span_s = (time.monotonic_ns() - start_ns) / 1e9
    return late_us, (time.process_time() - cpu_s) / span_s


def _planned(log: list[Record]) -> Iterator[can.Message]:
    pace = Pace()
    for at_us, _, frame in ReplayPlan(log, lambda channel: channel):
        pace.wait_until(at_us)
        yield to_message(frame)


def _synced(log: list[Record]) -> Iterator[can.Message]:
    """Return its iterator; the messages are made before its clock starts."""
    return iter(can.MessageSync([to_message(record.frame, record.at_us) for record in log]))


PEERS: dict[str, Callable[[list[Record]], Iterator[can.Message]]] = {
    "canmon play": _planned,
    "python-can MessageSync": _synced,
}


def sequences() -> None:
    """Carry out an endless sequence in virtual time."""
    values = []
    for _ in range(RUNS):
        endless = SequenceRun(TomlSequence(FOREVER, "bench.toml").parse())
        start = time.perf_counter()
        for now_us in range(0, 20_000_000, 1_000):
            endless.tick(now_us)
            endless.events.clear()
        values.append(20_000 / (time.perf_counter() - start))
    row("sequence: steps of send and wait", [2 * value for value in values], "steps/s")


def pictures() -> None:
    """Draw curves of many samples."""
    for count in (2_000, 20_000, 1_000_000):
        wave = [_wave(count)]
        view = View.of(wave)
        row(f"braille, 100x28, {count:,} samples", _ms(partial(render, wave, view, 100, 28)), "ms")
        row(f"SVG, 960x400, {count:,} samples", _ms(partial(svg, wave, view)), "ms")


def _wave(count: int) -> Series:
    series = Series("wave")
    for n in range(count):
        series.append(n * 1_000, math.sin(n / 300) + (n * 7_919 % 101) / 500)
    return series


def _ms(work: Callable[[], object]) -> list[float]:
    values = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        values.append((time.perf_counter() - start) * 1e3)
    return values
