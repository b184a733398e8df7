"""What a device on a serial line said, and what an emulator says to the same host."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Final

from tickrig.emulators.commands.device_type import ConfiguredDevice
from tickrig.emulators.record.bench_replay import BenchRecording, do, play_device, traffic_of
from tickrig.emulators.record.comparison import Said, compare
from tickrig.emulators.record.tolerance import Tolerance
from tickrig.emulators.record.wire_log import Splitter, WireLine, line_splitter
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.text.bench_record import BenchRecord
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER

SEARCHED_US: Final = 10_000_000
"""So long after it was switched on an emulator may say the first that was recorded."""

PHASES: Final = 8
"""So many places of the emulator's ticks are tried; a port does not show where they begin."""


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """Two runs of a device, in the time of the recording.

    Attributes:
        recorded: what was recorded.
        emulated: what the emulator says.
    """

    recorded: list[Said]
    emulated: list[Said]


def compare_ticks(
    recording: BenchRecording, name: str, configured: ConfiguredDevice
) -> ComparedRun:
    """Feed the emulator tick by tick, as the recorded device was.

    Args:
        recording: recorded at the device.
        name: of the device.
        configured: a fresh one.
    """
    split = configured.type.line.splitter or line_splitter
    said = traffic_of(recording.of(name), Mark.FROM_DEVICE)
    played = ((at, data, 0) for at, data in play_device(recording, name, configured.device))
    return ComparedRun(
        list(cut(split(Mark.FROM_DEVICE), said)), list(cut(split(Mark.FROM_DEVICE), played))
    )


def compare_port(
    recording: BenchRecording,
    name: str,
    make: Callable[[], ConfiguredDevice],
    tolerance: Tolerance,
    settle_us: int,
) -> ComparedRun:
    """Let the recorded host talk to the emulator over a line, at its times.

    Args:
        recording: recorded at the host's port.
        name: of the device.
        make: makes the device.
        tolerance: how long after the end the emulator may still answer.
        settle_us: how long the emulator has been on when the recording begins. If what the
            device said first is what it says by itself when it is switched on, that is tried
            too; so are other places of its ticks where something was set for less than one.
            The closest counts.
    """
    records, device = recording.of(name), make().device
    until_us = recording.until_us + tolerance.allowed_us(recording.until_us)
    split = make().type.line.splitter or line_splitter
    recorded = list(cut(split(Mark.FROM_DEVICE), traffic_of(records, Mark.FROM_DEVICE)))

    def run(begin_us: int) -> ComparedRun:
        emulated = _play(make(), records, begin_us, begin_us + until_us)
        return ComparedRun(recorded, [x for x in emulated if x.at_us >= -tolerance.time_us])

    phases = PHASES if has_short_change(records, device.tick_us) else 1
    begins = [settle_us + device.tick_us * phase // phases for phase in range(phases)]
    if recorded:
        begins += begin_with(recorded[0], _play(make(), (), 0, SEARCHED_US), tolerance)
    return closest(map(run, begins), recording.until_us, tolerance)


def has_short_change(records: Iterable[BenchRecord], tick_us: int) -> bool:
    """Say whether an input was set twice within a tick: only some ticks see what was between."""
    latest: dict[str, int] = {}
    for record in records:
        if record.mark is Mark.PHYSICAL and (change := record.change) is not None:
            if record.at_us - latest.get(change[0], -NEVER) < tick_us:
                return True
            latest[change[0]] = record.at_us
    return False


def begin_with(first: Said, alone: Iterable[Said], tolerance: Tolerance) -> list[int]:
    """Return when a recording began, if the device said that by itself.

    Args:
        first: what it said first.
        alone: what the emulator says since it was switched on, if nobody does anything.
        tolerance: what counts as the same.
    """
    found = (said.at_us for said in alone if tolerance.same(first.text, said.text))
    return [at_us - first.at_us for at_us in islice(found, 1)]


def closest(runs: Iterable[ComparedRun], until_us: int, tolerance: Tolerance) -> ComparedRun:
    """Return the run with the fewest differences, the first of them."""

    def differences(run: ComparedRun) -> int:
        pairs = compare(run.recorded, run.emulated, until_us, tolerance)
        return sum(bool(pair.difference) for pair in pairs)

    return min(runs, key=differences)


def _play(
    configured: ConfiguredDevice, records: Iterable[BenchRecord], begin_us: int, end_us: int
) -> list[Said]:
    """Return what the emulator says, from the begin of the recording."""
    emulator = Emulator(configured.type.name, configured.device, line=configured.type.line)
    said: list[Said] = []

    def hear(line: WireLine) -> None:
        if line.mark is Mark.FROM_DEVICE:
            said.append(Said(line.at_us - begin_us, escape(line.data)))

    emulator.log.listeners.append(hear)
    for number, record in enumerate(records):
        at_us = begin_us + record.at_us
        if record.mark is Mark.PHYSICAL or (record.mark is Mark.TO_DEVICE and at_us >= 0):
            emulator.event_queue.put(number, max(0, at_us), partial(_act, emulator, record))
    emulator.event_queue.put("end", end_us, lambda now_us: emulator.stop())
    while emulator.running and emulator.rig.now_us < NEVER:
        emulator.step()
    return said


def _act(emulator: Emulator, record: BenchRecord, now_us: int) -> None:
    """Do what the recorded host did, or the hand at the device."""
    if isinstance(record.traffic, bytes) and record.mark is Mark.TO_DEVICE:
        emulator.send(now_us, record.traffic)
    else:
        do(emulator.device, record)


def cut(split: Splitter, traffic: Iterable[tuple[int, object, int]]) -> Iterator[Said]:
    """Give the lines of what passed, each with the time and the line of its end."""
    for at_us, data, line in traffic:
        assert isinstance(data, bytes)
        for whole in split(at_us, data):
            yield Said(at_us, escape(whole), line)
