"""Conformance checks: clause, level, requirements and steps.

A step is an action, such as `Write` or `Expect`. docs/reference/canopen/conform.md defines the
notation of steps, and `parse_step` reads it. `bind_check` replaces names such as `$heartbeat` by
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
"""How long a check waits for an answer if it gives no time: CiA 301 defines none."""

# What a step does on the bus.


@dataclass(frozen=True, slots=True)
class Send:
    """Send a frame, as candump writes it."""

    frame: str
    extended: bool = False


@dataclass(frozen=True, slots=True)
class Expect:
    """Wait for the next frame with a CAN-ID; it must match one of the patterns."""

    patterns: tuple[str, ...]
    within_ms: int = ANSWER_MS


@dataclass(frozen=True, slots=True)
class ExpectNone:
    """Wait; no frame with this CAN-ID may come."""

    can_id: str
    for_ms: int


@dataclass(frozen=True, slots=True)
class Count:
    """Wait; between `least` and `most` matching frames must come."""

    pattern: str
    for_ms: int
    least: int
    most: int


@dataclass(frozen=True, slots=True)
class Period:
    """Wait; matching frames must come with a period of `each_ms`."""

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
    """Operate an input of the device, compare an output, or switch the power.

    Attributes:
        words: arguments of the stimulus, such as `input`, `6000:01`, `01`.
        within_ms: time limit of the action; if the action takes longer, the check is inconclusive.
            None allows any time.
    """

    words: tuple[str, ...]
    within_ms: int | None = None


@dataclass(frozen=True, slots=True)
class Macro:
    """Do an operation of many frames.

    Attributes:
        words: texts, and addresses of objects once the check is bound.
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
    """Write an object; the node must accept the value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseWrite(OfObject):
    """Write an object; the node must refuse it with one of the SDO abort codes."""

    data: str
    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Read(OfObject):
    """Read an object; its value must match the pattern."""

    data: str


@dataclass(frozen=True, slots=True)
class ReadOther(OfObject):
    """Read an object; it must not have this value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseRead(OfObject):
    """Read an object; the node must refuse it with one of the SDO abort codes."""

    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keep(OfObject):
    """Declare that the check changes an object by other means; it is restored at the end."""


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
    """Read an object and write it back, longer by `grow` bytes; the node must refuse that."""

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
        action: the action of the step.
        given: whether the step is a preparation; if it fails, the check is inconclusive.
        at_end: whether the step is always done at the end; such a step cannot fail the check.
    """

    action: Action
    given: bool = False
    at_end: bool = False


class Level(IntEnum):
    """What a run may do to the node; each level includes the levels before it."""

    READ_ONLY = 0
    """SDO uploads and listening; no downloads, not even a download that the node must refuse."""
    COMMUNICATION = 1
    """Communication objects, refused downloads, NMT, SYNC, PDO, error control; all restored."""
    INTRUSIVE = 2
    """Reset node, LSS, store and restore, further objects of the manufacturer."""

    @property
    def word(self) -> str:
        """Name of the option on the command line."""
        return self.name.lower().replace("_", "-")


STIMULUS: Final = "stimulus"
"""Need of a check that operates the inputs of the device."""


@dataclass(frozen=True, slots=True)
class Check:
    """One question to a node.

    Attributes:
        id: for example `NMT-03`; `OD-2000.00-type` for checks of an object of the EDS.
        group: for example `NMT`.
        title: what a conforming node does.
        source: document, version and clause; `practice` if no clause is certain.
        level: the lowest level that the check needs.
        needs: features without which the check is not applicable; `STIMULUS` is one of them.
        choice: why the device may choose the answer; empty if the clause decides.
        steps: what the tester sends, expects, counts and waits for.
    """

    id: str
    group: str
    title: str
    source: str
    level: Level
    needs: frozenset[str]
    steps: tuple[Step, ...]
    choice: str = ""


# The options of a run of the tester.

_WILD: Final = re.compile(r"[*?[]")
"""The first character of a pattern part that is not fixed."""

Stimulus = Callable[..., str]
"""Operates the inputs of the device.

Takes words such as `input 6000:01 01`, and returns the answer. Raises ValueError if it cannot do
the operation.
"""


@dataclass(frozen=True, slots=True)
class ConformancePlan:
    """The options of a run.

    Attributes:
        level: what the run may do to the node.
        only: names of groups or checks, with * and ?, in any case; all if empty.
        allow: indices of profile objects (6000h to 9FFFh) that may be written.
        never: indices of objects that are never written, even if another option allows it.
        bit_rate: of the bus in bit/s, None if unknown.
        max_load: share of the bit rate that the tester may use, above 0 to 1.
        seed: seed for the order of the objects; 0 keeps the order of the dictionary.
        stimulus: operates the inputs of the device, None if there is none.
        confirm: called before actions that concern other nodes or cannot be undone; returns whether
            to do them.
        longest_s: after this time no further check starts.
        resolution_us: resolution of the adapter's time stamps.
        shared_host: whether the node may be a process of this machine, which is delayed together
            with the tester.
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
        """Return whether a check is selected: by its level, and by its name or group."""
        if check.level > self.level:
            return False
        named = (check.id.upper(), check.group)
        return not self.only or any(
            fnmatchcase(name, pattern.upper()) for pattern in self.only for name in named
        )

    def may_choose(self, group: str, place: str = "") -> bool:
        """Return whether a check of a group may be selected; used before the check is made.

        Args:
            group: of the check.
            place: the part of its id after the group: `1017.00` for checks of this object.
        """
        begun = f"{group}-{place}".upper()
        for pattern in map(str.upper, self.only):
            fixed = _WILD.split(pattern, maxsplit=1)[0]
            wild = fixed != pattern and begun.startswith(fixed)
            if wild or fixed.startswith(begun) or fnmatchcase(group, pattern):
                return True
        return not self.only
