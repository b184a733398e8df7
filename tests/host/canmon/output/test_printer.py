from __future__ import annotations

import pytest

from tickrig.host.canmon.model.frames import DumpLines, LineRecord, Stamp
from tickrig.host.canmon.model.logs.log_reader import LogLines
from tickrig.host.canmon.output.printer import DumpFormat, printer_of
from tickrig.host.canmon.sources.line_source import RrcLines


def line(data: bytes) -> LineRecord:
    (found,) = RrcLines("tty").take(1_500_000, data, to_device=True)
    return found


@pytest.mark.parametrize(
    ("output", "text"),
    [
        (
            DumpFormat.TEXT,
            f" (000.000000)  tty  >  {'output1eff':<28}   rrc output v_pct=30 w_pct=-1",
        ),
        (
            DumpFormat.JSONL,
            '{"v":1,"ev":"line","t":1.500000,"ch":"tty","dir":"tx","data":"6F757470757431656666",'
            '"kind":"rrc","text":"output v_pct=30 w_pct=-1",'
            '"sig":{"command":"output","v_pct":30,"w_pct":-1}}',
        ),
        (DumpFormat.CSV, "1.500000,tty,,tx,10,6F757470757431656666,rrc,,output v_pct=30 w_pct=-1"),
    ],
)
def test_a_line_of_a_serial_port_is_printed_like_this(output: DumpFormat, text: str) -> None:
    found = line(b"output1eff\n")
    assert printer_of(output, DumpLines(Stamp.ZERO), False)(found, found.decoded) == text


def test_bytes_that_are_no_text_are_hex() -> None:
    printed = printer_of(DumpFormat.TEXT, DumpLines(Stamp.NONE), True)
    assert printed(line(b"\x01\xff\n"), None) == "  tty  >  01 FF"


def test_a_log_reader_counts_lines_of_a_serial_port() -> None:
    found, lines = line(b"device\n"), LogLines()
    text = printer_of(DumpFormat.JSONL, DumpLines(Stamp.NONE), False)(found, found.decoded)
    assert lines.push(text.encode() + b"\n") == []
    assert lines.tally.messages("pipe") == ["pipe: 1 lines of a serial port passed over"]
