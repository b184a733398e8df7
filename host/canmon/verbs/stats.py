"""The verb `stats`, which shows statistics of all identifiers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import Any, Final, NamedTuple

import click

from tickrig.host.canmon.model.frames import (
    EXTENDED,
    FD,
    REMOTE,
    Record,
    count_text,
    ident_text,
    load_text,
    ms_text,
    node_of,
    rate_text,
)
from tickrig.host.canmon.model.traffic import (
    WINDOW_US,
    BitRates,
    BusRow,
    IdRow,
    Traffic,
    TrafficSnapshot,
)
from tickrig.host.canmon.output import listening
from tickrig.host.canmon.sources.source import BlockLog, LogCut, Source, block_log, open_source
from tickrig.host.canmon.verbs.decode_options import cut_options, source_command
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import until_unread
from tickrig.host.cli.options import Choice
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import aligned
from tickrig.wire.can import EXTENDED_MAX

# Statistics of a whole log, by buses, identifiers or nodes: as text and as lines of JSON.


_ID_HEAD: Final = (
    *("bus", "CAN-ID", "frames", "1/s", "share %", "min ms", "avg ms", "p99 ms", "max ms"),
    *("jitter", "cycle ms", "missed", "bits"),
)
_NODE_HEAD: Final = ("bus", "node", "CAN-IDs", "frames", "1/s", "share %")
_LEFT: Final = 2
"""Number of left-aligned columns, which contain names."""


class _NodeRow(NamedTuple):
    """The total traffic of the identifiers of one node.

    Attributes:
        channel: name of the bus.
        node: node-ID of the node, or None for identifiers without a node-ID.
        idents: identifiers as `ident_of` returns them.
        frames: number of frames of all these identifiers.
        bits: number of bits of these frames on the bus.
    """

    channel: str
    node: int | None
    idents: tuple[int, ...]
    frames: int
    bits: int


def node_rows(rows: Iterable[IdRow]) -> list[_NodeRow]:
    """Return a row for each node. Identifiers without a node-ID are last."""
    groups: dict[tuple[str, int], list[IdRow]] = {}
    for row in rows:
        groups.setdefault((row.channel, node_of(row.ident) or 0), []).append(row)
    order = sorted(groups, key=lambda key: (key[0], not key[1], key[1]))
    return [
        _NodeRow(
            channel,
            node or None,
            tuple(row.ident for row in groups[channel, node]),
            sum(row.frames for row in groups[channel, node]),
            sum(row.bits for row in groups[channel, node]),
        )
        for channel, node in order
    ]


def bus_lines(bus: BusRow, bit_rate: int | None) -> list[str]:
    """Return the statistics of a bus, one per line."""
    load, span_s, peak = bus.load, (bus.last_us - bus.first_us) / 1e6, bus.load.peak
    window = "the second" if peak.span_us == WINDOW_US else f"{peak.span_us / 1e6:.6f} s"
    lines = [
        f"{bus.channel}: {bus.frames} frames in {span_s:.6f} s, {load.bits} bits with stuff bits",
        f"  load: mean {load_text(load.mean_bit_s, bit_rate)}, peak"
        f" {load_text(peak.bit_s, bit_rate)} in {window} from {peak.at_us / 1e6:.6f}",
        f"  error frames: {bus.errors.frames}",
    ]
    if bus.fd:
        rest = f"; {bus.unrated} have BRS with an unknown rate: the load is lower"
        lines.insert(2, f"  CAN FD: {bus.fd} frames{rest * bool(bus.unrated)}")
    lines += [f"    {count} x {kind}" for kind, count in bus.errors.kinds]
    if bus.errors.state is not None:
        lines.append(f"  controller: {bus.errors.state.name.lower().replace('_', '-')}")
    return lines + [f"  back in time: {bus.went_back} frames"] * bool(bus.went_back)


def by_id(snapshot: TrafficSnapshot) -> list[str]:
    """Return the table of identifiers."""
    bits = {bus.channel: bus.load.bits for bus in snapshot.buses}
    cells = (_id_cells(row, bits[row.channel]) for row in snapshot.rows)
    return aligned([_ID_HEAD, *cells], _LEFT)


def by_node(snapshot: TrafficSnapshot) -> list[str]:
    """Return the table of nodes."""
    buses = {bus.channel: bus for bus in snapshot.buses}
    rows = [_node_cells(row, buses[row.channel]) for row in node_rows(snapshot.rows)]
    return aligned([_NODE_HEAD, *rows], _LEFT)


def _id_cells(row: IdRow, bus_bits: int) -> list[str]:
    head = [row.channel, ident_text(row.ident), str(row.frames), rate_text(row.rate_hz)]
    head.append(f"{row.bits * 100 / bus_bits:.1f}")
    changed = row.changed.changed.bit_count()
    gaps = row.gaps
    if gaps is None:
        return [*head, *["-"] * 7, str(changed)]
    times = (gaps.min_us, gaps.mean_us, gaps.p99_us, gaps.max_us, gaps.jitter_us, gaps.cycle_us)
    return [*head, *map(ms_text, times), count_text(gaps.missed), str(changed)]


def _node_cells(row: _NodeRow, bus: BusRow) -> list[str]:
    span_us = bus.last_us - bus.first_us
    rate_hz = row.frames * 1e6 / span_us if span_us > 0 else 0.0
    share = f"{row.bits * 100 / bus.load.bits:.1f}"
    return [
        *(row.channel, count_text(row.node), str(len(row.idents)), str(row.frames)),
        *(rate_text(rate_hz), share),
    ]


def bus_json(bus: BusRow, bit_rate: int | None) -> str:
    """Return the statistics of a bus as one line of JSON, for `canmon stats --jsonl`.

    Loads are shares of the bit rate, or null if the bit rate is unknown.
    """
    load, errors = bus.load, bus.errors
    return _line(
        "bus",
        ch=bus.channel,
        n=bus.frames,
        first=bus.first_us / 1e6,
        last=bus.last_us / 1e6,
        bits=load.bits,
        mean_bit_s=load.mean_bit_s,
        peak_bit_s=load.peak.bit_s,
        peak_t=load.peak.at_us / 1e6,
        mean_load=None if bit_rate is None else load.mean_bit_s / bit_rate,
        peak_load=None if bit_rate is None else load.peak.bit_s / bit_rate,
        errors=errors.frames,
        error_kinds=dict(errors.kinds),
        state=None if errors.state is None else errors.state.name.lower(),
        went_back=bus.went_back,
        **({"fd": bus.fd, "fd_unrated": bus.unrated} if bus.fd else {}),
    )


def id_json(row: IdRow) -> str:
    """Return an identifier as JSON. Times are in microseconds."""
    gaps = None if row.gaps is None else row.gaps._asdict()
    return _line(
        "id",
        ch=row.channel,
        **_ident(row.ident),
        n=row.frames,
        first=row.first_us / 1e6,
        last=row.last_us / 1e6,
        rate=round(row.rate_hz, 6),
        bits=row.bits,
        gaps=gaps,
        data=row.frame.data.hex().upper(),
        changes=list(row.changed.counts()) if row.changed.planes else [],
    )


def node_json(row: _NodeRow) -> str:
    """Return a node as JSON. The node is null for identifiers without a node-ID."""
    idents: Iterable[dict[str, object]] = map(_ident, row.idents)
    return _line(
        "node", ch=row.channel, node=row.node, n=row.frames, bits=row.bits, ids=list(idents)
    )


def _ident(ident: int) -> dict[str, object]:
    plain: dict[str, object] = {"id": ident & EXTENDED_MAX, "x": int(bool(ident & EXTENDED))}
    if ident & FD:
        return plain | {"fd": 1}
    return plain | {"rtr": 1} if ident & REMOTE else plain


def _line(what: str, **members: object) -> str:
    return json_text({"v": 1, "what": what, **members}, compact=True, letters=True)


@source_command(
    click.option(
        "--by",
        type=Choice(["id", "node"]),
        default="id",
        help="Print one row per CAN-ID (default) or per node.",
    ),
    listening.span_option,
    cut_options,
    click.option("--jsonl", is_flag=True, help="Print one JSON object per row."),
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    by: str,
    span_us: int | None,
    cut: LogCut,
    jsonl: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Count a log: rates, gaps, jitter, missed cycles, exact load, error frames.

    Gaps are the times between successive frames with the same CAN-ID. The statistics use all gaps
    of the log. The shown 99th percentile of the gaps (p99) is at most 1/64 (1.6 %) longer than the
    true percentile. A cycle is shown if most gaps are near the median. "missed" counts the missing
    frames of the cycle. Jitter is the average difference between successive gaps. The load includes
    stuff bits. The load is shown as a share of the bit rate that -b gives.

    \b
    canmon stats run.log -b 500000
    canmon stats run.blf --by node --from 60 --to 90
    canmon stats can0 --for 10s --jsonl

    {source}
    """  # noqa: D301 - click wants the backspace
    bus = BusOptions(**options)
    rates = listening.bit_rates_of(source, bus)
    log = block_log(source, cut)
    snapshot = listening.count_blocks(log, span_us)
    frames = (log if snapshot else None) or open_source(source, bus, cut)
    with closing(frames):
        if not isinstance(frames, BlockLog):
            snapshot = _one_by_one(frames, source, span_us, rates)
    assert snapshot
    with until_unread():
        for line in (_jsonl if jsonl else _tables)(snapshot, by, rates.nominal):
            click.echo(line)
    listening.report(frames, strict)
    listening.expect_frames(frames)


def _one_by_one(
    source: Source, words: Sequence[str], span_us: int | None, rates: BitRates
) -> TrafficSnapshot:
    traffic = Traffic(rates)

    def take(records: Sequence[Record]) -> None:
        for record in records:
            traffic.take(record)

    listening.follow(source, words, take, span_us)
    return traffic.snapshot()


def _tables(snapshot: TrafficSnapshot, by: str, bit_rate: int | None) -> list[str]:
    lines = [line for bus in snapshot.buses for line in bus_lines(bus, bit_rate)]
    return [*lines, "", *(by_id if by == "id" else by_node)(snapshot)]


def _jsonl(snapshot: TrafficSnapshot, by: str, bit_rate: int | None) -> list[str]:
    lines = [bus_json(bus, bit_rate) for bus in snapshot.buses]
    if by == "id":
        return lines + [id_json(row) for row in snapshot.rows]
    return lines + [node_json(row) for row in node_rows(snapshot.rows)]
