"""Checks between the nodes of a bus, and restrictions of the container of ros2_canopen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusSlave, DriveChannel
from tickrig.host.canopen.bus_file.known_keys import SETTINGS
from tickrig.host.canopen.bus_file.layout import MASTER, OPTIONS, Layout
from tickrig.host.canopen.bus_file.notes import BusFileNotes, BusFileSection
from tickrig.host.canopen.bus_file.pdo_reader import RPDO, TPDO
from tickrig.host.canopen.data_sheet.check import check, failing, severities
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.eds import read_eds_bytes
from tickrig.host.text.document import FilePlace
from tickrig.host.text.names import near
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.nmt import CAN_ID_MASK, EXTENDED, INVALID, is_restricted

SYNC: Final = 0x080
_DRIVER_KEYS: Final = ("driver", "package")
_NAMESPACE: Final = "ros2_canopen::"
_CLASSES: Final = {
    "MasterDriver": "canopen_master_driver",
    "ProxyDriver": "canopen_proxy_driver",
    "Cia402Driver": "canopen_402_driver",
    "BaseDriver": "canopen_base_driver",
}
"""Packages of the ros2_canopen driver classes.

Each package also has a lifecycle variant of its class.
"""
_MISSING: Final = ("object-missing", "pdo-missing")
_MOST_OFF: Final = 0.01
"""The largest relative error between a scale and its inverse.

