"""What is wrong with a bus.yml, collected while its sections are read."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Final

from tickrig.host.canopen.data_sheet.rule import RuleFinding, rules_of
from tickrig.host.text.document import FilePlace, Item, Key
from tickrig.wire.canopen.eds.eds_file import shorten

# All rules for a bus.yml: name, who says so, what breaks, what to do.

_YAML: Final = "YAML 1.1"
_DCFGEN: Final = "dcfgen"
_COGEN: Final = "cogen"
_READERS: Final = "dcfgen, ros2_canopen"
_CONTAINER: Final = "device container of ros2_canopen"
_DRIVERS: Final = "drivers of ros2_canopen"

_ERRORS: Final = (
    ("yaml", _YAML, "nothing of it can be read", "mend this line, or the one before"),
    ("yaml-twice", _YAML, "dcfgen takes the last, the container the first", "keep one"),
    ("yaml-key", _YAML, "readers refuse the file", "give a text or a number"),
    ("yaml-value", _YAML, "readers refuse the file", "write what the tag says, or leave it out"),
    ("yaml-merge", _YAML, "readers refuse the file", "merge a mapping: <<: *name"),
    ("yaml-loop", _YAML, "readers do not end", "write it out"),
    (
        "kind",
        _READERS,
        "dcfgen or a driver refuses it",
        "write it as docs/reference/canopen/bus-file.md has it",
    ),
    ("no-number", _READERS, "dcfgen or a driver refuses it", "write a number, as 10 or 0xA"),
    (
        "number-range",
        _DCFGEN,
        "dcfgen refuses it, or the value is cut off",
        "give one of its range",
    ),
    ("no-dcf", _DCFGEN, "dcfgen refuses the file", "dcf: the name of its EDS or DCF"),
    ("no-file", _DCFGEN, "dcfgen refuses the file", "put the EDS beside bus.yml"),
    ("eds", "CiA 306", "the dictionary is another one, or none", "canmon eds check tells more"),
    ("no-identity", _DCFGEN, "dcfgen refuses the EDS", "describe 1000h and 1018h:01"),
    ("object-missing", _DCFGEN, "dcfgen refuses the file", "write to what is there"),
    ("value-range", _DCFGEN, "dcfgen refuses the file", "give a value of its data type"),
    ("value-type", _DCFGEN, "dcfgen cannot write such a type", "write it by the driver"),
    ("odd-size", _DCFGEN, "all writes behind it are lost", "write it by the driver"),
    ("pdo-missing", _DCFGEN, "dcfgen refuses the file", "configure a PDO that is there"),
    ("cob-id-none", _DCFGEN, "dcfgen refuses the file", "give COB-IDs of your own"),
    ("event-deadline", _DCFGEN, "dcfgen fails, or writes the event timer", "write 14xxh:05 as sdo"),
    ("no-master", _CONTAINER, "dcfgen and the container refuse the file", "master: node_id: 1"),
    ("no-node-id", _CONTAINER, "the container refuses the node", "node_id: 1 to 127"),
    ("node-id", "CiA 301 7.2", "no node has it", "node_id: 1 to 127"),
    ("node-id-twice", "CiA 301 7.2", "two nodes answer to one master", "give each its own"),
    ("no-driver", _CONTAINER, "the container refuses the node", "driver: a class, package: where"),
    (
        "hidden",
        _CONTAINER,
        "the container stops here",
        "<<: &name in the first node: docs/reference/canopen/bus-file.md",
    ),
    ("node-name", _CONTAINER, "the container does not load it", "give it another name"),
    ("no-nodes", _COGEN, "cogen writes nothing", "nodes: NAME: ..."),
    (
        "tickrig",
        "canopen-slave-emu",
        "no slave is made of it",
        "docs/howto/ros2-canopen.md has all keys",
    ),
)
_WARNINGS: Final = (
    (
        "yaml-number",
        _READERS,
        "dcfgen and the drivers have two numbers",
        "write 10, 0xA, 1.5 or 1.5e+3",
    ),
    (
        "eds-check",
        "canmon eds check",
        "dcfgen stops, or misreads it",
        "canmon eds fix mends a part",
    ),
    ("slaves-only", _DCFGEN, "dcfgen refuses the file", "master: node_id: 1"),
    ("file-elsewhere", _DCFGEN, "dcfgen, which runs beside bus.yml, fails", "put the EDS there"),
    ("sync-period", _DCFGEN, "nothing else has time on the bus", "give µs: 10 ms are 10000"),
    ("bit-rate", "CiA 301", "devices have no such bit rate", "baudrate: 125, 250, 500 or 1000"),
    ("no-value", _DCFGEN, "dcfgen writes 0", "value: what is meant"),
    ("driver-class", _CONTAINER, "the container finds no such driver", "a class and its package"),
    ("driver-value", _DRIVERS, "the driver takes another one, or fails", "give what it takes"),
    ("scale", _DRIVERS, "the joint is not where ROS has it", "from_dev: 1 divided by to_dev"),
    (
        "bus-load",
        _DRIVERS,
        "periods are left out, heartbeats are late",
        "map what is polled into PDOs, or a longer period",
    ),
    ("not-whole", _DCFGEN, "dcfgen cuts it off", "write a whole number"),
    ("flag-text", _DCFGEN, "dcfgen takes any text for true", "true or false, without quotes"),
    (
        "pdo-key",
        _DCFGEN,
        "dcfgen drops it",
        "a TPDO has event_timer, inhibit_time, sync_start; write 14xxh:05 of an RPDO as sdo",
    ),
    ("unknown-key", _DCFGEN, "nobody reads it", "write the key that is meant"),
    ("section-lost", _COGEN, "cogen drops it", "put it under nodes:"),
    (
        "defaults-win",
        _COGEN,
        "cogen overwrites what the node says",
        "an anchor, not defaults: docs/reference/canopen/bus-file.md",
    ),
    (
        "defaults-other",
        _COGEN,
        "they are written to it, too",
        "an anchor: docs/reference/canopen/bus-file.md",
    ),
    ("identity-key", _DCFGEN, "the master checks what the EDS says", "write it into the EDS"),
    ("identity", _DCFGEN, "the master refuses the node", "give bus.yml and EDS one number"),
    ("no-object", _DCFGEN, "dcfgen leaves it out", "leave the key out"),
    ("read-only", _DCFGEN, "the node refuses it at boot-up", "leave it out, or mend the EDS"),
    (
        "value-limits",
        "CiA 306",
        "the node refuses it at boot-up",
        "give a value between the limits",
    ),
    ("not-mappable", _DCFGEN, "the node refuses it at boot-up", "map what can be mapped"),
    ("direction", "CiA 306", "the node refuses it at boot-up", "map it the other way"),
    ("pdo-length", _DCFGEN, "the node refuses it at boot-up", "map at most 64 bits"),
    ("mapped-length", _DCFGEN, "dcfgen takes the length of the EDS", "leave bits out"),
    ("not-enabled", _DCFGEN, "the PDO is never sent", "cob_id: auto"),
    ("cob-id-twice", "CiA 301", "one CAN-ID means two things", "cob_id: auto, or another one"),
    ("cob-id-restricted", "CiA 301", "it clashes with a service", "cob_id: auto, or another one"),
    ("error-control", _DCFGEN, "dcfgen drops guarding", "keep heartbeat or guarding"),
    ("no-entry", _DCFGEN, "the node does not watch the master", "free an entry of 1016h"),
    ("joint", "canopen-slave-emu", "the slave is not what is meant", "let the files agree"),
)
_NOTES: Final = (
    ("own-key", _CONTAINER, "nothing", "leave it, if a driver of your own reads it"),
    ("not-disabled", _DCFGEN, "the master has a PDO that never comes", "mapping: []"),
)

RULES: Final = rules_of(_ERRORS, _WARNINGS, _NOTES)
"""By name, errors first."""


_HEX: Final = re.compile(r"[0-9A-Fa-f]{1,8}[hH]")
_QUOTED: Final = re.compile(r"0[xX][0-9A-Fa-f]+")
_FOLLOWING: Final = frozenset(
    {"direction", "no-value", "not-mappable", "read-only", "value-limits"}
)
"""Rules that a wrong key of the same line breaks, too: it was another entry that was meant."""
UNSIGNED8, UNSIGNED16, UNSIGNED32 = 0xFF, 0xFFFF, 0xFFFF_FFFF


class BusFileNotes:
    """All findings of a file, each once."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, FilePlace, str], RuleFinding] = {}

    def note(self, rule: str, place: FilePlace, where: str, text: str) -> None:
        """Note what breaks a rule; what several nodes have of one line is noted once.

        Args:
            rule: its name.
            place: the line.
            where: section and keys, as `joint_1.tpdo.1`; empty for the file as a whole.
            text: what came, and what was allowed.
        """
        found = RuleFinding(RULES[rule], place.file, place.line, shorten(where), text)
        self._found.setdefault((rule, place, text), found)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._found)

    def since(self, count: int) -> list[RuleFinding]:
        """Return those that came after so many."""
        return [*self._found.values()][count:]

    @property
    def all(self) -> tuple[RuleFinding, ...]:
        """All of them in the order of the lines, without those of `_FOLLOWING` that follow."""
        found = self._found.values()
        slips = {(one.file, one.line) for one in found if one.rule.name == "unknown-key"}
        told = (
            one
            for one in found
            if one.rule.name not in _FOLLOWING or (one.file, one.line) not in slips
        )
        return tuple(sorted(told, key=lambda one: (one.file, one.line)))


