"""What a conformance check is: its clause, what it may do, what it needs, and its steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

Step = Mapping[str, Any]
"""One step, in the terms of the notation of checks (docs/reference/canopen/conform.md)."""


class Level(IntEnum):
    """What a run may do to the node; a level holds those before it."""

    READ_ONLY = 0
    """SDO uploads and listening: no download to any object, not even one that must be refused."""
    COMMUNICATION = 1
    """Communication objects, refused downloads, NMT, SYNC, PDO, error control; all restored."""
    INTRUSIVE = 2
    """Reset node, LSS, store and restore, further objects of the manufacturer."""

    @property
    def word(self) -> str:
        """The name on the command line."""
        return self.name.lower().replace("_", "-")


STIMULUS: Final = "stimulus"
"""What a check needs for which somebody moves the inputs of the device."""


@dataclass(frozen=True, slots=True)
class Check:
    """One question to a node.

    Attributes:
        id: of the suite, as `NMT-03`; those made of an object are `OD-2000.00-type`.
        group: what it belongs to, as `NMT`.
        title: what conforming means, for people.
        source: document, version and clause; `practice` where no clause is certain.
        level: the least that it needs.
        needs: features without which it is not applicable; `STIMULUS` is one.
        choice: why the answer is left to the device; empty where the clause decides.
        steps: what is sent, expected, counted and waited for.
    """

    id: str
    group: str
    title: str
    source: str
    level: Level
    needs: frozenset[str]
    steps: tuple[Step, ...]
    choice: str = ""
