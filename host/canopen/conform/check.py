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
"""Time that a check waits for an answer if the check sets no time. CiA 301 defines none."""

# Actions of steps on the bus.


@dataclass(frozen=True, slots=True)
class Send:
    """Step that sends a frame, given in candump notation."""

    frame: str
    extended: bool = False


@dataclass(frozen=True, slots=True)
class Expect:
    """Step that waits for a frame of the node, which must match one of the patterns.

    The next frame with the CAN-ID of the patterns is compared. Frames with other CAN-IDs are
    ignored.
    """

    patterns: tuple[str, ...]
    within_ms: int = ANSWER_MS


@dataclass(frozen=True, slots=True)
class ExpectNone:
    """Step that waits. No frame with this CAN-ID may come."""

    can_id: str
    for_ms: int


@dataclass(frozen=True, slots=True)
class Count:
    """Step that waits. Between `least` and `most` matching frames must come."""

    pattern: str
    for_ms: int
    least: int
    most: int


@dataclass(frozen=True, slots=True)
class Period:
    """Step that waits. Matching frames must come with a period of `each_ms`."""

    pattern: str
    each_ms: int
    times: int


@dataclass(frozen=True, slots=True)
class Wait:
    """Step that lets time pass."""

    for_ms: int


@dataclass(frozen=True, slots=True)
class Forget:
    """Step that drops the received frames of a CAN-ID."""

    can_id: str


@dataclass(frozen=True, slots=True)
class Act:
    """Step that calls the stimulus function, which operates the device from outside.

    The function sets an input, compares an output, or switches the power.

    Attributes:
        words: arguments of the function, such as `input`, `6000:01`, `01`.
        within_ms: time limit of the function in milliseconds, or None for no limit. If the function
            takes longer, the check is inconclusive.
    """

    words: tuple[str, ...]
    within_ms: int | None = None


@dataclass(frozen=True, slots=True)
class Macro:
    """Step that runs a macro, an operation that needs many frames, such as an LSS fastscan.

    Attributes:
        words: arguments of the macro. In a check, an argument may be the name of an object. Before
            a run executes the step, it replaces each name by the index and sub-index of the object.
    """

    name: str
    words: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class OfObject:
    """Base class of the steps that read or write one object of the node.

    Attributes:
        at: object, as a name or as a text such as `1017:00`. When a run has replaced the names, the
            attribute is an index and a sub-index.
    """

    at: str | Address

    @property
    def address(self) -> Address:
        """Index and sub-index of the object of a bound step."""
        assert not isinstance(self.at, str)
        return self.at


