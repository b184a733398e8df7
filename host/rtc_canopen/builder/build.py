"""All files that are written of a profile."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from tickrig.host.rtc_canopen.builder.c_header import write_header
from tickrig.host.rtc_canopen.builder.names import check_identifiers, snake_name
from tickrig.host.rtc_canopen.builder.profile_file import Project
from tickrig.host.rtc_canopen.builder.skeleton import SKELETON_SUFFIX, write_skeleton
from tickrig.host.rtc_canopen.definition.definition import NodeEntry, SystemDefinition
from tickrig.host.rtc_canopen.definition.definition_writer import write_definition
from tickrig.wire.canopen.eds.eds_value import format_value
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.rtc_canopen.objects import device_info, object_table
from tickrig.wire.rtc_canopen.profile import FIRST_PORT, PlacedPort, PortDirection, RtcProfile


def build(project: Project) -> dict[str, str]:
    """Return the text of each file by its name.

    Raises:
        ValueError: names that Python or C cannot have.
    """
    profile = project.profile
    check_identifiers(profile.type_name, (port.name for port in profile.ports))
    stem = snake_name(profile.type_name)
    return {
        f"{stem}.eds": write_eds(object_table(profile), device_info(profile)),
        f"{stem}_od.h": write_header(profile),
        f"{stem}.yaml": write_fragment(project),
        f"{stem}{SKELETON_SUFFIX}": write_skeleton(project),
    }


def write_fragment(project: Project) -> str:
    """Return a System Definition that has this node alone; its ports keep their names."""
    profile = project.profile
    node = NodeEntry(
        project.node_id,
        f"{profile.type_name}0",
        f"{snake_name(profile.type_name)}.eds",
        ports={pdo_name(port): port.profile.name for port in profile.placed()},
    )
    return write_definition(SystemDefinition((node,)))


def pdo_name(port: PlacedPort) -> str:
    """Return what a System Definition calls the PDO of a port: `tpdo1`, `rpdo1`."""
    kind = "rpdo" if port.profile.direction is PortDirection.IN else "tpdo"
    return f"{kind}{port.number}"


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


def _objects(rows: Iterable[EntryDescription]) -> Iterator[str]:
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
