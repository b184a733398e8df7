r"""Data ports of a component on a small device: a buffer of one place each.

A new value overwrites the one before; reading it makes it old (RTno's NullBuffer).

>>> from tickrig.wire.rtc_lite.values import LONG
>>> inlet = LiteInPort("in", LONG)
>>> inlet.accept(b"\x2a\x00\x00\x00"), inlet.is_new, inlet.read(), inlet.is_new
(True, True, 42, False)
"""

from __future__ import annotations

from typing import Generic, TypeVar

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.layout import MAX_DATA_BYTES
from tickrig.wire.rtc_lite.messages import PORT_COUNTS_BYTES
from tickrig.wire.rtc_lite.values import LitePortType, encode_name

T = TypeVar("T")


class LitePort(Generic[T]):
    """What both kinds of ports have.

    Args:
        name: 1 to 15 printable ASCII characters.
        port_type: type of its values.
        most: the largest number of elements of a sequence; as many as fit
            into a frame unless given.

    Attributes:
        is_new: whether the value was not read yet.
        value: the latest value.

    Raises:
        ValueError: the name or the largest value does not fit into a frame.
    """

    def __init__(self, name: str, port_type: LitePortType[T], most: int | None = None) -> None:
        self.name, self.port_type = encode_name(name), port_type
        room = MAX_DATA_BYTES - PORT_COUNTS_BYTES - len(self.name)
        if not port_type.sequence:
            most = 1
        elif most is None:
            most = room // port_type.size
        if not 1 <= most <= room // port_type.size:
            raise ValueError(
                f"port {name}: {most} elements of {port_type.name}, 1..{room // port_type.size} fit"
            )
        self._most_bytes = most * port_type.size
        self.is_new, self.value = False, port_type.initial

    def fits(self, data: bytes) -> bool:
        """Whether so many bytes are a value that this port has room for."""
        try:
            self.port_type.check_size(data)
        except FieldError:
            return False
        return len(data) <= self._most_bytes


class LiteInPort(LitePort[T]):
    """Where the proxy writes and the component reads."""

    def read(self) -> T:
        """Return the latest value; it is not new any more."""
        self.is_new = False
        return self.value

    def accept(self, data: bytes) -> bool:
        """Take what came from the wire; False, and nothing changes, if it is no value."""
        if not self.fits(data):
            return False
        self.value, self.is_new = self.port_type.decode(data), True
        return True


class LiteOutPort(LitePort[T]):
    """Where the component writes; what is new goes to the proxy."""

    def write(self, value: T) -> bool:
        """Put a value into the buffer; False, and nothing changes, if there is no room for it.

        Raises:
            ValueError: the type has no such value.
        """
        data = self.port_type.encode(value)
        if not self.fits(data):
            return False
        self.value, self.is_new = self.port_type.decode(data), True
        return True

    def take(self) -> bytes:
        """Return the value as it goes to the wire; it is not new any more."""
        self.is_new = False
        return self.port_type.encode(self.value)
