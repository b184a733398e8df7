"""Read a bus.yml: its slaves and its master, and all that is wrong with it."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from tickrig.host.canopen.bus_file.bus_checks import (
    check_cob_ids,
    check_container,
    check_defaults,
    check_node_ids,
    check_settings,
    has_drivers,
)
from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusOptions, BusSlave
from tickrig.host.canopen.bus_file.item import Place
from tickrig.host.canopen.bus_file.layout import Layout, read_layout
from tickrig.host.canopen.bus_file.master_reader import read_master, read_options, watch_master
from tickrig.host.canopen.bus_file.notes import Notes, Section
from tickrig.host.canopen.bus_file.pdo_reader import CobIds, pdos_after
from tickrig.host.canopen.bus_file.sheet import Sheets
from tickrig.host.canopen.bus_file.slave_reader import SlaveReader
from tickrig.host.canopen.data_sheet.rule import RuleFinding, Severity

MOST_BYTES: Final = 1 << 20
"""A larger file is no bus.yml."""
_SECTION: Final = re.compile(
    r"^(master|nodes|defaults)[ \t]*:|^[ \t]+(dcf|node_id)[ \t]*:", re.MULTILINE
)
_TOML: Final = re.compile(r"^[ \t]*\[\[?[\w.\"-]+\]|^[\w.-]+[ \t]*=", re.MULTILINE)
_LIST_OF_NODES: Final = re.compile(
    r"^nodes[ \t]*:[ \t]*(?:\[|(?:#[^\n]*)?\n(?:[ \t]*(?:#[^\n]*)?\n)*+[ \t]*-[ \t])", re.MULTILINE
)
NEEDS_YAML: Final = "a bus.yml needs PyYAML: pip install 'tickrig[bus]'"


@dataclass(frozen=True, slots=True)
class BusFile:
    """What a bus.yml says.

    Attributes:
        path: the file.
        options: what holds for all nodes.
        master: None where there is none.
        slaves: by name, those with an EDS, in the order of dcfgen.
        findings: all that is wrong, in the order of the lines; with an error in it the rest is
            what could be read all the same.
    """

    path: Path
    options: BusOptions
    master: BusMaster | None
    slaves: dict[str, BusSlave]
    findings: tuple[RuleFinding, ...] = ()

    @property
    def errors(self) -> tuple[RuleFinding, ...]:
        """What dcfgen, cogen or the container of ros2_canopen refuse."""
        return self._of(Severity.ERROR)

    @property
    def warnings(self) -> tuple[RuleFinding, ...]:
        """What dcfgen only warns of, and what a node would refuse at boot-up."""
        return self._of(Severity.WARNING)

    def _of(self, severity: Severity) -> tuple[RuleFinding, ...]:
        return tuple(one for one in self.findings if one.rule.severity is severity)


def is_bus_file(data: bytes) -> bool:
    r"""Return whether a file is a bus.yml, a good or a bad one; PyYAML is not needed.

    Args:
        data: the file, or its beginning.

    >>> is_bus_file(b"master:\n  node_id: 1\n"), is_bus_file(b"[device.rrc]\n")
    (True, False)
    """
    text = data.decode("utf-8", "replace")
    return _SECTION.search(text) is not None and _TOML.search(text) is None


def check_of(data: bytes, path: Path) -> str:
    r"""Say what a file in YAML is, and which command checks it; empty if it is neither of ours.

    Args:
        data: the file, or its beginning.
        path: of the file.

    >>> check_of(b"master:\n  node_id: 1\n", Path("bus.yml"))
    'a bus.yml; use: tickrig check bus.yml'
    >>> check_of(b"nodes:\n- {id: 1}\n", Path("a.yaml"))
    'a System Definition; use: rtc-canopen-server --check a.yaml'
    """
    if not is_bus_file(data):
        return ""
    if _LIST_OF_NODES.search(data.decode("utf-8", "replace")):
        return f"a System Definition; use: rtc-canopen-server --check {path}"
    return f"a bus.yml; use: tickrig check {path}"


def read_bus_file(path: Path) -> BusFile:
    """Read a bus.yml and the EDS and DCF files that it names.

    Args:
        path: the file; others are looked for beside it, too.

    Returns:
        What it says, and all that is wrong with it.

    Raises:
        OSError: it cannot be read.
        ImportError: PyYAML is not installed; the text says how.
    """
    with path.open("rb") as file:
        return decode_bus_file(file.read(MOST_BYTES + 1), path)


def decode_bus_file(data: bytes, path: Path) -> BusFile:
    """Read the bytes of a bus.yml; see `read_bus_file`."""
    try:
        from tickrig.host.canopen.bus_file.yaml_tree import read_yaml  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise ImportError(NEEDS_YAML) from error
    notes = Notes()
    empty = BusFile(path, BusOptions(), None, {})
    if len(data) > MOST_BYTES:
        notes.note("yaml", Place(str(path), 1), "", "more than 1 MB: this is no bus.yml")
        return replace(empty, findings=notes.all)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = Place(str(path), data.count(b"\n", 0, error.start) + 1)
        notes.note("yaml", place, "", f"the byte 0x{data[error.start]:02x} is no UTF-8")
        return replace(empty, findings=notes.all)
    tree, wrong = read_yaml(text, str(path))
    for rule, place, reason in wrong:
        notes.note(rule, place, "", reason)
    if tree is None:
        return replace(empty, findings=notes.all)
    return _Reader(path, read_layout(tree, notes), notes, Place(str(path), 0)).read()


class _Reader:
    """Reads the sections of one file."""

    def __init__(self, path: Path, layout: Layout, notes: Notes, top: Place) -> None:
        self._path, self._layout, self._notes, self._top = path, layout, notes, top
        self._options = read_options(layout.options)
        self._cob_ids, self._sheets = CobIds(), Sheets(path.parent, self._options.dcf_path)

    def read(self) -> BusFile:
        """Read them all."""
        master = None
        if self._layout.master is None:
            rule = "no-master" if has_drivers(self._layout) else "slaves-only"
            self._notes.note(rule, self._top, "", "it has no section master")
        else:
            master = read_master(self._layout.master, self._options)
        slaves: dict[str, BusSlave] = {}
        for name, node in self._layout.slaves.items():
            if (slave := self._slave(name, node, master)) is not None:
                slaves[name] = slave
        check_node_ids(self._layout, master, slaves)
        check_cob_ids(self._notes, master, slaves)
        check_container(self._notes, self._layout, slaves)
        check_settings(self._layout, slaves)
        return BusFile(self._path, self._options, master, slaves, self._notes.all)

    def _slave(self, name: str, node: Section, master: BusMaster | None) -> BusSlave | None:
        sheet = self._sheets.find(node)
        if sheet is None:
            return None
        if not sheet.node_id:
            if "node_id" not in node:
                text = f"no node_id, and none in {sheet.path.name}"
                node.note("no-node-id", "node_id", text)
            return None
        count = len(self._notes)
        reader = SlaveReader(name, node, sheet, self._options, self._cob_ids)
        slave = reader.read()
        check_defaults(self._layout, node, self._notes.since(count))
        if master is not None:
            watch_master(node, sheet, reader.writes, master)
        pdos = pdos_after(sheet, reader.writes)
        return replace(slave, writes=reader.writes.all, pdos=pdos)
