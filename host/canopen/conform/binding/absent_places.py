"""Places in the dictionary of a node at which there is nothing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.binding.object_reader import ObjectReader
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.standard_objects import standard_object

ABSENT_OBJECTS: Final = range(0x5FFF, 0x5EFF, -1)
COUNTED: Final = (0x1018, 0x1016, 0x1010, 0x1200)
"""Of these sub-index 0 tells which sub-index is the highest."""
GROWING: Final = (0x1003, *range(0x1200, 0x1C00))
"""In these a node may have more than its EDS describes: errors, COB-IDs, mapped objects."""
LAST_SUB: Final = 0xFE

Place = tuple[int, int]
"""Index and sub-index."""


class AbsentPlaces(NamedTuple):
    """Places of a kind, in the order in which they are tried.

    Attributes:
        name: in checks, after `$`.
        what: what the node must have for it, for people.
        certain: CiA 301 says that there can be nothing.
        likely: nobody has described anything.
    """

    name: str
    what: str
    certain: tuple[Place, ...]
    likely: tuple[Place, ...]


def absent_places(device: EdsDevice, reader: ObjectReader) -> Iterator[AbsentPlaces]:
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
    free = tuple((index, 0) for index in ABSENT_OBJECTS if index not in highest)
    yield AbsentPlaces("absent_object", "index free", (), free)
    counted = ((i, max(highest[i], reader.number(i, 0) or 0) + 1) for i in COUNTED if i in highest)
    behind = ((i, last + 1) for i, last in highest.items() if last and i not in GROWING)
    certain, likely = ([at for at in places if at[1] <= LAST_SUB] for places in (counted, behind))
    what = "record with a sub-index free"
    yield AbsentPlaces("absent_sub", what, tuple(certain), tuple(likely))
    variables = [index for index, last in highest.items() if not last and not _is_composed(index)]
    certain = [(index, 1) for index in variables if standard_object(index)]
    likely = [(index, 1) for index in variables if not standard_object(index)]
    yield AbsentPlaces("sub_of_variable", "variable", tuple(certain), tuple(likely))


def _is_composed(index: int) -> bool:
    known = standard_object(index)
    return known is not None and known.composed
