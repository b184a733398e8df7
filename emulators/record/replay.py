"""Replay a recorded run on a fresh device and find the first difference."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.host.text.trace import (
    RESET,
    Header,
    Mark,
    Record,
    TraceError,
    parse_header,
    parse_records,
)
from tickrig.wire.instant import NEVER


@dataclass(frozen=True, slots=True)
class Recording:
    """A trace as it was read.

    Attributes:
        header: which device, and how it was configured.
        records: the lines in order.
        ended: whether it says how long the run lasted.
            Without that the writer was killed or its disk full, and the last
            tick, which may not be whole, is left out.
    """

    header: Header
    records: tuple[Record, ...]
    ended: bool

    @property
    def until_us(self) -> int:
        """How far the recording reaches."""
        return self.records[-1].at_us if self.records else 0

    @property
    def ticks(self) -> int:
        """How many ticks had traffic or a change."""
        return len({record.at_us for record in self.records if record.mark is not Mark.END})


@dataclass(frozen=True, slots=True)
class Difference:
    """The first tick at which a replay did not say what was recorded.

    Attributes:
        at_us: the tick.
        recorded: what the device said then.
        replayed: what it says now.
        line: the line of the trace, 0 if it said nothing then.
    """

    at_us: int
    recorded: bytes
    replayed: bytes
    line: int


def read_recording(data: bytes) -> Recording:
    """Read a trace, also one whose writer was killed in the middle of a line.

    Raises:
        TraceError: not a trace of this version, or a line of it is damaged.
    """
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError as error:
        raise TraceError(f"not a trace: byte {error.start} is not ASCII") from None
    first, *lines = text.split("\n")
    header = parse_header(first)
    records = tuple(parse_records(lines[:-1]))
    ended = bool(records) and records[-1].mark is Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return Recording(header, records, ended)


def replay(recording: Recording, device: Emulated[bytes]) -> Difference | None:
    """Feed a fresh device what was recorded; None if it said the same.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    records = recording.records
    port = _ReplayPort(record for record in records if record.mark is Mark.TO_DEVICE)
    rig = Rig(Station(device, port))
    for record in records:
        if record.mark is Mark.PHYSICAL:
            rig.run_to(record.at_us - 1)
            _set_signal(device, record)
    rig.run_to(recording.until_us)
    said = [record for record in records if record.mark is Mark.FROM_DEVICE]
    return _first_difference(said, port.sent)


def _set_signal(device: Emulated[bytes], record: Record) -> None:
    if record.text == RESET:
        device.reset()
        return
    try:
        device.inputs.set(*record.change)
    except ValueError as error:
        raise TraceError(f"line {record.line}: {error}") from None


def _first_difference(recorded: Sequence[Record], replayed: Sequence[Record]) -> Difference | None:
    silence = Record(NEVER, Mark.FROM_DEVICE)
    for then, now in zip_longest(recorded, replayed, fillvalue=silence):
        if (then.at_us, then.data) != (now.at_us, now.data):
            first_us = min(then.at_us, now.at_us)
            old, new = (r if r.at_us == first_us else silence for r in (then, now))
            return Difference(first_us, old.data, new.data, old.line)
    return None


class _ReplayPort:
    """Gives the device what it heard at the ticks it heard it."""

    def __init__(self, recorded: Iterable[Record]) -> None:
        self._recorded = deque(recorded)
        self.sent: list[Record] = []

    @property
    def due_us(self) -> int:
        return self._recorded[0].at_us if self._recorded else NEVER

    def poll(self, now_us: int, /) -> bytes:
        out = b""
        while self._recorded and self._recorded[0].at_us <= now_us:
            out += self._recorded.popleft().data
        return out

    def send(self, now_us: int, traffic: bytes, /) -> None:
        if traffic:
            self.sent.append(Record(now_us, Mark.FROM_DEVICE, traffic))
