"""ContentsInterpretation, which reads the place and properties in the information at an address."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

from tickrig.host.rtc.component import ModuleSpec
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.host.rtc.ucode.cache import LookupCache, OpenSource
from tickrig.host.rtc.ucode.http_source import HttpSource
from tickrig.host.rtc.ucode.lookup import Lookup, WantedUcode
from tickrig.wire.rtc_types.rtc import Point2D, TimedPoint2D, TimedStringSeq

_FAR_M: Final = 1e6
_MOST_PROPERTIES: Final = 32
_MOST_CHARACTERS: Final = 200
"""Maximum number of characters of a property."""


@dataclass(frozen=True, slots=True)
class Contents:
    """Information that a service has about the place of a ucode marker.

    A ucode is an identifier of 128 bits, and a ucode marker is the object that carries it. The
    component `ContentsInterpretation` fetches this information.

    Attributes:
        x_m: x coordinate of the place in m.
        y_m: y coordinate of the place in m. The y axis points to the left of the x axis.
        properties: further properties as texts `name=value`, in the order of the names.
    """

    x_m: float
    y_m: float
    properties: tuple[str, ...]


class ContentsInterpretation(Lookup[Contents]):
    """Component that fetches the information about ucode markers: positions and properties.

    A ucode is an identifier of 128 bits, and a ucode marker is an object that carries it.

    The ports are:

    - `addresses` in, as `UcodeSettlement` writes them
    - `position` out: a point for each ucode, in m
    - `place` out: the ucode, then `name=value` of each property

    The information at an address is a JSON object with the numbers `x_m` and `y_m`. Its other
    members are properties. The NEDO report (Fig. 123) gives only the name of the component and its
    cache, so the ports and the JSON object are additions of Tickrig.

    Args:
        instance_name: name of the component.
        open_source: function that creates the source of the information. By default, it is an HTTP
            source.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec(
        "ContentsInterpretation", "Places of ucodes and their properties, cached"
    )

    def __init__(self, instance_name: str, open_source: OpenSource = HttpSource) -> None:
        super().__init__(instance_name, "addresses", LookupCache(parse_contents), open_source)
        self.position = self.add_port(OutPort("position", TimedPoint2D))
        self.place = self.add_port(OutPort("place", TimedStringSeq))
        self._add_outputs()

    def _wanted(self, value: TimedStringSeq) -> Iterator[WantedUcode]:
        words = value.data
        for ucode, address in zip(words[::2], words[1::2], strict=False):
            yield WantedUcode(ucode, address, value.tm)

    def _write(self, found: list[tuple[WantedUcode, Contents]]) -> None:
        for wanted, contents in found:
            point = Point2D(contents.x_m, contents.y_m)
            self.position.write(TimedPoint2D(wanted.received, point))
            words = (wanted.ucode, *contents.properties)
            self.place.write(TimedStringSeq(wanted.received, words))


def parse_contents(text: str) -> Contents:
    """Read the information of a place.

    Raises:
        ValueError: the text is not such information.

    >>> parse_contents('{"x_m": 1, "y_m": 2.5, "name": "door"}')
    Contents(x_m=1.0, y_m=2.5, properties=('name=door',))
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{text[:60]!r} is no JSON object")
    x_m, y_m = (_metres(found.pop(name, None), name) for name in ("x_m", "y_m"))
    if len(found) > _MOST_PROPERTIES:
        raise ValueError(f"{len(found)} properties are more than {_MOST_PROPERTIES}")
    return Contents(x_m, y_m, tuple(_property(name, found[name]) for name in sorted(found)))


def _metres(value: object, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= _FAR_M:
        raise ValueError(f"{name} is a number of metres, not {json.dumps(value)[:40]}")
    return float(value)


def _property(name: str, value: object) -> str:
    text = f"{name}={value if isinstance(value, str) else json.dumps(value)}"
    if len(text) > _MOST_CHARACTERS or not text.isprintable():
        raise ValueError(f"the property {name[:40]!r} is no short line")
    return text
