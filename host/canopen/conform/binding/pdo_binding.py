"""The PDOs of a node by kind: enabled or not, event-driven or synchronous, remappable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.binding.object_reader import ObjectReader
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.nmt import EXTENDED, FLAG_30
from tickrig.wire.canopen.pdo import PdoDescription, fields

RPDOS: Final = range(0x1400, 0x1600)
_TPDOS: Final = range(0x1800, 0x1A00)
_MAPPING: Final = 0x200
"""Distance of a mapping parameter from its communication parameter."""

_LOOKED_AT: Final = 16
"""Number of PDOs of each direction that are read. A node may have 512 PDOs."""

_MOST_MAPPED: Final = 64
"""The highest number of mapped objects. Larger numbers mark multiplexed PDOs."""

_COB_ID: Final = 1
_TYPE: Final = 2
_INHIBIT: Final = 3
_EVENT_TIMER: Final = 5
_SYNC_START: Final = 6

_EVENT_DRIVEN: Final = (254, 255)
_CYCLIC: Final = range(1, 241)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundPdo(PdoDescription):
    """PDO of the node under test that replaces a name such as `$tpdo` in a conformance check.

    Attributes:
        index: index of the PDO's communication parameter, from 1400h for an RPDO or from 1800h for
            a TPDO.
        subs: sub-indices of the PDO's communication parameter.
        remappable: whether the mapping and the COB-ID of the PDO can be written.
        places: number of objects that the PDO can map.
        restless: whether the PDO has an inhibit time or an event timer that cannot be switched off.
    """

    index: int
    subs: frozenset[int]
    remappable: bool
    places: int
    restless: bool = False

    @property
    def mapping_index(self) -> int:
        """Index of the mapping parameter of the PDO."""
        return self.index + _MAPPING

    def place(self, address: tuple[int, int]) -> tuple[int, int] | None:
        """Return the number of bytes before and after an object in the PDO."""
        for mapped, before in fields(self.mapping):
            if (mapped.index, mapped.sub) == address:
                whole = not before % 8 and not mapped.bits % 8
                return (before // 8, self.size - (before + mapped.bits) // 8) if whole else None
        return None


class _PdoKind(NamedTuple):
    """A kind of PDO: its name in checks, its meaning in words, and the PDOs of that kind."""

    name: str
    what: str
    fits: Callable[[BoundPdo], bool]


def _kinds(way: str) -> Iterator[_PdoKind]:
    """Yield the kinds of PDOs that exist in both directions."""
    pdo = way.upper()
    yield _PdoKind(way, pdo, lambda pdo: True)
    yield _PdoKind(f"{way}_enabled", f"{pdo} that is enabled", lambda pdo: pdo.enabled)
    yield _PdoKind(f"{way}_disabled", f"{pdo} that is disabled", lambda pdo: not pdo.enabled)
    yield _PdoKind(
        f"{way}_async",
        f"{pdo} that is enabled, event-driven, has a mapping and no timer that cannot be stopped",
        lambda pdo: (
            pdo.enabled
            and bool(pdo.mapping)
            and pdo.transmission_type in _EVENT_DRIVEN
            and not pdo.restless
        ),
    )
    yield _PdoKind(
        f"{way}_sync",
        f"{pdo} that is enabled, synchronous and has a mapping",
        lambda pdo: pdo.enabled and bool(pdo.mapping) and pdo.transmission_type in _CYCLIC,
    )
    what = f"{pdo} with a mapping that may be changed"
    yield _PdoKind(f"{way}_remappable", what, lambda pdo: pdo.remappable and not pdo.restless)
    yield _PdoKind(
        f"{way}_event_timer",
        f"{pdo} with an event timer",
        lambda pdo: pdo.remappable and _EVENT_TIMER in pdo.subs,
    )


CARRIED: Final[dict[str, tuple[int, int]]] = {
    "tpdo_di1": (0x6000, 1),
    "tpdo_ai1": (0x6401, 1),
    "rpdo_do1": (0x6200, 1),
    "rpdo_ao1": (0x6411, 1),
}
"""Names of event-driven PDOs that carry the first input or output of a CiA 401 module."""


def _carrying(way: str) -> Iterator[_PdoKind]:
    """Yield the kinds of PDOs that carry an object."""
    for name, (index, sub) in CARRIED.items():
        if name.startswith(way):
            what = f"{way.upper()} that is enabled, event-driven and carries {index:04X}h:{sub:02X}"
            yield _PdoKind(name, what, partial(_carries, (index, sub)))


def _carries(address: tuple[int, int], pdo: BoundPdo) -> bool:
    driven = pdo.enabled and pdo.transmission_type in _EVENT_DRIVEN
    return driven and pdo.place(address) is not None


_TPDO_KINDS: Final = (
    *_kinds("tpdo"),
    *_carrying("tpdo"),
    _PdoKind("tpdo_inhibit", "TPDO with an inhibit time", lambda pdo: _INHIBIT in pdo.subs),
    _PdoKind(
        "tpdo_sync_start", "TPDO with a SYNC start value", lambda pdo: _SYNC_START in pdo.subs
    ),
    _PdoKind(
        "tpdo_rtr",
        "TPDO that may be fetched with a remote frame",
        lambda pdo: pdo.enabled and bool(pdo.mapping) and not pdo.cob_id & FLAG_30,
    ),
)
_RPDO_KINDS: Final = (*_kinds("rpdo"), *_carrying("rpdo"))
_MAPPED_RPDO: Final = "mapped_rpdo"
PDO_NAMES: Final = (*(kind.name for kind in (*_TPDO_KINDS, *_RPDO_KINDS)), _MAPPED_RPDO)


def bind_pdos(
    device: EdsDevice, reader: ObjectReader, may_write: Callable[[int], bool]
) -> tuple[dict[str, BoundPdo], dict[str, str]]:
    """Find one PDO of the node for each PDO name in conformance checks.

    The name `mapped_rpdo` stands for an RPDO whose mapped objects may all be written. Checks may
    send data to this RPDO without changing its mapping. Before checks send data to any other RPDO,
    they must change its mapping.

    Args:
        device: device that the EDS describes.
        reader: reader for the objects of the node.
        may_write: function that returns whether the run may write an object, by its index.

    Returns:
        Two mappings: the PDO of each name, and for the names without a PDO a text that explains
        why.
    """
    bound: dict[str, BoundPdo] = {}
    reasons: dict[str, str] = {}
    tpdos, rpdos = list(_read(device, reader, _TPDOS)), list(_read(device, reader, RPDOS))
    for name, what, fits in (*_TPDO_KINDS, *_RPDO_KINDS, _harmless(may_write)):
        pdo = next(filter(fits, tpdos if name.startswith("t") else rpdos), None)
        if pdo is None:
            reasons[name] = f"the node has no {what}"
        else:
            bound[name] = pdo
    return bound, reasons


def _harmless(may_write: Callable[[int], bool]) -> _PdoKind:
    return _PdoKind(
        _MAPPED_RPDO,
        "RPDO that is enabled and whose objects may be written without moving anything",
        lambda pdo: (
            pdo.enabled
            and bool(pdo.mapping)
            and all(may_write(mapped.index) for mapped, _ in fields(pdo.mapping))
        ),
    )


def _read(device: EdsDevice, reader: ObjectReader, area: range) -> Iterator[BoundPdo]:
    """Read the first PDOs of a direction. Skip PDOs that are incomplete or have a 29-bit CAN-ID."""
    subs: dict[int, dict[int, bool]] = {}
    for entry in device.entries:
        subs.setdefault(entry.index, {})[entry.sub] = entry.writable
    for index in [index for index in subs if index in area][:_LOOKED_AT]:
        cob_id, kind = reader.number(index, _COB_ID), reader.number(index, _TYPE)
        mapping = _mapping(reader, index + _MAPPING)
        if cob_id is None or kind is None or mapping is None or cob_id & EXTENDED:
            continue
        head, body = subs[index], dict(subs.get(index + _MAPPING, {}))
        changeable = body.pop(0, False) and any(body.values()) and head.get(_COB_ID, False)
        yield BoundPdo(
            *(cob_id, mapping, kind),
            relative=False,
            index=index,
            subs=frozenset(head),
            remappable=changeable,
            places=len(body),
            restless=any(
                head.get(sub) is False and reader.number(index, sub)
                for sub in (_INHIBIT, _EVENT_TIMER)
            ),
        )


def _mapping(reader: ObjectReader, index: int) -> tuple[int, ...] | None:
    count = reader.number(index, 0)
    if count is None or count > _MOST_MAPPED:
        return None
    mapped = (reader.number(index, sub) for sub in range(1, count + 1))
    return tuple(number for number in mapped if number is not None)
