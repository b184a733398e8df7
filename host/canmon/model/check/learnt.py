r"""Rules that are learnt from a good log, written as TOML, and compared with another log.

>>> rules = parse_learnt('[learnt.can0.frame.185]\nlengths = [6]\nperiod = "10ms±20%"\n')
>>> rules["can0"].frames[0x185].period
(10000, 2000)
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, pairwise
from typing import Any, Final, NamedTuple

from tickrig.host.canmon.model.check.bus_frames import BusFrames, Hit
from tickrig.host.canmon.model.check.node_events import BusEvents
from tickrig.host.canmon.model.frames import ident_text, ms_text, node_of, parse_ident
from tickrig.host.text.names import closest
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.text.values import parse_time_with_unit_us

RULES: Final = {
    "learnt-nodes": "a node that is missing, or that is new",
    "learnt-identity": "a node with another identity",
    "learnt-frames": "a CAN-ID that is missing, or that is new",
    "learnt-length": "a length that was not seen before",
    "learnt-period": "another period, or none",
    "learnt-jitter": "a larger jitter",
    "learnt-load": "more bits a second than before",
    "learnt-order": "another order of boot-ups",
}
"""Descriptions of the rules in addition to the rules without parameters."""

IDENTITY: Final = ("vendor", "product", "revision", "serial")
"""Sub-indices 1 to 4 of 1018h."""

CYCLIC, ON_SYNC, _EVENT = "cyclic", "sync", "event"
_KINDS: Final = (CYCLIC, ON_SYNC, _EVENT)
_MORE_LOAD: Final = 1.25
_MORE_BITS: Final = 5_000
_TOLERANCE: Final = 20
_JITTERS: Final = 4
_LEAST_JITTER_US: Final = 500
_PERIOD: Final = re.compile(r"([^±+]+)(?:±|\+-)([0-9]{1,3})%")
_MOST_USUAL: Final = 50
_HEARTBEAT: Final = 0x700
KEPT_FRAMES: Final = 1_000
"""Number of frames that are kept of a finding."""


class FrameSummary(NamedTuple):
    """Summary of the frames of one CAN-ID in a log, from which rules are learnt.

    Rows are indices in `BusFrames`.

    Attributes:
        ident: CAN-ID with flags.
        name: displayed name of the CAN-ID.
        rows: rows of all frames of the CAN-ID.
        pieces: parts of the rows between two changes of the rhythm, without parts that are too
            short to find a rhythm.
        lengths: all numbers of data bytes that occur.
        kind: kind of the frames, which is cyclic, sync or event.
        period_us: period in microseconds, or None if the frames are not periodic.
        jitter_us: jitter in microseconds, as interquartile range of the times between two frames.
        few: whether the frames are too few to find a rhythm.
        irregular: whether the frames are not periodic.
        service: whether the frames are NMT, EMCY, SDO or error control frames.
    """

    ident: int
    name: str
    rows: Sequence[int]
    pieces: Sequence[Sequence[int]]
    lengths: tuple[int, ...]
    kind: str = _EVENT
    period_us: int | None = None
    jitter_us: int = 0
    few: bool = False
    irregular: bool = False
    service: bool = False


class NodeSummary(NamedTuple):
    """Summary of the traffic of one node in a log, from which rules are learnt.

    Attributes:
        row: index in `BusFrames` of the first frame of the node.
        identity: vendor-ID, product code, revision and serial number (1018h) from SDO traffic. A
            value is None if it is unknown.
        emcy: error codes of the node's EMCY messages, such as 8130h.
        answers: indices in `BusFrames` of the SDO answers with the identity, by sub-index of 1018h.
    """

    row: int
    identity: tuple[int | None, ...]
    emcy: tuple[str, ...]
    answers: Mapping[int, int]


@dataclass(frozen=True, slots=True)
class BusSummary:
    """Summary of the traffic on one bus. Rules are learnt from it, or it is compared with them.

    Rows are indices in `BusFrames`.

    Attributes:
        name: name of the bus.
        frames: summary of the frames of each CAN-ID, by CAN-ID with flags.
        nodes: summary of each node, by node-ID.
        boot_order: node-IDs in the order in which the nodes first booted. Nodes that booted within
            100 ms form one group.
        boots: row of the first boot-up of each node, by node-ID.
        bits_per_second: bus load in the busiest half second, in bits per second.
        busy: rows of the first and last frame of a half second with more bits than learnt, or
            otherwise of the busiest half second.
        found: texts of the faults that the rules without parameters found.
    """

    name: str
    frames: Mapping[int, FrameSummary]
    nodes: Mapping[int, NodeSummary]
    boot_order: Sequence[Sequence[int]] = ()
    boots: Mapping[int, int] = field(default_factory=dict)
    bits_per_second: int = 0
    busy: tuple[int, ...] = ()
    found: tuple[str, ...] = ()


class _LearntFrame(NamedTuple):
    """Requirements for the frames of an identifier.

    Attributes:
        lengths: allowed numbers of data bytes, empty for any number.
        kind: kind of the frames, which is cyclic, sync or event.
        period: period and tolerance of the period in us, or None for any period.
        jitter_us: interquartile range of the gaps, or None for any.
        required: whether the frames must be present.
    """

    lengths: tuple[int, ...] = ()
    kind: str = _EVENT
    period: tuple[int, int] | None = None
    jitter_us: int | None = None
    required: bool = False


class _LearntNode(NamedTuple):
    """Requirements for a node.

    Attributes:
        identity: values of 1018h, or None for any.
        emcy: error codes that are usual for the node.
    """

    identity: tuple[int | None, ...] = (None,) * len(IDENTITY)
    emcy: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LearntBus:
    """Rules for one bus that were learnt from a good log, to be compared with a `BusSummary`.

    Attributes:
        frames: requirements for the frames of each CAN-ID. Each key is a CAN-ID with the flag bits
            that `ident_of` adds.
        nodes: requirements for each node, by node-ID.
        boot_order: groups of node-IDs, in the required order of boot-ups. The nodes of one group
            may boot in any order.
        bits_per_second: largest allowed bus load in bits per second, or None for no limit.
        usual: texts of the faults that occurred in the good log. Faults with these texts are not
            reported.
        others: whether CAN-IDs that are not in `frames` are allowed.
    """

    frames: Mapping[int, _LearntFrame]
    nodes: Mapping[int, _LearntNode]
    boot_order: tuple[tuple[int, ...], ...] = ()
    bits_per_second: int | None = None
    usual: frozenset[str] = frozenset()
    others: bool = False

    def is_usual(self, hit: Hit) -> bool:
        """Return whether a finding is usual."""
        if hit.rule == "no-emcy" and hit.node is not None:
            codes = self.nodes.get(hit.node, _LearntNode()).emcy
            if any(hit.text.startswith(f"EMCY {code} ") for code in codes):
                return True
        return usual_text(hit) in self.usual


Learnt = Mapping[str, LearntBus]
"""Requirements for buses, by name of the bus."""


def usual_text(hit: Hit) -> str:
    """Return a finding as text, as a rule file lists usual findings."""
    where = f"node {hit.node}: " if hit.node is not None else ""
    return f"{hit.rule}: {where}{hit.text.partition(BusEvents.SILENT)[0]}"


def bus_of(learnt: Learnt, name: str, buses: int) -> LearntBus | None:
    """Return the learnt rules for one bus, or None if there are none.

    If the rules and the traffic both have only one bus, the rules apply even if the names differ.

    Args:
        learnt: learnt rules by name of the bus.
        name: name of the bus in the traffic.
        buses: number of buses in the traffic.
    """
    if len(learnt) == buses == 1:
        return next(iter(learnt.values()))
    return learnt.get(name)


# Writing


def learnt_text(summaries: Iterable[BusSummary], head: Sequence[str]) -> str:
    """Return the text of a TOML file with the rules that are learnt from a good log.

    Args:
        summaries: summaries of the traffic in the good log, one for each bus.
        head: lines of text for a comment at the beginning of the file.
    """
    lines = [f"# {one}" for one in head]
    for bus in summaries:
        lines += ["", *_bus_lines(bus)]
    return "\n".join(lines) + "\n"


def _bus_lines(bus: BusSummary) -> Iterator[str]:
    table = f"learnt.{_key(bus.name)}"
    yield f"[{table}]"
    if bus.bits_per_second:
        most = int(bus.bits_per_second * _MORE_LOAD) + _MORE_BITS
        yield f"bits_per_second = {most} # at most; the log had {bus.bits_per_second}"
    if len(bus.boot_order) > 0:
        groups = ", ".join(str(list(group)) for group in bus.boot_order)
        yield f"boot_order = [{groups}] # within 100 ms: together, in any order"
    if bus.found:
        yield "# Findings of the good log; delete those that are not usual."
        yield "usual = ["
        yield from (f"  {json.dumps(text)}," for text in bus.found[:_MOST_USUAL])
        yield "]"
    for node, one in sorted(bus.nodes.items()):
        yield ""
        yield f"[{table}.node.{node}]"
        for name, value in zip(IDENTITY, one.identity, strict=True):
            if value is not None:
                yield f"{name} = 0x{value:08X}"
        if one.emcy:
            yield f"emcy = {json.dumps(one.emcy)} # usual"
    for ident, frame in sorted(bus.frames.items()):
        yield ""
        yield f"[{table}.frame.{_key(ident_text(ident))}] # {frame.name}"
        yield f"lengths = {list(frame.lengths)}"
        yield f'kind = "{frame.kind}"'
        if frame.period_us is not None:
            yield f'period = "{_time(frame.period_us)}±{_TOLERANCE}%"'
            yield f'jitter = "{_time(frame.jitter_us)}"'
            yield "required = true"


def scanned_text(
    bus: str, nodes: Mapping[int, tuple[Sequence[int | None], int | None]], head: Sequence[str]
) -> str:
    """Return the text of a TOML file with rules that are made from a scan of the nodes on a bus.

    The rules are about the identity and the heartbeat of each node. `canmon check` reads the file.

    Args:
        bus: name of the bus.
        nodes: vendor-ID, product code, revision and serial number (1018h:01 to 04) and the producer
            heartbeat time in ms of each node, by node-ID. Unknown values are None.
        head: lines of text for a comment at the beginning of the file.
    """
    table = f"learnt.{_key(bus)}"
    lines = [f"# {one}" for one in head]
    lines += ["", f"[{table}]", "others = true # CAN-IDs that are not listed may come"]
    for node, (identity, heartbeat_ms) in sorted(nodes.items()):
        lines += ["", f"[{table}.node.{node}]"]
        for name, value in zip(IDENTITY, identity, strict=False):
            if value is not None:
                # A spare part has another serial number.
                lines.append(f"{'# ' * (name == IDENTITY[-1])}{name} = 0x{value:08X}")
        if heartbeat_ms:
            lines += ["", f"[{table}.frame.{_HEARTBEAT + node:03X}] # heartbeat of node {node}"]
            lines += ["lengths = [1]", f'kind = "{CYCLIC}"']
            lines += [f'period = "{heartbeat_ms}ms±{_TOLERANCE}%"', "required = true"]
    return "\n".join(lines) + "\n"


def _key(text: str) -> str:
    if re.fullmatch(r"[A-Za-z0-9_-]+", text):
        return text
    return json.dumps(text.encode("utf-8", "replace").decode("utf-8"))


def _time(us: int) -> str:
    return f"{us // 1_000}ms" if us % 1_000 == 0 else f"{us}us"


# Reading


def parse_learnt(text: str) -> Learnt | None:
    """Parse a TOML file with learnt rules, and return the rules by name of the bus.

    The result is None if the file has no table `learnt`, because it then contains other rules.

    Args:
        text: text of the file.

    Raises:
        ValueError: the file has an error. The message names the table or key with the error.
    """
    words = load_toml(text)
    if "learnt" not in words:
        return None
    others = [name for name in words if name != "learnt"]
    if others:
        raise ValueError(f"{others[0]!r} beside [learnt]: give other rules in a check of their own")
    table = _table(words["learnt"], "learnt")
    return {
        name: _bus(_table(one, f"learnt.{name}"), f"learnt.{name}") for name, one in table.items()
    }


def _bus(words: Mapping[str, Any], place: str) -> LearntBus:
    _known(words, ("bits_per_second", "boot_order", "usual", "others", "node", "frame"), place)
    others = _truth(words.get("others", False), f"{place}.others")
    most = words.get("bits_per_second")
    if most is not None:
        most = _whole(most, f"{place}.bits_per_second", 1 << 40)
    nodes = {
        _number(name, 1, 127, f"{place}.node"): _node(one, f"{place}.node.{name}")
        for name, one in _table(words.get("node", {}), f"{place}.node").items()
    }
    frames = {}
    for name, one in _table(words.get("frame", {}), f"{place}.frame").items():
        try:
            ident = parse_ident(name)
        except ValueError as error:
            raise ValueError(f"{place}.frame: {error}") from None
        frames[ident] = _frame(one, f"{place}.frame.{name}")
    order = tuple(
        tuple(
            _whole(node, f"{place}.boot_order", 127) for node in _list(group, f"{place}.boot_order")
        )
        for group in _list(words.get("boot_order", []), f"{place}.boot_order")
    )
    usual = frozenset(_texts(words.get("usual", []), f"{place}.usual"))
    return LearntBus(frames, nodes, order, most, usual, others)


def _node(value: object, place: str) -> _LearntNode:
    words = _table(value, place)
    _known(words, (*IDENTITY, "emcy"), place)
    identity = tuple(
        _whole(words[name], f"{place}.{name}", 1 << 32) if name in words else None
        for name in IDENTITY
    )
    return _LearntNode(identity, _texts(words.get("emcy", []), f"{place}.emcy"))


def _frame(value: object, place: str) -> _LearntFrame:
    words = _table(value, place)
    _known(words, ("lengths", "kind", "period", "jitter", "required"), place)
    lengths = tuple(
        _whole(one, f"{place}.lengths", 64)
        for one in _list(words.get("lengths", []), f"{place}.lengths")
    )
    kind, required = words.get("kind", _EVENT), words.get("required", False)
    required = _truth(required, f"{place}.required")
    if kind not in _KINDS:
        raise ValueError(f"{place}.kind = {kind!r} is not one of {', '.join(_KINDS)}")
    period = _period(words["period"], f"{place}.period") if "period" in words else None
    jitter = _us(words["jitter"], f"{place}.jitter") if "jitter" in words else None
    return _LearntFrame(lengths, kind, period, jitter, required)


def _truth(value: object, place: str) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{place} = {value!r} is not true or false")
    return value


def _period(value: object, place: str) -> tuple[int, int]:
    match = _PERIOD.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise ValueError(f"{place} = {value!r} is not like 10ms±20%")
    period_us = _us(match[1], place)
    return period_us, period_us * int(match[2]) // 100


def _us(value: object, place: str) -> int:
    if not isinstance(value, str):
        raise ValueError(f"{place} = {value!r} is not a time, as 10ms")
    try:
        return parse_time_with_unit_us(value.strip())
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _known(words: Mapping[str, Any], known: Sequence[str], place: str) -> None:
    for name in words:
        if name not in known:
            meant = "".join(f"; did you mean {word!r}?" for word in closest(name, known))
            raise ValueError(f"{place}: {name!r} is not one of {', '.join(known)}{meant}")


def _table(value: object, place: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{place} is not a table")
    return value


def _list(value: object, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"{place} = {value!r} is not a list")
    return value


def _texts(value: object, place: str) -> tuple[str, ...]:
    texts = _list(value, place)
    for one in texts:
        if not isinstance(one, str):
            raise ValueError(f"{place}: {one!r} is not a text")
    return tuple(texts)


def _whole(value: object, place: str, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise ValueError(f"{place}: {value!r} is not a whole number from 0 to {most}")
    return value


def _number(text: str, low: int, high: int, place: str) -> int:
    if not re.fullmatch(r"[0-9]{1,3}", text, re.ASCII) or not low <= int(text) <= high:
        raise ValueError(f"{place}: {text!r} is not a node-ID from {low} to {high}")
    return int(text)


# Holding


def broken(
    learnt: LearntBus, bus: BusSummary, frames: BusFrames, times: Sequence[int]
) -> Iterator[Hit]:
    """Yield the violations of the learnt rules on one bus.

    Args:
        learnt: learnt rules for the bus.
        bus: summary of the traffic to judge.
        frames: all frames of the bus. The violation for a missing node or CAN-ID refers to the last
            of these frames.
        times: corrected times of these frames in microseconds.
    """
    last_row = len(frames) - 1
    for node in sorted(learnt.nodes.keys() - bus.nodes.keys()):
        yield Hit("learnt-nodes", node, None, "is missing", (last_row,))
    for node, one in sorted(bus.nodes.items()):
        if node not in learnt.nodes:
            yield Hit("learnt-nodes", node, None, "is new", (one.row,))
            continue
        identity = zip(IDENTITY, learnt.nodes[node].identity, one.identity, strict=True)
        for sub, (name, right, value) in enumerate(identity, 1):
            if right is not None and value is not None and value != right:
                text = f"its {name} is {value:08X}h, {right:08X}h is right"
                yield Hit("learnt-identity", node, None, text, (one.answers.get(sub, one.row),))
    for ident, wanted in sorted(learnt.frames.items()):
        if wanted.required and ident not in bus.frames:
            text = f"{ident_text(ident)} is missing"
            yield Hit("learnt-frames", node_of(ident), ident, text, (last_row,))
    for ident, frame in sorted(bus.frames.items()):
        expected = learnt.others or (frame.service and node_of(ident) in learnt.nodes)
        if ident not in learnt.frames and expected:
            continue  # an EMCY, or SDO: rules of their own
        if ident not in learnt.frames:
            text = f"{ident_text(ident)} is new"
            yield Hit("learnt-frames", node_of(ident), ident, text, (int(frame.rows[0]),))
        else:
            yield from _frame_broken(learnt.frames[ident], frame, frames, times)
    most = learnt.bits_per_second
    if most is not None and bus.bits_per_second > most:
        text = f"{bus.bits_per_second} bits a second, at most {most} is right"
        yield Hit("learnt-load", None, None, text, bus.busy)
    yield from _order_broken(learnt.boot_order, bus.boots)


def _frame_broken(
    right: _LearntFrame, frame: FrameSummary, frames: BusFrames, times: Sequence[int]
) -> Iterator[Hit]:
    ident = frame.ident
    node, name = node_of(ident), frame.name
    odd = [one for one in frame.lengths if right.lengths and one not in right.lengths]
    if odd:
        wanted = " or ".join(map(str, right.lengths))
        text = f"{name} has {' or '.join(map(str, odd))} B, {wanted} is right"
        wrong = (int(row) for row in frame.rows if frames.dlc[row] in odd)
        yield Hit("learnt-length", node, ident, text, tuple(islice(wrong, KEPT_FRAMES)))
    if right.period is None or frame.few:
        return
    period, off = right.period
    if frame.period_us is None and not frame.irregular:
        return
    if frame.period_us is None:
        text = f"{name} has no period, {ms_text(period)} ms is right"
        rows = _odd_rows(frame.pieces, times, period, off)
        yield Hit("learnt-period", node, ident, text, rows)
    elif abs(frame.period_us - period) > off:
        text = f"{name} has a period of {ms_text(frame.period_us)} ms, {ms_text(period)} is right"
        rows = _odd_rows(frame.pieces, times, period, off)
        yield Hit("learnt-period", node, ident, text, rows)
    elif right.jitter_us is not None and frame.jitter_us > max(
        _JITTERS * right.jitter_us, _LEAST_JITTER_US, period // 10
    ):
        text = f"{name} has a jitter of {ms_text(frame.jitter_us)} ms,"
        text += f" {ms_text(right.jitter_us)} is right"
        rows = _odd_rows(frame.pieces, times, frame.period_us, frame.jitter_us // 2)
        yield Hit("learnt-jitter", node, ident, text, rows)


def _odd_rows(
    pieces: Sequence[Sequence[int]], times: Sequence[int], period: int, off: int
) -> tuple[int, ...]:
    """Return the rows after gaps that a period does not allow, if there are at least two such rows.

    A single such gap at the beginning is caused by a late or lost frame, and is not the start of
    another period.
    """
    ends = (pair for piece in pieces for pair in pairwise(piece))
    gaps = [(abs(times[row] - times[before] - period) > off, int(row)) for before, row in ends]
    begin = next((at for at, (a, b) in enumerate(pairwise(gaps)) if a[0] and b[0]), 0)
    odd = (row for is_odd, row in gaps[begin:] if is_odd)
    return tuple(islice(odd, KEPT_FRAMES)) or (gaps[-1][1],)


def _order_broken(order: Sequence[Sequence[int]], boots: Mapping[int, int]) -> Iterator[Hit]:
    """Compare the order of boot-ups, if all nodes boot."""
    if not order or not all(node in boots for group in order for node in group):
        return
    latest, row = -1, -1
    for group in order:
        first = min(group, key=lambda node: boots[node], default=None)
        if first is not None and boots[first] < row:
            text = f"boots before node {latest}"
            yield Hit("learnt-order", first, None, text, (boots[first], row))
            return
        latest = max(group, key=lambda node: boots[node], default=latest)
        row = max([row, *(boots[node] for node in group)])
