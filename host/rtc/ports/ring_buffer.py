"""The buffer of a connector (OpenRTM-aist 1.x, RingBuffer)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Generic, TypeVar

from tickrig.host.rtc.states import PortStatus

T = TypeVar("T")

DEFAULT_LENGTH: Final = 8
_MAX_LENGTH: Final = 1_000_000

_OK: Final = PortStatus.PORT_OK
"""Value that is looked up once, because looking up a member of an enum takes 0.1 us."""


class FullPolicy(StrEnum):
    """Effect of a write to a full buffer (`buffer.write.full_policy`)."""

    OVERWRITE = "overwrite"
    DO_NOTHING = "do_nothing"
    BLOCK = "block"


class EmptyPolicy(StrEnum):
    """Effect of a read from an empty buffer (`buffer.read.empty_policy`)."""

    READBACK = "readback"
    DO_NOTHING = "do_nothing"
    BLOCK = "block"


class ReadPolicy(StrEnum):
    """Which of the waiting values is read (`buffer.read.policy`). Older values are dropped."""

    FIFO = "fifo"
    LAST = "last"
    SKIP = "skip"


@dataclass(frozen=True, slots=True)
class BufferOptions:
    """Settings of the buffer in which a connector keeps values (`RingBuffer`).

    Attributes:
        length: largest number of values in the buffer, 1 to 1 000 000.
        full: effect of a write to the full buffer.
        empty: effect of a read from the empty buffer.
        read: policy that selects which waiting value is read.
        skip_count: number of values that are dropped before each read value, if the read policy is
            `skip`.

    Raises:
        ValueError: the length is out of range, or skip_count is not below the length.
    """

    length: int = DEFAULT_LENGTH
    full: FullPolicy = FullPolicy.OVERWRITE
    empty: EmptyPolicy = EmptyPolicy.READBACK
    read: ReadPolicy = ReadPolicy.FIFO
    skip_count: int = 0

    def __post_init__(self) -> None:
        """Check the settings."""
        if not 1 <= self.length <= _MAX_LENGTH:
            raise ValueError(f"buffer length {self.length} is not in 1..{_MAX_LENGTH}")
        if not 0 <= self.skip_count < self.length:
            raise ValueError(f"skip_count {self.skip_count} is not in 0..{self.length - 1}")


class RingBuffer(Generic[T]):
    """Buffer of a connector for values that were written and not yet read, up to a maximum length.

    Calls do not wait. If the buffer of OpenRTM would block, this buffer returns at once, with the
    status of a time-out.

    Attributes:
        on_write: function that is called after a value was put into the buffer, or None.
    """

    __slots__ = ("_last", "_newest", "_options", "_skip", "_values", "on_write")

    def __init__(self, options: BufferOptions = BufferOptions()) -> None:
        self._options = options
        self._skip = options.skip_count if options.read is ReadPolicy.SKIP else 0
        self._newest = options.read is ReadPolicy.LAST
        self._values: deque[T] = deque(maxlen=options.length)
        self._last: T | None = None
        self.on_write: Callable[[], None] | None = None

    def __len__(self) -> int:
        """Return the number of waiting values."""
        return len(self._values)

    @property
    def readable(self) -> bool:
        """Whether `read` finds a new value."""
        return len(self._values) > self._skip

    def write(self, value: T) -> PortStatus:
        """Add a value at the end of the buffer.

        Returns:
            PORT_OK, also if the oldest value was overwritten. If the buffer is full and its full
            policy is not `overwrite`, the value is dropped. The result is then BUFFER_FULL with the
            policy `do_nothing`, or BUFFER_TIMEOUT with `block`.
        """
        values, options = self._values, self._options
        if len(values) == options.length and options.full is not FullPolicy.OVERWRITE:
            blocks = options.full is FullPolicy.BLOCK
            return PortStatus.BUFFER_TIMEOUT if blocks else PortStatus.BUFFER_FULL
        values.append(value)
        if self.on_write is not None:
            self.on_write()
        return _OK

    def read(self) -> T | None:
        """Remove the next value from the buffer and return it. The read policy selects the value.

        Returns:
            The value. If there is no new value, the result depends on the empty policy. With the
            empty policy `readback`, the result is the value that was read last. With any other one,
            the result is None.
        """
        values, skip = self._values, self._skip
        if len(values) <= skip:
            return self._last if self._options.empty is EmptyPolicy.READBACK else None
        for _ in range(len(values) - 1 if self._newest else skip):
            values.popleft()
        self._last = values.popleft()
        return self._last

    def pop(self) -> tuple[T, ...]:
        """Remove the oldest value. Return it in a tuple, which is empty if there is no value."""
        return (self._values.popleft(),) if self._values else ()

    def clear(self) -> tuple[T, ...]:
        """Drop all waiting values. The value that was read last is kept."""
        values = tuple(self._values)
        self._values.clear()
        return values
