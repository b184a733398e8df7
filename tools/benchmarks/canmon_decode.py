"""Decoding of canmon, beside the canopen library's PDOs, canopen-lens and Wireshark."""

from __future__ import annotations

import shutil
import struct
import subprocess
import tempfile
import time
from pathlib import Path

import canopen
from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.pdo.base import PdoMap

from benchmarks.table import RUNS, rates, row
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType

NODE = 5
FRAMES = 100_000
FILE_FRAMES = 200_000
LIMIT_S = 60
TRACE = Path(__file__).parents[2] / "tests" / "golden" / "canmon" / "drive.log"
MAPPING = (
    *("605#2F001A0000000000", "585#60001A0000000000"),
    *("605#23001A0110004160", "585#60001A0100000000"),
    *("605#23001A0220006460", "585#60001A0200000000"),
    *("605#2F001A0002000000", "585#60001A0000000000"),
)
_VALUES = struct.Struct("<Hi")


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    pdos()
    library()
    transfers()
    verbs()


def pdos() -> None:
    """Decode TPDOs with a statusword and a position, one node and fifty."""
    frames = [_tpdo(n) for n in range(FRAMES)]
    decoder = _configured(Decoder())
    board, chosen = NodeBoard(decoder), parse_filter("node=5 and (statusword.fault or emcy)")
    rates("canmon: TPDO of two signals", FRAMES, "frames/s", lambda: _decode(decoder, frames))
    unknown = [Record(h.at_us, "can1", h.frame) for h in frames]
    rates("canmon: TPDO unmapped", FRAMES, "frames/s", lambda: _decode(decoder, unknown))

    def work() -> None:
        for record in frames:
            decoded = decoder.take(record)
            board.take(record, decoded)
            chosen.matches(record, decoded)

    rates("canmon: the same with node board and a filter", FRAMES, "frames/s", work)


def library() -> None:
    """Let the canopen library take the same TPDOs, and read both values."""
    dictionary = ObjectDictionary()
    for index, name, kind in (
        (0x6041, "statusword", DataType.UNSIGNED16),
        (0x6064, "position", DataType.INTEGER32),
    ):
        variable = ODVariable(name, index)
        variable.data_type = kind
        dictionary.add_object(variable)
    node = canopen.RemoteNode(NODE, dictionary)
    found = PdoMap(node.tpdo, None, None)  # its records are for configuring alone
    for name in ("statusword", "position"):
        found.add_variable(name)
    found.cob_id = 0x180 + NODE
    datas = [bytearray(record.frame.data) for record in (_tpdo(n) for n in range(FRAMES))]

    def work() -> None:
        for number, data in enumerate(datas):
            found.on_message(0x180 + NODE, data, number / 1e3)
            found[0].raw, found[1].raw

    rates("canopen library: the same TPDO, both values read", FRAMES, "frames/s", work)


def transfers() -> None:
    """Decode SDO traffic: reads that are answered at once."""
    pair = [CanFrame.parse(t) for t in ("605#4041600000000000", "585#4B41600037020000")]
    frames = [Record(n * 1_000, "can0", pair[n % 2]) for n in range(FRAMES)]
    decoder = Decoder()
    rates("canmon: SDO, expedited uploads", FRAMES, "frames/s", lambda: _decode(decoder, frames))


def verbs() -> None:
    """Start whole programs: one of them must read, decode and show a log."""
    small = str(TRACE)
    seconds("canmon nodes, 134 frames", ["canmon", "nodes", small])
    with tempfile.TemporaryDirectory() as folder:
        log = str(Path(folder) / "run.log")
        _write(Path(log))
        what = f"{FILE_FRAMES:,} frames"
        seconds(f"canmon nodes, {what}", ["canmon", "nodes", log])
        seconds(f"canopen-lens, {what}", ["canopen-lens", log, "--lang", "en"])
        wireshark = ["tshark", "-r", log, "-d", "can.subdissector,canopen"]
        seconds(f"tshark, canopen dissector, {what}", wireshark)


def seconds(what: str, command: list[str]) -> None:
    """Print how long a program takes; that it is not installed, or takes too long, where so."""
    program = shutil.which(command[0])
    if program is None:
        print(f"| {what} | not installed | |")
        return
    values = []
    for _ in range(RUNS):
        start = time.perf_counter()
        try:
            subprocess.run(
                [program, *command[1:]], capture_output=True, check=False, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            print(f"| {what} | more than {LIMIT_S} s | |")
            return
        values.append(time.perf_counter() - start)
    row(what, values, "s")


def _tpdo(number: int) -> Record:
    data = _VALUES.pack(0x0237, number)
    return Record(number * 1_000, "can0", CanFrame(0x180 + NODE, data))


def _configured(decoder: Decoder) -> Decoder:
    for text in MAPPING:
        decoder.take(Record(0, "can0", CanFrame.parse(text)))
    return decoder


def _decode(decoder: Decoder, frames: list[Record]) -> None:
    for record in frames:
        decoder.take(record)


def _write(path: Path) -> None:
    """Write a log of a configured node: TPDOs, and a heartbeat now and then."""
    lines = [f"(0000000000.000000) can0 {text}\n" for text in MAPPING]
    for number in range(1, FILE_FRAMES - len(MAPPING) + 1):
        frame = f"{0x700 + NODE:03X}#05" if number % 100 == 0 else str(_tpdo(number).frame)
        lines.append(f"({number // 1_000:010d}.{number % 1_000 * 1_000:06d}) can0 {frame}\n")
    path.write_text("".join(lines), "ascii")
