"""What the names in checks mean on this node: an object or PDO of the kind that each asks for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.binding.pdo_binding import (
    PDO_NAMES,
    BoundPdo,
    ObjectReader,
    Upload,
    bind_pdos,
    probe_device,
)
from tickrig.host.canopen.conform.check import Level
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import standard_object
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

# The names of objects in checks, and which object of a dictionary is of that kind.
COMMUNICATION_AREA: Final = range(0x1000, 0x2000)
PROFILE_AREA: Final = range(0x6000, 0xA000)
"""Where a write may move something."""

GENERIC_IO: Final = 401
"""The low word of 1000h of a module of CiA 401."""
PLAIN_OUTPUTS: Final = (0x6200, 0x6300, 0x6320, 0x6410, 0x6411, 0x6412)
"""Outputs of CiA 401 take any value; all else of a profile means something: a mode, a position."""

HARMLESS: Final = (0x1015, 0x1007, 0x100D, 0x100C, 0x1017, 0x1006)
"""Communication objects that take any value, and that stand for others of their size."""

TEXTS: Final = (DataType.VISIBLE_STRING, DataType.OCTET_STRING, DataType.UNICODE_STRING)
_SIZES: Final = (8, 16, 32, 64)
_ACCESS: Final = {
    **{"r": Access.READ.value, "w": Access.WRITE.value, "c": Access.CONST.value},
    **{"t": Access.TPDO.value, "p": Access.RPDO.value},
}
"""The letters of `objects.txt`."""
_MOST_BYTES: Final = 1 << 32


class Use(Enum):
    """What is done with an object."""

    READ = "read, or mapped where it is only read"
    REFUSED = "written, and the node must refuse it"
    WRITE = "written, and restored"


class EntryFacts(NamedTuple):
    """What decides for which names an entry can stand, found out once for all names.

    Attributes:
        entry: the entry.
        access: the bits of its access.
        kind: the number of its data type.
        free: it takes what its description says, without rules of CiA 301.
    """

    entry: EntryDescription
    access: int
    kind: int
    free: bool


def facts_of(entry: EntryDescription) -> EntryFacts:
    """Find out the facts about an entry."""
    free = entry.index not in COMMUNICATION_AREA or entry.index in HARMLESS
    return EntryFacts(entry, entry.access.value, int(entry.data_type), free)


class WantedObject(NamedTuple):
    """A name and what it stands for.

    Attributes:
        name: in checks, after `$`.
        what: for people.
        use: what is done with it.
        access: the bits of the access that are asked for: those that count, and their values.
        kinds: numbers of the data types; None for any.
        limited: there must be values of its type on both sides of its limits.
        at: the only place where it can be, and then nothing else counts.
        lengths: how many bytes its value may have.
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
        """Return the entries that are of this kind, in their order.

        What is written takes what its description says, without rules of CiA 301.

        One loop without calls: a tenth of a run of one check was here.
        """
        (mask, wanted), kinds, anyway = self.access, self.kinds, self.use is not Use.WRITE
        found = [
            entry
            for entry, access, kind, free in facts
            if access & mask == wanted and (kinds is None or kind in kinds) and (free or anyway)
        ]
        return list(filter(_is_limited, found)) if self.limited else found


def _is_limited(entry: EntryDescription) -> bool:
    """Return whether there are values of its type on both sides of its limits."""
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
    """Read `objects.txt`, whose head says what stands in a line."""
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


# Places in the dictionary of a node at which there is nothing.

_ABSENT_OBJECTS: Final = range(0x5FFF, 0x5EFF, -1)
_COUNTED: Final = (0x1018, 0x1016, 0x1010, 0x1200)
"""Of these sub-index 0 tells which sub-index is the highest."""
_GROWING: Final = (0x1003, *range(0x1200, 0x1C00))
"""In these a node may have more than its EDS describes: errors, COB-IDs, mapped objects."""
_LAST_SUB: Final = 0xFE

_Place = tuple[int, int]
"""Index and sub-index."""


class _AbsentPlaces(NamedTuple):
    """Places of a kind, in the order in which they are tried.

    Attributes:
        name: in checks, after `$`.
        what: what the node must have for it, for people.
        certain: CiA 301 says that there can be nothing.
        likely: nobody has described anything.
    """

    name: str
    what: str
    certain: tuple[_Place, ...]
    likely: tuple[_Place, ...]


