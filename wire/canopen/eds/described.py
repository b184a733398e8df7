"""Entries with their description, whoever keeps them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, ObjectInfo


class Described(Protocol):
    """An entry that an EDS can be written of: an `ObjectRow`, or one of a live dictionary."""

    @property
    def index(self) -> int:
        """0x1000..0xFFFF."""
        ...

    @property
    def sub(self) -> int:
        """0..254."""
        ...

    @property
    def name(self) -> str:
        """As in the EDS."""
        ...

    @property
    def data_type(self) -> DataType:
        """Data type of its value."""
        ...

    @property
    def access(self) -> Access:
        """What the bus may do."""
        ...

    @property
    def default(self) -> bytes:
        """Power-on value."""
        ...

    @property
    def data(self) -> bytes:
        """Present value."""
        ...

    @property
    def low(self) -> float | None:
        """Smallest value, None for that of the data type."""
        ...

    @property
    def high(self) -> float | None:
        """Largest value."""
        ...

    @property
    def relative(self) -> bool:
        """Whether the node-ID is added to the default."""
        ...

    @property
    def max_bytes(self) -> int:
        """What a string or domain holds."""
        ...


class Table(Protocol):
    """Entries sorted by index and sub-index."""

    @property
    def objects(self) -> Mapping[int, ObjectInfo]:
        """Names and kinds by index, sorted."""
        ...

    def __iter__(self) -> Iterator[Described]:
        """Give all entries."""
        ...
