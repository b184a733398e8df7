"""Conformance checks: clause, level, requirements and steps.

A step is an action, as `Write` or `Expect`. docs/reference/canopen/conform.md has the notation of
steps, and `parse_step` reads it. Where the notation has names, as `$heartbeat`, `bind_check` puts
the numbers of one node.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from fnmatch import fnmatchcase
from typing import Any, Final, NamedTuple

Address = tuple[int, int]
"""Index and sub-index."""

ANSWER_MS: Final = 1_000
"""How long a check waits for an answer where it says nothing: CiA 301 gives no time."""

# What a step does on the bus.


@dataclass(frozen=True, slots=True)
class Send:
    """Send a frame, as candump writes it."""

    frame: str
    extended: bool = False


@dataclass(frozen=True, slots=True)
class Expect:
    """Wait for the next frame on a CAN-ID; it must match one of the patterns."""

    patterns: tuple[str, ...]
    within_ms: int = ANSWER_MS


@dataclass(frozen=True, slots=True)
class ExpectNone:
    """Wait; no frame on this CAN-ID may come."""

    can_id: str
    for_ms: int


@dataclass(frozen=True, slots=True)
class Count:
    """Wait; so many frames that match must come."""

    pattern: str
    for_ms: int
    least: int
    most: int


@dataclass(frozen=True, slots=True)
class Period:
    """Wait; frames that match must come each so many milliseconds."""

    pattern: str
    each_ms: int
    times: int


@dataclass(frozen=True, slots=True)
class Wait:
    """Let time pass."""

    for_ms: int


@dataclass(frozen=True, slots=True)
class Forget:
    """Drop the frames of a CAN-ID that have come."""

    can_id: str


@dataclass(frozen=True, slots=True)
class Act:
    """Move an input of the device, compare an output, or switch the power.

    Attributes:
        words: for the stimulus, as `input`, `6000:01`, `01`.
        within_ms: a longer act disturbs the check; None allows any time.
    """

    words: tuple[str, ...]
    within_ms: int | None = None


@dataclass(frozen=True, slots=True)
class Macro:
    """Do what takes many frames.

    Attributes:
        words: texts, and addresses of objects once they are bound.
    """

    name: str
    words: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class OfObject:
    """A step about one object.

    Attributes:
        at: the object: a name, or `1017:00`; once it is bound, index and sub-index.
    """

    at: str | Address

    @property
    def address(self) -> Address:
        """Index and sub-index of a bound step."""
        assert not isinstance(self.at, str)
        return self.at


@dataclass(frozen=True, slots=True)
class Write(OfObject):
    """Write an object; the node must take the value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseWrite(OfObject):
    """Write an object; the node must refuse it with one of the SDO abort codes."""

    data: str
    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Read(OfObject):
    """Read an object; it must hold what the pattern says."""

    data: str


@dataclass(frozen=True, slots=True)
class ReadOther(OfObject):
    """Read an object; it must not hold this value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseRead(OfObject):
    """Read an object; the node must refuse it with one of the SDO abort codes."""

    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keep(OfObject):
    """Say that the check changes an object by other means: it is written back at the end."""


@dataclass(frozen=True, slots=True)
class Hold(OfObject):
    """Read an object; it must have a value of its data type.

    Attributes:
        kind: name of the data type.
        low: its lowest value, None for that of the type.
        high: its highest.
        value: the value in hex, None for any.
        codes: SDO abort codes with which the node may refuse instead.
    """

    kind: str
    low: int | float | None = None
    high: int | float | None = None
    value: str | None = None
    codes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RefuseRewrite(OfObject):
    """Read an object and write it back, so many bytes longer; the node must refuse that."""

    grow: int
    codes: tuple[str, ...]


Action = (
    Send
    | Expect
    | ExpectNone
    | Count
    | Period
    | Wait
    | Forget
    | Act
    | Macro
    | Write
    | RefuseWrite
    | Read
    | ReadOther
    | RefuseRead
    | Keep
    | Hold
    | RefuseRewrite
)


class Step(NamedTuple):
    """One step of a check.

    Attributes:
        action: what is done.
        given: it prepares: if the node does not do it, the check says nothing about the node.
        at_end: it is done at the end, however the check went, and fails no check.
    """

    action: Action
    given: bool = False
    at_end: bool = False


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


# What a run of the tester was told to do.

_WILD: Final = re.compile(r"[*?[]")
"""Begins what is not fixed in a pattern."""

Stimulus = Callable[..., str]
"""Moves the inputs of the device: takes words as `input 6000:01 01`, returns what it answers.

Raises ValueError for what it cannot do.
"""


@dataclass(frozen=True, slots=True)
class ConformancePlan:
    """What was chosen.

    Attributes:
        level: what may be done to the node.
        only: names of groups or checks, with * and ?, in any case; all if empty.
        allow: indices of profile objects (6000h to 9FFFh) that may be written.
        never: indices of objects that are never written, whatever else is allowed.
        bit_rate: of the bus in bit/s, None if nobody says it.
        max_load: share of the bit rate that the tester may use, above 0 to 1.
        seed: of the order in which objects are judged; 0: that of the dictionary.
        stimulus: moves the inputs of the device, None if nobody can.
        confirm: is asked before what concerns other nodes or cannot be undone; no says no.
        longest_s: after so long no further check is begun.
        resolution_us: of the time stamps of the adapter.
        shared_host: the node may be a process of this machine, and late when this one is.
    """

    level: Level = Level.READ_ONLY
    only: tuple[str, ...] = ()
    allow: frozenset[int] = frozenset()
    never: frozenset[int] = frozenset()
    bit_rate: int | None = None
    max_load: float = 0.3
    seed: int = 0
    stimulus: Stimulus | None = None
    confirm: Callable[[str], bool] = lambda question: False
    longest_s: float = 1_800
    resolution_us: int = 1_000
    shared_host: bool = False

    def chooses(self, check: Check) -> bool:
        """Return whether a check was chosen: by its level, and by its name or group."""
        if check.level > self.level:
            return False
        named = (check.id.upper(), check.group)
        return not self.only or any(
            fnmatchcase(name, pattern.upper()) for pattern in self.only for name in named
        )

    def may_choose(self, group: str, place: str = "") -> bool:
        """Return whether a check of a group may be chosen, before it is made.

        Args:
            group: of the check.
            place: what follows the group in its id: `1017.00` for those of this object.
        """
        begun = f"{group}-{place}".upper()
        for pattern in map(str.upper, self.only):
            fixed = _WILD.split(pattern, maxsplit=1)[0]
            wild = fixed != pattern and begun.startswith(fixed)
            if wild or fixed.startswith(begun) or fnmatchcase(group, pattern):
                return True
        return not self.only