def _absent_places(device: EdsDevice, reader: ObjectReader) -> Iterator[_AbsentPlaces]:
    """Yield an object, a sub-index behind a record, and one of a variable that are not there.

    Args:
        device: the objects that are there.
        reader: reads how many sub-indices they have.

    Raises:
        SdoTimeout: the node does not answer.
    """
    highest: dict[int, int] = {}
    for entry in device.entries:
        highest[entry.index] = max(entry.sub, highest.get(entry.index, 0))
    free = tuple((index, 0) for index in _ABSENT_OBJECTS if index not in highest)
    yield _AbsentPlaces("absent_object", "index free", (), free)
    counted = ((i, max(highest[i], reader.number(i, 0) or 0) + 1) for i in _COUNTED if i in highest)
    behind = ((i, last + 1) for i, last in highest.items() if last and i not in _GROWING)
    certain, likely = ([at for at in places if at[1] <= _LAST_SUB] for places in (counted, behind))
    what = "record with a sub-index free"
    yield _AbsentPlaces("absent_sub", what, tuple(certain), tuple(likely))
    variables = [index for index, last in highest.items() if not last and not _is_composed(index)]
    certain = [(index, 1) for index in variables if standard_object(index)]
    likely = [(index, 1) for index in variables if not standard_object(index)]
    yield _AbsentPlaces("sub_of_variable", "variable", tuple(certain), tuple(likely))


def _is_composed(index: int) -> bool:
    known = standard_object(index)
    return known is not None and known.composed


_DEVICE_TYPE: Final = 0x1000


@dataclass(frozen=True, slots=True)
class BoundObject:
    """An object of the node that a name stands for.

    Attributes:
        entry: its description.
        value: what was read of it, None where it cannot be read.
    """

    entry: EntryDescription
    value: bytes | None = None

    @property
    def index(self) -> int:
        """Index of the object."""
        return self.entry.index

    @property
    def sub(self) -> int:
        """Sub-index."""
        return self.entry.sub

    @property
    def level(self) -> Level:
        """The least level at which it may be written with a value that the node accepts."""
        inside = self.index in COMMUNICATION_AREA
        return Level.COMMUNICATION if inside else Level.INTRUSIVE


@dataclass(frozen=True, slots=True)
class BoundPlace:
    """A place in the dictionary at which the node has nothing."""

    index: int
    sub: int


Bound = BoundObject | BoundPdo | BoundPlace


@dataclass(frozen=True, slots=True)
class Binding:
    """What each name of `NAMES` stands for, or why it stands for nothing.

    Attributes:
        device: the objects: of the EDS, or those that answered.
        bound: by name.
        reasons: for people, by the names that are not bound.
        findings: where EDS and node contradict each other, one a line.
        known: the objects are those of an EDS.
        entries: the objects by index and sub-index.
        held: what was read of them.
    """

    device: EdsDevice
    bound: Mapping[str, Bound]
    reasons: Mapping[str, str]
    findings: tuple[str, ...] = ()
    known: bool = True
    entries: Mapping[_Place, EntryDescription] = field(default_factory=dict)
    held: Mapping[_Place, bytes] = field(default_factory=dict)


@dataclass(slots=True)
class _Search:
    """The search for what the names stand for."""

    device: EdsDevice
    reader: ObjectReader
    allow: Collection[int]
    never: Collection[int]
    known: bool
    entries: Mapping[_Place, EntryDescription]
    facts: list[EntryFacts]
    bound: dict[str, Bound] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    findings: list[str] = field(default_factory=list)


def bind(
    device: EdsDevice | None,
    upload: Upload,
    *,
    allow: Collection[int] = (),
    never: Collection[int] = (),
) -> Binding:
    """Find an object or PDO for each name; the node is only read.

    What is written later is of the communication area or of the manufacturer; without an
    EDS only of the former, as nobody knows what else may be written.

    Args:
        device: what its EDS says; None to ask the node which objects of CiA 301 it has.
        upload: reads an object of the node.
        allow: indices of the profile area, 6000h to 9FFFh, that may be written all the same.
        never: indices that are never written.

    Returns:
        What was found.

    Raises:
        SdoTimeout: the node does not answer.
    """
    reader = ObjectReader(upload)
    found = device or probe_device(reader)
    entries = {(entry.index, entry.sub): entry for entry in found.entries}
    facts = list(map(facts_of, found.entries))
    search = _Search(found, reader, allow, never, device is not None, entries, facts)
    for wanted in WANTED:
        _bind_object(search, wanted)
    for places in _absent_places(found, reader):
        _bind_absent(search, places)
    pdos, missing = bind_pdos(found, reader, lambda index: _may_write(search, index))
    search.bound.update(pdos)
    search.reasons.update(missing)
    findings = (*reader.findings, *search.findings)
    bound, reasons = search.bound, search.reasons
    return Binding(found, bound, reasons, findings, search.known, entries, reader.held)


