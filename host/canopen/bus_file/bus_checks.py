"""What is wrong between the nodes of a bus, and what the container of ros2_canopen refuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusSlave
from tickrig.host.canopen.bus_file.item import Place
from tickrig.host.canopen.bus_file.layout import MASTER, OPTIONS, Layout
from tickrig.host.canopen.bus_file.notes import Notes, Section
from tickrig.host.canopen.bus_file.pdo_reader import RPDO, TPDO
from tickrig.host.canopen.bus_file.writes import final_places
from tickrig.host.canopen.data_sheet.check import check, failing, severities
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.eds import read_eds_bytes
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, EXTENDED, INVALID, is_restricted

SYNC: Final = 0x080
DRIVER_KEYS: Final = ("driver", "package")
STOPS: Final = frozenset(
    (
        *("access-form", "access-missing", "bom", "data-type-missing", "doubled-key"),
        *("doubled-section", "list-entry", "list-extra", "list-gap", "name-missing", "no-keyword"),
        *("no-number", "no-objects", "number-form", "number-word", "object-index", "pdo-half"),
        *("truncated", "utf-16", "xml"),
    )
)
"""Rules for EDS files: dcfgen stops where one of them is broken."""


def check_node_ids(
    layout: Layout, master: BusMaster | None, slaves: Mapping[str, BusSlave]
) -> None:
    """Note node-IDs that two nodes have."""
    taken: dict[int, tuple[str, Place]] = {}
    if master is not None and layout.master is not None:
        taken[master.node_id] = MASTER, layout.master.place_of("node_id")
    for name, slave in slaves.items():
        section = layout.slaves[name]
        place = section.place_of("node_id")
        if slave.node_id in taken:
            who, where = taken[slave.node_id]
            text = f"node_id: {slave.node_id} is that of {who}, too: {where}"
            section.note("node-id-twice", "node_id", text)
        taken.setdefault(slave.node_id, (section.name, place))


def check_cob_ids(notes: Notes, master: BusMaster | None, slaves: Mapping[str, BusSlave]) -> None:
    """Note CAN-IDs that two nodes send with, and those that belong to other services.

    The master sends what slaves receive; two slaves may receive one message.
    """
    senders: dict[int, tuple[str, Place]] = {}
    if master is not None and master.sync_period_us:
        senders[SYNC] = "SYNC", master.place
    for slave in slaves.values():
        if not slave.emcy_cob_id & (INVALID | EXTENDED):
            can_id = slave.emcy_cob_id & CAN_ID_MASK
            senders.setdefault(can_id, (f"EMCY of {slave.name}", slave.place))
    for what, can_id, place, slave, transmit in _pdos(slaves):
        if is_restricted(can_id):
            text = f"{what}: CAN-ID 0x{can_id:03X} is restricted"
            notes.note("cob-id-restricted", place, slave.name, text)
        elif (other := senders.get(can_id)) is not None:
            text = f"{what}: CAN-ID 0x{can_id:03X} is that of {other[0]}, too: {other[1]}"
            notes.note("cob-id-twice", place, slave.name, text)
        elif transmit:
            senders[can_id] = f"{what} of {slave.name}", place


def _pdos(
    slaves: Mapping[str, BusSlave],
) -> Iterator[tuple[str, int, Place, BusSlave, bool]]:
    """Give the PDOs that are on with 11 bits, TPDOs first: what they are, CAN-ID, place, slave."""
    for transmit in (True, False):
        for slave in slaves.values():
            places = final_places(slave.writes)
            for pdo in slave.pdos:
                if pdo.transmit is not transmit or pdo.cob_id & (INVALID | EXTENDED):
                    continue
                index = (TPDO if transmit else RPDO) + pdo.number - 1
                place = places.get(index << 8 | 1, slave.place)
                kind = "TPDO" if transmit else "RPDO"
                yield f"{kind} {pdo.number}", pdo.cob_id & CAN_ID_MASK, place, slave, transmit


def check_container(notes: Notes, layout: Layout, slaves: Mapping[str, BusSlave]) -> None:
    """Note what the container of ros2_canopen refuses, in a file that is for it."""
    unmade = layout.slaves.keys() - slaves.keys()
    sections = [*layout.slaves.values()]
    if layout.master is not None:
        sections.append(layout.master)
    if not any(key in section for section in sections for key in DRIVER_KEYS):
        return
    for section in sections:
        missing = [key for key in DRIVER_KEYS if key not in section]
        if missing:
            section.note("no-driver", missing[0], f"no {' and no '.join(missing)}")
        if "node_id" not in section and section.name not in unmade:
            text = "no node_id, which the container looks for here, not in the EDS"
            section.note("no-node-id", "node_id", text)
    for section in layout.slaves.values():
        _check_name(section)
    for name, place in layout.hidden.items():
        text = "the container takes it for a node, too, and finds no driver"
        notes.note("hidden", place, name, text)


def _check_name(section: Section) -> None:
    for word in (MASTER, OPTIONS):
        if word in section.name:
            text = f"{word!r} is in its name: the container takes it for one"
            section.notes.note("node-name", section.place, section.name, text)


def check_sheets(slaves: Mapping[str, BusSlave]) -> tuple[RuleFinding, ...]:
    """Return how much `canmon eds check` finds in each EDS, and what of it stops dcfgen."""
    notes = Notes()
    for sheet in dict.fromkeys(slave.sheet for slave in slaves.values()):
        document = Document(str(sheet), read_eds_bytes(sheet))
        found = check(document)
        stops = [one for one in found if one.rule.name in STOPS]
        names = [one.rule.name for one in stops]
        if document.encoding == "cp1252":
            names.insert(0, "its encoding, which is not UTF-8")
        counted = [*stops, *failing(found)]
        if names or counted:
            stopped = f"; dcfgen stops at {', '.join(dict.fromkeys(names))}" if names else ""
            place = Place(str(sheet), min((one.line for one in counted), default=0))
            notes.note("eds-check", place, "", f"it finds {severities(found)}{stopped}")
    return notes.all
