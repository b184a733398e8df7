"""A check in which numbers of one node replace the names.

`parse_step` reads the steps of a check, one step per line, in the notation of
docs/reference/canopen/conform.md.

>>> parse_step("3..5 x $heartbeat#05 in 400 ms").action
Count(pattern='$heartbeat#05', for_ms=400, least=3, most=5)
>>> parse_step("refuse write $ro_u8 00 06010002 06010000").action
RefuseWrite(at='$ro_u8', data='00', codes=('06010002', '06010000'))

`step_words` returns a step as text in the same notation, also for steps of object checks.

>>> step_words(Step(RefuseWrite((0x1000, 0), "00", ("06010002",))))
'refuse write 1000:00 00 06010002'
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol, assert_never

from tickrig.host.canopen.conform.check import (
    ANSWER_MS,
    Act,
    Action,
    Address,
    Check,
    Count,
    Expect,
    ExpectNone,
    Forget,
    Hold,
    Keep,
    Macro,
    OfObject,
    Period,
    Read,
    ReadOther,
    RefuseRead,
    RefuseRewrite,
    RefuseWrite,
    Send,
    Step,
    Wait,
    Write,
)
from tickrig.wire.canopen.sdo_frame import SPECIFIER, ClientCommand

# Names in place of numbers: the value of `$heartbeat` or `$rw_u8.new` for one node.

NAME: Final = re.compile(r"\$(?:\{([a-z][a-z0-9_]*)\}|([a-z][a-z0-9_]*)(?:\.([a-z]+))?)")
"""Pattern of `$name`, `$name.attribute`, or `${name}` if a digit follows."""
_ADDRESS: Final = re.compile(r"([0-9A-F]{4}):([0-9A-F]{2})")


class Unbound(Exception):  # noqa: N818 - what the name is
    """Raised if a check uses a name for which the node under test has no object or value.

    Attributes:
        reason: text that explains why.
    """

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"${name}: {reason}")
        self.reason = reason


class _Names(Protocol):
    """The values that stand for the names in checks on one node."""

    def text(self, name: str, attribute: str, /) -> str:
        """Return the text that replaces `$name.attribute` in a check.

        The text is in hex, in the byte order of the bus. If the name stands for an object, the
        attributes mean:

        - `new` and `other`: two different values that a check may write to the object;
        - `old`: the value of the object before the run;
        - `map`: the PDO mapping entry for the object (index, sub-index and length);
        - empty: index and sub-index of the object.

        Raises:
            Unbound: the node has no object or value for this name.
        """
        ...

    def address(self, name: str, /) -> Address:
        """Return the index and sub-index of the object that a name in a check stands for.

        Raises:
            Unbound: the node has no such object.
        """
        ...


def _resolve(text: str, names: _Names) -> str:
    """Replace all names in a text. Raise Unbound if a name has no value."""
    if "$" not in text:
        return text
    return NAME.sub(lambda match: names.text(match[1] or match[2], match[3] or ""), text)


def _resolve_address(target: str, names: _Names) -> Address:
    """Return the address of `$name`, `1017:00` or `$tpdo.comm:01`."""
    match = NAME.fullmatch(target)
    if match is not None and not match[3]:
        return names.address(match[1] or match[2])
    match = _ADDRESS.fullmatch(_resolve(target, names))
    if match is None:
        raise ValueError(f"{target!r} is no object like 1017:00 or $rw_u8")
    return int(match[1], 16), int(match[2], 16)


# Information in the arguments of macros: the objects that they write, and their duration.

_DOWNLOADS: Final = frozenset({"segdn", "blkdn"})
MAP: Final = "map"
_ENABLE: Final = "enable"
_REFUSE_SEGMENTS: Final = "refusesegments"
_FOLLOW: Final = "follow"
_PARAMETERS: Final = {_ENABLE: (1,), MAP: (1, 2)}
"""Sub-indices of the communication parameter that a macro writes, by its first words."""
TO_MAPPING: Final = 0x200
"""Distance of a mapping parameter from its communication parameter."""

_PER_BYTE_US: Final = 2_500
"""The longest time per byte of a transfer: two frames for seven bytes, at 30 % of 125 kbit/s."""
_TRANSFER_MS: Final = 5_000


def written_by(name: str, *words: Any) -> tuple[Address, ...]:
    """Return the objects that a bound macro writes.

    >>> written_by("segdn", (0x2008, 0), "1000"), written_by("segup", (0x2008, 0), "1000")
    (((8200, 0),), ())
    """
    if name in _DOWNLOADS or name in {_FOLLOW, _REFUSE_SEGMENTS}:
        return (words[0],)
    if name in _PARAMETERS:
        (index, _), subs = words[0], _PARAMETERS[name]
        entries = range(len(words) - len(subs))
        return (*((index, sub) for sub in subs), *((index + TO_MAPPING, sub) for sub in entries))
    return ()


def _transfer(words: Sequence[Any]) -> int:
    """Return the duration of a transfer of the test pattern. The second word is the size."""
    return _TRANSFER_MS + int(words[1]) * _PER_BYTE_US // 1_000


_LONGEST_MS: Final[dict[str, Callable[[Sequence[Any]], int]]] = {
    "sync": lambda words: 20 * int(words[1]),
    "syncperiod": lambda words: 1_000 + 100 * int(words[2]),
    "segdn": _transfer,
    "segup": _transfer,
    "blkdn": _transfer,
    "blkup": _transfer,
    "upload": lambda words: _TRANSFER_MS,
    "room": lambda words: _TRANSFER_MS,
    "blockup": lambda words: 2 * _TRANSFER_MS,
    "fastscan": lambda words: 10_000,
    "lssstore": lambda words: 1_000,
    "guard": lambda words: 1_500 * len(words),
    MAP: lambda words: _TRANSFER_MS,
    _ENABLE: lambda words: _TRANSFER_MS,
    _REFUSE_SEGMENTS: lambda words: _TRANSFER_MS,
    _FOLLOW: lambda words: _TRANSFER_MS + 4 * int(words[4]),
}


_FINALLY: Final = "finally "
"""Prefix of a step that is always done at the end. Such a step cannot fail the check."""

_GIVEN: Final = "given "
"""Prefix of a preparing step. If the node does not do the step, the check is inconclusive."""


def parse_step(line: str) -> Step:
    """Parse a line.

    Raises:
        ValueError: the line is not in the notation.
    """
    if line.startswith(_FINALLY):
        return parse_step(line.removeprefix(_FINALLY))._replace(at_end=True)
    if line.startswith(_GIVEN):
        return parse_step(line.removeprefix(_GIVEN))._replace(given=True)
    for pattern, make in _NOTATIONS:
        match = pattern.fullmatch(line)
        if match is not None:
            return Step(make(*match.groups()))
    raise ValueError(f"{line!r} is not a step; docs/reference/canopen/conform.md has the notation")


def _expect(patterns: str, within_ms: str | None) -> Expect:
    return Expect(tuple(patterns.split(" or ")), int(within_ms or ANSWER_MS))


def _act(words: str, within_ms: str | None) -> Act:
    return Act(tuple(words.split()), int(within_ms) if within_ms else None)


_POWER_CYCLE: Final = Act(("power-cycle",))

_LINES: Final[tuple[tuple[str, Callable[..., Action]], ...]] = (
    (r"> (\S+)( \(29-bit\))?", lambda frame, extended: Send(frame, bool(extended))),
    (r"< (.+?)(?: within (\d+) ms)?", _expect),
    (r"none on (\S+) for (\d+) ms", lambda can_id, ms: ExpectNone(can_id, int(ms))),
    (r"wait (\d+) ms", lambda ms: Wait(int(ms))),
    (r"forget (\S+)", Forget),
    (
        r"(\d+)\.\.(\d+) x (\S+) in (\d+) ms",
        lambda least, most, pattern, ms: Count(pattern, int(ms), int(least), int(most)),
    ),
    (
        r"(\d+) x (\S+) each (\d+) ms",
        lambda times, pattern, ms: Period(pattern, int(ms), int(times)),
    ),
    (r"power cycle", lambda: _POWER_CYCLE),
    (r"app: (.+?)(?: within (\d+) ms)?", _act),
    (r"macro (\w+)((?: \S+)*)", lambda name, words: Macro(name, tuple(words.split()))),
    (r"write (\S+) (\S+)", Write),
    (r"read (\S+) not (\S+)", ReadOther),
    (r"read (\S+) (\S+)", Read),
    (
        r"refuse write (\S+) (\S+) (.+)",
        lambda at, data, codes: RefuseWrite(at, data, tuple(codes.split())),
    ),
    (r"refuse read (\S+) (.+)", lambda at, codes: RefuseRead(at, tuple(codes.split()))),
    (r"keep (\S+)", Keep),
)
_NOTATIONS: Final = tuple((re.compile(pattern), make) for pattern, make in _LINES)


_GROWN: Final = {0: "again", 1: "a byte longer", -1: "a byte shorter"}
_LONGEST: Final = 60


def step_words(step: Step) -> str:
    """Return a step as text, with names or with the numbers of a node."""
    return _FINALLY * step.at_end + _GIVEN * step.given + _words(step.action)


def step_head(step: Step) -> str:
    """Return the beginning of the error message for a failed step: a description of the step.

    The description does not contain the expected abort codes. For a step that only sends, expects
    or drops frames, or that only waits, the result is an empty text.
    """
    match step.action:
        case Send() | Expect() | ExpectNone() | Count() | Period() | Wait() | Forget():
            return ""
        case RefuseWrite() | RefuseRead() as action:
            step = step._replace(action=replace(action, codes=()))
    words = step_words(step)
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}..."


def _words(action: Action) -> str:  # noqa: PLR0911, PLR0912 - one line an action
    match action:
        case Send(frame, extended):
            return f"> {frame}" + (" (29-bit)" if extended else "")
        case Expect(patterns, ms):
            return f"< {' or '.join(patterns)}" + (f" within {ms} ms" if ms != ANSWER_MS else "")
        case ExpectNone(can_id, ms):
            return f"none on {can_id} for {ms} ms"
        case Count(pattern, ms, least, most):
            return f"{least}..{most} x {pattern} in {ms} ms"
        case Period(pattern, ms, times):
            return f"{times} x {pattern} each {ms} ms"
        case Wait(ms):
            return f"wait {ms} ms"
        case Forget(can_id):
            return f"forget {can_id}"
        case Act() if action == _POWER_CYCLE:
            return "power cycle"
        case Act(words, within_ms):
            within = f" within {within_ms} ms" if within_ms is not None else ""
            return f"app: {' '.join(words)}{within}"
        case Macro(name, words):
            return " ".join(["macro", name, *map(_word, words)])
        case Write(at, data):
            return f"write {_word(at)} {data}"
        case RefuseWrite(at, data, codes):
            return " ".join(["refuse write", _word(at), data, *codes])
        case Read(at, data):
            return f"read {_word(at)} {data}"
        case ReadOther(at, data):
            return f"read {_word(at)} not {data}"
        case RefuseRead(at, codes):
            return " ".join(["refuse read", _word(at), *codes])
        case Keep(at):
            return f"keep {_word(at)}"
        case Hold(at):
            return f"read {_word(at)}"
        case RefuseRewrite(at, grow):
            return f"write {_word(at)} {_GROWN[grow]}"
        case _:
            assert_never(action)


def _word(word: object) -> str:
    return f"{word[0]:04X}:{word[1]:02X}" if isinstance(word, tuple) else str(word)


_MARGIN_US: Final = 2_000_000
"""Time in addition to the sum of all waits, for sending at a low bus load."""

_STIMULUS_MS: Final = 60_000
"""Longest time that the operation of an input may take. A person is slow."""

_LONGEST_TRANSFER_MS: Final = 2_000
"""Longest time that the transfer of a few bytes may take."""

_BLOCK_ENDS: Final = 1
"""Bit that later requests of a block download have."""
_BEGIN_DOWNLOAD: Final = frozenset(
    command
    for command in range(0x100)
    if command & SPECIFIER == ClientCommand.DOWNLOAD
    or (command & SPECIFIER == ClientCommand.BLOCK_DOWNLOAD and not command & _BLOCK_ENDS)
)
_RESETS: Final = ("000#81", "000#82")
NMT: Final = "000"
_LSS: Final = "7E5"
_STORAGE: Final = (0x1010, 0x1011)

NMT_TO_ALL: Final = "send NMT commands to all nodes of the bus"
LSS_TO_ALL: Final = "send LSS requests, which every node of the bus takes"
SYNC_TO_ALL: Final = "send SYNC, which every node of the bus takes"
_STORED: Final = "store parameters in the node, in place of those stored before"
"""Texts of questions to the user."""


@dataclass(frozen=True, slots=True)
class BoundCheck:
    """A check in which names are replaced by objects and values of the node, ready to be executed.

    Attributes:
        check: check with its names, as in the file.
        steps: steps with numbers. An object is given by its index and sub-index.
        changed: objects that the steps change, so that they are restored.
        used: objects that the node must have. Otherwise the check is not applicable.
        written: objects that the steps write, including writes that the node may or must refuse.
        questions: questions to which the user must answer yes before the check.
        can_ids: CAN-IDs of the frames that the check judges.
        within_us: time limit of the check in microseconds.
        resets: kinds of resets among the steps, which change all values of the node. A kind is an
            NMT frame without the node-ID, or the first word of a stimulus.
    """

    check: Check
    steps: tuple[Step, ...]
    changed: frozenset[Address]
    used: frozenset[Address]
    written: frozenset[Address]
    questions: frozenset[str]
    can_ids: frozenset[str]
    within_us: int
    resets: tuple[str, ...]


def bind_check(check: Check, names: _Names) -> BoundCheck:
    """Replace the names in a check by objects and values of the node.

    Raises:
        Unbound: the node has no object or value for a name.
    """
    steps = tuple(_bind_step(step, names) for step in check.steps)
    actions = [step.action for step in steps]
    request, sync = _resolve("$request", names), _resolve("$sync", names)
    changed = frozenset(address for action in actions for address in _changed(action, request))
    refused = {
        action.address for action in actions if isinstance(action, RefuseWrite | RefuseRewrite)
    }
    return BoundCheck(
        check,
        steps,
        changed,
        frozenset(address for action in actions for address in _used(action)),
        changed | refused,
        frozenset(question for action in actions for question in _questions(action, sync)),
        frozenset(text.partition("#")[0] for action in actions for text in _watched(action)),
        _MARGIN_US + 1_000 * sum(map(_longest_ms, actions)),
        tuple(reset for action in actions for reset in _resets(action)),
    )


def _bind_step(step: Step, names: _Names) -> Step:
    action = step.action
    if isinstance(action, OfObject) and isinstance(action.at, tuple):
        return step  # made from an object: all its arguments are numbers
    bind = _bind_word if isinstance(action, Macro) else _bind_value
    values = [
        _resolve_address(getattr(action, name), names)
        if name == "at"
        else bind(getattr(action, name), names)
        for name in action.__match_args__
    ]
    make: Callable[..., Action] = type(action)
    return step._replace(action=make(*values))


def _bind_value(value: Any, names: _Names) -> Any:
    if isinstance(value, str):
        return _resolve(value, names)
    if isinstance(value, tuple):
        return tuple(_resolve(word, names) for word in value)
    return value


def _bind_word(word: Any, names: _Names) -> Any:
    """Bind a word of a macro. An address, or a name without attribute, is an object."""
    if isinstance(word, tuple):
        return tuple(_bind_word(each, names) for each in word)
    if _ADDRESS.fullmatch(word):
        return _resolve_address(word, names)
    match = NAME.fullmatch(word)
    if match is None or match[3]:
        return _resolve(word, names)
    try:
        return names.address(match[1] or match[2])
    except Unbound:
        return _resolve(word, names)


def _longest_ms(action: Action) -> int:
    """Return the longest duration of a step."""
    match action:
        case Expect(_, ms) | ExpectNone(_, ms) | Count(_, ms) | Wait(ms):
            return ms
        case Period(_, ms, times):
            return ms * (times + 2)
        case Macro(name, words):
            return _LONGEST_MS[name](words)
        case Act():
            return _STIMULUS_MS
        case Send() | Forget() | Keep():
            return 0
        case _:
            return _LONGEST_TRANSFER_MS


def _resets(action: Action) -> Iterator[str]:
    if isinstance(action, Act):
        yield action.words[0]
    elif isinstance(action, Send) and action.frame[:6] in _RESETS:
        yield action.frame[:6]


def _changed(action: Action, request: str) -> Iterator[Address]:
    match action:
        case Write() | Keep():
            yield action.address
        case Macro(name, words):
            yield from written_by(name, *words)
        case Send(frame):
            can_id, _, data = frame.partition("#")
            if can_id == request and len(data) >= 8 and begins_download(int(data[:2], 16)):
                yield int(data[4:6] + data[2:4], 16), int(data[6:8], 16)


def _used(action: Action) -> Iterator[Address]:
    match action:
        case Write() | Read() | ReadOther():
            yield action.address
        case Macro(name, words):
            yield from (word for word in words if isinstance(word, tuple) and word[1])
            yield from written_by(name, *words)


def begins_download(command: int) -> bool:
    """Return whether a request starts to write the object that it names."""
    return command in _BEGIN_DOWNLOAD


def _questions(action: Action, sync: str) -> Iterator[str]:
    """Yield the actions that concern other nodes or cannot be undone."""
    match action:
        case Send(frame):
            can_id, _, data = frame.partition("#")
            if can_id == NMT and data[2:4] == "00":
                yield NMT_TO_ALL
            if can_id == _LSS:
                yield LSS_TO_ALL
            if can_id == sync:
                yield SYNC_TO_ALL
        case Macro("fastscan" | "lssstore"):
            yield LSS_TO_ALL
        case Macro("sync" | "syncperiod"):
            yield SYNC_TO_ALL
        case Write() if action.address[0] in _STORAGE:
            yield _STORED


def _watched(action: Action) -> Iterable[str]:
    match action:
        case Expect(patterns):
            return patterns
        case Count(text) | Period(text) | ExpectNone(text) | Forget(text):
            return (text,)
        case _:
            return ()
