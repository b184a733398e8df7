from __future__ import annotations

import time

import pytest

from tests.host.canmon.model.logs.test_log_lines import read
from tickrig.host.canmon.model.frames import DumpLines, Record, Stamp
from tickrig.wire.can import CanFrame


def record(line: str) -> Record:
    found, _ = read(line)
    assert found is not None
    return found


def test_what_has_no_date_is_shown_in_seconds() -> None:
    line = DumpLines(Stamp.DATE).line(Record(999_999_999_999_000_000, "can0", CanFrame(1)))
    assert line.startswith(" (999999999999.000000)  can0")


def test_a_date_is_in_local_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "UTC-2")
    time.tzset()
    try:
        line = DumpLines(Stamp.DATE).line(record("(1436509052.249713) can0 705#7F"))
    finally:
        monkeypatch.undo()
        time.tzset()
    assert line == " (2015-07-10 08:17:32.249713)  can0  705   [1]  7F"


def test_a_time_that_runs_backwards_has_a_sign() -> None:
    lines = DumpLines(Stamp.DELTA)
    lines.line(record("(2.0) can0 705#"))
    assert lines.line(record("(0.5) can0 705#")) == " (-001.500000)  can0  705   [0] "


def test_identifiers_are_aligned_once_a_long_one_came() -> None:
    lines = DumpLines()
    shown = [lines.line(record(f"(0.5) can0 {ident}#")) for ident in ("123", "00000123", "123")]
    assert shown == ["  can0  123   [0] ", "  can0  00000123   [0] ", "  can0       123   [0] "]


def test_what_a_frame_means_is_aligned() -> None:
    lines = DumpLines()
    short = lines.line(record("(0.5) can0 123#"), "meaning")
    long = lines.line(record("(0.5) can0 123#0011223344556677"), "meaning")
    assert short.index("meaning") == long.index("meaning")
