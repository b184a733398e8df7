"""What happened on a bench: lines and frames of all wires, and what was done to the devices."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from tickrig.emulators.record.frames import FrameFormat, hex_text
from tickrig.emulators.record.wire_log import Splitter, WireLine, WireLog
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import format_time
from tickrig.wire.can import CanFrame, ErrorFrame, Frames

KEPT: Final = 10_000
"""So many lines are kept; of those before it is known how many there were."""

_MAPPINGS_KEPT: Final = 4_000
"""So many frames that say what PDOs carry are kept beyond that."""

_SDO_IDS: Final = range(0x581, 0x680)
_ERROR_CONTROL_IDS: Final = range(0x701, 0x780)
_PDO_OBJECTS: Final = range(0x1400, 0x1C00)
"""What PDOs carry is written there, by SDO; a boot-up ends what was written."""

_ENDS: Final = (b"host", b"device")


class Journal(WireLog):
    """The latest lines and frames of all wires, and what was done, in the order of happening.

    A line counts as passed when the device takes its end, or sends it. A serial line has what the
    host sent and hears; what a fault changed of it, as the device takes or sends it, is a line of
    the mark `~`.
    """

    def __init__(self) -> None:
        super().__init__(KEPT)
        self._logs: list[tuple[str, WireLog]] = []
        self._mappings: deque[WireLine] = deque(maxlen=_MAPPINGS_KEPT)

    def of_line(
        self, source: str, splitter: Callable[[Mark], Splitter] | None
    ) -> Callable[[int, Mark, bytes], None]:
        """Return what takes the bytes of a serial line, cut anywhere."""
        log = WireLog(0) if splitter is None else WireLog(0, splitter)
        log.listeners.append(lambda line: self.add(line.at_us, line.mark, line.data, source))
        self._logs.append((source, log))
        return log.hear

    def of_faults(
        self,
        source: str,
        ends: tuple[bytes, bytes] = _ENDS,
        splitter: Callable[[Mark], Splitter] | None = None,
    ) -> Callable[[int, Mark, bytes | Frames, bytes | Frames], None]:
        """Return what takes traffic as it was sent, and as it is heard.

        Args:
            source: the line, or the node.
            ends: who is at the far end, and who at the near one.
            splitter: of the line; bytes of one without a delimiter are shown in hex.
        """
        is_binary = isinstance(splitter, FrameFormat) and not splitter.delimiter

        def hear(at_us: int, mark: Mark, sent: bytes | Frames, received: bytes | Frames) -> None:
            if is_binary and isinstance(sent, bytes) and isinstance(received, bytes):
                sent, received = hex_text(sent).encode(), hex_text(received).encode()
            sender, receiver = ends if mark is Mark.TO_DEVICE else ends[::-1]
            words = (
                b"the",
                receiver,
                b"hears",
                _shown(received) or b"nothing",
                b"where the",
                sender,
                b"sent",
            )
            self.add(at_us, Mark.WIRE, b" ".join((*words, _shown(sent))), source)

        return hear

    def of_lost(self, source: str) -> Callable[[int, CanFrame], None]:
        """Return what takes the frames of a bus that no node takes."""

        def hear(at_us: int, frame: CanFrame) -> None:
            self.add(at_us, Mark.WIRE, f"no node takes {frame}".encode(), source)

        return hear

    def of_bus(self, source: str) -> Callable[[int, CanFrame | ErrorFrame], None]:
        """Return an observer of a CAN bus."""

        def hear(at_us: int, frame: CanFrame | ErrorFrame) -> None:
            self.add(at_us, Mark.FROM_DEVICE, frame, source)
            if isinstance(frame, CanFrame) and _maps(frame):
                data = str(frame).encode()
                line = WireLine(self._count, at_us, Mark.FROM_DEVICE, data, source)
                self._mappings.append(line)

        return hear

    def unfinished(self) -> tuple[WireLine, ...]:
        """Return what has begun on serial lines and did not end, by the time of its last byte."""
        found = [
            replace(line, source=name) for name, log in self._logs for line in log.unfinished()
        ]
        return tuple(sorted(found, key=lambda line: line.at_us))

    def lines(self) -> tuple[WireLine, ...]:
        """Return what is kept."""
        return self.since(0)

    def mappings(self) -> tuple[WireLine, ...]:
        """Return the frames before those that are kept which say what PDOs carry."""
        first = self._count - KEPT
        return tuple(line for line in self._mappings if line.number <= first)


def _shown(traffic: bytes | Frames) -> bytes:
    return traffic if isinstance(traffic, bytes) else " ".join(map(str, traffic)).encode()


def _maps(frame: CanFrame) -> bool:
    """Say whether a frame writes or reads what PDOs carry, or is a boot-up."""
    if frame.can_id in _SDO_IDS:
        return int.from_bytes(frame.data[1:3], "little") in _PDO_OBJECTS
    return frame.can_id in _ERROR_CONTROL_IDS and frame.data == b"\0"


def text_of(lines: Sequence[WireLine]) -> str:
    """Write what is kept for people, a line each.

    How many lines came before these, and are kept no more, stands above them.
    """
    written = [line_text(line) for line in lines]
    if missing := missing_of(lines):
        written.insert(0, f"({missing})")
    return "\n".join(written)


def line_text(line: WireLine) -> str:
    """Write a line for people: time in seconds, which wire or device, direction, text."""
    return f"{format_time(line.at_us)} {line.source} {line.mark} {escape(line.data)}"


def missing_of(lines: Sequence[WireLine]) -> str:
    """Say how many lines came before these, and are kept no more; empty if none did."""
    before = lines[0].number - 1 if lines else 0
    came = f"{before} {'line' if before == 1 else 'lines'} came before"
    return f"{came}; the last {len(lines)} are kept" if before else ""
