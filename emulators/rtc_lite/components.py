"""Components by name: ours, and those of a user's file (`FILE.py:Class`)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from tickrig.device.rtc_lite.component import Component
from tickrig.device.rtc_lite.relays import Echo, LiteA, LiteB
from tickrig.host.text.user_file import SUFFIX, explain_error, find_class

COMPONENTS: Final[Mapping[str, type[Component]]] = MappingProxyType(
    {"echo": Echo, "lite-a": LiteA, "lite-b": LiteB}
)


def find_component(spec: str) -> type[Component]:
    """Return the component that a name or `FILE.py:Class` stands for.

    Raises:
        ValueError: there is none, its file cannot be run, or no PIC has room for it.
    """
    if spec in COMPONENTS:
        return COMPONENTS[spec]
    if f"{SUFFIX}:" not in spec:
        raise ValueError(f"no node {spec!r}; known: {', '.join(COMPONENTS)}, or FILE.py:Class")
    kind: type[Component] = find_class(spec, Component)
    try:
        kind()
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {explain_error(error, spec.rpartition(':')[0])}") from None
    return kind
