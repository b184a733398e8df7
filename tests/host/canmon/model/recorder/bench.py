"""A recorder that is fed, and what is in its files."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import Mark
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.recorder.files import RecordingPlan
from tickrig.host.canmon.model.recorder.recorder import Recorder
from tickrig.wire.can import CanFrame

GAP_US = 125
"""8000 frames a second."""


def record(number: int, ident: int = 0x181, gap_us: int = GAP_US) -> Record:
    return Record(number * gap_us, "can0", CanFrame(ident, number.to_bytes(8, "big")))


def numbers(records: Iterable[Record]) -> list[int]:
    return [int.from_bytes(one.frame.data, "big") for one in records]


def feed(
    recorder: Recorder,
    records: Sequence[Record],
    lost: int = 0,
    marks: Sequence[Mark] = (),
    batch: int = 100,
) -> None:
    """Feed frames as a source does, decoded."""
    decoder = Decoder()
    for begin in range(0, max(1, len(records)), batch):
        some = records[begin : begin + batch]
        now_us = some[-1].at_us if some else 0
        recorder.take([(one, decoder.take(one)) for one in some], lost, now_us, marks)


def parts(plan: RecordingPlan) -> list[Path]:
    return sorted(path for path in plan.path.parent.iterdir() if plan.number(path.name))


def frames_of(plan: RecordingPlan) -> list[int]:
    return [number for path in parts(plan) for number in numbers(read_log(path))]


def index_of(plan: RecordingPlan) -> list[dict[str, Any]]:
    return [json.loads(line) for line in plan.index.read_text("utf-8").splitlines()]


def events(plan: RecordingPlan, event: str) -> list[dict[str, Any]]:
    return [said for said in index_of(plan) if said["ev"] == event]
