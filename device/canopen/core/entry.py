"""One entry of the object dictionary of a slave: its value, and who acts on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.twin import Part
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.sdo.abort import AbortCode

TRUTH: Final = (0, 1)

Guard = Callable[["Entry", Value], None]
OnEntry = Callable[["Entry"], None]


class Entry(Part):
    """The value of a variable, or of one element of an array or record.

    Its bytes are kept as they go over the wire. The service that owns an object
    hangs its rules onto the entry; each of them is called with the entry.

    Args:
        description: name, type, access and limits; shared with other slaves.

    Attributes:
        description: as given.
        data: the present value as bytes.
        guard: called with a value that comes over the bus; raises SdoAbort to refuse it.
        written: called after a value came over the bus.
        source: gives the bytes to read instead of `data`; may raise SdoAbort.
        measured: `source` gives what is measured, whenever it is asked; it never raises, and
            asking changes nothing.
        watchers: called whenever the value has changed, from the bus or from the inside.
        takes_commands: what is written is a command, as "save": the guard alone judges it, for the
            limits are those of what is read.
    """

    __slots__ = (
        *("data", "description", "guard", "measured", "source", "takes_commands", "watchers"),
        "written",
    )

    def __init__(self, description: EntryDescription) -> None:
        self.description = description
        self.data = description.default
        self.guard: Guard | None = None
        self.written: OnEntry | None = None
        self.source: Callable[[Entry], bytes] | None = None
        self.measured = self.takes_commands = False
        self.watchers: tuple[OnEntry, ...] = ()

    def __repr__(self) -> str:
        """Name it as a log line would."""
        return repr(self.description)

    @property
    def index(self) -> int:
        """Index, 0x0000..0xFFFF."""
        return self.description.index

    @property
    def sub(self) -> int:
        """Sub-index, 0..255."""
        return self.description.sub

    @property
    def key(self) -> int:
        """Index and sub-index in one number."""
        return self.description.key

    @property
    def data_type(self) -> DataType:
        """Size and notation."""
        return self.description.data_type

    @property
    def size(self) -> int:
        """Size in bytes, 0 where it varies."""
        return self.description.size

    @property
    def takes_all(self) -> bool:
        """Whether every value of the right size is taken, and nobody acts on it."""
        low, high, kind = self.description.low, self.description.high, self.data_type
        free = low is None and high is None and kind is not DataType.BOOLEAN
        return free and self.guard is None and self.written is None

    @property
    def value(self) -> Value:
        """The present value."""
        return self.data_type.decode(self.present() if self.measured else self.data)

    @value.setter
    def value(self, value: Value) -> None:
        self.assign(self.data_type.encode(value))

    @property
    def number(self) -> int:
        """The present value of an integer."""
        data = self.present() if self.measured else self.data
        return int.from_bytes(data, "little", signed=self.description.signed)

    def watch(self, changed: OnEntry) -> None:
        """Have `changed` called whenever the value has changed from what it is now."""
        if self.measured:
            self.data = self.present()
        self.watchers = (*self.watchers, changed)

    def unwatch(self, changed: OnEntry) -> None:
        """Do so no longer."""
        self.watchers = tuple(watcher for watcher in self.watchers if watcher != changed)

    def assign(self, data: bytes) -> None:
        """Change the value from the inside; watchers are called."""
        if data != self.data:
            self.data = data
            for changed in self.watchers:
                changed(self)

    def force(self, data: bytes) -> None:
        """Change the value from the inside; its owner acts as if the bus had written it."""
        self.assign(data)
        if self.written is not None:
            self.written(self)

    def present(self) -> bytes:
        """Return what is to be read now; SdoAbort if its owner has nothing."""
        return self.data if self.source is None else self.source(self)

    def upload(self) -> bytes:
        """Read over the bus; SdoAbort if that is not allowed."""
        if not self.description.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        return self.present()

    def check_writable(self) -> None:
        """Raise SdoAbort unless the bus may write."""
        if not self.description.writable:
            raise SdoAbort(AbortCode.READ_ONLY)

    def check_size(self, size: int) -> None:
        """Raise SdoAbort if so many bytes cannot be a value."""
        if size > (self.size or self.description.max_bytes):
            raise SdoAbort(AbortCode.TOO_LONG)
        if size < self.size:
            raise SdoAbort(AbortCode.TOO_SHORT)

    def check_owner(self, data: bytes) -> None:
        """Raise SdoAbort if the owner of the object refuses a value."""
        if self.guard is not None:
            self.guard(self, self.data_type.decode(data))

    def download(self, data: bytes) -> None:
        """Write over the bus; SdoAbort if access, size, range or the owner refuses."""
        self.check_writable()
        self.check_size(len(data))
        value = self.data_type.decode(data)
        if self.data_type is DataType.BOOLEAN and value not in TRUTH:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        if self.guard is not None:  # what the object itself refuses has a code of its own
            self.guard(self, value)
        if isinstance(value, int | float) and not self.takes_commands:
            self._check_limits(value)
        self.force(data)

    def receive(self, data: bytes) -> None:
        """Write from a PDO: what is refused is not taken, and nobody is notified."""
        try:
            self.download(data)
        except SdoAbort:
            return

    def _check_limits(self, value: int | float) -> None:
        low, high = self.description.low, self.description.high
        if high is not None and value > high:
            raise SdoAbort(AbortCode.VALUE_TOO_HIGH)
        if low is not None and value < low:
            raise SdoAbort(AbortCode.VALUE_TOO_LOW)
