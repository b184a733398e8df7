"""Read a bus.yml: its slaves, its master, and all its errors."""

# How a bus.yml becomes a bus
# ---------------------------
# The reference is what dcfgen (Lely) makes of the file, to the byte; tests compare with it. The
# steps below have the order of dcfgen; most depend on it.
#
#   1. `read_yaml`: the tree. If a key occurs twice, the last one counts, as for dcfgen.
#   2. `read_layout`: dcfgen has its nodes at the top, cogen under `nodes`. cogen merges `defaults`
#      into each node, where they override the node's own keys; then it sorts all keys. A file with
#      `nodes` or `defaults` is for cogen, and the steps below read the sections that cogen writes.
#   3. `Sheets.find`: the EDS or DCF of a node, beside the file first. A node without one is left
#      out.
#   4. `SlaveReader`: the keys of a node become writes to its objects. Their order, and the defaults
#      for wrong keys, are those of dcfgen, so later steps see the bus that dcfgen would make. All
#      nodes share one `CobIds`: `auto` counts over the whole bus.
#   5. `_watch_master` needs the master and all writes of the slave: it puts 1016h before them.
#   6. `pdos_after`: the PDOs as they are after the writes, for the checks of COB-IDs and load.
#   7. `bus_checks`: conflicts between nodes, and what the container of ros2_canopen refuses.
#
# Findings are noted where they are found, in any order; `BusFileNotes.all` sorts them by line, and
# leaves out those that follow from a misspelt key in the same line.

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from tickrig.host.canopen.bus_file import bus_checks
from tickrig.host.canopen.bus_file.bus_values import BusDefaults, BusMaster, BusSlave, Identity
from tickrig.host.canopen.bus_file.known_keys import MASTER, OPTIONS, SLAVE, check_keys
from tickrig.host.canopen.bus_file.layout import Layout, read_layout
from tickrig.host.canopen.bus_file.notes import UNSIGNED8, UNSIGNED16, BusFileNotes, BusFileSection
from tickrig.host.canopen.bus_file.pdo_reader import CobIds, pdos_after
from tickrig.host.canopen.bus_file.sheet import UNSET, Sheet, Sheets, Writes
from tickrig.host.canopen.bus_file.slave_reader import SlaveReader, read_extra
from tickrig.host.canopen.data_sheet.rule import RuleFinding, Severity
from tickrig.host.text.document import FilePlace
from tickrig.wire.canopen.eds.eds_device import HIGHEST_NODE_ID
from tickrig.wire.canopen.eds.object_table import BIT_RATES_KBIT

# The section of the master, and how it handles the heartbeats of its slaves.

_CONSUMER: Final = 0x1016
_TIME: Final = 0x100
_SHORTEST_SYNC_US: Final = 1_000
_FLAGS: Final = {
    "start": True,
    "start_nodes": True,
    "start_all_nodes": False,
    "reset_all_nodes": False,
    "stop_all_nodes": False,
}
"""Keys whose values dcfgen reads as numbers, with their defaults."""


def _read_options(section: BusFileSection | None) -> BusDefaults:
    """Read the section `options`, whose settings apply to all nodes."""
    if section is None:
        return BusDefaults()
    check_keys(section, OPTIONS, open_to_others=True)
    return BusDefaults(
        dcf_path=section.text("dcf_path"),
        heartbeat_multiplier=section.real("heartbeat_multiplier", 3.0),
        retry_factor=section.whole("retry_factor", 3, 0, UNSIGNED8),
        extra=read_extra(section),
    )


def _read_master(section: BusFileSection, options: BusDefaults) -> BusMaster:
    """Read the section of the master."""
    check_keys(section, MASTER, open_to_others=True)
    whole = section.whole
    numbers = ("vendor_id", "product_code", "revision_number", "serial_number")
    node_id = whole("node_id", UNSET, 1, UNSET)
    if HIGHEST_NODE_ID < node_id < UNSET:
        section.wrong("node-id", "node_id", f"{node_id} is not in 1..127")
        node_id = UNSET
    return BusMaster(
        node_id,
        section.place,
        baudrate=_bit_rate(section),
        identity=Identity(0, *(whole(key) for key in numbers)),
        sync_period_us=_sync_period(section),
        sync_window_us=whole("sync_window"),
        sync_overflow=whole("sync_overflow", 0, 0, 240),
        heartbeat_producer_ms=whole("heartbeat_producer", 0, 0, UNSIGNED16),
        heartbeat_multiplier=section.real("heartbeat_multiplier", options.heartbeat_multiplier),
        emcy_inhibit_time_100us=whole("emcy_inhibit_time", 0, 0, UNSIGNED16),
        nmt_inhibit_time_100us=whole("nmt_inhibit_time", 0, 0, UNSIGNED16),
        error_behavior=_error_behavior(section),
        heartbeat_consumer=section.flag("heartbeat_consumer", default=True),
        time_cob_id=whole("time_cob_id", _TIME),
        **{key: bool(whole(key, default, -UNSIGNED16)) for key, default in _FLAGS.items()},
        boot_time_ms=whole("boot_time"),
        boot_timeout_ms=whole("boot_timeout") if "boot_timeout" in section else None,
        driver=section.text("driver"),
        package=section.text("package"),
        extra=read_extra(section),
    )


