"""Frames of a binary protocol: where they end on a serial line, and how people read them."""

# Theory of operation
# ===================
#
# A `FrameFormat` says how a stream of bytes is cut into frames. Both ends of a test use it: a
# device, which takes `rule.splitter()` and pushes what it receives, and the log of its line
# (`LineSettings(splitter=rule)`), which calls the rule for each direction and shows the frames
# in transcripts, failure reports and HTML pages.
#
# Every byte is in exactly one piece. What is no frame is a piece as well, because people have
# to see it, and a device refuses it by its check. So a rule never raises and never loses bytes.
# Bytes before a header end with that header, not with what came at once: pieces do not depend
# on how the bytes arrived.
#
# There are four rules. Three know where a frame ends: `by_size`, `by_delimiter`, `by_length`.
# A silence of `gap` ends a frame that has only begun, so a lost byte costs one frame. `by_gap`
# knows the silence alone: its frame is whole when the silence is over, which is later than its
# last byte. `due_us` says when; `WireLog` asks it before it takes anything later, so request
# and answer stand in the order and with the times in which they passed; and it lets the rig
# stop there (`WireLog.follow`), so that the last frame ends as well.
#
# The log shows text. Without a description a frame is shown in hex. A description is a function
# of a frame, or an object with such a method `parse` (a Struct of the library construct): it
# returns the fields by name. A frame that it refuses is shown in hex with the reason.

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Final, Literal, Protocol

from tickrig.device.twin import Copyable, Immutable
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.wire.instant import NEVER

_MOST_BYTES: Final = 4_096
_SHOWN_BYTES: Final = 32
_SHOWN_ITEMS: Final = 8
_REASON_CHARACTERS: Final = 80


class _HasParse(Protocol):
    """What a description may be: a Struct of construct is one."""

    @property
    def parse(self) -> Callable[[bytes], Any]:
        """Return the fields of a frame; raises an exception if it is none."""
        ...


FrameFields = Callable[[bytes], Mapping[str, Any]] | _HasParse
"""Describes frames: returns the fields of one by name, or raises an exception."""

_Cut = Callable[[bytes], int]
"""Returns how long the first piece of some bytes is, 0 if it is not whole yet."""


@dataclass(frozen=True, slots=True)
class FrameFormat(Immutable):
    """How the bytes of a serial line are cut into frames, and how a log shows them.

    Made by `by_gap`, `by_length`, `by_size` and `by_delimiter`.

    Attributes:
        cut: returns the length of the first piece of some bytes, 0 if it is not whole yet.
        gap_us: a silence of this length ends a frame that has begun; `NEVER` if none does.
        delimiter: what ends each frame and is not part of it.
        request: describes what the host sends, see `described`.
        answer: describes what the device sends.
    """

    cut: Callable[[bytes], int]
    gap_us: int = NEVER
    delimiter: bytes = b""
    request: FrameFields | None = None
    answer: FrameFields | None = None

    def described(self, request: FrameFields, answer: FrameFields | None = None) -> FrameFormat:
        """Return the same rule, whose log shows frames field by field.

        Args:
            request: describes what the host sends: a function that returns the fields of a frame
                by name, or an object with such a method `parse`, as a Struct of construct. It
                raises an exception if the bytes are no frame.
            answer: describes what the device sends; the same unless given.

        Returns:
            The rule.
        """
        return replace(self, request=request, answer=answer or request)

    def splitter(self) -> FrameSplitter:
        """Return what cuts the bytes of one direction, for a device."""
        return FrameSplitter(self)

    def shown(self, mark: Mark, frame: bytes) -> bytes:
        """Return a frame as a log shows it.

        Args:
            mark: its direction.
            frame: its bytes.

        Returns:
            Its fields, or hex.
        """
        fields = self.request if mark is Mark.TO_DEVICE else self.answer
        if fields is None:
            is_text = self.delimiter and frame.isascii() and frame.decode("ascii").isprintable()
            return frame if is_text else hex_text(frame).encode()
        try:
            parsed = fields(frame) if callable(fields) else fields.parse(frame)
            return _fields_text(parsed).encode()
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:_REASON_CHARACTERS]
            return f"{hex_text(frame)} ({reason})".encode()

    def __call__(self, mark: Mark) -> FrameLog:
        """Return what cuts one direction for a log.

        Args:
            mark: the direction.

        Returns:
            What takes bytes and returns the frames as text.
        """
        return FrameLog(self, mark)


