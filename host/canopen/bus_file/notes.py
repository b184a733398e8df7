"""Errors of a bus.yml, collected while its sections are read."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from tickrig.host.canopen.data_sheet.rule import RuleFinding, read_rules
from tickrig.host.text.document import FilePlace, Item, Key
from tickrig.wire.canopen.eds.eds_file import shorten

RULES: Final = read_rules(Path(__file__).with_name("rules.txt"))
"""Rules for a bus.yml by name. Rules for errors come first."""

_HEX: Final = re.compile(r"[0-9A-Fa-f]{1,8}[hH]")
_QUOTED: Final = re.compile(r"0[xX][0-9A-Fa-f]+")
_FOLLOWING: Final = frozenset(
    {"direction", "no-value", "not-mappable", "read-only", "value-limits"}
)
"""Rules that a wrong key in the same line also breaks, because the user meant another key."""
UNSIGNED8, UNSIGNED16, UNSIGNED32 = 0xFF, 0xFFFF, 0xFFFF_FFFF


class BusFileNotes:
    """All findings of a file, without duplicates."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, FilePlace, str], RuleFinding] = {}

    def note(self, rule: str, place: FilePlace, where: str, text: str) -> None:
        """Add an error or a warning.

        Several nodes may use the same line of the file, for example by a YAML anchor. If one of
        them already has a finding with this rule, place and text, the new finding is ignored.

        Args:
            rule: name of the violated rule.
            place: file and line of the finding.
            where: path of keys to the value, such as `joint_1.tpdo.1`, or an empty text for the
                whole file.
            text: invalid value, and the allowed values.
        """
        found = RuleFinding(RULES[rule], place.file, place.line, shorten(where), text)
        self._found.setdefault((rule, place, text), found)

    def __len__(self) -> int:
        """Return the number of findings."""
        return len(self._found)

    def since(self, count: int) -> list[RuleFinding]:
        """Return the findings after the first `count` findings."""
        return [*self._found.values()][count:]

    @property
    def all(self) -> tuple[RuleFinding, ...]:
        """All errors and warnings in the order of their lines.

        A misspelt key is reported as an unknown key. Errors in the same line that may only be a
        consequence of the misspelt key are left out. For example, if the key `value` is misspelt,
        it is not reported that the value is missing.
        """
        found = self._found.values()
        slips = {(one.file, one.line) for one in found if one.rule.name == "unknown-key"}
        told = (
            one
            for one in found
            if one.rule.name not in _FOLLOWING or (one.file, one.line) not in slips
        )
        return tuple(sorted(told, key=lambda one: (one.file, one.line)))


class BusFileSection:
    """A section of a bus.yml. Its methods read values and report invalid values, as dcfgen would.

    Args:
        notes: collector of the findings.
        name: path of keys to the section, as shown to the user.
        item: YAML mapping with the values. A value that is not a mapping is reported, and counts as
            an empty mapping.
        place: file and line of the key whose value is this section.
    """

    def __init__(self, notes: BusFileNotes, name: str, item: Item, place: FilePlace) -> None:
        self.notes, self.name, self.place = notes, name, place
        self._item = item
        if not item.is_mapping:
            text = f"{item} is not a mapping"
            notes.note("kind", item.place if item.text else place, name, text)

    @property
    def fields(self) -> Mapping[Key, Item]:
        """All keys with their values."""
        return self._item.fields

    def __contains__(self, key: object) -> bool:
        """Return whether the mapping has a key."""
        return key in self.fields

    def place_of(self, key: Key) -> FilePlace:
        """Return the file and line of a key. If the key is missing, return those of its section."""
        return self._item.keys.get(key, self.place)

    def note(self, rule: str, key: Key, text: str) -> None:
        """Record a finding about a key."""
        self.notes.note(rule, self.place_of(key), self.name, text)

    def wrong(self, rule: str, key: Key, reason: str) -> None:
        """Record a finding about a key, with the key before the reason."""
        self.note(rule, key, f"{shorten(str(key))}: {reason}")

    def section(self, key: Key) -> BusFileSection:
        """Return the nested section of a key. If the key is missing, the section is empty."""
        place = self.place_of(key)
        item = self.fields.get(key, Item({}, place))
        return BusFileSection(self.notes, f"{self.name}.{key}", item, place)

    def sections(self, key: Key) -> list[BusFileSection]:
        """Return the mappings of a list of the section."""
        item = self.fields.get(key)
        if item is None:
            return []
        if not item.is_list:
            self.wrong("kind", key, f"{item} is not a list")
        name = f"{self.name}.{key}"
        return [BusFileSection(self.notes, name, each, each.place) for each in item.items]

    def whole(self, key: Key, default: int = 0, low: int = 0, high: int = UNSIGNED32) -> int:
        """Return the integer of a key, or the default if the key is missing or invalid."""
        item = self.fields.get(key)
        if item is None:
            return default
        number = self._number(key, item)
        if number is None:
            return default
        if isinstance(number, float) and not number.is_integer():
            self.wrong("not-whole", key, f"{item.text} is cut off: {int(number)}")
        number = int(number)
        if not low <= number <= high:
            allowed = f"{low}..{high}" if high <= UNSIGNED16 else f"{low}..0x{high:X}"
            self.wrong("number-range", key, f"{item.text} is not in {allowed}")
            return default
        return number

    def real(self, key: Key, default: float) -> float:
        """Return a whole or fractional number, or the default."""
        item = self.fields.get(key)
        number = None if item is None else self._number(key, item, fraction=True)
        return default if number is None else float(number)

    def flag(self, key: Key, default: bool) -> bool:
        """Return a boolean. As in dcfgen, any text counts as true."""
        item = self.fields.get(key)
        if item is None:
            return default
        if not isinstance(item.value, bool | int):
            taken = str(bool(item.value)).lower()
            self.wrong("flag-text", key, f"{item} is not true or false: {taken} is taken")
        return bool(item.value)

    def text(self, key: Key, default: str = "") -> str:
        """Return a text, or the default."""
        item = self.fields.get(key)
        if item is None:
            return default
        if item.is_list or item.is_mapping or item.value is None:
            self.wrong("kind", key, f"{item} is not a text")
            return default
        return item.value if isinstance(item.value, str) else item.text

    def _number(self, key: Key, item: Item, *, fraction: bool = False) -> int | float | None:
        """Return the result of Python's int() or float() for a value, or None after an error."""
        value = item.value
        try:
            if isinstance(value, str):
                value = float(value) if fraction else int(value)
            if isinstance(value, int | float) and math.isfinite(value):
                return value
        except (ValueError, OverflowError):
            pass
        self.wrong("no-number", key, f"{item} is not a number{_as_number(item.text)}")
        return None


def _as_number(text: str) -> str:
    """Return the notation that makes a text a number: without quotes, or with 0x in front."""
    if _HEX.fullmatch(text):
        return f"; did you mean 0x{text[:-1]}?"
    return ": it is a text; without quotes it is one" if _QUOTED.fullmatch(text) else ""
