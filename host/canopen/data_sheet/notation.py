"""How values of an EDS are shown to people."""

from __future__ import annotations

from tickrig.wire.canopen.eds.eds_value import format_value
from tickrig.wire.canopen.eds.eds_writer import access_type
from tickrig.wire.canopen.eds.object_table import Access, DeviceInfo, EntryDescription


def access_text(row: EntryDescription) -> str:
    """Return the access of an entry, and which PDOs may carry it.

    >>> from tickrig.wire.canopen.eds.object_table import ROT, RW, DataType
    >>> [access_text(EntryDescription(1, 0, "", DataType.UNSIGNED8, each)) for each in (ROT, RW)]
    ['ro T', 'rw']
    """
    try:
        word = access_type(row)
    except ValueError:
        word = "?"
    ways = ("T" * (Access.TPDO in row.access)) + ("R" * (Access.RPDO in row.access))
    return f"{word} {ways}".strip()


def default_text(row: EntryDescription) -> str:
    """Return the default of an entry as an EDS has it; empty without one."""
    if not row.has_default:
        return ""
    text = format_value(row.data_type, row.default, relative=row.relative)
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def limit_text(limit: int | float | None) -> str:
    """Return a limit, empty without one."""
    return "" if limit is None else str(limit)


def rates_text(info: DeviceInfo) -> str:
    """Return bit rates in kbit/s, the slowest first."""
    return " ".join(str(rate // 1_000) for rate in sorted(info.bit_rates))