class FrameSplitter(Copyable):
    """Takes bytes in and gives frames out; chunking makes no difference.

    Args:
        rule: where frames end.

    Attributes:
        begun: the bytes of a frame that is not whole.
        last_us: when they came.
    """

    def __init__(self, rule: FrameFormat) -> None:
        self._rule = rule
        self.begun, self.last_us = b"", 0

    @property
    def due_us(self) -> int:
        """When a silence ends the frame that has begun; `NEVER` if none does."""
        return self.last_us + self._rule.gap_us if self.begun and self._ends else NEVER

    @property
    def _ends(self) -> bool:
        return self._rule.gap_us < NEVER

    def push(self, now_us: int, data: bytes) -> list[bytes]:
        """Take bytes in, and give whole frames out.

        Args:
            now_us: the present.
            data: what came since the last call; call it without bytes when `due_us` is over.

        Returns:
            The frames that have ended, and pieces that are no frame.
        """
        out = []
        if self.due_us <= now_us:
            out.append(self.begun)
            self.begun = b""
        if data:
            self.begun, self.last_us = self.begun + data, now_us
        while self.begun:
            size = min(self._rule.cut(self.begun), _MOST_BYTES)
            if not size and len(self.begun) >= _MOST_BYTES:
                size = _MOST_BYTES
            if not size:
                break
            out.append(self.begun[:size].removesuffix(self._rule.delimiter))
            self.begun = self.begun[size:]
        return out

    def clear(self) -> None:
        """Forget a frame that has only begun."""
        self.begun = b""


class FrameLog:
    """Cuts one direction for a log, and returns the frames as text.

    Args:
        rule: where frames end, and how they are shown.
        mark: the direction.
    """

    def __init__(self, rule: FrameFormat, mark: Mark) -> None:
        self._rule, self._mark = rule, mark
        self._splitter = rule.splitter()

    @property
    def due_us(self) -> int:
        """When a silence ends the frame that has begun."""
        return self._splitter.due_us

    @property
    def last_us(self) -> int:
        """When the latest byte came."""
        return self._splitter.last_us

    @property
    def gap_alone(self) -> bool:
        """Whether silence alone ends frames, so that each one that has begun may be whole."""
        return self._rule.cut is _never_whole

    @property
    def ends_by_time(self) -> bool:
        """Whether a silence ends frames."""
        return self._rule.gap_us < NEVER

    @property
    def begun(self) -> bytes:
        """A frame that is not whole, as text."""
        begun = self._splitter.begun
        return self._rule.shown(self._mark, begun) if begun else b""

    def __call__(self, at_us: int, data: bytes) -> list[bytes]:
        """Take bytes; return the frames that have ended, as text."""
        frames = self._splitter.push(at_us, data)
        return [self._rule.shown(self._mark, frame) for frame in frames]


def by_gap(gap: str | int) -> FrameFormat:
    """Cut where the line is silent.

    Args:
        gap: the silence that ends a frame, as `"2ms"` or in us. It is longer than a byte takes, and
            than the control period of the device.

    Returns:
        The rule.

    Raises:
        ValueError: not a time above 0.

    >>> splitter = by_gap("2ms").splitter()
    >>> splitter.push(0, b"ab"), splitter.push(1_000, b"c"), splitter.push(3_000, b"d")
    ([], [], [b'abc'])
    """
    gap_us = parse_time_with_unit_us(gap) if isinstance(gap, str) else gap
    if gap_us <= 0:
        raise ValueError(f"gap {gap!r} is not a time above 0, as '2ms'")
    return FrameFormat(_never_whole, gap_us)


def by_size(size: int, gap: str | int | None = None) -> FrameFormat:
    """Cut into frames of one size.

    Args:
        size: in bytes, 1 or more.
        gap: a silence that ends a frame that has only begun, as `"20ms"` or in us; None if none
            does.

    Returns:
        The rule.

    Raises:
        ValueError: a size below 1, or not a time above 0.

    >>> by_size(2).splitter().push(0, b"abcde")
    [b'ab', b'cd']
    """
    if size < 1:
        raise ValueError(f"size {size} is not 1 or more")
    return FrameFormat(_BySize(size), _gap_us(gap))


