"""Objects of a device, written down as its manual lists them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from tickrig.device.canopen.dictionary import Dictionary, ObjectCode, ObjectInfo
from tickrig.device.canopen.entry import Access, Entry
from tickrig.wire.canopen.datatypes import DataType, Value

RO: Final = Access.READ
RW: Final = Access.READ | Access.WRITE
WO: Final = Access.WRITE
CONST: Final = Access.READ | Access.CONST
ROT: Final = RO | Access.TPDO
"""Read only, may be mapped into a TPDO."""
RWW: Final = RW | Access.RPDO
"""Read and written, may be mapped into an RPDO."""
RWRW: Final = RWW | Access.TPDO
"""Read and written, may be mapped both ways."""


class Element(NamedTuple):
    """One sub-index of a record.

    Attributes:
        sub: 1..254.
        name: as in the EDS.
        kind: data type.
        access: what the bus may do.
        default: power-on value.
        relative: the node-ID is added to it.
    """

    sub: int
    name: str
    kind: DataType
    access: Access
    default: Value = 0
    relative: bool = False


class Objects:
    """Collects objects and makes a dictionary of them.

    >>> objects = Objects()
    >>> objects.variable(0x1000, "Device type", DataType.UNSIGNED32, RO, 0x191)
    >>> objects.array(0x6000, "Read input 8-bit", 2, DataType.UNSIGNED8, ROT)
    >>> [str(entry) for entry in objects.dictionary()][:2]
    ['<1000h:00 Device type>', '<6000h:00 Number of entries>']
    """

    def __init__(self) -> None:
        self._entries: list[Entry] = []
        self._infos: dict[int, ObjectInfo] = {}

    def variable(  # noqa: PLR0913 - a row of an object table
        self,
        index: int,
        name: str,
        kind: DataType,
        access: Access,
        default: Value | None = None,
        *,
        low: float | None = None,
        high: float | None = None,
        relative: bool = False,
    ) -> None:
        """Add a variable."""
        entry = Entry(
            *(index, 0, name, kind, access), default=default, low=low, high=high, relative=relative
        )
        self._entries.append(entry)

    def array(  # noqa: PLR0913, PLR0917 - a row of an object table
        self,
        index: int,
        name: str,
        count: int,
        kind: DataType,
        access: Access,
        default: Value | None = None,
    ) -> None:
        """Add an array of elements that are alike; sub-index 0 counts them."""
        self._head(index, name, ObjectCode.ARRAY, RO, count)
        self._entries += (
            Entry(index, sub, f"{name} {sub}", kind, access, default=default)
            for sub in range(1, count + 1)
        )

    def record(
        self,
        index: int,
        name: str,
        elements: Iterable[Element],
        *,
        count_access: Access = RO,
        count: int | None = None,
    ) -> None:
        """Add a record; sub-index 0 holds `count`, or else the highest sub-index."""
        rows = list(elements)
        highest = max(row.sub for row in rows) if count is None else count
        self._head(index, name, ObjectCode.RECORD, count_access, highest)
        self._entries += (
            Entry(index, sub, what, kind, access, default=default, relative=relative)
            for sub, what, kind, access, default, relative in rows
        )

    def dictionary(self) -> Dictionary:
        """Make a dictionary of all objects; each call makes a new one."""
        return Dictionary((entry.copy() for entry in self._entries), self._infos)

    def _head(self, index: int, name: str, code: ObjectCode, access: Access, count: int) -> None:
        self._infos[index] = ObjectInfo(name, code)
        title, kind = "Number of entries", DataType.UNSIGNED8
        self._entries.append(Entry(index, 0, title, kind, access, default=count))