class BusFileSection:
    """A mapping of the file, read as dcfgen reads it.

    Args:
        notes: take what is wrong.
        name: section and keys, for people.
        item: the mapping; what is none counts as empty, and is noted.
        place: of its key.
    """

    def __init__(self, notes: BusFileNotes, name: str, item: Item, place: FilePlace) -> None:
        self.notes, self.name, self.place = notes, name, place
        self._item = item
        if not item.is_mapping:
            text = f"{item} is no mapping"
            notes.note("kind", item.place if item.text else place, name, text)

    @property
    def fields(self) -> Mapping[Key, Item]:
        """All that it holds."""
        return self._item.fields

    def __contains__(self, key: object) -> bool:
        """Return whether it has a key."""
        return key in self.fields

    def place_of(self, key: Key) -> FilePlace:
        """Return where a key stands, else the section."""
        return self._item.keys.get(key, self.place)

    def note(self, rule: str, key: Key, text: str) -> None:
        """Note what is wrong with a key."""
        self.notes.note(rule, self.place_of(key), self.name, text)

    def section(self, key: Key) -> BusFileSection:
        """Return a mapping in it; it is empty where there is none."""
        place = self.place_of(key)
        item = self.fields.get(key, Item({}, place))
        return BusFileSection(self.notes, f"{self.name}.{key}", item, place)

    def sections(self, key: Key) -> list[BusFileSection]:
        """Return the mappings of a list in it."""
        item = self.fields.get(key)
        if item is None:
            return []
        if not item.is_list:
            self.note("kind", key, f"{shorten(str(key))}: {item} is no list")
        name = f"{self.name}.{key}"
        return [BusFileSection(self.notes, name, each, each.place) for each in item.items]

    def whole(self, key: Key, default: int = 0, low: int = 0, high: int = UNSIGNED32) -> int:
        """Return a whole number, the default where there is none or a wrong one."""
        item = self.fields.get(key)
        if item is None:
            return default
        number = self._number(key, item)
        if number is None:
            return default
        if isinstance(number, float) and not number.is_integer():
            self.note(
                "not-whole", key, f"{shorten(str(key))}: {item.text} is cut off: {int(number)}"
            )
        number = int(number)
        if not low <= number <= high:
            allowed = f"{low}..{high}" if high <= UNSIGNED16 else f"{low}..0x{high:X}"
            self.note("number-range", key, f"{shorten(str(key))}: {item.text} is not in {allowed}")
            return default
        return number

    def real(self, key: Key, default: float) -> float:
        """Return a number, with a fraction or without."""
        item = self.fields.get(key)
        number = None if item is None else self._number(key, item, fraction=True)
        return default if number is None else float(number)

    def flag(self, key: Key, default: bool) -> bool:
        """Return a flag; any text is true, as for dcfgen."""
        item = self.fields.get(key)
        if item is None:
            return default
        if not isinstance(item.value, bool | int):
            taken = str(bool(item.value)).lower()
            text = f"{shorten(str(key))}: {item} is not true or false: {taken} is taken"
            self.note("flag-text", key, text)
        return bool(item.value)

    def text(self, key: Key, default: str = "") -> str:
        """Return a text."""
        item = self.fields.get(key)
        if item is None:
            return default
        if item.is_list or item.is_mapping or item.value is None:
            self.note("kind", key, f"{shorten(str(key))}: {item} is no text")
            return default
        return item.value if isinstance(item.value, str) else item.text

    def _number(self, key: Key, item: Item, *, fraction: bool = False) -> int | float | None:
        """Return what int() of Python, or float(), makes of a value; None if that is nothing."""
        value = item.value
        try:
            if isinstance(value, str):
                value = float(value) if fraction else int(value)
            if isinstance(value, int | float) and math.isfinite(value):
                return value
        except (ValueError, OverflowError):
            pass
        self.note(
            "no-number", key, f"{shorten(str(key))}: {item} is no number{_as_number(item.text)}"
        )
        return None


def _as_number(text: str) -> str:
    """Say how a text could be meant as a number: without quotes, or with 0x before it."""
    if _HEX.fullmatch(text):
        return f"; did you mean 0x{text[:-1]}?"
    return ": it is a text; without quotes it is one" if _QUOTED.fullmatch(text) else ""
