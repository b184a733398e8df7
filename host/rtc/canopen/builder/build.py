"""All files that are made from a profile."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Final

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.rtc.canopen.builder.c_header import write_header
from tickrig.host.rtc.canopen.builder.profile_file import (
    Project,
    check_identifiers,
    parse_project,
    snake_name,
)
from tickrig.host.rtc.canopen.builder.skeleton import SKELETON_SUFFIX, write_skeleton
from tickrig.host.rtc.canopen.definition import NodeEntry, SdoPortEntry, SystemDefinition
from tickrig.host.rtc.canopen.definition_writer import write_definition
from tickrig.host.text.whole_file import write_whole
from tickrig.wire import rtc_canopen
from tickrig.wire.canopen.eds.eds_value import format_value
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription


def build(project: Project) -> dict[str, str]:
    """Generate all files for a DeviceRTC, such as its EDS and the skeleton of its component.

    A DeviceRTC is a robot technology component (RT component) inside a CANopen slave.

    Returns:
        The text of each file, by file name.

    Raises:
        ValueError: a name is not allowed in Python or C.
    """
    profile = project.profile
    check_identifiers(profile.type_name, (port.name for port in profile.ports))
    stem = snake_name(profile.type_name)
    return {
        f"{stem}.eds": write_eds(
            rtc_canopen.object_table(profile),
            rtc_canopen.device_info(profile),
            file_name=f"{stem}.eds",
        ),
        f"{stem}_od.h": write_header(profile),
        f"{stem}.yaml": _write_fragment(project),
        f"{stem}{SKELETON_SUFFIX}": write_skeleton(project),
    }


def _write_fragment(project: Project) -> str:
    """Return a System Definition with only this node. Its ports keep their names."""
    profile = project.profile
    node = NodeEntry(
        project.node_id,
        f"{profile.type_name}0",
        f"{snake_name(profile.type_name)}.eds",
        ports={_pdo_name(port): port.profile.name for port in profile.placed() if port.number},
        sdo_ports={
            port.profile.name: SdoPortEntry(
                port.index, port.profile.direction, _sdo_type(port.profile.port_type)
            )
            for port in profile.placed()
            if not port.number
        },
    )
    return write_definition(SystemDefinition((node,)))


def _sdo_type(kind: rtc_canopen.CanopenPortType[Any]) -> str | None:
    """Return the name of a type in a System Definition. The EDS determines the type of Integer."""
    return None if kind.name == rtc_canopen.INTEGER else kind.name


def _pdo_name(port: rtc_canopen.PlacedPort) -> str:
    """Return the name of a port's PDO in a System Definition, `tpdo1` or `rpdo1`, or else `sdo`."""
    if not port.number:
        return rtc_canopen.PortTransport.SDO.value
    kind = "rpdo" if port.profile.direction is rtc_canopen.PortDirection.IN else "tpdo"
    return f"{kind}{port.number}"


_OBJECT: Final = "{:<9} {:<36} {:<14} {:<6} {}"
_LETTERS: Final = {
    Access.READ: "r",
    Access.WRITE: "w",
    Access.CONST: "c",
    Access.TPDO: "T",
    Access.RPDO: "R",
}
PDO: Final = "{:<9} {:<9} {:<5} {}"


def _summary(profile: rtc_canopen.RtcProfile, *, every: bool = False) -> Iterator[str]:
    """Return the lines with the objects of the ports, or with `every` object, and then the PDOs."""
    rows = [
        row
        for row in rtc_canopen.object_table(profile)
        if every or row.index >= rtc_canopen.FIRST_PORT
    ]
    yield from _objects(rows)
    yield ""
    yield PDO.format("PDO", "COB-ID", "bits", "carries")
    for port in profile.placed():
        yield _pdo(port)


def _objects(rows: Iterable[EntryDescription]) -> Iterator[str]:
    yield _OBJECT.format("object", "name", "type", "access", "default")
    for row in rows:
        access = "".join(letter for flag, letter in _LETTERS.items() if flag in row.access)
        default = format_value(row.data_type, row.default, relative=row.relative)
        place = f"{row.index:04X}h:{row.sub:02X}"
        shown = default if default.isprintable() else row.default.hex()
        yield _OBJECT.format(place, row.name, row.data_type.name, access, shown).rstrip()


def _pdo(port: rtc_canopen.PlacedPort) -> str:
    kind = port.profile.port_type
    what = f"{kind.length} x {kind.name}" if kind.length > 1 else kind.name
    if not port.number:
        cob_id = "-"
    elif port.cob_id is None:
        cob_id = "off"
    else:
        cob_id = f"{port.cob_id:03X}h{'+id' * port.relative}"
    return PDO.format(_pdo_name(port), cob_id, kind.bits or "-", f"{port.profile.name}: {what}")


# The work of rtc-canopen-builder after its options are read.


def run_builder(
    path: Path, out: Path | None, warn: Callable[[str], None], *, force: bool, every: bool
) -> Iterator[str]:
    """Check the profile of a DeviceRTC and write the files made from it.

    Args:
        path: path of the profile.
        out: folder for the files, or None to write no files.
        warn: function that is called with a line about each existing file that is not overwritten.
        force: whether to overwrite an existing skeleton.
        every: whether the lines list all objects. If not, they list only the objects of ports.

    Yields:
        Lines that describe the profile to the user.
    """
    project, files = _read_and_build(path)
    if out is not None:
        _write_files(out, files, warn, force=force)
    yield from _summary(project.profile, every=every)


def _read_and_build(path: Path) -> tuple[Project, dict[str, str]]:
    try:
        project = parse_project(path.read_text("utf-8"))
        return project, build(project)
    except OSError as error:
        refuse_path("profile", error)
    except UnicodeDecodeError:
        raise Refused(f"profile {path}: is no text in UTF-8") from None
    except ValueError as error:
        raise Refused(f"profile {path}: {error}") from None


def _write_files(
    folder: Path, files: dict[str, str], warn: Callable[[str], None], *, force: bool
) -> None:
    """Write the files. An existing skeleton is kept, because the user may have filled it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            path = folder / name
            if path.suffix == SKELETON_SUFFIX and path.exists() and not force:
                warn(f"{path} is kept; --force overwrites it")
                continue
            write_whole(path, text)
    except OSError as error:
        refuse_path("file", error)