def by_delimiter(delimiter: bytes, gap: str | int | None = None) -> FrameFormat:
    """Cut behind a delimiter, which is not part of the frame.

    Args:
        delimiter: the bytes that end each frame.
        gap: a silence that ends a frame that has only begun; None if none does.

    Returns:
        The rule. A log shows printable ASCII as text and other frames in hex.

    Raises:
        ValueError: an empty delimiter, or not a time above 0.

    >>> by_delimiter(b"!").splitter().push(0, b"on!off!o")
    [b'on', b'off']
    """
    if not delimiter:
        raise ValueError("a delimiter has at least 1 byte")
    return FrameFormat(_ByDelimiter(delimiter), _gap_us(gap), delimiter)


def by_length(  # noqa: PLR0913 - all but three by keyword
    header: bytes,
    at: int,
    extra: int,
    *,
    size: int = 1,
    order: Literal["big", "little"] = "big",
    gap: str | int | None = None,
) -> FrameFormat:
    """Cut by a length that each frame carries.

    Args:
        header: the bytes with which each frame begins; may be empty. Bytes before it are a piece
            of their own.
        at: where the length is, in bytes from the start of the frame.
        extra: bytes of the frame that the length does not count; below 0 if it counts more than
            the frame.
        size: bytes of the length, 1 to 4.
        order: byte order of the length.
        gap: a silence that ends a frame that has only begun; None if none does.

    Returns:
        The rule. A length that gives more than 4096 bytes, or less than up to itself, makes its
        first byte no frame.

    Raises:
        ValueError: a place or size that cannot be, or not a time above 0.

    >>> splitter = by_length(bytes([0x55]), at=1, extra=3).splitter()
    >>> [piece.hex(" ") for piece in splitter.push(0, bytes.fromhex("00 55 02 AA BB CC 55"))]
    ['00', '55 02 aa bb cc']
    """
    if at < 0 or not 1 <= size <= 4:
        raise ValueError(f"a length of {size} bytes at {at}: it has 1 to 4 bytes at 0 or more")
    return FrameFormat(_ByLength(header, at, extra, size, order), _gap_us(gap))


def _gap_us(gap: str | int | None) -> int:
    return NEVER if gap is None else by_gap(gap).gap_us


def _never_whole(data: bytes) -> int:
    return 0


@dataclass(frozen=True, slots=True)
class _BySize(Immutable):
    size: int

    def __call__(self, data: bytes) -> int:
        return self.size if len(data) >= self.size else 0


@dataclass(frozen=True, slots=True)
class _ByDelimiter(Immutable):
    delimiter: bytes

    def __call__(self, data: bytes) -> int:
        place = data.find(self.delimiter)
        return place + len(self.delimiter) if place >= 0 else 0


@dataclass(frozen=True, slots=True)
class _ByLength(Immutable):
    header: bytes
    at: int
    extra: int
    size: int
    order: Literal["big", "little"]

    def __call__(self, data: bytes) -> int:
        if not data.startswith(self.header):
            return max(0, data.find(self.header))
        behind = self.at + self.size
        if len(data) < max(behind, len(self.header)):
            return 0
        whole = int.from_bytes(data[self.at : behind], self.order) + self.extra
        if not max(behind, len(self.header)) <= whole <= _MOST_BYTES:
            return max(0, data.find(self.header, 1)) if self.header else 1
        return whole if len(data) >= whole else 0


def hex_text(data: bytes) -> str:
    """Write bytes in hex, in groups of four; long ones are cut, with their count.

    >>> hex_text(bytes.fromhex("0103 0452 4801"))
    '01030452 4801'
    """
    shown = " ".join(data[at : at + 4].hex() for at in range(0, min(len(data), _SHOWN_BYTES), 4))
    return f"{shown} ... ({len(data)} bytes)" if len(data) > _SHOWN_BYTES else shown


def _fields_text(fields: Mapping[str, Any]) -> str:
    pairs = [(str(name), value) for name, value in fields.items()]
    shown = [f"{name}={_value_text(value)}" for name, value in pairs if not name.startswith("_")]
    return " ".join(shown)


def _value_text(value: Any) -> str:
    if isinstance(value, bytes | bytearray):
        return hex_text(bytes(value)) or "-"
    if isinstance(value, Mapping):
        return f"({_fields_text(value)})"
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, Sequence) and not isinstance(value, str):
        items = ", ".join(map(_value_text, value[:_SHOWN_ITEMS]))
        return f"[{items}, ... ({len(value)})]" if len(value) > _SHOWN_ITEMS else f"[{items}]"
    return f"{value:g}" if isinstance(value, float) else str(value)