def _bit_rate(section: BusFileSection) -> int:
    rate = section.whole("baudrate", 1000, 1, 1000)
    if rate not in BIT_RATES_KBIT:
        allowed = ", ".join(map(str, BIT_RATES_KBIT))
        section.wrong("bit-rate", "baudrate", f"{rate} kbit/s is not one of {allowed}")
    return rate


def _sync_period(section: BusFileSection) -> int:
    period_us = section.whole("sync_period")
    if 0 < period_us < _SHORTEST_SYNC_US:
        text = f"a SYNC each {period_us} µs; {_SHORTEST_SYNC_US} µs is already short"
        section.wrong("sync-period", "sync_period", text)
    return period_us


def _error_behavior(section: BusFileSection) -> dict[int, int]:
    behavior = {1: 0}
    if "error_behavior" in section:
        given = section.section("error_behavior")
        for sub in given.fields:
            if isinstance(sub, int):
                behavior[sub] = given.whole(sub, 0, 0, UNSIGNED8)
            else:
                given.note("kind", sub, f"{sub!r:.40}: a sub-index of 1029h is a number")
    return behavior


def _watch_master(node: BusFileSection, sheet: Sheet, writes: Writes, master: BusMaster) -> None:
    """Write the heartbeat time of the master that a slave watches.

    The write is placed before all other writes.
    """
    time_ms = int(master.heartbeat_producer_ms * master.heartbeat_multiplier)
    entries = {sub: sheet.value(_CONSUMER, sub) for sub in sheet.subs(_CONSUMER) if sub}
    watched = node.flag("heartbeat_consumer", default=False) and time_ms > 0
    place = node.place_of("heartbeat_consumer")
    if not watched:
        for sub, value in entries.items():
            if value & UNSIGNED16 and _node_id(value) == master.node_id:
                writes.insert(_CONSUMER, sub, master.node_id << 16, place)
        return
    if _CONSUMER not in sheet:
        node.wrong("no-object", "heartbeat_consumer", f"{sheet.path.name} has no 1016h")
        return
    own = [sub for sub, value in entries.items() if _node_id(value) == master.node_id]
    free = [sub for sub, value in entries.items() if not value & UNSIGNED16 or _is_unused(value)]
    if sub := next(iter(own + free), 0):
        value = (master.node_id & UNSIGNED8) << 16 | time_ms & UNSIGNED16
        writes.insert(_CONSUMER, sub, value, place)
    else:
        text = f"no entry of 1016h is free: {sheet.place(_CONSUMER)}"
        node.wrong("no-entry", "heartbeat_consumer", text)


def _node_id(value: int) -> int:
    return value >> 16 & UNSIGNED8


def _is_unused(value: int) -> bool:
    return not 1 <= _node_id(value) <= HIGHEST_NODE_ID


_MOST_BYTES: Final = 1 << 20
"""The size above which a file is not read as a bus.yml."""
_SECTION: Final = re.compile(
    r"^(master|nodes|defaults)[ \t]*:|^[ \t]+(dcf|node_id)[ \t]*:", re.MULTILINE
)
_TOML: Final = re.compile(r"^[ \t]*\[\[?[\w.\"-]+\]|^[\w.-]+[ \t]*=", re.MULTILINE)
_LIST_OF_NODES: Final = re.compile(
    r"^nodes[ \t]*:[ \t]*(?:\[|(?:#[^\n]*)?\n(?:[ \t]*(?:#[^\n]*)?\n)*+[ \t]*-[ \t])", re.MULTILINE
)
_NEEDS_YAML: Final = "a bus.yml needs PyYAML: pip install 'tickrig[bus]'"