@dataclass(frozen=True, slots=True)
class Write(OfObject):
    """Step that writes an object. The node must accept the value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseWrite(OfObject):
    """Step that writes a value which the node must refuse with one of the given SDO abort codes."""

    data: str
    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Read(OfObject):
    """Step that reads an object. The value must match the pattern."""

    data: str


@dataclass(frozen=True, slots=True)
class ReadOther(OfObject):
    """Step that reads an object. The object must not have this value."""

    data: str


@dataclass(frozen=True, slots=True)
class RefuseRead(OfObject):
    """Step that reads an object. The node must refuse it with one of the given SDO abort codes."""

    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Keep(OfObject):
    """Step that declares an object which the check changes indirectly.

    The declared object is restored at the end of the check.
    """


@dataclass(frozen=True, slots=True)
class Hold(OfObject):
    """Step that reads an object, and checks that its value has the right data type and range.

    Attributes:
        kind: name of the data type that the value must have.
        low: lowest allowed value, or None for the lowest value of the type.
        high: highest allowed value, or None for the highest value of the type.
        value: the only allowed value in hex, or None for any value.
        codes: SDO abort codes with which the node may refuse the read request.
    """

    kind: str
    low: int | float | None = None
    high: int | float | None = None
    value: str | None = None
    codes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RefuseRewrite(OfObject):
    """Step that reads an object and writes its value back. The node must refuse the write.

    Attributes:
        grow: number of bytes that are added to the value. A negative number removes bytes from its
            end. 0 does not change the value.
        codes: SDO abort codes with which the node may refuse the write.
    """

    grow: int
    codes: tuple[str, ...]


_OfFrames = Send | Expect | ExpectNone | Count | Period | Wait | Forget | Act | Macro
_OfAnObject = Write | RefuseWrite | Read | ReadOther | RefuseRead | Keep | Hold | RefuseRewrite
Action = _OfFrames | _OfAnObject


class Step(NamedTuple):
    """One step of a conformance check, with its action and its effect on the verdict.

    Attributes:
        action: action of the step, such as sending a frame or waiting for one.
        given: whether the step only prepares the check. If it fails, the check is inconclusive.
        at_end: whether the step is a clean-up, which is always executed at the end and cannot fail
            the check.
    """

    action: Action
    given: bool = False
    at_end: bool = False


class Level(IntEnum):
    """Level of a run: how much the run may change the tested node.

    Each level also allows everything that the lower levels allow.
    """

    READ_ONLY = 0
    """SDO uploads and listening.

    There are no downloads, not even a download that the node must refuse.
    """
    COMMUNICATION = 1
    """Communication objects, refused downloads, NMT, SYNC, PDO and error control.

    All are restored.
    """
    INTRUSIVE = 2
    """Reset node, LSS, store and restore, and further objects of the manufacturer."""

    @property
    def word(self) -> str:
        """Name of the level in the option on the command line."""
        return self.name.lower().replace("_", "-")


STIMULUS: Final = "stimulus"
"""Name of the feature that operates the inputs of the device."""


@dataclass(frozen=True, slots=True)
class Check:
    """One conformance check of a CANopen node: its requirement, its conditions and its steps.

    Attributes:
        id: name of the check, such as `NMT-03`, or `OD-2000.00-type` for checks of an object of the
            EDS.
        group: group of the check, such as `NMT`.
        title: requirement, as a sentence about what a conforming node does.
        source: document, version and clause of the requirement, or `practice` if no clause is
            certain.
        level: lowest level of a run at which the check is executed.
        needs: features that the node must have. Otherwise the check is not applicable. `STIMULUS`
            stands for a stimulus of the user.
        choice: reason why a device may answer in several ways, empty if the clause decides the
            answer.
        steps: steps in the order of execution.
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
"""Pattern for the first character that is not fixed in a part of a frame pattern."""

Stimulus = Callable[..., str]
"""Function that operates the inputs of the device.

The function takes words such as `input 6000:01 01`, and returns the answer. It raises ValueError if
it cannot do the operation.
"""


@dataclass(frozen=True, slots=True)
class ConformancePlan:
    """The options of a run.

    Attributes:
        level: highest level of the actions that the run may do to the node.
        only: names of groups or checks, with * and ?, in upper or lower case. If it is empty, all
            checks are selected.
        allow: indices of profile objects (6000h to 9FFFh) that may be written.
        never: indices of objects that are never written, even if another option allows the write.
        bit_rate: bit rate of the bus in bit/s, or None if unknown.
        max_load: share of the bit rate that the tester may use, above 0 to 1.
        seed: seed for the order of the objects. 0 keeps the order of the dictionary.
        stimulus: function that operates the inputs of the device, or None if there is none.
        confirm: function that is called before actions that concern other nodes or cannot be
            undone. It returns whether to do the action.
        longest_s: time in seconds after which no further check starts.
        resolution_us: resolution of the time stamps of the adapter.
        shared_host: whether the node may be a process of this machine. Such a node is delayed
            together with the tester.
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
        """Return whether the run executes a check, by its level and by the patterns of `--only`."""
        if check.level > self.level:
            return False
        named = (check.id.upper(), check.group)
        return not self.only or any(
            fnmatchcase(name, pattern.upper()) for pattern in self.only for name in named
        )

    def may_choose(self, group: str, place: str = "") -> bool:
        """Return whether the patterns of `--only` can match a check, before the check is built.

        If the result is False, the caller does not build the checks that the arguments select.

        Args:
            group: name of the group.
            place: beginning of the check's id after the name of the group. For example, `1017.00`
                selects the checks of the object 1017h:00 in this group. An empty text selects all
                checks of the group.
        """
        begun = f"{group}-{place}".upper()
        for pattern in map(str.upper, self.only):
            fixed = _WILD.split(pattern, maxsplit=1)[0]
            wild = fixed != pattern and begun.startswith(fixed)
            if wild or fixed.startswith(begun) or fnmatchcase(group, pattern):
                return True
        return not self.only
