"""The verb `stats`: statistics of all identifiers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from tickrig.host.canmon.model import statistics
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.traffic import BitRates, Traffic, TrafficSnapshot
from tickrig.host.canmon.output import listening
from tickrig.host.canmon.sources.opening import BlockLog, block_log, open_source
from tickrig.host.canmon.sources.source import Source
from tickrig.host.canmon.verbs.decode_options import source_command
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import until_unread


@source_command(
    click.option(
        "--by", type=click.Choice(["id", "node"]), default="id", help="A row each (default: id)."
    ),
    listening.span_option,
    click.option("--jsonl", is_flag=True, help="One JSON object a row."),
)
def command(
    *,
    source: Sequence[str],
    by: str,
    span_us: int | None,
    jsonl: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Count a log: rates, gaps, jitter, missed cycles, exact load, error frames.

    Gaps are of all frames; p99 is at most 1/64 too long. A cycle is told where
    most gaps are near the median; missed are its frames that did not come.
    Jitter is how much a gap differs from the one before, on average. Loads
    count stuff bits and are a share of the bit rate that -b gives.

    \b
    canmon stats run.log -b 500000
    canmon stats run.blf --by node
    canmon stats can0 --for 10s --jsonl

    {source}
    """  # noqa: D301 - click wants the backspace
    bus = BusOptions(**options)
    rates = listening.bit_rates_of(source, bus)
    log = block_log(source)
    snapshot = listening.count_blocks(log)
    frames = (log if snapshot else None) or open_source(source, bus)
    try:
        if not isinstance(frames, BlockLog):
            snapshot = _one_by_one(frames, source, span_us, rates)
    finally:
        frames.close()
    assert snapshot
    with until_unread():
        for line in (_jsonl if jsonl else _tables)(snapshot, by, rates.nominal):
            click.echo(line)
    listening.report(frames, strict)


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
    lines = [line for bus in snapshot.buses for line in statistics.bus_lines(bus, bit_rate)]
    return [*lines, "", *(statistics.by_id if by == "id" else statistics.by_node)(snapshot)]


def _jsonl(snapshot: TrafficSnapshot, by: str, bit_rate: int | None) -> list[str]:
    lines = [statistics.bus_json(bus, bit_rate) for bus in snapshot.buses]
    if by == "id":
        return lines + [statistics.id_json(row) for row in snapshot.rows]
    return lines + [statistics.node_json(row) for row in statistics.node_rows(snapshot.rows)]
