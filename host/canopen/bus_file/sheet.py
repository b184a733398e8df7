"""The EDS or DCF of a node: its path, and the values that dcfgen uses."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusWrite
from tickrig.host.canopen.bus_file.notes import BusFileNotes, BusFileSection
from tickrig.host.canopen.eds import eds_number, read_sheet
from tickrig.host.text.document import FilePlace
from tickrig.host.text.names import closest
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import COMMISSIONING, HIGHEST_NODE_ID, EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, shorten
from tickrig.wire.canopen.eds.object_table import EntryDescription

_FOLDER_WORD: Final = "@BUS_CONFIG_PATH@"
"""Placeholder that ros2_canopen's build replaces by the folder of the installed bus.yml."""
IDENTITY: Final = 0x1018
UNSET: Final = 255
"""The node-ID of an unconfigured node."""
_WRONG: Final = -(1 << 31) - 1
"""Node-ID of an entry that is not a number. The entry itself is reported."""
_MOST_PDOS: Final = 0x200
_SUFFIXES: Final = (".eds", ".dcf", ".xdd", ".xdc")


class Sheet:
    """The EDS or DCF of one node, with methods that return the power-on values of its objects.

    Args:
        path: path of the EDS or DCF.
        file: parsed sections of the file.
        device: device that the sections describe.
        node_id: node-ID of the node. 0 stands for the node-ID in the file.
    """

    def __init__(self, path: Path, file: EdsFile, device: EdsDevice, node_id: int) -> None:
        self.path, self.file, self.device = path, file, device
        self.node_id = node_id or device.node_id or 0
        self._rows: dict[int, dict[int, EntryDescription]] = {}
        for row in self.device.entries:
            self._rows.setdefault(row.index, {})[row.sub] = row

    def __contains__(self, index: int) -> bool:
        """Return whether an object exists."""
        return index in self._rows

    def pdos(self, first: int) -> list[int]:
        """Return the indices of the PDO communication parameters in the EDS, sorted.

        Args:
            first: index of the communication parameter of PDO 1, 1400h for RPDOs or 1800h for
                TPDOs.
        """
        return sorted([index for index in self._rows if first <= index < first + _MOST_PDOS])

    def subs(self, index: int) -> dict[int, EntryDescription]:
        """Return the entries of an object by sub-index.

        The result is empty if the object does not exist.
        """
        return self._rows.get(index, {})

    def row(self, index: int, sub: int) -> EntryDescription | None:
        """Return an entry, or None if the entry does not exist."""
        return self._rows.get(index, {}).get(sub)

    def value(self, index: int, sub: int, default: int = 0) -> int:
        """Return the power-on value of an integer entry, or the default if there is none."""
        row = self.row(index, sub)
        if row is None or not row.data_type.is_integer:
            return default
        data = row.power_on_data(self.node_id)
        return int.from_bytes(data, "little", signed=row.signed)

    def beside(self, index: int) -> str:
        """Return the EDS file and line of an object, as a text for error messages.

        If the EDS lacks the object, the text states this instead.
        """
        return str(self.place(index)) if index in self else f"{self.path} has no {index:04X}h"

    def place(self, index: int, sub: int | None = None) -> FilePlace:
        """Return the line that describes an object or an entry."""
        names = [] if sub is None else [f"{index:04X}sub{sub:X}"]
        for section in (*names, f"{index:04X}"):
            if line := self.file.line(section):
                return FilePlace(str(self.path), line)
        return FilePlace(str(self.path), 0)

    def head_number(self, section: str, key: str) -> int:
        """Return a number of the section DeviceInfo, or 0 if the keyword is missing."""
        return eds_number(self.file.value(section, key)) or 0

    def identity(self, key: str, sub: int) -> int:
        """Return a number of the identity. As in dcfgen, DeviceInfo takes precedence over 1018h."""
        section = COMMISSIONING if key.startswith("LSS") else "DeviceInfo"
        if self.file.value(section, key):  # a 0 also takes precedence: then nothing is checked
            return self.head_number(section, key)
        return self.value(IDENTITY, sub)


