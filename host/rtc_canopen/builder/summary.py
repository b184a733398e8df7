"""Objects and PDOs of a DeviceRTC as tables for people."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from tickrig.host.rtc_canopen.builder.fragment import pdo_name
from tickrig.wire.canopen.eds.eds_value import format_value
from tickrig.wire.canopen.eds.object_table import Access, ObjectRow
from tickrig.wire.rtc_canopen.objects import object_table
from tickrig.wire.rtc_canopen.profile import FIRST_PORT, PlacedPort, RtcProfile

OBJECT: Final = "{:<9} {:<36} {:<14} {:<6} {}"
LETTERS: Final = {
    Access.READ: "r",
    Access.WRITE: "w",
    Access.CONST: "c",
    Access.TPDO: "T",
    Access.RPDO: "R",
}
PDO: Final = "{:<9} {:<9} {:<5} {}"


def summary(profile: RtcProfile, *, every: bool = False) -> Iterator[str]:
    """Give the lines: objects of the ports, or `every` object, then the PDOs."""
    rows = [row for row in object_table(profile) if every or row.index >= FIRST_PORT]
    yield from _objects(rows)
    yield ""
    yield PDO.format("PDO", "COB-ID", "bits", "carries")
    for port in profile.placed():
        yield _pdo(port)


def _objects(rows: Iterable[ObjectRow]) -> Iterator[str]:
    yield OBJECT.format("object", "name", "type", "access", "default")
    for row in rows:
        access = "".join(letter for flag, letter in LETTERS.items() if flag in row.access)
        default = format_value(row.data_type, row.default, relative=row.relative)
        place = f"{row.index:04X}h:{row.sub:02X}"
        shown = default if default.isprintable() else row.default.hex()
        yield OBJECT.format(place, row.name, row.data_type.name, access, shown).rstrip()


def _pdo(port: PlacedPort) -> str:
    kind = port.profile.port_type
    what = f"{kind.length} x {kind.name}" if kind.length > 1 else kind.name
    cob_id, name = f"{port.cob_id:03X}h+id", port.profile.name
    return PDO.format(pdo_name(port), cob_id, kind.bits, f"{name}: {what}")
