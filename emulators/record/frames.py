"""Frames of a binary protocol: splitting of the byte stream, and readable descriptions."""

# Theory of operation
# ===================
#
# A `FrameFormat` is a rule that splits a stream of bytes into frames. Both ends of a test use it:
#
# - A device calls `rule.splitter()` and pushes the bytes that it receives.
# - The log of the device's line (`LineSettings(splitter=rule)`) calls the rule for each direction
#   and shows the frames in transcripts, failure reports and HTML pages.
#
# Every byte is in exactly one piece. Bytes that are not a frame are a piece, too: people have to
# see them, and a device rejects them by its check. So a rule never raises an exception and never
# loses bytes. A piece of bytes before a header ends at the header. It does not depend on how the
# bytes were divided when they arrived.
#
# There are four rules. `by_size`, `by_delimiter` and `by_length` find the end of a frame in its
# bytes. With these three a silence of `gap` ends an incomplete frame, so a lost byte costs one
# frame. `by_gap` uses the silence alone: its frame is complete at the end of the silence, which is
# later than its last byte. `due_us` returns this time. `WireLog` reads `due_us` before it accepts
# later traffic, so request and answer appear in the order and with the times in which they passed.
# It also stops the rig at that time (`WireLog.follow`), so that the last frame ends as well.
#
# The log shows text. Without a description a frame is shown in hex. A description is a function
# of a frame, or an object with a method `parse` (a Struct of the library construct), that returns
# the fields by name. If the description rejects a frame, the frame is shown in hex with the reason.

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
    """Interface of a description object, such as a Struct of construct."""

    @property
    def parse(self) -> Callable[[bytes], Any]:
        """Return the fields of a frame; raise an exception if the frame is invalid."""
        ...


FrameFields = Callable[[bytes], Mapping[str, Any]] | _HasParse
"""Function or object that returns the fields of a frame by name, or raises an exception."""

_Cut = Callable[[bytes], int]
"""Function that returns the length of the first piece of some bytes, or 0 if it is incomplete."""


@dataclass(frozen=True, slots=True)
class FrameFormat(Immutable):
    """Rule for splitting the bytes of a serial line into frames, and for showing them in a log.

    The functions `by_gap`, `by_length`, `by_size` and `by_delimiter` make such a rule.

    Attributes:
        cut: function that gets the bytes since the last frame, and returns the length of the first
            frame in them, or 0 if the frame is incomplete.
        gap_us: duration of a silence that ends an incomplete frame, in microseconds, or `NEVER`
            without a limit.
        delimiter: bytes after each frame, which are not part of the frame.
        request: function or object that splits frames of the host into fields for a log; see
            `described`.
        answer: function or object that splits frames of the device into fields for a log.
    """

    cut: Callable[[bytes], int]
    gap_us: int = NEVER
    delimiter: bytes = b""
    request: FrameFields | None = None
    answer: FrameFields | None = None

    def described(self, request: FrameFields, answer: FrameFields | None = None) -> FrameFormat:
        """Return a copy of this frame format that splits frames into fields for a log.

        Args:
            request: function that gets a frame of the host, and returns its fields by name. The
                function raises an exception for an invalid frame. An object whose method `parse`
                does this is accepted, too, for example a Struct of the library construct.
            answer: the same for the frames of the device. The default is `request`.
        """
        return replace(self, request=request, answer=answer or request)

    def splitter(self) -> FrameSplitter:
        """Return a splitter for the bytes of one direction, for a device."""
        return FrameSplitter(self)

    def shown(self, mark: Mark, frame: bytes) -> bytes:
        """Return a frame as a log shows it.

        Args:
            mark: direction of the frame: to the device or from the device.
            frame: bytes of the frame.

        Returns:
            The fields of the frame, or the bytes in hex.
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
        """Return a splitter for one direction of a log.

        Args:
            mark: direction of the traffic.

        Returns:
            A splitter that returns the frames as text.
        """
        return FrameLog(self, mark)


class FrameSplitter(Copyable):
    """Splits received bytes of a serial line into frames. The bytes may arrive in any chunks.

    Args:
        rule: rule that defines where a frame ends.

    Attributes:
        begun: bytes of an incomplete frame.
        last_us: time of the latest byte of the incomplete frame.
    """

    def __init__(self, rule: FrameFormat) -> None:
        self._rule = rule
        self.begun, self.last_us = b"", 0

    @property
    def due_us(self) -> int:
        """Time at which a silence ends the incomplete frame, or `NEVER` without a limit."""
        return self.last_us + self._rule.gap_us if self.begun and self._ends else NEVER

    @property
    def _ends(self) -> bool:
        return self._rule.gap_us < NEVER

    def push(self, now_us: int, data: bytes) -> list[bytes]:
        """Add received bytes, and return the frames that are now complete.

        Args:
            now_us: present time in microseconds.
            data: bytes received since the last call, or empty if no byte has arrived. A silence can
                end a frame: the attribute `due_us` is the time at which the silence is long enough.
                At this time the caller must call the method, even without bytes.

        Returns:
            The completed frames, and pieces of data that are not complete frames.
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
        """Discard an incomplete frame."""
        self.begun = b""


