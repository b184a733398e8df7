"""The report of a log as one self-contained HTML page, and as PDF and PNG made by Chromium."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

from tickrig.host.canmon.model.check.diagnosis import RULES, BusFault, Diagnosis
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.node_board import (
    FROM_TWO_NODES,
    NodeStatus,
    name_text,
    pdo_contents,
    told_identity,
)
from tickrig.host.canmon.model.decode.node_memory import HEARTBEAT_TIME
from tickrig.host.canmon.model.frames import (
    DATED_US,
    REMOTE,
    Record,
    decoded_text,
    ident_text,
    load_text,
    node_of,
    rate_text,
)
from tickrig.host.canmon.model.survey import Mark, Survey, Thinned
from tickrig.host.canmon.model.traffic import bits_per_second
from tickrig.host.text.page_text import content_policy, duration, harmless, json_text, one_line
from tickrig.host.text.values import counted
from tickrig.wire.canopen import nmt

_Around = Sequence[tuple[Record, Decoded]]

_HERE: Final = Path(__file__).parent
_MOST_POINTS: Final = 60_000
"""Number of points of all curves together. More points would make the page too large for a mail."""
_MOST_IDS: Final = 1_000
_MOST_FAULTS: Final = 1_000
_MOST_PLACES: Final = 100
_NMT_NAMES: Final = ("operational", "pre-operational", "stopped", "initialising")
_SERVICES: Final = {
    0x080: "EMCY",
    0x580: "SDO response",
    0x600: "SDO request",
    0x700: "heartbeat, guarding",
}
_ALONE: Final = {
    0x000: "NMT",
    0x080: "SYNC",
    0x100: "TIME",
    0x7E4: "LSS answer",
    0x7E5: "LSS request",
}


class Verdict(NamedTuple):
    """The diagnosed faults of a recording that a report page shows, with the frames around them.

    Attributes:
        diagnosis: result of the diagnosis.
        around: excerpts of the log. Each key is the number of a frame, and its value is the excerpt
            around this frame. An excerpt consists of the number of its first frame, and of its
            frames.
    """

    diagnosis: Diagnosis
    around: Mapping[int, tuple[int, _Around]]


@dataclass(frozen=True, slots=True)
class ReportHead:
    """Title and general information of a report page.

    Attributes:
        title: title of the page.
        source: description of the source, such as the name of the log.
        about: information at the end of the page. Each item has a text, and a second text that is
            shown as code.
        bit_rate: bit rate of the buses in bit/s, or None if unknown.
    """

    title: str
    source: str
    about: Sequence[tuple[str, str]]
    bit_rate: int | None = None


def report_page(survey: Survey, verdict: Verdict, head: ReportHead) -> str:
    """Return the HTML page. The same arguments always give exactly the same text."""
    style, script = (_HERE.joinpath(f"page.{kind}").read_text("utf-8") for kind in ("css", "js"))
    parts = {
        "policy": escape(content_policy(style, script)),
        "title": escape(one_line(head.title)),
        "summary": escape(" ".join(map(one_line, summary(survey, verdict, head)))),
        "plain": _plain(survey, verdict),
        "style": style,
        "script": script,
        # Nothing in the text of strangers ends the element that holds it.
        "data": _page_json(_page_data(survey, verdict, head)),
    }
    pieces = _HERE.joinpath("page.html").read_text("utf-8").split("@")
    pieces[1::2] = [parts[name] for name in pieces[1::2]]
    return "".join(pieces)


def _plain(survey: Survey, verdict: Verdict) -> str:
    """Return the findings without a script, as mail programs display a page."""
    faults = verdict.diagnosis.faults[:_MOST_FAULTS]
    items = (
        f"<li>{survey.since(one.first_us) / 1e6:.6f} s, {escape(one_line(_title(one.rule)))}: "
        f"{escape(one_line(_fault_text(one)))}</li>"
        for one in faults
    )
    return f"<ol>{''.join(items)}</ol>" if faults else ""


def _page_json(value: object) -> str:
    text = json_text(value, compact=True, letters=True)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def summary(survey: Survey, verdict: Verdict, head: ReportHead) -> list[str]:
    """Return three sentences about the traffic, the nodes, and the faults."""
    return [_what(survey, head), _who(survey.rows()), _wrong(verdict, survey.first_us or 0)]


def _what(survey: Survey, head: ReportHead) -> str:
    frames = sum(survey.frames.values())
    if survey.first_us is None:
        return f"{head.source} holds no frame."
    span_us = survey.last_us - survey.first_us
    buses = ", ".join(sorted(survey.frames))
    begun = f", from {_date(survey.first_us)}" if survey.first_us >= DATED_US else ""
    bits = sum(sum(spans.values()) for spans in survey.bits.sums.values())
    load = load_text(bits_per_second(bits, span_us), head.bit_rate) if span_us else ""
    busy = f", at a mean load of {load} over that time" if load and len(survey.frames) == 1 else ""
    return f"{head.source} holds {frames:,} frames of {buses} in {duration(span_us)}{begun}{busy}."


def _date(at_us: int) -> str:
    """Return a date as text. The reader may be in another place than the log."""
    try:
        return f"{datetime.fromtimestamp(at_us // 1_000_000, UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (ValueError, OverflowError, OSError):
        return f"{at_us / 1e6:.0f} s"


def _who(rows: Iterable[NodeStatus]) -> str:
    present = [row for row in rows if row.present]
    if not present:
        return "No CANopen node sent a frame."
    groups: dict[str, list[str]] = {}
    for row in present:
        told = "in no state that they reported" if row.state is None else row.state_text
        groups.setdefault(told, []).append(str(row.node))
    parts = [
        f"{', '.join(nodes)} {'is' if len(nodes) == 1 else 'are'} {state}"
        for state, nodes in groups.items()
    ]
    were = "node was" if len(present) == 1 else "nodes were"
    return f"{len(present)} {were} present; at the end {'; '.join(parts)}."


def _wrong(verdict: Verdict, first_us: int) -> str:
    faults, judged = verdict.diagnosis.faults, verdict.diagnosis.judged
    if not faults:
        return f"No fault was found by {counted(len(judged), 'rule')}."
    first = next((one for one in faults if one.frames), faults[0])
    at = f"{max(0, first.first_us - first_us) / 1e6:.3f} s"
    return f"{counted(len(faults), 'fault')} found; the first, at {at}: {_fault_text(first)}."


def _fault_text(fault: BusFault) -> str:
    return f"{fault.where}: {fault.text}".removeprefix(": ")


def _page_data(survey: Survey, verdict: Verdict, head: ReportHead) -> dict[str, object]:
    span_us = survey.since(survey.last_us)
    rows = survey.rows()
    several, faults = len(survey.frames) > 1, verdict.diagnosis.faults
    return {
        "span": span_us,
        "findings": [_finding(survey, one, verdict) for one in faults[:_MOST_FAULTS]],
        "around": bool(verdict.around),
        "judged": _judged(verdict.diagnosis),
        "buses": [
            {
                "name": one_line(channel),
                "rate": head.bit_rate,
                "load": _bins(survey.bits.sums.get(channel, {}), survey.bits.width_us),
                "errors": _bins(survey.errors.sums.get(channel, {}), survey.errors.width_us),
            }
            for channel in sorted(survey.frames)
        ],
        "nodes": [_node(survey, row, verdict.diagnosis, several=several) for row in rows],
        "nodeHeads": _HEADS,
        "signals": _signals(survey, several=several),
        "ids": _idents(survey, rows, max(span_us, 1)),
        "about": [[one_line(text), harmless(code)] for text, code in _notes(survey, verdict, head)],
    }


def _notes(survey: Survey, verdict: Verdict, head: ReportHead) -> Iterable[tuple[str, str]]:
    yield from head.about
    if (faults := len(verdict.diagnosis.faults)) > _MOST_FAULTS:
        yield f"{faults - _MOST_FAULTS} of {faults} findings had no room.", ""
    if left := len(survey.signals_left):
        yield f"{counted(left, 'signal')} more had no room.", ""
    thinned = [
        f"node {node}: {one.count - len(one.items)} of {one.count} {what}"
        for (_, node), lane in sorted(survey.lanes.items(), key=lambda one: one[0])
        for what, one in (("EMCYs", lane.emcys), ("SDO transfers", lane.transfers))
        if len(one.items) < one.count
    ]
    if thinned:
        yield f"Not drawn one by one: {', '.join(thinned)}.", ""


def _judged(diagnosis: Diagnosis) -> str:
    judged = ", ".join(diagnosis.judged)
    text = f"Judged by: {judged}." if judged else "No rule judged anything."
    none = "; ".join(f"{name}: {why}" for name, why in diagnosis.unjudged.items())
    return one_line(f"{text} Not judged: {none}." if none else text)


def _key(channel: str, node: int | None) -> str:
    return "" if node is None else f"{one_line(channel)}/{node}"


def _finding(survey: Survey, fault: BusFault, verdict: Verdict) -> dict[str, object]:
    places = fault.frames[:_MOST_PLACES]
    numbers = {place.number for place in fault.frames}
    first, around = verdict.around.get(places[0].number, (0, ())) if places else (0, ())
    return {
        "t": survey.since(fault.first_us) if places else 0,
        "at": [survey.since(place.at_us) for place in places],
        "last": survey.since(fault.last_us),
        "rule": one_line(fault.rule),
        "title": _title(fault.rule),
        "text": one_line(_fault_text(fault)),
        "key": _key(fault.channel, fault.node),
        "count": fault.amount,
        "frames": [
            [
                one.at_us - (survey.first_us or 0),
                one_line(one.channel),
                str(one.frame),
                one_line(decoded_text(decoded)),
                int(number in numbers),
            ]
            for number, (one, decoded) in enumerate(around, first)
        ],
    }


def _title(rule: str) -> str:
    """Return the violation that a rule finds. The name of a rule may state the demand instead."""
    text = RULES.get(rule, "")
    return text[:1].upper() + text[1:]


_HEADS: Final = (
    *("Node", "Name", "Identity", "NMT state", "Heartbeat", "Boot-ups", "Drive", "EMCY"),
    "SDO errors",
)


def _node(
    survey: Survey, row: NodeStatus, diagnosis: Diagnosis, *, several: bool
) -> dict[str, object]:
    lane = survey.lanes[row.channel, row.node]
    label = f"{row.channel} node {row.node}" if several else f"Node {row.node}"
    gaps = _gaps(survey, row, lane.gaps, diagnosis)
    boots = f"{row.boots}" + f" ({row.unrequested_boots} unasked)" * bool(row.unrequested_boots)
    name = name_text(row)
    cells = (
        *(label, name, told_identity(row) or "not read", row.state_text),
        *(_heartbeat(row, gaps, diagnosis), boots, row.drive_state),
        *(_latest(lane.emcys), _latest(lane.failures)),
    )
    return {
        "key": _key(row.channel, row.node),
        "label": one_line(label),
        "short": one_line(name or row.drive_state),
        "cells": [one_line(cell) for cell in cells],
        "states": [part for at_us, state in lane.states.changes for part in (at_us, state)],
        "pdos": _bins(_pdo_counts(survey, row), survey.counts.width_us),
        **{
            name: [[one.at_us, one.span_us, one_line(one.text)] for one in marks.items]
            for name, marks in (
                ("gaps", gaps),
                ("boots", lane.boots),
                ("commands", lane.commands),
                ("emcys", lane.emcys),
                ("transfers", lane.transfers),
                ("failures", lane.failures),
            )
        },
    }


_FROM_EDS: Final = " (EDS)"


def _of_node(diagnosis: Diagnosis, row: NodeStatus, rule: str) -> list[BusFault]:
    return [
        one
        for one in diagnosis.faults
        if one.rule == rule and (one.channel, one.node) == (row.channel, row.node)
    ]


def _heartbeat(row: NodeStatus, gaps: Thinned[Mark], diagnosis: Diagnosis) -> str:
    if _of_node(diagnosis, row, "doubled-node"):  # their gaps give the period of neither
        return FROM_TWO_NODES if row.heartbeats.last_us is not None else ""
    if row.heartbeats.period_us is None:
        return ""
    filed = not row.heartbeats.learnt and not row.memory.was_received(HEARTBEAT_TIME)
    late = f", late {counted(gaps.count, 'time')}" if gaps.count else ""
    return f"{row.heartbeats.period_us / 1e3:g} ms{_FROM_EDS * filed}{late}"


def _gaps(
    survey: Survey, row: NodeStatus, gaps: Thinned[Mark], diagnosis: Diagnosis
) -> Thinned[Mark]:
    """Return the gaps that a finding confirms.

    A survey detects a gap at once, from the heartbeats before the gap. The rules see the whole log,
    and detect two nodes with one node-ID. A node with node guarding has no heartbeats to judge.
    """
    guarded = (row.channel, nmt.ERROR_CONTROL_COB_ID + row.node | REMOTE) in survey.counts.sums
    if guarded or "no-lost-heartbeat" not in diagnosis.judged:
        return gaps
    silences = [
        one for one in diagnosis.faults if one.rule == "silence" and one.channel == row.channel
    ]
    spans = [
        (survey.since(from_us), survey.since(to_us))
        for one in [*_of_node(diagnosis, row, "no-lost-heartbeat"), *silences]
        for from_us, to_us in _seen(one)
    ]
    kept = [
        gap
        for gap in gaps.items
        if any(begin <= gap.at_us + gap.span_us and gap.at_us <= end for begin, end in spans)
    ]
    if len(kept) == len(gaps.items):
        return gaps
    found = Thinned[Mark]()
    for gap in kept:
        found.append(gap)
    return found


def _seen(fault: BusFault) -> Iterable[tuple[int, int]]:
    """Return the times of a finding. A finding with too many frames is one span at its end."""
    yield from ((place.at_us, place.at_us) for place in fault.frames)
    if fault.amount > len(fault.frames):
        yield fault.frames[-1].at_us if fault.frames else fault.first_us, fault.last_us


def _latest(marks: Thinned[Mark]) -> str:
    return f"{marks.count}, the latest: {marks.items[-1].text}" if marks.items else ""


def _pdo_counts(survey: Survey, row: NodeStatus) -> dict[int, int]:
    """Return the number of PDOs of a node in each span, by known PDOs, or else predefined ones."""
    known = pdo_contents(row)
    others = {pdo.can_id for pdo in known if pdo.receives}
    sent = {pdo.can_id for pdo in known if not pdo.receives}
    sent |= {base + row.node for base in (0x180, 0x280, 0x380, 0x480)} - others
    counts: dict[int, int] = {}
    for can_id in sorted(sent):
        for place, count in survey.counts.sums.get((row.channel, can_id), {}).items():
            counts[place] = counts.get(place, 0) + count
    return counts


def _bins(spans: Mapping[int, int], width_us: int) -> dict[str, object]:
    flat = [part for place in sorted(spans) for part in (place, spans[place])]
    return {"width": width_us, "at": flat}


def _signals(survey: Survey, *, several: bool) -> list[dict[str, object]]:
    """Return the signals with their values. With more signals, the spans are wider."""
    points = sum(len(spans) for spans in survey.values.ranges.values())
    shift = max(0, (points // _MOST_POINTS).bit_length())
    found = []
    order = sorted(
        survey.signals.items(), key=lambda one: (one[0].channel, one[0].node or 0, one[0][2:])
    )
    for name, track in order:
        if not track.count:
            continue
        where = "" if name.node is None else f"{name.node}."
        bus = f"{name.channel} " if several else ""
        one: dict[str, object] = {
            "key": _key(name.channel, name.node),
            "name": one_line(f"{bus}{where}{name.name}"),
            "unit": one_line(track.unit),
        }
        if track.states is not None:
            changes = track.states.changes
            one["states"] = [part for at_us, text in changes for part in (at_us, one_line(text))]
        else:
            one["width"] = survey.values.width_us << shift
            one["at"] = _ranges(survey.values.ranges.get(name, {}), shift)
        found.append(one)
    return found


def _ranges(spans: Mapping[int, tuple[float, float]], shift: int) -> list[float]:
    joined: dict[int, tuple[float, float]] = {}
    for place, (low, high) in spans.items():
        was = joined.get(place >> shift, (low, high))
        joined[place >> shift] = min(was[0], low), max(was[1], high)
    return [
        part
        for place in sorted(joined)
        for part in (place, _rounded(joined[place][0]), _rounded(joined[place][1]))
    ]


def _rounded(value: float) -> float:
    """Return a number with the number of digits that a picture shows."""
    short = float(f"{value:.6g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short


def _idents(survey: Survey, rows: Sequence[NodeStatus], span_us: int) -> list[dict[str, object]]:
    meanings = {
        (row.channel, pdo.can_id): f"node {row.node} {pdo.kind}: {', '.join(pdo.names)}"
        for row in rows
        for pdo in pdo_contents(row)
        if pdo.names
    }
    found: list[dict[str, object]] = []
    for channel, ident in sorted(survey.counts.sums)[:_MOST_IDS]:
        count = sum(survey.counts.sums[channel, ident].values())
        text = meanings.get((channel, ident)) or _meaning(ident)
        rate = rate_text(count * 1e6 / span_us)
        cells = (channel, ident_text(ident), str(count), rate, text)
        node = node_of(ident & ~REMOTE)
        found.append({"key": _key(channel, node), "cells": [one_line(cell) for cell in cells]})
    return found


def _meaning(ident: int) -> str:
    """Return the meaning of an identifier in the pre-defined connection set."""
    can_id, remote = ident & ~REMOTE, ", asked for by a remote frame" * bool(ident & REMOTE)
    if can_id in _ALONE:
        return _ALONE[can_id] + remote
    node = node_of(can_id)
    if node is None:
        return ""
    service = _SERVICES.get(can_id - node)
    return f"node {node} {service or 'PDO, not described'}{remote}"


# Pictures of the page.

_BROWSERS: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_PATIENCE_S: Final = 120
_WIDTH, _HEIGHT = 1280, 1600


class BrowserError(ValueError):
    """Chromium is not installed, or wrote nothing."""


def browser() -> str:
    """Return the path of Chromium.

    Raises:
        BrowserError: Chromium is not installed.
    """
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    if found is None:
        raise BrowserError(
            "PDF and PNG are drawn by Chromium, which is not installed: apt-get install chromium,"
            " or print the page of -o from any browser"
        )
    return found


def _unboxed() -> Sequence[str]:
    """Return the option to run Chromium as root.

    The sandbox of Chromium refuses to run as root, but containers run everything as root.
    """
    return ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []


def print_page(page: Path, path: Path) -> None:
    """Convert an HTML page to a PDF or PNG file with Chromium.

    The suffix of `path` selects the format.

    Raises:
        BrowserError: Chromium is not installed, or wrote no file.
    """
    what = "--print-to-pdf" if path.suffix.lower() == ".pdf" else "--screenshot"
    with TemporaryDirectory(prefix="canmon-") as folder:
        words = [
            *(browser(), "--headless=new", "--disable-gpu", "--no-first-run", "--hide-scrollbars"),
            *("--no-pdf-header-footer", f"--user-data-dir={folder}", *_unboxed()),
            *(f"--window-size={_WIDTH},{_HEIGHT}", "--virtual-time-budget=5000"),
            *(f"{what}={path.resolve()}", page.resolve().as_uri()),
        ]
        try:
            ended = subprocess.run(
                words, capture_output=True, text=True, timeout=_PATIENCE_S, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise BrowserError(f"{path}: Chromium wrote nothing: {error}") from None
    if not path.is_file() or ended.returncode:
        last = one_line(ended.stderr.strip().rpartition("\n")[2] or "no message")
        raise BrowserError(f"{path}: Chromium wrote nothing (status {ended.returncode}): {last}")
