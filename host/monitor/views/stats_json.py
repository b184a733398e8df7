"""Statistics of a whole log as lines of JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable

from tickrig.host.monitor.frames.ident import EXTENDED, REMOTE
from tickrig.host.monitor.traffic.tally import IdRow
from tickrig.host.monitor.traffic.traffic import BusRow
from tickrig.host.monitor.views.stats_table import NodeRow
from tickrig.wire.can import EXTENDED_MAX


def bus_json(bus: BusRow, bit_rate: int | None) -> str:
    """Write a bus; loads are shares of the bit rate, null if that is not known."""
    load, errors = bus.load, bus.errors
    return _line(
        "bus",
        ch=bus.channel,
        n=bus.frames,
        first=bus.first_us / 1e6,
        last=bus.last_us / 1e6,
        bits=load.bits,
        mean_bit_s=load.mean_bit_s,
        peak_bit_s=load.peak.bits,
        peak_t=load.peak.at_us / 1e6,
        mean_load=None if bit_rate is None else load.mean_bit_s / bit_rate,
        peak_load=None if bit_rate is None else load.peak.bits / bit_rate,
        errors=errors.frames,
        error_kinds=dict(errors.kinds),
        state=None if errors.state is None else errors.state.name.lower(),
        went_back=bus.went_back,
    )


def id_json(row: IdRow) -> str:
    """Write an identifier; times are in microseconds."""
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


def node_json(row: NodeRow) -> str:
    """Write a node; null is what has no node-ID by default."""
    idents: Iterable[dict[str, object]] = map(_ident, row.idents)
    return _line(
        "node", ch=row.channel, node=row.node, n=row.frames, bits=row.bits, ids=list(idents)
    )


def _ident(ident: int) -> dict[str, object]:
    plain: dict[str, object] = {"id": ident & EXTENDED_MAX, "x": int(bool(ident & EXTENDED))}
    return plain | {"rtr": 1} if ident & REMOTE else plain


def _line(what: str, **members: object) -> str:
    return json.dumps({"v": 1, "what": what, **members}, separators=(",", ":"), ensure_ascii=False)
