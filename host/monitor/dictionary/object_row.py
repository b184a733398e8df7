"""One object of a node, as a table shows it."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from tickrig.host.monitor.decode.objects.object_text import ObjectText
from tickrig.host.monitor.decode.sdo.transfer import write_entry


class Origin(StrEnum):
    """Where a value was seen last."""

    NONE = ""
    EDS = "eds"  # its power-on value
    SDO = "sdo"
    PDO = "pdo"


class ObjectRow(NamedTuple):
    """An object and its latest value.

    Attributes:
        entry: index and sub-index.
        text: its name, type and unit.
        value: for people; empty where none is known.
        origin: where that was seen.
        at_us: when; None for that of the EDS.
        trouble: why the latest transfer failed, empty if it did not.
    """

    entry: tuple[int, int]
    text: ObjectText
    value: str = ""
    origin: Origin = Origin.NONE
    at_us: int | None = None
    trouble: str = ""

    @property
    def kind(self) -> str:
        """Its data type, empty where nobody said it."""
        return "" if self.text.kind is None else self.text.kind.name

    def is_meant(self, wanted: str) -> bool:
        """Say whether a part of its name, or the begin of its index, is wanted.

        >>> row = ObjectRow((0x6041, 0), ObjectText("statusword"))
        >>> [row.is_meant(wanted) for wanted in ("", "604", "Status", "6041h:00", "word 6", "41")]
        [True, True, True, True, False, False]
        """
        wanted = wanted.lower()
        return write_entry(self.entry).lower().startswith(wanted) or wanted in self.text.name
