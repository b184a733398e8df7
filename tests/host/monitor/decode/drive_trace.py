"""The golden trace of a drive, and what decoders made of it."""

from __future__ import annotations

import csv
from pathlib import Path

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.heard import Heard
from tickrig.wire.candump import parse_log

GOLDEN = Path(__file__).parents[3] / "golden" / "canmon"
TRACE = GOLDEN / "drive.log"


def heard() -> list[Heard]:
    """Return the frames."""
    return [Heard(*line) for line in parse_log(TRACE.read_text())]


def decoded() -> list[Decoded]:
    """Return what our decoder says of each."""
    decoder = Decoder()
    return [decoder.take(item) for item in heard()]


def peer(name: str) -> list[dict[str, str]]:
    """Return what another decoder says of each."""
    with (GOLDEN / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="|"))


def line(item: Heard, found: Decoded) -> str:
    """Write a frame as the golden text has it."""
    head = f"{item.frame!s:22}{found.kind:10}{found.node or '-':>3} {found.source or '-':5}"
    return f"{head}{found.text}".rstrip()
