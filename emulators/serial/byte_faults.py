"""Faults of a serial line: effects on the bytes of a device and of its host."""

# Theory of operation
# ===================
#
# `BYTE_FAULTS` declares each fault (`FaultType` of rig/faults.py). The class in the declaration is
# one direction of the fault. There are two kinds of faults.
#
# Plain faults change the bytes that pass in a tick: flip, drop, dup, cut, swap, garbage, repeat,
# truncate, framing, parity. `swap` and `repeat` keep a part of the bytes for the next tick.
#
# Late faults (`_Late`) delay bytes: delay, jitter, split, break. Each keeps a queue, so no byte
# overtakes another. Each part in the queue has an earliest time, and a silence that the line needs
# before the part. The silence counts from the last stop bit of the previous part; only then is a
# pause of 3 ms also a pause on a line of 9600 bit/s. `FaultyPort` reports the time of that stop
# bit (`sent`). Late bytes are sent in a tick of the device, so their times are rounded up to its
# `tick_us`.
#
# Each fault acts on the bytes that the device sends, on those it receives, or on both (`way=`).
# flip, drop, dup and cut act on both by default. The others act by the byte, by the line or by the
# frame (`by=`). A line ends with a line feed. A frame is all bytes that the device sends or
# receives in one tick: an answer, if the device sends each answer in one piece.

from __future__ import annotations

import re
from abc import abstractmethod
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from tickrig.emulators.rig.faults import (
    EITHER_WAY,
    WAY,
    FaultArgument,
    FaultArguments,
    FaultTrigger,
    FaultType,
    HoldingFault,
)
from tickrig.wire.instant import NEVER

_LINES: Final = re.compile(rb"[^\n]*\n|[^\n]+")


def _units(by: str, data: bytes) -> list[bytes]:
    r"""Split bytes into the units that a fault acts on.

    >>> _units("line", b"a\nbc"), _units("byte", b"ab"), _units("frame", b"a\nbc")
    ([b'a\n', b'bc'], [b'a', b'b'], [b'a\nbc'])
    """
    if by == "byte":
        return [data[at : at + 1] for at in range(len(data))]
    return _LINES.findall(data) if by == "line" else [data]


@dataclass(slots=True)
class ByteFault:
    """A wire fault that acts on random bits, bytes, lines or frames of a serial line.

    Attributes:
        trigger: trigger that decides which bits, bytes, lines or frames are affected.
        arguments: arguments of the fault.
    """

    trigger: FaultTrigger
    arguments: FaultArguments


class _Flip(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := self.trigger.hits(8 * len(data))):
            return data
        turned = bytearray(data)
        for bit in hits:
            turned[bit >> 3] ^= 1 << (bit & 7)
        return bytes(turned)


class _Drop(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := set(self.trigger.hits(len(data)))):
            return data
        return bytes(byte for at, byte in enumerate(data) if at not in hits)


