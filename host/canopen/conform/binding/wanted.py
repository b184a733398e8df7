"""The names of objects in checks, and the matching objects of a dictionary."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

COMMUNICATION_AREA: Final = range(0x1000, 0x2000)
PROFILE_AREA: Final = range(0x6000, 0xA000)
"""Area of profile objects, in which a write may move something."""

GENERIC_IO: Final = 401
"""The profile number of a CiA 401 module, which is the low word of 1000h."""
PLAIN_OUTPUTS: Final = (0x6200, 0x6300, 0x6320, 0x6410, 0x6411, 0x6412)
"""Outputs of CiA 401 that accept every value. Other profile objects are modes or positions."""

HARMLESS: Final = (0x1015, 0x1007, 0x100D, 0x100C, 0x1017, 0x1006)
"""Communication objects that accept every value, and that stand for others of their size."""

TEXTS: Final = (DataType.VISIBLE_STRING, DataType.OCTET_STRING, DataType.UNICODE_STRING)
_SIZES: Final = (8, 16, 32, 64)
_ACCESS: Final = {
    **{"r": Access.READ.value, "w": Access.WRITE.value, "c": Access.CONST.value},
    **{"t": Access.TPDO.value, "p": Access.RPDO.value},
}
"""Letters that `objects.txt` uses."""
_MOST_BYTES: Final = 1 << 32


class Use(Enum):
    """The use of an object in a check."""

    READ = "read, or mapped if it is read-only"
    REFUSED = "written, and the node must refuse it"
    WRITE = "written, and restored"


class EntryFacts(NamedTuple):
    """Properties of an object dictionary entry that decide which names can stand for the entry.

    A check contains a name in place of an index and sub-index. A name can stand for an entry if the
    properties of the entry meet the requirements of the name.

    Attributes:
        entry: entry of the object dictionary.
        access: access rights of the entry as a bit mask.
        kind: number of the entry's data type (CiA 301).
        free: whether every value between the limits of the entry may be written. This is False for
            communication objects whose values CiA 301 limits further.
    """

    entry: EntryDescription
    access: int
    kind: int
    free: bool


def facts_of(entries: Iterable[EntryDescription]) -> list[EntryFacts]:
    """Find out the facts about entries."""
    return [
        EntryFacts(
            *(entry, entry.access._value_, int(entry.data_type)),
            free=entry.index not in COMMUNICATION_AREA or entry.index in HARMLESS,
        )
        for entry in entries
    ]


class WantedObject(NamedTuple):
    """Name in conformance checks, with the criteria for the object that replaces it.

    Attributes:
        name: name as in checks, without its `$`.
        what: description of the object, for messages.
        use: use of the object in checks: it is read, written and restored, or written although the
            node must refuse it.
        access: bit mask of access rights, and the required value of these bits.
        kinds: numbers of the allowed data types, or None for any type.
        limited: whether the object must have a low and a high limit, with values of its data type
            beyond both.
        at: index and sub-index that the object must have, or None. If it is set, the other criteria
            do not apply.
        lengths: allowed lengths of the object's value in bytes.
    """

    name: str
    what: str
    use: Use
    access: tuple[int, int] = (0, 0)
    kinds: Collection[int] | None = None
    limited: bool = False
    at: tuple[int, int] | None = None
    lengths: range = range(1, _MOST_BYTES)

    def fitting(self, facts: Iterable[EntryFacts]) -> list[EntryDescription]:
        """Return the objects of a node that this name can stand for, in the order of `facts`.

        A check contains the name in place of an index and sub-index. When the check is executed,
        the name stands for one of these objects.

        If checks write to the object and restore it (`Use.WRITE`), they may write any value between
        its limits. For such a name, a communication object (1000h to 1FFFh) is in the result only
        if CiA 301 allows all values between its limits.
        """
        # One loop without function calls, which took a tenth of the time of a single check.
        (mask, wanted), kinds, anyway = self.access, self.kinds, self.use is not Use.WRITE
        found = [
            entry
            for entry, access, kind, free in facts
            if access & mask == wanted and (kinds is None or kind in kinds) and (free or anyway)
        ]
        return list(filter(_is_limited, found)) if self.limited else found


def _is_limited(entry: EntryDescription) -> bool:
    """Return whether the data type of an entry has values beyond both limits."""
    if entry.low is None or entry.high is None:
        return False
    lowest, highest = entry.data_type.limits
    return lowest < entry.low and entry.high < highest


_INTEGERS: Final = frozenset(kind for kind in DataType if kind.is_integer)
_KINDS: Final[Mapping[str, Collection[int] | None]] = {
    "any": None,
    "integers": frozenset(map(int, _INTEGERS)),
    "texts": frozenset(map(int, TEXTS)),
    **{kind.name: (int(kind),) for kind in (DataType.BOOLEAN, DataType.REAL32, DataType.DOMAIN)},
    **{f"{bits} bits": frozenset(int(k) for k in _INTEGERS if k.bits == bits) for bits in _SIZES},
}


def _read_wanted(text: str) -> Iterator[WantedObject]:
    """Read `objects.txt`. The head of that file describes the format of a line."""
    for line in text.splitlines():
        if line.startswith("#"):
            continue
        name, what, use, place, *rest = line.split(" | ")
        if not rest:
            index, sub = (int(word, 16) for word in place.split(":"))
            what = f"{index:04X}h:{sub:02X}, {what}"
            yield WantedObject(name, what, Use[use.upper()], at=(index, sub))
            continue
        has, lacks = (sum(_ACCESS[letter] for letter in part) for part in place.partition("-")[::2])
        kinds, length, *limited = rest
        least, _, most = length.partition(" to ")
        yield WantedObject(
            *(name, what, Use[use.upper()], (has | lacks, has), _KINDS[kinds]),
            limited=bool(limited),
            lengths=range(int(least), int(most or _MOST_BYTES) + 1),
        )


WANTED: Final = tuple(_read_wanted(Path(__file__).with_name("objects.txt").read_text("utf-8")))