class Sheets:
    """Finder that locates and reads the EDS or DCF file of each node in a bus.yml.

    Args:
        folder: folder that contains the bus.yml.
        dcf_path: `dcf_path` in the options of the bus.yml, for nodes without a `dcf_path` of their
            own.
    """

    def __init__(self, folder: Path, dcf_path: str) -> None:
        self._folder, self._dcf_path = folder, dcf_path

    def find(self, node: BusFileSection) -> Sheet | None:
        """Find and read the EDS or DCF of a node.

        If no file is found, a finding is reported and the result is None. The node gives the path
        of the file, which may contain folders. The file is searched in this order:

        - path of the file, relative to the folder of the bus.yml, as in dcfgen
        - path of the file, relative to `dcf_path`
        - only the name of the file, in the folder of the bus.yml and then in its parent folder,
          because the folder `dcf_path` may exist only in a container
        """
        name = node.text("dcf")
        if not name:
            if "dcf" not in node or node.fields["dcf"].value == "":
                hint = "it is called dcf, not eds" if "eds" in node else "which EDS is it?"
                node.note("no-dcf", "dcf", f"no dcf: {hint}")
            return None
        looked = list(dict.fromkeys(self._candidates(name, node.text("dcf_path", self._dcf_path))))
        try:
            path = next((path for path in looked if path.is_file()), None)
            if path is not None:
                return self._sheet(node, path, is_first=path == looked[0])
            node.wrong("no-file", "dcf", self._not_found(name, looked))
        except (OSError, EdsError) as error:
            node.wrong("no-file", "dcf", _said(name, error))
        return None

    def _candidates(self, name: str, dcf_path: str) -> Iterator[Path]:
        """Yield the paths where a file may be."""
        folder, given = self._folder, Path(self._expanded(name))
        yield folder / given
        if dcf_path:
            yield folder / self._expanded(dcf_path) / given
            yield Path(self._expanded(dcf_path)) / given
        yield folder / given.name
        yield folder.parent / given.name

    def _expanded(self, text: str) -> str:
        return os.path.expandvars(text.replace(_FOLDER_WORD, str(self._folder)))

    def _not_found(self, name: str, looked: list[Path]) -> str:
        """Return the folders that lack a file, and the existing file that the user may mean."""
        where = ", ".join(dict.fromkeys(str(path.parent) for path in looked))
        beside = [path.name for path in self._folder.iterdir() if path.suffix.lower() in _SUFFIXES]
        meant = closest(Path(name).name, sorted(beside))
        hint = f"; did you mean {shorten(meant[0])!r}?" if meant else ""
        return f"no file {shorten(name)!r}; looked in {_printable(where)}{hint}"

    def _sheet(self, node: BusFileSection, path: Path, *, is_first: bool) -> Sheet | None:
        file, device = read_sheet(path)
        if not is_first:
            node.wrong("file-elsewhere", "dcf", f"using the file in {_printable(str(path.parent))}")
        for one in file.errors:
            where = f"[{shorten(one.section)}] " if one.section else ""
            place = FilePlace(str(path), one.line)
            node.notes.note("eds", place, node.name, f"{where}{one.reason}")
        return Sheet(path, file, device, _node_id(node)) if device.entries else None


def _node_id(node: BusFileSection) -> int:
    """Return the node-ID in the section, or 0 if the node-ID is missing or wrong."""
    number = node.whole("node_id", _WRONG if "node_id" in node else UNSET, _WRONG + 1)
    if number == _WRONG:
        return 0
    if number != UNSET and not 1 <= number <= HIGHEST_NODE_ID:
        node.wrong("node-id", "node_id", f"{number} is not in 1..127")
    elif number == UNSET and "node_id" in node:
        node.wrong("no-node-id", "node_id", "255 is not a node: dcfgen leaves it out")
    else:
        return number % UNSET
    return 0


def _said(name: str, error: OSError | EdsError) -> str:
    if isinstance(error, EdsError):
        return _printable(str(error.findings[0]))
    return f"{shorten(name)!r}: {error.strerror}"