def _bind_object(search: _Search, wanted: WantedObject) -> None:
    """Take the best object that fits, may be used so and can be read."""
    if wanted.at is None:
        fitting = wanted.fitting(search.facts)
    else:
        fitting = [search.entries[wanted.at]] if wanted.at in search.entries else []
    if not fitting:
        where = "the EDS has no" if search.known else "without an EDS nobody knows of any"
        search.reasons[wanted.name] = f"{where} {wanted.what}"
        return
    free = [entry for entry in fitting if wanted.use is not Use.WRITE or _is_free(search, entry)]
    safe = [entry for entry in free if wanted.use is Use.READ or _may_write(search, entry.index)]
    if not safe:
        search.reasons[wanted.name] = (
            _unsafe(wanted, free[0]) if free else _not_free(wanted, fitting)
        )
        return
    for entry in sorted(safe, key=lambda entry: _order(wanted, entry)):
        value = search.reader.read(entry) if entry.readable else None
        if (value is not None or not entry.readable) and len(value or b"") in wanted.lengths:
            search.bound[wanted.name] = BoundObject(entry, value)
            return
    first = f"{safe[0].index:04X}h:{safe[0].sub:02X}"
    search.reasons[wanted.name] = f"no {wanted.what}: what {first} and its like hold is none"


def _unsafe(wanted: WantedObject, entry: EntryDescription) -> str:
    where = f"{entry.index:04X}h"
    if entry.index in PROFILE_AREA:
        return f"{where} is the only {wanted.what}; writing it may move something (--allow {where})"
    return f"{where} is the only {wanted.what}, and it must not be written"


def _not_free(wanted: WantedObject, fitting: list[EntryDescription]) -> str:
    where = f"{fitting[0].index:04X}h"
    return f"no {wanted.what} takes any value: what {where} and its like hold means something"


def _is_free(search: _Search, entry: EntryDescription) -> bool:
    """Say whether an object takes any value of its type: in the profile area few do."""
    if entry.index not in PROFILE_AREA:
        return True
    profile = (search.reader.number(_DEVICE_TYPE, 0) or 0) & 0xFFFF
    return profile == GENERIC_IO and entry.index in PLAIN_OUTPUTS


def _may_write(search: _Search, index: int) -> bool:
    """Say whether an object may be written, with a value or to be refused."""
    if index in search.never:
        return False
    return index not in PROFILE_AREA or index in search.allow


def _order(wanted: WantedObject, entry: EntryDescription) -> tuple[bool | int, ...]:
    """Sort: what does least harm, then what is simplest."""
    narrow = entry.low is not None or entry.high is not None
    if wanted.use is Use.WRITE and entry.index in HARMLESS:
        return (0, HARMLESS.index(entry.index))
    area = 1 if entry.index in COMMUNICATION_AREA else 3 if entry.index in PROFILE_AREA else 2
    return (area, narrow, entry.signed, -_room(wanted, entry), entry.key)


def _room(wanted: WantedObject, entry: EntryDescription) -> int:
    """Return how much a string that is written is known to hold."""
    return len(entry.default) if wanted.use is Use.WRITE and entry.data_type in TEXTS else 0


def _bind_absent(search: _Search, places: _AbsentPlaces) -> None:
    """Take a place at which there can be nothing and is something: the checks tell it.

    Else the first at which the node has nothing, else, as it has something everywhere, any.
    """
    certain, likely = (
        [place for place in some if _may_write(search, place[0])]
        for some in (places.certain, places.likely)
    )
    there = [place for place in certain if _has_something(search, place)]
    for place in [*there, *certain, *likely]:
        if place in there or search.reader.has_nothing(*place):
            search.bound[places.name] = BoundPlace(*place)
            return
        if place not in certain and _has_something(search, place):
            there.append(place)
    if there:
        search.bound[places.name] = BoundPlace(*there[0])
    else:
        search.reasons[places.name] = f"the node has no {places.what}"


def _has_something(search: _Search, place: _Place) -> bool:
    """Read a place at which there should be nothing; what it has is a finding."""
    if not isinstance(search.reader.try_read(*place), bytes):
        return False
    why = "is not described" if search.known else "cannot be there"
    search.findings.append(f"{place[0]:04X}h:{place[1]:02X} {why}, and the node has it")
    return True


_ABSENT_NAMES: Final = ("absent_object", "absent_sub", "sub_of_variable")
NAMES: Final = frozenset({*(wanted.name for wanted in WANTED), *_ABSENT_NAMES, *PDO_NAMES})
"""All names that `bind` tells about."""
