"""Replay a recorded run on a fresh device and find the first difference."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.emulators.record.replay_port import Difference, ReplayPort, first_difference
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.text.trace import (
    RESET,
    Header,
    Mark,
    Record,
    TraceError,
    parse_header,
    parse_records,
    trace_text,
)


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


def read_recording(data: bytes) -> Recording:
    """Read a trace, also one whose writer was killed in the middle of a line.

    Raises:
        TraceError: not a trace of this version, or a line of it is damaged.
    """
    first, *lines = trace_text(data).split("\n")
    header = parse_header(first)
    records = tuple(parse_records(lines[:-1]))
    ended = bool(records) and records[-1].mark is Mark.END
    if not ended:
        records = tuple(r for r in records if r.at_us < records[-1].at_us)
    return Recording(header, records, ended)


def replay(recording: Recording, device: Emulated[bytes]) -> Difference[bytes] | None:
    """Feed a fresh device what was recorded; None if it said the same.

    Raises:
        TraceError: the trace names an input that the device does not have.
    """
    records = recording.records
    received = ((r.at_us, r.data) for r in records if r.mark is Mark.TO_DEVICE)
    port = ReplayPort(received, b"")
    rig = Rig(Station(device, port))
    for record in records:
        if record.mark is Mark.PHYSICAL:
            rig.run_to(record.at_us - 1)
            _set_signal(device, record)
    rig.run_to(recording.until_us)
    said = [(r.at_us, r.data, r.line) for r in records if r.mark is Mark.FROM_DEVICE]
    return first_difference(said, port.sent, b"")


def _set_signal(device: Emulated[bytes], record: Record) -> None:
    if record.text == RESET:
        device.reset()
        return
    try:
        device.inputs.set(*record.change)
    except ValueError as error:
        raise TraceError(f"line {record.line}: {error}") from None