def _printable(text: str) -> str:
    """Return a path as printable text in one line."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


# The writes of a concise DCF, as dcfgen makes them, checked against the EDS.

_FLOATS: Final = (DataType.REAL32, DataType.REAL64)
_ODD_SIZES: Final = (3, 5, 6, 7)


class Writes:
    """Collector of the SDO writes with which the master configures one slave at boot-up.

    Args:
        sheet: EDS or DCF of the slave.
        name: name of the slave's section in the bus.yml.
        notes: collector of the findings, which receives each write that contradicts the EDS.
    """

    def __init__(self, sheet: Sheet, name: str, notes: BusFileNotes) -> None:
        self._sheet, self._name, self._notes = sheet, name, notes
        self._all: list[BusWrite] = []

    @property
    def all(self) -> tuple[BusWrite, ...]:
        """All writes in their order."""
        return tuple(self._all)

    def add(self, index: int, sub: int, value: int, place: FilePlace, said: str = "") -> None:
        """Add an SDO write. If dcfgen would refuse the write, report it instead of adding it.

        Args:
            index: index of the object.
            sub: sub-index of the object.
            value: value that the bus.yml gives.
            place: path of the bus.yml, and number of its line that requires the write.
            said: text of the value in this line.
        """
        if (write := self._made(index, sub, value, place, said)) is not None:
            self._all.append(write)

    def insert(self, index: int, sub: int, value: int, place: FilePlace) -> None:
        """Insert a write before all others."""
        if (write := self._made(index, sub, value, place, "")) is not None:
            self._all.insert(0, write)

    def values(self) -> dict[int, bytes]:
        """Return the last written values. The key is index << 8 | sub-index."""
        return {write.index << 8 | write.sub_index: write.data for write in self._all}

    def _made(
        self, index: int, sub: int, value: int, place: FilePlace, said: str
    ) -> BusWrite | None:
        what, row = f"{index:04X}h:{sub:02X}", self._sheet.row(index, sub)
        kind = DataType.UNSIGNED8
        if row is not None:
            kind = row.data_type
            self._check_access(row, what, place)
        elif sub or index not in self._sheet:
            text = f"{what} does not exist: {self._sheet.beside(index)}"
            self._notes.note("object-missing", place, self._name, text)
            return None
        data = self._data(kind, what, value, place, said or str(value))
        if data is None:
            return None
        if row is not None:
            self._check_limits(row, what, value, place)
        return BusWrite(index, sub, data, place)

    def _data(
        self, kind: DataType, what: str, value: int, place: FilePlace, said: str
    ) -> bytes | None:
        if kind not in _FLOATS and not kind.is_integer:
            text = f"{what} is a {kind.name}, which dcfgen does not write"
            self._notes.note("value-type", place, self._name, text)
            return None
        if kind.size in _ODD_SIZES:
            text = f"{what} is a {kind.name}: dcfgen writes more bytes than it declares"
            self._notes.note("odd-size", place, self._name, text)
        if kind is DataType.BOOLEAN:  # dcfgen writes one byte, whatever the value is
            kind = DataType.UNSIGNED8
        try:
            return kind.encode(float(value) if kind in _FLOATS else value)
        except (ValueError, OverflowError):
            text = f"{what}: {said} is not a valid {kind.name}"
            self._notes.note("value-range", place, self._name, text)
            return None

    def _check_access(self, row: EntryDescription, what: str, place: FilePlace) -> None:
        if not row.writable:
            text = f"{what} cannot be written: {self._sheet.place(row.index, row.sub)}"
            self._notes.note("read-only", place, self._name, text)

    def _check_limits(self, row: EntryDescription, what: str, value: int, place: FilePlace) -> None:
        low, high = row.low, row.high
        if (low is not None and value < low) or (high is not None and value > high):
            limits = f"{'' if low is None else low}..{'' if high is None else high}"
            text = f"{what}: {value} is not in {limits}: {self._sheet.place(row.index, row.sub)}"
            self._notes.note("value-limits", place, self._name, text)
