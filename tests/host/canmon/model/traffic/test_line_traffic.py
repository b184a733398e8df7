from __future__ import annotations

from tickrig.host.canmon.model.frames import LineRecord, Record
from tickrig.host.canmon.model.top_model import LineTraffic, TopModel, line_table
from tickrig.host.canmon.sources.line_source import RrcLines
from tickrig.wire.can import CanFrame

TALK = (
    (0, True, b"device\n"),
    (10_000, False, b"OK:device\n"),
    (20_000, False, b"EV:PowerOn\n"),
    (30_000, False, b"ER:CommandUnknown\n"),
    (40_000, False, b"RRC 1.0\n"),
    (100_000, False, b"SA:64003200A1000F\n"),
    (200_000, False, b"SA:64003200A1000F\n"),
)


def talk() -> list[LineRecord]:
    lines = RrcLines("tty")
    return [line for at_us, sent, data in TALK for line in lines.take(at_us, data, to_device=sent)]


def test_each_kind_of_message_has_a_row() -> None:
    traffic = LineTraffic()
    for line in talk():
        traffic.take(line)
    table = [" ".join(line.split()) for line in line_table(traffic.rows(), 1_200_000, 200)]
    status = "in_v_pct=100 in_w_pct=0 out_v_pct=50 out_w_pct=0"
    assert table[:6] == [
        "",
        "line count 1/s gap ms age s meaning",
        "tty < event 1 0.00 - 1.2 event PowerOn",
        "tty < ok 1 0.00 - 1.2 OK device",
        "tty < other 1 0.00 - 1.2 RRC 1.0",
        "tty < refused 1 0.00 - 1.2 refused CommandUnknown",
    ]
    assert table[6].startswith(f"tty < status 2 10.00 100.000 1.0 status {status}")
    assert table[7:] == ["tty > device 1 0.00 - 1.2 device"]


def test_noise_has_one_row() -> None:
    traffic, lines = LineTraffic(), RrcLines("tty")
    for number in range(100):
        for line in lines.take(number, b"?%d\n" % number, to_device=True):
            traffic.take(line)
    (row,) = traffic.rows()
    assert (row.word, row.messages) == ("other", 100)


def test_top_shows_lines_below_frames_and_holds_and_clears_both() -> None:
    model = TopModel()
    model.take([Record(0, "can0", CanFrame(0x705, b"\x05")), *talk()])
    shown = model.lines(1_000_000, 0, 80, 24)
    assert any(line.startswith("705") for line in shown)
    assert shown[-1].startswith("tty > device")
    assert max(map(len, shown)) <= 80
    assert len(model.lines(1_000_000, 0, 80, 8)) <= 8
    model.press(" ")
    model.press("c")
    assert model.lines(2_000_000, 0, 80, 24)[-1] == shown[-1]
    model.press(" ")
    assert not any("tty" in line for line in model.lines(2_000_000, 0, 80, 24))


def test_a_table_for_paper_has_the_ages_at_the_last_line() -> None:
    model = TopModel()
    model.take_decoded((line, line.decoded) for line in talk())
    ages = [line.split()[6] for line in model.final(0) if line.startswith("tty < status")]
    assert ages == ["0.0"]