class _Dup(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        hits = set(self.trigger.hits(len(data)))
        return b"".join(bytes([byte]) * (1 + (at in hits)) for at, byte in enumerate(data))


class _Cut(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        self.trigger.tally.allow()
        return b""


class _Framing(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        received = bytearray(data)
        for at in self.trigger.hits(len(data)):
            # One bit less on the line: the stop bit is read as the highest data bit.
            received[at] = received[at] >> 1 | 0x80
        return bytes(received)


class _Parity(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        received = bytearray(data)
        for at in self.trigger.hits(len(data)):
            received[at] ^= 1 << self.trigger.chance.draw() % 7  # a data bit on lines of 7 bits too
        return bytes(received)


class _UnitFault(ByteFault):
    """A fault that changes each byte, line or frame that it hits."""

    def __call__(self, now_us: int, data: bytes) -> bytes:
        units = _units(self.arguments["by"], data)
        return b"".join([self._pass(unit) for unit in units])

    def _pass(self, unit: bytes) -> bytes:
        return self._spoil(unit) if self.trigger.hit() else unit

    def _spoil(self, unit: bytes) -> bytes:
        """Return the bytes that arrive in place of a unit."""
        raise NotImplementedError


class _Garbage(_UnitFault):
    def _spoil(self, unit: bytes) -> bytes:
        draw = self.trigger.chance.draw
        noise = bytes(draw() & 0xFF for _ in range(self.arguments["bytes"]))
        return noise + unit if self.arguments["place"] == "before" else unit + noise


class _Truncate(_UnitFault):
    def _spoil(self, unit: bytes) -> bytes:
        number, is_share = self.arguments["keep"]
        return unit[: len(unit) * number // 100 if is_share else number]


class _Swap(_UnitFault):
    _held = b""

    def _pass(self, unit: bytes) -> bytes:
        if self._held:
            unit, self._held = unit + self._held, b""
            return unit
        return super()._pass(unit)

    def _spoil(self, unit: bytes) -> bytes:
        self._held = unit
        return b""

    def __call__(self, now_us: int, data: bytes) -> bytes:
        passed = super().__call__(now_us, data)
        if self.arguments["by"] == "byte":  # the last of an odd number has nothing to go behind
            passed, self._held = passed + self._held, b""
        return passed


class _Repeat(_UnitFault):
    _before = b""

    def _pass(self, unit: bytes) -> bytes:
        # Without an answer before this one it could not act: no chance is drawn.
        passed = super()._pass(unit) if self._before else unit
        self._before = unit
        return passed

    def _spoil(self, unit: bytes) -> bytes:
        return self._before + (unit if self.arguments["place"] == "before" else b"")


class _Late(ByteFault, HoldingFault[bytes]):
    """A fault that delays bytes, in their order."""

    is_late = True

    def __init__(self, trigger: FaultTrigger, arguments: FaultArguments) -> None:
        super().__init__(trigger, arguments)
        # Not before this time, so much silence before it, and the bytes.
        self._queue: deque[tuple[int, int, bytes]] = deque()
        self._free_us = 0  # when the line will have sent what went last

    @property
    def due_us(self) -> int:
        """Time at which the next bytes are sent."""
        if not self._queue:
            return NEVER
        at_us, pause_us, _ = self._queue[0]
        return max(at_us, self._free_us + pause_us) if pause_us else at_us

    def __call__(self, now_us: int, data: bytes, /) -> bytes:
        """Accept bytes; return the bytes that pass at once."""
        for unit in _units(self.arguments["by"], data):
            if self.trigger.hit():
                self._queue.extend(self._delayed(now_us, unit))
            else:
                self._queue.append((now_us, 0, unit))
        return self.release(now_us) or b""

    def release(self, now_us: int) -> bytes | None:
        """Return the bytes to send now."""
        out = b""
        while self.due_us <= now_us:
            out += self._queue.popleft()[2]
            self._free_us = now_us
        return out or None

    def end(self) -> None:
        """Stop delaying bytes."""
        self.trigger.tally.count = self.trigger.tally.acted

    def take_over(self, other: HoldingFault[bytes]) -> None:
        """Take over the held bytes of the fault that this fault replaces."""
        assert isinstance(other, _Late)
        self._queue, self._free_us = other._queue, other._free_us

    def sent(self, until_us: int) -> None:
        """Record the time at which the line will have sent the latest bytes.

        If the fault makes a pause before the next bytes, the pause begins at this time.

        Args:
            until_us: time at which the last byte has been sent, in microseconds.
        """
        self._free_us = max(self._free_us, until_us)

    @abstractmethod
    def _delayed(self, now_us: int, unit: bytes) -> list[tuple[int, int, bytes]]:
        """Return the times of the parts of a unit."""


class _Delay(_Late):
    def _delayed(self, now_us: int, unit: bytes) -> list[tuple[int, int, bytes]]:
        return [(now_us + self.arguments["time"], 0, unit)]


class _Jitter(_Late):
    def _delayed(self, now_us: int, unit: bytes) -> list[tuple[int, int, bytes]]:
        late_us = self.trigger.chance.draw() % (self.arguments["time"] + 1)
        return [(now_us + late_us, 0, unit)]


class _Split(_Late):
    def _delayed(self, now_us: int, unit: bytes) -> list[tuple[int, int, bytes]]:
        count, pause_us = min(self.arguments["pieces"], len(unit)), self.arguments["pause"]
        ends = [number * len(unit) // count for number in range(count + 1)]
        pieces = [unit[begin:end] for begin, end in pairwise(ends)]
        return [(now_us, number and pause_us, piece) for number, piece in enumerate(pieces)]


class _Break(_Late):
    def _delayed(self, now_us: int, unit: bytes) -> list[tuple[int, int, bytes]]:
        # A UART delivers a break as one byte of 0, however long it is.
        return [(now_us, 0, b"\0"), (now_us, self.arguments["time"], unit)]


def _by(default: str) -> FaultArgument:
    return FaultArgument("by", "what it hits", default, choices=("byte", "line", "frame"))


def _place(*choices: str) -> FaultArgument:
    return FaultArgument("place", "where it comes", choices[0], choices=choices)


def _time(name: str, text: str, default: str) -> FaultArgument:
    return FaultArgument(name, text, default, "time", 1, 3_600_000_000)


def _read_keep(word: str) -> tuple[int, bool]:
    """Read the part that remains: a number, and whether the number is a percentage.

    >>> _read_keep("half"), _read_keep("3"), _read_keep("90%")
    ((50, True), (3, False), (90, True))
    """
    if word == "half":
        return 50, True
    number = word.removesuffix("%")
    is_share = number != word
    if not (number.isdecimal() and number.isascii()) or (is_share and int(number) > 100):
        raise ValueError(f"keep {word!r} is not half, a number of bytes or a share, as 30%")
    return int(number), is_share


_KEEP: Final = FaultArgument(
    "keep",
    "what is left of it",
    "half",
    "half, a number of bytes or a share such as 30%",
    read=_read_keep,
)
_BYTES: Final = FaultArgument("bytes", "how many", "1", "bytes", 1, 4_096)
_PIECES: Final = FaultArgument("pieces", "how many", "2", "pieces", 2, 4_096)
_FRAME: Final = _by("frame")

BYTE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    "flip": FaultType("each bit is inverted at this rate", _Flip, arguments=(EITHER_WAY,)),
    "drop": FaultType("each byte is lost at this rate", _Drop, arguments=(EITHER_WAY,)),
    "dup": FaultType("each byte arrives twice at this rate", _Dup, arguments=(EITHER_WAY,)),
    "cut": FaultType("nothing passes", _Cut, rated=False, arguments=(EITHER_WAY,)),
    "delay": FaultType(
        "an answer comes late", _Delay, arguments=(_time("time", "how late", "100ms"), _FRAME, WAY)
    ),
    "jitter": FaultType(
        "an answer comes late by a random time",
        _Jitter,
        arguments=(_time("time", "how late at most", "20ms"), _FRAME, WAY),
    ),
    "split": FaultType(
        "an answer comes in pieces with pauses",
        _Split,
        arguments=(_time("pause", "silence between two pieces", "3ms"), _PIECES, _FRAME, WAY),
    ),
    "swap": FaultType(
        "two neighbours arrive in the wrong order", _Swap, arguments=(_by("byte"), WAY)
    ),
    "garbage": FaultType(
        "random bytes come before an answer, or after it",
        _Garbage,
        arguments=(_BYTES, _place("before", "behind"), _FRAME, WAY),
    ),
    "repeat": FaultType(
        "the previous answer comes again: before this one, or instead of it",
        _Repeat,
        arguments=(_place("before", "instead"), _FRAME, WAY),
    ),
    "truncate": FaultType(
        "the end of an answer is lost", _Truncate, arguments=(_KEEP, _FRAME, WAY)
    ),
    "break": FaultType(
        "the line is 0 before an answer: the host reads a byte of 0",
        _Break,
        arguments=(_time("time", "how long", "2ms"), _FRAME, WAY),
        uart_error="breaks",
    ),
    "framing": FaultType(
        "a byte arrives one bit short, its stop bit as highest data bit",
        _Framing,
        arguments=(WAY,),
        uart_error="framing",
    ),
    "parity": FaultType(
        "a data bit of a byte is inverted, its parity bit is not",
        _Parity,
        arguments=(WAY,),
        uart_error="parity",
    ),
}
