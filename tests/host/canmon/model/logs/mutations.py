"""Logs of every format with chance in them: CAN and CAN FD frames, then bytes changed."""

from __future__ import annotations

import struct
from functools import lru_cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Final
from zlib import crc32

from tests.host.canmon.model.columns.test_column_reader import rows_of, rows_of_records
from tests.host.canmon.model.logs.test_reports import REPORTS
from tests.mutators import spoilt
from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rules import Rules
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.columns.columns import Columns, NoColumnsError
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import AnyFrame, DumpLines, Record, Stamp
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.model.trace import FrameTrace
from tickrig.host.canmon.model.traffic import BitRates, Traffic
from tickrig.host.canmon.output.printer import DumpFormat, printer_of
from tickrig.host.canmon.verbs.stats import by_id, by_node
from tickrig.wire.can import FD_LENGTHS, CanFrame, ErrorFrame, FdFrame

NAMES: Final = (
    *("run.log", "run.jsonl", "run.csv", "run.asc", "run.trc", "run.blf", "run.pcapng"),
    *("run.pcapng.gz", "run.txt", "run.pcap", "run.gvret.csv"),
)
WRITTEN: Final = (
    *("out.log", "out.jsonl", "out.csv", "out.asc", "out.trc", "out.blf", "out.pcapng"),
    "out.gvret.csv",
)
EXACT_US: Final = 1 << 52
"""Times beyond, as mutated ones, are not held to the microsecond by a number of JSON."""
IDS: Final = (0x000, 0x080, 0x083, 0x183, 0x583, 0x603, 0x703, 0x7E5)


def frame(chance: Random) -> AnyFrame:
    """Return a frame of any kind."""
    can_id = chance.choice(IDS)
    match chance.randrange(8):
        case 0:
            return CanFrame(can_id, b"", True, False, chance.randrange(9))
        case 1:
            return CanFrame(can_id << 18, chance.randbytes(chance.randrange(9)), False, True)
        case 2:
            return ErrorFrame(chance.randrange(0x400), chance.randbytes(8))
        case 3 | 4:
            data = chance.randbytes(chance.choice(FD_LENGTHS))
            return FdFrame(can_id, data, False, chance.randrange(4))
        case 5:
            return FdFrame(can_id << 18, chance.randbytes(chance.choice(FD_LENGTHS)), True)
        case _:
            return CanFrame(can_id, chance.randbytes(chance.randrange(9)))


def heard(chance: Random) -> list[Record]:
    """Return a few frames on two buses."""
    at_us, found = 1_700_000_000_000_000, []
    for _ in range(chance.randint(1, 12)):
        at_us += chance.choice((0, 250, 1_000, 40_000))
        found.append(
            Record(at_us, chance.choice(("can0", "can1")), frame(chance), chance.random() < 0.2)
        )
    return found


def log(name: str, records: list[Record], chance: Random) -> bytes:
    """Return the bytes of a log."""
    if name == "run.txt":
        lines = DumpLines(chance.choice(list(Stamp)), chance.random() < 0.5)
        return "".join(f"{lines.line(record)}\n" for record in records).encode()
    with TemporaryDirectory() as folder:
        path = Path(folder, name if name != "run.pcap" else "run.pcapng")
        writer = write_log(path)
        for record in records:
            writer.write(record)
        writer.close()
        data = path.read_bytes()
    return as_pcap(data) if name == "run.pcap" else data


def as_pcap(data: bytes) -> bytes:
    """Return the packets of a pcapng file that we wrote as a pcap file."""
    out, at = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 227), 0
    while at < len(data):
        kind, size = struct.unpack_from("<II", data, at)
        if kind == 6:
            _, high, low, captured, _ = struct.unpack_from("<5I", data, at + 8)
            seconds, micros = divmod(high << 32 | low, 1_000_000)
            out += struct.pack("<4I", seconds, micros, captured, captured)
            out += data[at + 28 : at + 28 + captured]
        at += size
    return out


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return the name and the bytes of a log that somebody spoilt; one in eight is whole.

    One in four is of a kind that people reported of other tools.
    """
    if chance.random() < 1 / 4:
        report = chance.choice(list(REPORTS.values()))
        name, data = report.name, report.text.encode()
    else:
        name = chance.choice(NAMES)
        data = whole_log(name, chance.randrange(100))
    return name, data if chance.random() < 1 / 8 else spoilt(data, chance)


@lru_cache(1_000)
def whole_log(name: str, number: int) -> bytes:
    """Return one of the logs that are spoilt."""
    chance = Random(number)
    return log(name, heard(chance), chance)


def judge(name: str, data: bytes) -> str:
    """Read a log, show, count and write what is in it; say whether it was read to its end."""
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        records, ended = read(path)
        show(records)
        rewrite(Path(folder, WRITTEN[crc32(data) % len(WRITTEN)]), records)
        rows: list[Columns] = []
        try:
            rows.extend(read_columns(path))
        except NoColumnsError:
            return ended
        except LogError:
            assert ended == "broken off"
        assert rows_of(rows) == rows_of_records(records)
    return ended


def read(path: Path) -> tuple[list[Record], str]:
    """Return what can be read, and how that ended."""
    found: list[Record] = []
    reader = read_log(path)
    said = ""
    try:
        found.extend(reader)
    except LogError as error:
        said = str(error)
    assert all("\n" not in text for text in (said, *reader.tally.messages(path.name)))
    return found, "broken off" if said else "with bad lines" if reader.tally.unread else "whole"


def show(records: list[Record]) -> None:
    """Do with frames what verbs do."""
    traffic, trace, decoder = Traffic(BitRates(500_000, 2_000_000)), FrameTrace(), Decoder()
    checker = Checker(Rules(no_emcy=True, no_sdo_abort=True, max_load=50.0), 500_000)
    printers = [printer_of(output, DumpLines(Stamp.DATE, True), raw=False) for output in DumpFormat]
    for record in records:
        decoded = decoder.take(record)
        traffic.take(record)
        trace.take(record, decoded)
        checker.take(record)
        for printer in printers:
            printer(record, decoded)
    snapshot = traffic.snapshot()
    assert by_id(snapshot)
    assert by_node(snapshot)
    checker.end(records[-1].at_us if records else 0)


def rewrite(path: Path, records: list[Record]) -> None:
    """Write frames; what a text or a capture holds is read again as it was."""
    writer = write_log(path)
    for record in records:
        writer.write(record)
    writer.close()
    if path.suffix in (".log", ".jsonl", ".pcapng"):
        again = list(read_log(path))
        assert [one.frame for one in again] == [one.frame for one in records]
        assert [min(EXACT_US, one.at_us) for one in again] == [
            min(EXACT_US, one.at_us) for one in records
        ]
