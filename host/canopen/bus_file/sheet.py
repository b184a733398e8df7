"""The EDS or DCF of a node: where it is, and what dcfgen takes from it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tickrig.host.canopen.bus_file.item import Place
from tickrig.host.canopen.bus_file.notes import Section
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import (
    COMMISSIONING,
    HIGHEST_NODE_ID,
    EdsDevice,
    read_device,
)
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, shorten
from tickrig.wire.canopen.eds.eds_value import parse_number
from tickrig.wire.canopen.eds.object_table import EntryDescription

FOLDER_WORD: Final = "@BUS_CONFIG_PATH@"
"""What the build of ros2_canopen replaces by the folder of the installed bus.yml."""
IDENTITY: Final = 0x1018
UNSET: Final = 255


class Sheet:
    """A data sheet with the power-on values of one node.

    Args:
        path: the file.
        file: its sections.
        node_id: that of the node, 0 where only the file gives one.
    """

    def __init__(self, path: Path, file: EdsFile, node_id: int) -> None:
        self.path, self.file = path, file
        self.device: EdsDevice = read_device(file)
        self.node_id = node_id or self.device.node_id or 0
        self._rows: dict[int, dict[int, EntryDescription]] = {}
        for row in self.device.entries:
            self._rows.setdefault(row.index, {})[row.sub] = row

    def __contains__(self, index: int) -> bool:
        """Return whether there is an object."""
        return index in self._rows

    def subs(self, index: int) -> dict[int, EntryDescription]:
        """Return the entries of an object by sub-index; none if it is not there."""
        return self._rows.get(index, {})

    def row(self, index: int, sub: int) -> EntryDescription | None:
        """Return an entry, None if it is not there."""
        return self._rows.get(index, {}).get(sub)

    def value(self, index: int, sub: int, default: int = 0) -> int:
        """Return the power-on value of a number; the default if there is none."""
        row = self.row(index, sub)
        if row is None or not row.data_type.is_integer:
            return default
        data = row.power_on_data(self.node_id)
        return int.from_bytes(data, "little", signed=row.signed)

    def beside(self, index: int) -> str:
        """Say where an object is described that lacks an entry, or that there is no object."""
        return str(self.place(index)) if index in self else f"{self.path} has no {index:04X}h"

    def place(self, index: int, sub: int | None = None) -> Place:
        """Return the line where an object, or an entry of it, is described."""
        names = [] if sub is None else [f"{index:04X}sub{sub:X}"]
        for section in (*names, f"{index:04X}"):
            if line := self.file.line(section):
                return Place(str(self.path), line)
        return Place(str(self.path), 0)

    def head_number(self, section: str, key: str) -> int:
        """Return a number of the head, 0 if there is none."""
        try:
            return parse_number(self.file.value(section, key) or "0")
        except ValueError:
            return 0

    def identity(self, key: str, sub: int) -> int:
        """Return a number of the identity; that of the head counts more, as for dcfgen."""
        section = COMMISSIONING if key.startswith("LSS") else "DeviceInfo"
        return self.head_number(section, key) or self.value(IDENTITY, sub)


def find_sheet(node: Section, dcf_path: str, folder: Path) -> Sheet | None:
    """Find and read the EDS or DCF of a node.

    It is looked for beside the file, as dcfgen does; then in `dcf_path`; then by its name alone
    beside the file and one folder up, for a `dcf_path` of a container that is not there.

    Args:
        node: its section.
        dcf_path: of the options, for a node that has none of its own.
        folder: of the bus.yml.

    Returns:
        The sheet; None, and a finding, without one.
    """
    name = node.text("dcf")
    if not name:
        if "dcf" not in node:
            node.note("no-dcf", "dcf", "no dcf: which EDS is it?")
        return None
    looked: list[Path] = []
    for path in _candidates(name, node.text("dcf_path", dcf_path), folder):
        if path in looked:
            continue
        looked.append(path)
        try:
            if not path.is_file():
                continue
            return _read(node, path, is_first=len(looked) == 1)
        except (OSError, ValueError) as error:
            node.note("no-file", "dcf", f"dcf: {_said(path, error)}")
            return None
    where = ", ".join(dict.fromkeys(shorten(str(path.parent)) for path in looked))
    node.note("no-file", "dcf", f"dcf: no file {shorten(name)!r}; looked in {where}")
    return None


def _node_id(node: Section) -> int:
    """Return the node-ID that the section gives, 0 for none or a wrong one."""
    number = node.whole("node_id", UNSET, -(1 << 31))
    if number != UNSET and not 1 <= number <= HIGHEST_NODE_ID:
        node.note("node-id", "node_id", f"node_id: {number} is not in 1..127")
    elif number == UNSET and "node_id" in node:
        node.note("no-node-id", "node_id", "node_id: 255 is no node: dcfgen leaves it out")
    else:
        return number % UNSET
    return 0


def _said(path: Path, error: OSError | ValueError) -> str:
    if isinstance(error, EdsError):
        return shorten(str(error))
    reason = error.strerror if isinstance(error, OSError) else "this is no path"
    return f"{shorten(str(path))}: {reason}"


def _candidates(name: str, dcf_path: str, folder: Path) -> Iterator[Path]:
    """Give the places where a file may be."""
    given = Path(_expanded(name, folder))
    yield folder / given
    if dcf_path:
        yield folder / _expanded(dcf_path, folder) / given
        yield Path(_expanded(dcf_path, folder)) / given
    yield folder / given.name
    yield folder.parent / given.name


def _expanded(text: str, folder: Path) -> str:
    return os.path.expandvars(text.replace(FOLDER_WORD, str(folder)))


def _read(node: Section, path: Path, *, is_first: bool) -> Sheet | None:
    file = open_eds(path)
    sheet = Sheet(path, file, _node_id(node))
    if not is_first:
        node.note("file-elsewhere", "dcf", f"dcf: it is taken from {path.parent}")
    for one in file.errors:
        where = f"[{one.section}] " if one.section else ""
        text = f"{where}{one.reason}"
        node.notes.note("eds", Place(str(path), one.line), node.name, text)
    return sheet if sheet.device.entries else None