class FrameLog:
    """Splits the traffic of one direction into frames, and returns the frames as text for a log.

    Args:
        rule: rule that defines where a frame ends and how it is shown.
        mark: direction of the traffic: to the device or from the device.
    """

    def __init__(self, rule: FrameFormat, mark: Mark) -> None:
        self._rule, self._mark = rule, mark
        self._splitter = rule.splitter()

    @property
    def due_us(self) -> int:
        """Time at which a silence ends the incomplete frame."""
        return self._splitter.due_us

    @property
    def last_us(self) -> int:
        """Time of the latest byte."""
        return self._splitter.last_us

    @property
    def gap_alone(self) -> bool:
        """Whether only silence ends frames, so that an unfinished frame may be complete."""
        return self._rule.cut is _never_whole

    @property
    def ends_by_time(self) -> bool:
        """Whether a silence ends frames."""
        return self._rule.gap_us < NEVER

    @property
    def begun(self) -> bytes:
        """The incomplete frame as text."""
        begun = self._splitter.begun
        return self._rule.shown(self._mark, begun) if begun else b""

    def __call__(self, at_us: int, data: bytes) -> list[bytes]:
        """Add received bytes; return the completed frames as text."""
        frames = self._splitter.push(at_us, data)
        return [self._rule.shown(self._mark, frame) for frame in frames]


def by_gap(gap: str | int) -> FrameFormat:
    """Return a rule that splits serial data into frames at silences of the line.

    Args:
        gap: duration of the silence that ends a frame: a text such as `"2ms"`, or a number in
            microseconds. It must be longer than the time of a byte and longer than the control
            period of the device.

    Returns:
        The rule.

    Raises:
        ValueError: the gap is not a time above 0.

    >>> splitter = by_gap("2ms").splitter()
    >>> splitter.push(0, b"ab"), splitter.push(1_000, b"c"), splitter.push(3_000, b"d")
    ([], [], [b'abc'])
    """
    gap_us = parse_time_with_unit_us(gap) if isinstance(gap, str) else gap
    if gap_us <= 0:
        raise ValueError(f"gap {gap!r} is not a time above 0, as '2ms'")
    return FrameFormat(_never_whole, gap_us)


def by_size(size: int, gap: str | int | None = None) -> FrameFormat:
    """Return a rule that splits serial data into frames of a fixed size.

    Args:
        size: size of each frame in bytes, 1 or more.
        gap: duration of a silence that ends an incomplete frame: a text such as `"20ms"`, or a
            number in microseconds, or None for no limit.

    Returns:
        The rule.

    Raises:
        ValueError: the size is below 1, or the gap is not a time above 0.

    >>> by_size(2).splitter().push(0, b"abcde")
    [b'ab', b'cd']
    """
    if size < 1:
        raise ValueError(f"size {size} is not 1 or more")
    return FrameFormat(_BySize(size), _gap_us(gap))


def by_delimiter(delimiter: bytes, gap: str | int | None = None) -> FrameFormat:
    """Return a rule that splits serial data after a delimiter, which is not part of the frame.

    Args:
        delimiter: bytes that end each frame.
        gap: duration of a silence that ends an incomplete frame: a text such as `"20ms"`, or a
            number in microseconds, or None for no limit.

    Returns:
        The rule. A log shows printable ASCII as text and other frames in hex.

    Raises:
        ValueError: the delimiter is empty, or the gap is not a time above 0.

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
    """Split by a length field in each frame.

    Args:
        header: bytes at the start of each frame, which may be empty. Bytes before the header are a
            separate piece.
        at: position of the length field, in bytes from the start of the frame.
        extra: number of bytes of the frame that the length does not count. The number is below 0 if
            the length counts more bytes than the frame has.
        size: size of the length field in bytes, 1 to 4.
        order: byte order of the length field.
        gap: length of a silence that ends an incomplete frame, or None for no limit.

    Returns:
        The rule. If the frame would have more than 4096 bytes, or would end before the end of its
        length field, its first byte is treated as a byte outside a frame.

    Raises:
        ValueError: the position or size is invalid, or the gap is not a time above 0.

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
    """Return bytes as hex digits in groups of four. Long data are cut, and their size is added.

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
