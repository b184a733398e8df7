"""A check with the numbers of one node in place of names.

Steps of a check, one a line, in the notation of docs/reference/canopen/conform.md.

>>> parse_step("3..5 x $heartbeat#05 in 400 ms")
{'count': '$heartbeat#05', 'for': 400, 'min': 3, 'max': 5}
>>> parse_step("refuse write $ro_u8 00 06010002 06010000")
{'refuse write': '$ro_u8', 'data': '00', 'codes': ['06010002', '06010000']}

Steps written as they are read, for people: what `step_text` reads, and steps of objects.

>>> step_words({"refuse write": (0x1000, 0), "data": "00", "codes": ["06010002"]})
'refuse write 1000:00 00 06010002'
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from tickrig.host.canopen.conform.check import Check, Step
from tickrig.wire.canopen.sdo_frame import SPECIFIER, ClientCommand

# Names in place of numbers: what stands for `$heartbeat` or `$rw_u8.new` on this node.

NAME: Final = re.compile(r"\$(?:\{([a-z][a-z0-9_]*)\}|([a-z][a-z0-9_]*)(?:\.([a-z]+))?)")
"""`$name`, `$name.attribute`, or `${name}` where a digit follows."""
_ADDRESS: Final = re.compile(r"([0-9A-F]{4}):([0-9A-F]{2})")

Address = tuple[int, int]
"""Index and sub-index."""


class Unbound(Exception):  # noqa: N818 - what the name is
    """A name for which this node has nothing.

    Attributes:
        reason: why, for people.
    """

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"${name}: {reason}")
        self.reason = reason


class Names(Protocol):
    """What stands for the names in checks on one node."""

    def text(self, name: str, attribute: str, /) -> str:
        """Return what stands for `$name.attribute`; the attribute may be empty.

        Of an object: its multiplexer in hex as an SDO carries it; `new` and `other`, two allowed
        values, `old`, the one before the run, `map`, its mapping entry; all in hex as they go
        over the bus.

        Raises:
            Unbound: the node has nothing of the kind.
        """
        ...

    def address(self, name: str, /) -> Address:
        """Return index and sub-index of an object; Unbound if there is none."""
        ...


def _resolve(text: str, names: Names) -> str:
    """Replace all names in a text; Unbound if one has nothing."""
    if "$" not in text:
        return text
    return NAME.sub(lambda match: names.text(match[1] or match[2], match[3] or ""), text)


def resolve_address(target: str, names: Names) -> Address:
    """Return the address of `$name`, `1017:00` or `$tpdo.comm:01`."""
    match = NAME.fullmatch(target)
    if match is not None and not match[3]:
        return names.address(match[1] or match[2])
    match = _ADDRESS.fullmatch(_resolve(target, names))
    if match is None:
        raise ValueError(f"{target!r} is no object like 1017:00 or $rw_u8")
    return int(match[1], 16), int(match[2], 16)


# What the words of macros say before they are played: what is written, and how long it lasts.

_DOWNLOADS: Final = frozenset({"segdn", "blkdn"})
MAP: Final = "map"
_ENABLE: Final = "enable"
_REFUSE_SEGMENTS: Final = "refusesegments"
_FOLLOW: Final = "follow"
TO_MAPPING: Final = 0x200
"""A mapping parameter is so far behind its communication parameter."""

_PER_BYTE_US: Final = 2_500
"""What a byte of a transfer takes at most: two frames for seven, at 30 % of 125 kbit/s."""
_TRANSFER_MS: Final = 5_000


def written_by(name: str, *words: Any) -> tuple[Address, ...]:
    """Return what a bound macro writes.

    >>> written_by("segdn", (0x2008, 0), "1000"), written_by("segup", (0x2008, 0), "1000")
    (((8200, 0),), ())
    """
    if name in _DOWNLOADS or name in {_FOLLOW, _REFUSE_SEGMENTS}:
        return (words[0],)
    if name == _ENABLE:
        communication = words[0][0]
        entries = ((communication + TO_MAPPING, sub) for sub in range(len(words) - 1))
        return ((communication, 1), *entries)
    if name == MAP:
        communication = words[0][0]
        entries = ((communication + TO_MAPPING, sub) for sub in range(len(words) - 2))
        return ((communication, 1), (communication, 2), *entries)
    return ()


def longest_ms(name: str, words: Sequence[Any]) -> int:
    """Return how long a bound macro lasts at most."""
    return _LONGEST_MS[name](words)


def _transfer(words: Sequence[Any]) -> int:
    """Return how long the pattern takes whose size is the second word."""
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
"""Begins a step that is done at the end, however the check went; it fails no check."""

_GIVEN: Final = "given "
"""Begins a step that prepares: if the node does not do it, the check says nothing of the node."""

ANSWER_MS: Final = 1_000
"""How long is waited for an answer where a check says nothing: CiA 301 gives no time."""


def parse_step(line: str) -> Step:
    """Read a line.

    Raises:
        ValueError: it is none of the notation.
    """
    if line.startswith(_FINALLY):
        return {**parse_step(line.removeprefix(_FINALLY)), "finally": True}
    if line.startswith(_GIVEN):
        return {**parse_step(line.removeprefix(_GIVEN)), "given": True}
    for pattern, make in _NOTATIONS:
        match = pattern.fullmatch(line)
        if match is not None:
            return make(*match.groups())
    raise ValueError(f"{line!r} is no step; docs/reference/canopen/conform.md has the notation")


def _expect(patterns: str, within_ms: str | None) -> Step:
    return {"expect": patterns.split(" or "), "in": int(within_ms or ANSWER_MS)}


def _count(least: str, most: str, pattern: str, for_ms: str) -> Step:
    return {"count": pattern, "for": int(for_ms), "min": int(least), "max": int(most)}


def _period(times: str, pattern: str, period_ms: str) -> Step:
    return {"period": pattern, "each": int(period_ms), "times": int(times)}


def _send(frame: str, extended: str | None) -> Step:
    return {"send": frame, "ext": True} if extended else {"send": frame}


def _act(words: str, within_ms: str | None) -> Step:
    return {"app": words.split()} | ({"in": int(within_ms)} if within_ms else {})


def _refuse_write(target: str, data: str, codes: str) -> Step:
    return {"refuse write": target, "data": data, "codes": codes.split()}


def _refuse_read(target: str, codes: str) -> Step:
    return {"refuse read": target, "codes": codes.split()}


def _macro(name: str, words: str) -> Step:
    return {"macro": [name, *words.split()]}


_LINES: Final[tuple[tuple[str, Callable[..., Step]], ...]] = (
    (r"> (\S+)( \(29-bit\))?", _send),
    (r"< (.+?)(?: within (\d+) ms)?", _expect),
    (r"none on (\S+) for (\d+) ms", lambda can_id, ms: {"none": can_id, "for": int(ms)}),
    (r"wait (\d+) ms", lambda ms: {"wait": int(ms)}),
    (r"forget (\S+)", lambda can_id: {"forget": can_id}),
    (r"(\d+)\.\.(\d+) x (\S+) in (\d+) ms", _count),
    (r"(\d+) x (\S+) each (\d+) ms", _period),
    (r"power cycle", lambda: {"app": ["power-cycle"]}),
    (r"app: (.+?)(?: within (\d+) ms)?", _act),
    (r"macro (\w+)((?: \S+)*)", _macro),
    (r"write (\S+) (\S+)", lambda target, data: {"write": target, "data": data}),
    (r"read (\S+) not (\S+)", lambda target, data: {"read": target, "not": data}),
    (r"read (\S+) (\S+)", lambda target, data: {"read": target, "data": data}),
    (r"refuse write (\S+) (\S+) (.+)", _refuse_write),
    (r"refuse read (\S+) (.+)", _refuse_read),
    (r"keep (\S+)", lambda target: {"keep": target}),
)
_NOTATIONS: Final = tuple((re.compile(pattern), make) for pattern, make in _LINES)


_GROWN: Final = {0: "again", 1: "a byte longer", -1: "a byte shorter"}


def step_words(step: Mapping[str, Any]) -> str:
    """Write a step, with names or with the numbers of a node."""
    head = _FINALLY * ("finally" in step) + _GIVEN * ("given" in step)
    return head + (_of_bus(step) or _of_object(step))


_TEMPLATES: Final = {
    "send": "> {send}",
    "none": "none on {none} for {for} ms",
    "count": "{min}..{max} x {count} in {for} ms",
    "period": "{times} x {period} each {each} ms",
    "wait": "wait {wait} ms",
    "forget": "forget {forget}",
}
_LONGEST: Final = 60
_FRAMES: Final = frozenset({"send", "expect", "none", "count", "period", "wait", "forget"})
"""Steps whose failure tells itself which frames were meant."""


def step_head(step: Mapping[str, Any]) -> str:
    """Write what a step does, without the codes that are wanted; empty if it is of frames."""
    if _FRAMES & step.keys():
        return ""
    words = step_words({key: value for key, value in step.items() if key != "codes"})
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}..."


def _of_bus(step: Mapping[str, Any]) -> str:
    for word, text in _TEMPLATES.items():
        if word in step:
            return text.format_map(step) + (" (29-bit)" if step.get("ext") else "")
    match step:
        case {"expect": patterns, "in": ms}:
            return f"< {' or '.join(patterns)}" + (f" within {ms} ms" if ms != ANSWER_MS else "")
        case {"app": ["power-cycle"]}:
            return "power cycle"
        case {"app": words}:
            return f"app: {' '.join(words)}" + (f" within {step['in']} ms" if "in" in step else "")
        case {"macro": words}:
            return " ".join(["macro", *map(_word, words)])
    return ""


def _of_object(step: Mapping[str, Any]) -> str:
    match step:
        case {"refuse rewrite": at, "grow": grow}:
            return f"write {_word(at)} {_GROWN[grow]}"
        case {"holds": at}:
            return f"read {_word(at)}"
        case {"read": at, "not": data}:
            return f"read {_word(at)} not {data}"
    verb = next(iter(step))
    return " ".join([verb, _word(step[verb]), *_data(step)])


def _data(step: Mapping[str, Any]) -> list[str]:
    return [*([step["data"]] if "data" in step else []), *step.get("codes", ())]


def _word(word: object) -> str:
    return f"{word[0]:04X}:{word[1]:02X}" if isinstance(word, tuple) else str(word)


_TARGETS: Final = frozenset(
    {"write", "read", "refuse write", "refuse read", "keep", "holds", "refuse rewrite"}
)
"""Steps of an object; what their first word names is an address."""
_REFUSED: Final = ("refuse write", "refuse rewrite")

_MARGIN_US: Final = 2_000_000
"""Beyond the sum of all waits: for what is sent, when the load has to be kept low."""

_STIMULUS_MS: Final = 60_000
"""So long may the hand at the inputs take; a person is slow."""

_LONGEST_TRANSFER_MS: Final = 2_000
"""So long may an object of a few bytes take."""

_BLOCK_ENDS: Final = 1
"""Bit of a block download request that does not begin it."""
_RESETS: Final = ("000#81", "000#82")
NMT: Final = "000"
_LSS: Final = "7E5"
_STORAGE: Final = (0x1010, 0x1011)

NMT_TO_ALL: Final = "send NMT commands to all nodes of the bus"
LSS_TO_ALL: Final = "send LSS requests, which every node of the bus takes"
SYNC_TO_ALL: Final = "send SYNC, which every node of the bus takes"
_STORED: Final = "store parameters in the node, in place of those stored before"
"""What a person is asked."""


@dataclass(frozen=True, slots=True)
class BoundCheck:
    """A check on one node.

    Attributes:
        check: as it is written down.
        steps: with numbers; an object is its index and sub-index.
        changed: objects that it writes.
        used: objects that the node has to have.
        written: these, and those that the node must refuse to write, or may.
        questions: what a person is asked before it.
        can_ids: of the frames that it looks at.
        within_us: how long it may last at most.
        resets: it may reset the node, so that all its values change.
    """

    check: Check
    steps: tuple[Mapping[str, Any], ...]
    changed: frozenset[Address]
    used: frozenset[Address]
    written: frozenset[Address]
    questions: frozenset[str]
    can_ids: frozenset[str]
    within_us: int
    resets: bool


def bind_check(check: Check, names: Names) -> BoundCheck:
    """Put numbers in place of names; Unbound if the node has nothing for one."""
    steps = tuple(_bind_step(step, names) for step in check.steps)
    request, sync = _resolve("$request", names), _resolve("$sync", names)
    changed = frozenset(address for step in steps for address in _changed(step, request))
    refused = frozenset(step[key] for step in steps for key in _REFUSED if key in step)
    return BoundCheck(
        check,
        steps,
        changed,
        frozenset(address for step in steps for address in _used(step)),
        changed | refused,
        frozenset(question for step in steps for question in _questions(step, sync)),
        frozenset(text.partition("#")[0] for step in steps for text in _watched(step)),
        _MARGIN_US + 1_000 * sum(map(_longest_ms, steps)),
        any(map(_resets, steps)),
    )


def _bind_step(step: Step, names: Names) -> Mapping[str, Any]:
    return {key: _bind(key, value, names) for key, value in step.items()}


def _bind(key: str, value: object, names: Names) -> object:
    if key in _TARGETS:
        return resolve_address(str(value), names)
    if isinstance(value, str):
        return _resolve(value, names)
    if isinstance(value, list):
        bind = _bind_word if key == "macro" else _resolve
        return [bind(str(word), names) for word in value]
    return value


def _bind_word(word: str, names: Names) -> object:
    """Bind a word of a macro: an address, or a name without attribute, is an object."""
    if _ADDRESS.fullmatch(word):
        return resolve_address(word, names)
    match = NAME.fullmatch(word)
    if match is None or match[3]:
        return _resolve(word, names)
    try:
        return names.address(match[1] or match[2])
    except Unbound:
        return _resolve(word, names)


def _longest_ms(step: Step) -> int:
    """Return how long a step lasts at most."""
    match step:
        case {"expect": _, "in": ms} | {"none": _, "for": ms} | {"count": _, "for": ms}:
            return int(ms)
        case {"wait": ms}:
            return int(ms)
        case {"period": _, "each": ms, "times": times}:
            return int(ms) * (int(times) + 2)
        case {"macro": [name, *words]}:
            return longest_ms(name, words)
        case {"app": _}:
            return _STIMULUS_MS
    return 0 if {"send", "forget", "keep"} & step.keys() else _LONGEST_TRANSFER_MS


def _resets(step: Step) -> bool:
    return "app" in step or str(step.get("send", ""))[:6] in _RESETS


def _changed(step: Mapping[str, Any], request: str) -> Iterator[Address]:
    yield from (step[key] for key in ("write", "keep") if key in step)
    if "macro" in step:
        yield from written_by(*step["macro"])
    can_id, _, data = str(step.get("send", "")).partition("#")
    if can_id == request and len(data) >= 8 and begins_download(int(data[:2], 16)):
        yield int(data[4:6] + data[2:4], 16), int(data[6:8], 16)


def _used(step: Mapping[str, Any]) -> Iterator[Address]:
    yield from (step[key] for key in ("write", "read") if key in step)
    if "macro" in step:
        yield from (word for word in step["macro"] if isinstance(word, tuple) and word[1])
        yield from written_by(*step["macro"])


def begins_download(command: int) -> bool:
    """Return whether a request begins to write the object that it names."""
    specifier = command & SPECIFIER
    begins = specifier == ClientCommand.BLOCK_DOWNLOAD and not command & _BLOCK_ENDS
    return begins or specifier == ClientCommand.DOWNLOAD


def _questions(step: Mapping[str, Any], sync: str) -> Iterator[str]:
    """Yield what concerns other nodes, or cannot be undone."""
    can_id, _, data = str(step.get("send", "")).partition("#")
    macro = step.get("macro", [""])
    if can_id == NMT and data[2:4] == "00":
        yield NMT_TO_ALL
    if can_id == _LSS or macro[0] in ("fastscan", "lssstore"):
        yield LSS_TO_ALL
    if can_id == sync or macro[0] in ("sync", "syncperiod"):
        yield SYNC_TO_ALL
    if step.get("write", (0, 0))[0] in _STORAGE:
        yield _STORED


def _watched(step: Mapping[str, Any]) -> Iterator[str]:
    yield from step.get("expect", ())
    for key in ("none", "count", "period", "forget"):
        if key in step:
            yield step[key]