@dataclass(frozen=True, slots=True)
class BusFile:
    """The content of a bus.yml, the file in which Lely and ros2_canopen describe a CANopen bus.

    Attributes:
        path: path of the file.
        options: settings that apply to all nodes.
        master: master of the bus, or None if the file has no section for a master.
        slaves: slaves whose EDS was found, by name, in the order in which dcfgen reads them.
        findings: all errors and warnings, in the order of the lines. If one of them is an error,
            the other attributes contain only the valid parts of the file.
    """

    path: Path
    options: BusDefaults
    master: BusMaster | None
    slaves: dict[str, BusSlave]
    findings: tuple[RuleFinding, ...] = ()

    @property
    def errors(self) -> tuple[RuleFinding, ...]:
        """The findings that make dcfgen, cogen or the ros2_canopen container refuse the file."""
        return self._of(Severity.ERROR)

    @property
    def warnings(self) -> tuple[RuleFinding, ...]:
        """The findings that do not prevent the use of the file.

        For example, dcfgen prints a warning but continues, or a node will refuse a write at
        boot-up.
        """
        return self._of(Severity.WARNING)

    def _of(self, severity: Severity) -> tuple[RuleFinding, ...]:
        return tuple(one for one in self.findings if one.rule.severity is severity)


def is_bus_file(data: bytes) -> bool:
    r"""Return whether a file looks like a bus.yml, even if it is invalid. PyYAML is not needed.

    Args:
        data: content of the file, or its first bytes.

    >>> is_bus_file(b"master:\n  node_id: 1\n"), is_bus_file(b"[device.rrc]\n")
    (True, False)
    """
    text = data.decode("utf-8", "replace")
    return _SECTION.search(text) is not None and _TOML.search(text) is None


def check_of(data: bytes, path: Path) -> str:
    r"""Return a text that names the kind of a YAML file and the command that checks it.

    Other commands use this text in their messages about a file that they cannot read. If the kind
    of file is unknown, the text is empty.

    Args:
        data: content of the file, or its first bytes.
        path: path of the file, used in the message.

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
        path: path of the file. EDS and DCF files are also searched in the folder of this file.

    Returns:
        The content of the file with its findings.

    Raises:
        OSError: the file cannot be read.
        ImportError: PyYAML is not installed. The message contains the way to install it.
    """
    with path.open("rb") as file:
        return decode_bus_file(file.read(_MOST_BYTES + 1), path)


def decode_bus_file(data: bytes, path: Path) -> BusFile:
    """Read the bytes of a bus.yml; see `read_bus_file`."""
    try:
        from tickrig.host.text.yaml_reader import read_yaml  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise ImportError(_NEEDS_YAML) from error
    notes = BusFileNotes()
    empty = BusFile(path, BusDefaults(), None, {})
    if len(data) > _MOST_BYTES:
        notes.note("yaml", FilePlace(str(path), 1), "", "more than 1 MB: this is not a bus.yml")
        return replace(empty, findings=notes.all)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = FilePlace(str(path), data.count(b"\n", 0, error.start) + 1)
        notes.note("yaml", place, "", f"the byte 0x{data[error.start]:02x} is not UTF-8")
        return replace(empty, findings=notes.all)
    tree, wrong = read_yaml(text, str(path))
    for one in wrong:
        notes.note(one.rule, one.place, "", one.text)
    if tree is None:
        return replace(empty, findings=notes.all)
    return _Reader(path, read_layout(tree, notes), notes, FilePlace(str(path), 0)).read()


class _Reader:
    """Reader for the sections of one file."""

    def __init__(self, path: Path, layout: Layout, notes: BusFileNotes, top: FilePlace) -> None:
        self._path, self._layout, self._notes, self._top = path, layout, notes, top
        self._options = _read_options(layout.options)
        self._cob_ids, self._sheets = CobIds(), Sheets(path.parent, self._options.dcf_path)

    def read(self) -> BusFile:
        """Read all sections."""
        master = None
        if self._layout.master is None:
            rule = "no-master" if bus_checks.has_drivers(self._layout) else "slaves-only"
            self._notes.note(rule, self._top, "", "it has no section master")
        else:
            master = _read_master(self._layout.master, self._options)
        slaves: dict[str, BusSlave] = {}
        for name, node in self._layout.slaves.items():
            if (slave := self._slave(name, node, master)) is not None:
                slaves[name] = slave
        bus_checks.check_node_ids(self._layout, master, slaves)
        bus_checks.check_cob_ids(self._notes, master, slaves)
        bus_checks.check_container(self._notes, self._layout, slaves)
        bus_checks.check_settings(self._layout, slaves)
        return BusFile(self._path, self._options, master, slaves, self._notes.all)

    def _slave(self, name: str, node: BusFileSection, master: BusMaster | None) -> BusSlave | None:
        check_keys(node, SLAVE, open_to_others=True)
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
        bus_checks.check_defaults(self._layout, node, self._notes.since(count))
        if master is not None:
            _watch_master(node, sheet, reader.writes, master)
        pdos = pdos_after(sheet, reader.writes)
        return replace(slave, writes=reader.writes.all, pdos=pdos)
