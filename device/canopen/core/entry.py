"""One entry of the object dictionary: an index with a sub-index."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import MAX_VARIABLE_BYTES, Access
from tickrig.wire.canopen.sdo.abort import AbortCode

TRUTH: Final = (0, 1)

__all__ = ["MAX_VARIABLE_BYTES", "Access", "Entry"]


class Entry:
    """A variable, or one element of an array or record.

    Its bytes are kept as they go over the wire. The service that owns an object
    hangs its rules onto the entry: `guard` judges a value that comes over the
    bus, `written` acts on it, `source` makes the value on demand.

    Args:
        index: 0x0000..0xFFFF.
        sub: 0..255.
        name: as in the EDS.
        data_type: decides size and notation.
        access: what the bus may do.
        default: power-on value; zero or empty if left out.
        low: smallest value, None for that of the data type.
        high: largest value.
        relative: the default is to be added to the node-ID ($NODEID).
        max_bytes: largest size of a string or domain.

    Attributes:
        data: the present value as bytes.
        guard: raises SdoAbort for a value that the owner does not take.
        written: called after a value came over the bus.
        source: gives the bytes to read instead of `data`; may raise SdoAbort.
        watchers: called whenever the value has changed, from the bus or from the inside.
    """

    __slots__ = (
        *("access", "data", "data_type", "default", "guard", "high", "index", "low"),
        *("max_bytes", "name", "readable", "relative", "size", "source", "sub"),
        *("watchers", "writable", "written"),
    )

    def __init__(  # noqa: PLR0913 - a description, by keyword
        self,
        index: int,
        sub: int,
        name: str,
        data_type: DataType,
        access: Access,
        *,
        default: Value | None = None,
        low: float | None = None,
        high: float | None = None,
        relative: bool = False,
        max_bytes: int = MAX_VARIABLE_BYTES,
    ) -> None:
        self.index, self.sub, self.name = index, sub, name
        self.data_type, self.access = data_type, access
        self.low, self.high, self.relative, self.max_bytes = low, high, relative, max_bytes
        self.size = data_type.size
        self.readable, self.writable = Access.READ in access, Access.WRITE in access
        self.default = bytes(self.size) if default is None else data_type.encode(default)
        self.data = self.default
        self.guard: Callable[[Value], None] | None = None
        self.written: Callable[[], None] | None = None
        self.source: Callable[[], bytes] | None = None
        self.watchers: list[Callable[[], None]] = []

    def __repr__(self) -> str:
        """Name it as a log line would."""
        return f"<{self.index:04X}h:{self.sub:02X} {self.name}>"

    def copy(self) -> Entry:
        """Return the same description with its default value, and nobody's rules."""
        twin = Entry.__new__(Entry)
        twin.index, twin.sub, twin.name = self.index, self.sub, self.name
        twin.data_type, twin.access, twin.size = self.data_type, self.access, self.size
        twin.low, twin.high, twin.max_bytes = self.low, self.high, self.max_bytes
        twin.readable, twin.writable, twin.relative = self.readable, self.writable, self.relative
        twin.default = twin.data = self.default
        twin.guard = twin.written = twin.source = None
        twin.watchers = []
        return twin

    @property
    def takes_all(self) -> bool:
        """Whether every value of the right size is taken, and nobody acts on it."""
        free = self.low is None and self.high is None and self.data_type is not DataType.BOOLEAN
        return free and self.guard is None and self.written is None

    @property
    def key(self) -> int:
        """Index and sub-index in one number."""
        return self.index << 8 | self.sub

    @property
    def value(self) -> Value:
        """The present value."""
        return self.data_type.decode(self.data)

    @value.setter
    def value(self, value: Value) -> None:
        self.assign(self.data_type.encode(value))

    @property
    def number(self) -> int:
        """The present value of an integer."""
        return int.from_bytes(self.data, "little", signed=self.data_type.signed)

    def assign(self, data: bytes) -> None:
        """Change the value from the inside; watchers hear of it."""
        if data != self.data:
            self.data = data
            for changed in self.watchers:
                changed()

    def power_on_data(self, node_id: int) -> bytes:
        """Return the default, with the node-ID where it belongs to it."""
        if not self.relative:
            return self.default
        value = int.from_bytes(self.default, "little") + node_id
        return (value & (1 << 8 * self.size) - 1).to_bytes(self.size, "little")

    def upload(self) -> bytes:
        """Read over the bus; SdoAbort if that is not allowed."""
        if not self.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        return self.data if self.source is None else self.source()

    def check_writable(self) -> None:
        """Raise SdoAbort unless the bus may write."""
        if not self.writable:
            raise SdoAbort(AbortCode.READ_ONLY)

    def check_size(self, size: int) -> None:
        """Raise SdoAbort if so many bytes cannot be a value."""
        most = self.size or self.max_bytes
        if size > most:
            raise SdoAbort(AbortCode.TOO_LONG)
        if size < self.size:
            raise SdoAbort(AbortCode.TOO_SHORT)

    def download(self, data: bytes) -> None:
        """Write over the bus; SdoAbort if access, size, range or the owner refuses."""
        self.check_writable()
        self.check_size(len(data))
        value = self.data_type.decode(data)
        if isinstance(value, int | float):
            self._check_limits(value)
        if self.data_type is DataType.BOOLEAN and value not in TRUTH:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        if self.guard is not None:
            self.guard(value)
        self.assign(data)
        if self.written is not None:
            self.written()

    def _check_limits(self, value: float) -> None:
        if self.high is not None and value > self.high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
        if self.low is not None and value < self.low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW)
