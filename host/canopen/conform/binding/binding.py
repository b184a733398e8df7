"""Binding of the names in checks to objects and PDOs of the node."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.binding.object_reader import ObjectReader, Upload, probe_device
from tickrig.host.canopen.conform.binding.pdo_binding import PDO_NAMES, BoundPdo, bind_pdos
from tickrig.host.canopen.conform.binding.wanted import (
    COMMUNICATION_AREA,
    GENERIC_IO,
    HARMLESS,
    PLAIN_OUTPUTS,
    PROFILE_AREA,
    TEXTS,
    WANTED,
    EntryFacts,
    Use,
    WantedObject,
    facts_of,
)
from tickrig.host.canopen.conform.check import Level
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import standard_object
from tickrig.wire.canopen.eds.object_table import EntryDescription

# Places in the object dictionary of a node that hold nothing.

_ABSENT_OBJECTS: Final = range(0x5FFF, 0x5EFF, -1)
_COUNTED: Final = (0x1018, 0x1016, 0x1010, 0x1200)
"""Types whose sub-index 0 holds the highest sub-index."""
_GROWING: Final = (0x1003, *range(0x1200, 0x1C00))
"""Objects that may have more sub-indices than the EDS lists: errors, COB-IDs, mappings."""
_LAST_SUB: Final = 0xFE

_Place = tuple[int, int]
"""Index and sub-index."""
_MayWrite = Callable[[int], bool]
"""Function that returns whether an object may be written, by its index."""


class _AbsentPlaces(NamedTuple):
    """Kinds of unused places, in the order in which they are tried.

    Attributes:
        name: name of the place in checks, without its `$`.
        what: description of what the node must have, used in messages.
        certain: whether CiA 301 allows no object at this place.
        likely: whether no description mentions this place.
    """

    name: str
    what: str
    certain: tuple[_Place, ...]
    likely: tuple[_Place, ...]


def _absent_places(device: EdsDevice, reader: ObjectReader) -> Iterator[_AbsentPlaces]:
    """Yield unused places: an index, a sub-index of a record, and a sub-index of a variable.

    Args:
        device: the existing objects.
        reader: reader for the number of sub-indices.

    Raises:
        SdoTimeout: the node does not answer.
    """
    highest: dict[int, int] = {}
    for entry in device.entries:
        highest[entry.index] = max(entry.sub, highest.get(entry.index, 0))
    free = [(index, 0) for index in _ABSENT_OBJECTS if index not in highest]
    yield _AbsentPlaces("absent_object", "index free", (), tuple(free))
    counted = ((i, max(highest[i], reader.number(i, 0) or 0) + 1) for i in _COUNTED if i in highest)
    behind = ((i, last + 1) for i, last in highest.items() if last and i not in _GROWING)
    certain, likely = ([at for at in places if at[1] <= _LAST_SUB] for places in (counted, behind))
    what = "record with a sub-index free"
    yield _AbsentPlaces("absent_sub", what, tuple(certain), tuple(likely))
    variables = {index: standard_object(index) for index, last in highest.items() if not last}
    certain = [(index, 1) for index, known in variables.items() if known and not known.composed]
    likely = [(index, 1) for index, known in variables.items() if not known]
    yield _AbsentPlaces("sub_of_variable", "variable", tuple(certain), tuple(likely))


_DEVICE_TYPE: Final = 0x1000


@dataclass(frozen=True, slots=True)
class BoundObject:
    """Object of the node under test that replaces a name such as `$u8` in a conformance check.

    Attributes:
        entry: description of the object from the EDS, or from probing the node.
        value: bytes that were read from the node, or None if the object cannot be read.
    """

    entry: EntryDescription
    value: bytes | None = None

    @property
    def index(self) -> int:
        """Index of the object."""
        return self.entry.index

    @property
    def sub(self) -> int:
        """Sub-index of the object."""
        return self.entry.sub

    @property
    def level(self) -> Level:
        """The lowest level at which a value that the node accepts may be written."""
        inside = self.index in COMMUNICATION_AREA
        return Level.COMMUNICATION if inside else Level.INTRUSIVE


@dataclass(frozen=True, slots=True)
class BoundPlace:
    """An index and sub-index at which the node has no object."""

    index: int
    sub: int


Bound = BoundObject | BoundPdo | BoundPlace


@dataclass(frozen=True, slots=True)
class Binding:
    """Assignment of the names in conformance checks to objects and PDOs of the node under test.

    If a name in a check has no object, the check is not applicable to the node.

    Attributes:
        device: objects that the EDS describes. Without an EDS, these are the objects that could be
            read.
        known: whether the objects come from an EDS.
        entries: entries of the dictionary by index and sub-index.
        reader: reader that has read the objects, and caches their values.
        bound: object or PDO of each name.
        reasons: text by name that explains why the name has no object.
    """

    device: EdsDevice
    known: bool
    entries: Mapping[_Place, EntryDescription]
    reader: ObjectReader
    bound: dict[str, Bound] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)

    @property
    def findings(self) -> tuple[str, ...]:
        """Contradictions between EDS and node, one per line."""
        return tuple(self.reader.findings)


def bind(
    device: EdsDevice | None,
    upload: Upload,
    *,
    allow: Collection[int] = (),
    never: Collection[int] = (),
) -> Binding:
    """Find an object or PDO for each name. Nothing is written to the node.

    Objects that checks write later are in the communication area or the manufacturer area. Without
    an EDS these objects are only in the communication area, because it is unknown which other
    objects may be written.

    Args:
        device: device that the EDS describes, or None to read from the node which objects of CiA
            301 it has.
        upload: function that reads an object of the node.
        allow: indices of the profile area, 6000h to 9FFFh, that may be written despite the general
            rule.
        never: indices that are never written.

    Returns:
        The objects by name, and the reasons for names without an object.

    Raises:
        SdoTimeout: the node does not answer.
    """

    def may_write(index: int) -> bool:
        """Return whether a check may send a write request for an object to the node."""
        return index not in never and (index not in PROFILE_AREA or index in allow)

    reader = ObjectReader(upload)
    found = device or probe_device(reader)
    entries = {(entry.index, entry.sub): entry for entry in found.entries}
    binding = Binding(found, device is not None, entries, reader)
    facts = facts_of(found.entries)
    for wanted in WANTED:
        _bind_object(binding, wanted, facts, may_write)
    for places in _absent_places(found, reader):
        _bind_absent(binding, places, may_write)
    pdos, missing = bind_pdos(found, reader, may_write)
    binding.bound.update(pdos)
    binding.reasons.update(missing)
    return binding


def _bind_object(
    binding: Binding, wanted: WantedObject, facts: list[EntryFacts], may_write: _MayWrite
) -> None:
    """Take the best object that matches, may be used as the check needs, and can be read."""
    if wanted.at is None:
        fitting = wanted.fitting(facts)
    else:
        fitting = [binding.entries[wanted.at]] if wanted.at in binding.entries else []
    if not fitting:
        where = "the EDS has no" if binding.known else "without an EDS there is no known"
        binding.reasons[wanted.name] = f"{where} {wanted.what}"
        return
    free = [entry for entry in fitting if wanted.use is not Use.WRITE or _is_free(binding, entry)]
    safe = [entry for entry in free if wanted.use is Use.READ or may_write(entry.index)]
    if not safe:
        binding.reasons[wanted.name] = (
            _unsafe(wanted, free[0]) if free else _not_free(wanted, fitting)
        )
        return
    for entry in sorted(safe, key=partial(_order, wanted)):
        value = binding.reader.read(entry) if entry.readable else None
        if (value is not None or not entry.readable) and len(value or b"") in wanted.lengths:
            binding.bound[wanted.name] = BoundObject(entry, value)
            return
    first = f"{safe[0].index:04X}h:{safe[0].sub:02X}"
    binding.reasons[wanted.name] = (
        f"no {wanted.what}: {first} and similar objects have other values"
    )


def _unsafe(wanted: WantedObject, entry: EntryDescription) -> str:
    where = f"{entry.index:04X}h"
    if entry.index in PROFILE_AREA:
        return f"{where} is the only {wanted.what}; writing it may move something (--allow {where})"
    return f"{where} is the only {wanted.what}, and --never forbids to write it"


def _not_free(wanted: WantedObject, fitting: list[EntryDescription]) -> str:
    where = f"{fitting[0].index:04X}h"
    return f"no {wanted.what} accepts any value: values of {where} have a meaning"


def _is_free(binding: Binding, entry: EntryDescription) -> bool:
    """Return whether an object accepts every value of its type. Few profile objects do."""
    if entry.index not in PROFILE_AREA:
        return True
    profile = (binding.reader.number(_DEVICE_TYPE, 0) or 0) & 0xFFFF
    return profile == GENERIC_IO and entry.index in PLAIN_OUTPUTS


def _order(wanted: WantedObject, entry: EntryDescription) -> tuple[bool | int, ...]:
    """Return a sort key: the least harmful object comes first, then the simplest."""
    narrow = entry.low is not None or entry.high is not None
    if wanted.use is Use.WRITE and entry.index in HARMLESS:
        return (0, HARMLESS.index(entry.index))
    area = 1 if entry.index in COMMUNICATION_AREA else 3 if entry.index in PROFILE_AREA else 2
    is_text = wanted.use is Use.WRITE and entry.data_type in TEXTS
    return (area, narrow, entry.signed, -len(entry.default) if is_text else 0, entry.key)


def _bind_absent(binding: Binding, places: _AbsentPlaces, may_write: _MayWrite) -> None:
    """Take a place that must be unused but is used, so that the checks report this error.

    If the node uses no such place, take the first unused place. If the node has an object at every
    place, take any place.
    """
    certain = [place for place in places.certain if may_write(place[0])]
    there = [place for place in certain if _has_something(binding, place)]
    for place in [*there, *certain, *places.likely]:
        if not may_write(place[0]):
            continue
        if place in there or binding.reader.has_nothing(*place):
            binding.bound[places.name] = BoundPlace(*place)
            return
        if place not in certain and _has_something(binding, place):
            there.append(place)
    if there:
        binding.bound[places.name] = BoundPlace(*there[0])
    else:
        binding.reasons[places.name] = f"the node has no {places.what}"


def _has_something(binding: Binding, place: _Place) -> bool:
    """Read a place that should be unused. An answer is a finding."""
    if not isinstance(binding.reader.try_read(*place), bytes):
        return False
    why = "is not described" if binding.known else "cannot be there"
    binding.reader.findings.append(f"{place[0]:04X}h:{place[1]:02X} {why}, but the node has it")
    return True


_ABSENT_NAMES: Final = ("absent_object", "absent_sub", "sub_of_variable")
NAMES: Final = frozenset({*(wanted.name for wanted in WANTED), *_ABSENT_NAMES, *PDO_NAMES})
"""All names that `bind` handles."""
