"""Frames as a monitor hears them, from candump text."""

from __future__ import annotations

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.traffic import Traffic, TrafficSnapshot
from tickrig.wire.can import parse_line


def hear(text: str, channel: str = "can0") -> list[Record]:
    """Read lines such as `0.100 705#7F`: seconds, and a frame or an error frame."""
    lines = (line.split() for line in text.splitlines() if line.strip())
    return [_one(float(seconds), channel, frame) for seconds, frame in lines]


def _one(seconds: float, channel: str, frame: str) -> Record:
    return Record(
        round(seconds * 1e6), channel, parse_line(f"(0.000000) {channel} {frame}").received
    )


def snapshot(records: list[Record]) -> TrafficSnapshot:
    traffic = Traffic()
    for record in records:
        traffic.take(record)
    return traffic.snapshot()