Files contain rounded values of both.
"""


STOPS: Final = frozenset(
    (
        *("access-form", "access-missing", "bom", "data-type-missing", "doubled-key"),
        *("doubled-section", "list-entry", "list-extra", "list-gap", "name-missing", "no-keyword"),
        *("no-number", "no-objects", "number-form", "number-word", "object-index", "pdo-half"),
        *("truncated", "utf-16", "xml"),
    )
)
"""Rules for EDS files that dcfgen needs. dcfgen stops if an EDS breaks one of these rules."""


def check_node_ids(
    layout: Layout, master: BusMaster | None, slaves: Mapping[str, BusSlave]
) -> None:
    """Report node-IDs that two nodes share."""
    taken: dict[int, tuple[str, FilePlace]] = {}
    if master is not None and layout.master is not None:
        taken[master.node_id] = MASTER, layout.master.place_of("node_id")
    for name, slave in slaves.items():
        section = layout.slaves[name]
        place = section.place_of("node_id")
        if slave.node_id in taken:
            who, where = taken[slave.node_id]
            text = f"{slave.node_id} is also the node-ID of {who}: {where}"
            section.wrong("node-id-twice", "node_id", text)
        taken.setdefault(slave.node_id, (section.name, place))


def check_cob_ids(
    notes: BusFileNotes, master: BusMaster | None, slaves: Mapping[str, BusSlave]
) -> None:
    """Report CAN-IDs with which two nodes send, and CAN-IDs that are reserved for other services.

    The RPDOs of slaves count as messages that the master sends. Two slaves may receive the same
    message.
    """
    senders: dict[int, tuple[str, FilePlace, BusSlave | None]] = {}
    if master is not None and master.sync_period_us:
        senders[SYNC] = "SYNC", master.place, None
    for slave in slaves.values():
        if not slave.emcy_cob_id & (INVALID | EXTENDED):
            can_id = slave.emcy_cob_id & CAN_ID_MASK
            senders.setdefault(can_id, (f"EMCY of {slave.name}", slave.place, slave))
    for what, can_id, place, slave, transmit in _pdos(slaves):
        if is_restricted(can_id):
            text = f"{what}: CAN-ID 0x{can_id:03X} is restricted"
            notes.note("cob-id-restricted", place, slave.name, text)
        elif (other := senders.get(can_id)) is not None:
            if _is_double(other[2], slave):
                continue
            text = f"{what}: CAN-ID 0x{can_id:03X} is also that of {other[0]}: {other[1]}"
            notes.note("cob-id-twice", place, slave.name, text)
        elif transmit:
            senders[can_id] = f"{what} of {slave.name}", place, slave


def _is_double(one: BusSlave | None, other: BusSlave) -> bool:
    """Return whether two nodes share a node-ID, and thus all CAN-IDs.

    Such nodes are already reported.
    """
    return one is not None and one is not other and one.node_id == other.node_id


def _pdos(slaves: Mapping[str, BusSlave]) -> Iterator[tuple[str, int, FilePlace, BusSlave, bool]]:
    """Yield name, CAN-ID, place and slave of enabled PDOs with 11-bit CAN-IDs, TPDOs first."""
    for transmit in (True, False):
        for slave in slaves.values():
            places = {(write.index, write.sub_index): write.place for write in slave.writes}
            for pdo in slave.pdos:
                if pdo.transmit is not transmit or pdo.cob_id & (INVALID | EXTENDED):
                    continue
                index = (TPDO if transmit else RPDO) + pdo.number - 1
                place = places.get((index, 1), slave.place)
                kind = "TPDO" if transmit else "RPDO"
                yield f"{kind} {pdo.number}", pdo.cob_id & CAN_ID_MASK, place, slave, transmit


def _sections(layout: Layout) -> list[BusFileSection]:
    return [*layout.slaves.values(), *([] if layout.master is None else [layout.master])]


def has_drivers(layout: Layout) -> bool:
    """Return whether the ros2_canopen container also reads the file."""
    return any(key in section for section in _sections(layout) for key in _DRIVER_KEYS)


def check_container(notes: BusFileNotes, layout: Layout, slaves: Mapping[str, BusSlave]) -> None:
    """Report settings that the ros2_canopen container refuses, if the container reads the file."""
    if not has_drivers(layout):
        return
    unmade = layout.slaves.keys() - slaves.keys()
    for section in _sections(layout):
        missing = [key for key in _DRIVER_KEYS if key not in section]
        if missing:
            section.note("no-driver", missing[0], f"no {' and no '.join(missing)}")
        if "node_id" not in section and section.name not in unmade:
            text = "no node_id; the container reads it here, not in the EDS"
            section.note("no-node-id", "node_id", text)
    for section in layout.slaves.values():
        _check_name(section)
    for name, place in layout.hidden.items():
        text = "the container also takes it for a node, and finds no driver"
        notes.note("hidden", place, name, text)


def check_defaults(layout: Layout, node: BusFileSection, found: Iterable[RuleFinding]) -> None:
    """Report writes of `defaults` to objects that the EDS of a node lacks."""
    if layout.defaults is None or all(one.rule.name not in _MISSING for one in found):
        return
    shared = [key for key in ("rpdo", "sdo", "tpdo") if key in layout.defaults]
    if shared:
        text = f"{', '.join(shared)} of defaults are for other nodes: {layout.defaults.place}"
        node.notes.note("defaults-other", node.place, node.name, text)


def check_settings(layout: Layout, slaves: Mapping[str, BusSlave]) -> None:
    """Report settings that the drivers of ros2_canopen drop silently or fail on."""
    for section in _sections(layout):
        _check_class(section)
        for key, allowed in SETTINGS.items():
            item = section.fields.get(key)
            if item is not None and allowed.value_of(item) is None:
                section.wrong("driver-value", key, f"{item} is not {allowed.said}")
    for name, slave in slaves.items():
        for channel in slave.channels:
            _check_scale(layout.slaves[name], channel, "pos")
            _check_scale(layout.slaves[name], channel, "vel")


def _check_class(section: BusFileSection) -> None:
    """Report a driver class that ros2_canopen does not have, or that its package does not have."""
    if not (set(_DRIVER_KEYS) <= section.fields.keys()):
        return
    named, package = (section.text(key) for key in _DRIVER_KEYS)
    short = named.removeprefix(_NAMESPACE)
    if short == named:
        return
    own = _CLASSES.get(short.removeprefix("Lifecycle"))
    if own is None:
        known = [each for name in _CLASSES for each in (name, f"Lifecycle{name}")]
        text = f"ros2_canopen has no class {shorten(short)!r}; {near(short, known)}"
        section.wrong("driver-class", "driver", text)
    elif package != own and package in _CLASSES.values():
        section.wrong("driver-class", "package", f"{package} has no {short}; it is in {own}")


def _check_scale(section: BusFileSection, channel: DriveChannel, what: str) -> None:
    """Report scales to and from the device that are not inverse to each other."""
    keys = f"scale_{what}_to_dev", f"scale_{what}_from_dev"
    to_dev, from_dev = (getattr(channel, key) for key in keys)
    if abs(to_dev * from_dev - 1) > _MOST_OFF:
        key = next((key for key in keys if key in section), "channels")
        text = f"{keys[0]}: {to_dev:g} times {keys[1]}: {from_dev:g} is not 1"
        section.note("scale", key, text)


def _check_name(section: BusFileSection) -> None:
    for word in (MASTER, OPTIONS):
        if word in section.name:
            text = f"{word!r} is in its name, so the container takes it for one"
            section.notes.note("node-name", section.place, section.name, text)


@lru_cache(maxsize=16)  # an unchanged EDS has the findings of the last check
def _findings_of(name: str, data: bytes) -> tuple[tuple[RuleFinding, ...], bool]:
    """Return the findings in an EDS, and whether it is in UTF-8."""
    document = Document(name, data)
    return tuple(check(document)), document.is_unicode


def check_sheets(slaves: Mapping[str, BusSlave]) -> tuple[RuleFinding, ...]:
    """Return a finding for each faulty EDS of the slaves.

    The finding contains the number of errors that `canmon eds check` finds. Some errors prevent
    dcfgen, the Lely program that reads a bus.yml, from reading the EDS. The finding also contains
    the names of these errors.
    """
    notes = BusFileNotes()
    for sheet in dict.fromkeys(slave.sheet for slave in slaves.values()):
        found, is_unicode = _findings_of(str(sheet), read_eds_bytes(sheet))
        stops = [one for one in found if one.rule.name in STOPS]
        names = [one.rule.name for one in stops]
        if not is_unicode:
            names.insert(0, "its encoding, which is not UTF-8")
        counted = [*stops, *failing(found)]
        if names or counted:
            stopped = f"; dcfgen stops at {', '.join(dict.fromkeys(names))}" if names else ""
            place = FilePlace(str(sheet), min((one.line for one in counted), default=0))
            notes.note("eds-check", place, "", f"it finds {severities(found)}{stopped}")
    return notes.all
