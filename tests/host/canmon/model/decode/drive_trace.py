"""The golden traces, and what decoders made of them."""

from __future__ import annotations

import csv
from pathlib import Path

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import parse_log

GOLDEN = Path(__file__).parents[4] / "golden" / "canmon"
TRACE = GOLDEN / "drive.log"
NOISE = GOLDEN / "noise.log"


def record(path: Path = TRACE) -> list[Record]:
    """Return the frames."""
    return [Record(*line) for line in parse_log(path.read_text())]


def decoded(path: Path = TRACE) -> list[Decoded]:
    """Return what our decoder says of each."""
    decoder = Decoder()
    return [decoder.take(item) for item in record(path)]


def peer(name: str) -> list[dict[str, str]]:
    """Return what another decoder says of each."""
    with (GOLDEN / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="|"))


def line(item: Record, found: Decoded) -> str:
    """Write a frame as the golden text has it."""
    head = f"{item.frame!s:22}{found.kind:10}{found.node or '-':>3} {found.source or '-':5}"
    return f"{head}{found.text}".rstrip()
