"""An infra-red reader on its line, tick by tick."""

from __future__ import annotations

from math import pi

import pytest

from tickrig.device.ucode_reader import MOST_RECEIVED, Marker, UcodeReader
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER
from tickrig.wire.ucode import UcodeLine, parse_line

DOOR = Marker("00001C00000000000001000000000001", 1.0, 0.0)
LIFT = Marker("00001C00000000000001000000000002", -2.0, 0.0)
MS = 1_000


class Line:
    """A reader and all that it said, as lines with the time in ms."""

    def __init__(self, *markers: Marker) -> None:
        self.reader = UcodeReader(markers=markers)
        self.now_ms, self.said = 0, list[tuple[int, str]]()

    def run(self, until_ms: int, sent: bytes = b"") -> list[str]:
        """Tick each ms; return what it said."""
        begin = len(self.said)
        while self.now_ms < until_ms:
            tx = self.reader.tick(self.now_ms * MS, sent)
            sent = b""
            self.said += [(self.now_ms, text(line)) for line in tx.splitlines()]
            self.now_ms += 1
        return [line for _, line in self.said[begin:]]


def text(line: bytes) -> str:
    parsed: UcodeLine = parse_line(line)
    return " ".join((parsed.type.value, *map(str, parsed.fields)))


@pytest.fixture
def line() -> Line:
    return Line(DOOR, LIFT)


def test_it_boots_tells_who_it_is_and_listens_in_rounds(line: Line) -> None:
    line.run(401)
    assert line.said == [
        (200, "UI 1 3000 90 1"),
        (300, f"UC 0 {DOOR.ucode} 67"),
        (300, "UR 0 1"),
        (400, f"UC 1 {DOOR.ucode} 67"),
        (400, "UR 1 1"),
    ]
    assert (line.reader.read("rounds"), line.reader.tick_us) == (2, MS)


def test_it_follows_the_body(line: Line) -> None:
    line.run(300)
    for name, value in (("x_m", -0.5), ("y_m", 0.0), ("heading_rad", pi)):
        line.reader.inputs.set(name, value)
    assert line.reader.read("in_view") == 1
    assert line.run(301) == [f"UC 0 {LIFT.ucode} 50", "UR 0 1"]
    line.reader.inputs.set("x_m", 100)
    assert line.run(401) == ["UR 1 0"]
    assert line.reader.read("received") == 0


def test_it_is_told_to_listen_or_not(line: Line) -> None:
    line.run(250)
    assert line.run(800, b"OFF\n") == ["UI 1 3000 90 0"]
    assert (line.reader.due_us, line.reader.read("listening")) == (NEVER, 0)
    assert line.run(801, b"ON\n") == ["UI 1 3000 90 1"]
    assert line.run(901)[-1] == "UR 0 1"
    assert line.run(902, b"ON\nID\r\n") == ["UI 1 3000 90 1", "UI 1 3000 90 1"]
    assert line.said[-3][0] == 900


def test_what_is_no_command_is_refused(line: Line) -> None:
    line.run(250)
    assert line.run(251, b"on\n\n\xff\n") == ["UE", "UE"]
    assert line.reader.read("refused") == 2


def test_what_comes_while_it_boots_is_lost(line: Line) -> None:
    assert line.run(200, b"OFF\n") == []
    assert line.run(201) == ["UI 1 3000 90 1"]


def test_a_dirty_window_takes_half_of_the_range(line: Line) -> None:
    line.reader.inputs.set("dirty_window", 1)
    assert line.run(301)[-1] == "UR 0 1"
    line.reader.inputs.set("x_m", -1)
    assert line.run(401)[-1] == "UR 1 0"


def test_sunlight_leaves_nothing_and_is_told(line: Line) -> None:
    line.reader.inputs.set("sunlight", 1)
    assert line.run(301)[-1] == "UL 0"
    assert line.reader.read("in_view") == 0


def test_a_marker_without_supply_is_not_received(line: Line) -> None:
    line.reader.inputs.set("dark_marker", 1)
    assert line.run(301)[-1] == "UR 0 0"
    line.reader.inputs.set("dark_marker", 2)
    assert line.run(401)[-1] == "UR 1 1"


def test_more_than_the_line_carries_are_left_out() -> None:
    many = Line(*(Marker(f"{number:032X}", 1 + number / 100, 0) for number in range(20)))
    said = many.run(301)
    assert (len(said), said[-1]) == (1 + MOST_RECEIVED + 1, f"UR 0 {MOST_RECEIVED}")
    assert many.reader.read("in_view") == 20


def test_without_supply_it_is_silent_and_forgets(line: Line) -> None:
    line.run(350)
    line.reader.inputs.set("power_cut", 1)
    assert line.reader.due_us == 0
    assert line.run(1_000, b"ID\n") == []
    assert (line.reader.due_us, line.reader.read("in_view")) == (NEVER, 0)
    line.reader.inputs.set("power_cut", 0)
    assert line.run(1_200, b"ID\n") == []
    assert line.run(1_301) == ["UI 1 3000 90 1", f"UC 0 {DOOR.ucode} 67", "UR 0 1"]


def test_a_cut_that_nobody_could_see_is_none(line: Line) -> None:
    line.run(250)
    line.reader.inputs.set("power_cut", 1)
    line.reader.inputs.set("power_cut", 0)
    assert line.reader.due_us == 300 * MS
    assert line.run(301)[-1] == "UR 0 1"


def test_reset_begins_again(line: Line) -> None:
    line.run(350)
    line.reader.reset()
    assert line.reader.due_us == 0
    line.run(351)
    assert line.run(651)[0] == "UI 1 3000 90 1"
    assert line.reader.read("rounds") == 1


def test_a_round_comes_after_65535_again(line: Line) -> None:
    line.run(299)
    line.reader._round = 65_535
    assert line.run(401)[-3:] == ["UR 65535 1", f"UC 0 {DOOR.ucode} 67", "UR 0 1"]


def test_there_is_no_other_output(line: Line) -> None:
    assert set(line.reader.outputs) == {"listening", "in_view", "received", "rounds", "refused"}
    with pytest.raises(KeyError):
        line.reader.read("nope")


def test_a_line_that_is_too_long_is_no_command(line: Line) -> None:
    line.run(250)
    assert line.run(251, b"X" * 200 + b"\n") == ["UE"] * 4


def test_its_lines_have_sums(line: Line) -> None:
    with pytest.raises(WireError):
        parse_line(line.reader.tick(0, b"") + b"$UR,1,1*0000")
