from __future__ import annotations

import sys
from collections.abc import Collection
from pathlib import Path

import pytest

from tickrig.device.canopen.models.f_palette import ADC
from tickrig.host.canmon.conform.stimulus import (
    CommandStimulus,
    LinearConverter,
    SignalStimulus,
    open_stimulus,
)
from tickrig.host.canopen.conform.bus.exchange import Disturbed, NotAllowed
from tickrig.host.control.client import ControlRefused
from tickrig.host.text.values import Setting


def command(tmp_path: Path, program: str) -> CommandStimulus:
    path = tmp_path / "stimulus.py"
    path.write_text(program)
    found = open_stimulus(f"{sys.executable} '{path}'")
    assert isinstance(found, CommandStimulus)
    return found


def test_a_command_gets_the_words_and_its_first_line_is_the_answer(tmp_path: Path) -> None:
    stimulus = command(tmp_path, "import sys; print(sys.argv[1:]); print('more')")
    assert stimulus("output", "6200:01; rm -rf $HOME") == "['output', '6200:01; rm -rf $HOME']"


@pytest.mark.parametrize(
    ("program", "why"),
    [
        ("import sys; sys.exit('no \\x1b[2J relay')", "exit status 1: no ␛[2J relay"),
        ("import sys; sys.exit(7)", "exit status 7"),
    ],
)
def test_a_command_that_fails_disturbs_the_check(tmp_path: Path, program: str, why: str) -> None:
    with pytest.raises(Disturbed, match="power off: "):
        command(tmp_path, program)("power", "off")
    with pytest.raises(Disturbed) as caught:
        command(tmp_path, program)("power", "off")
    assert str(caught.value).endswith(why)


class Board(SignalStimulus):
    """A device with an input, an object and a supply."""

    def __init__(self) -> None:
        self.values: dict[str, Setting] = {
            "0x2000:1": 0,
            "0x2007": "short",
            "di1": 0,
            "di2": 0,
            "ai1_v": 0,
            "do": 0x5A,
            "emergency": 0,
        }
        self.units = {"0x2000:1": "UNSIGNED16", "0x2007": "VISIBLE_STRING", "ai1_v": "V"}
        self.on = True

    def set(self, name: str, value: Setting) -> None:
        if name not in self.values:
            raise ControlRefused(f"no input {name}")
        if isinstance(value, str) != isinstance(self.values[name], str):
            raise ControlRefused(f"{name} takes something else")
        self.values[name] = value

    def get(self, name: str) -> Setting:
        return self.values[name]

    def names(self) -> Collection[str]:
        return self.values.keys()

    def unit(self, name: str) -> str:
        return self.units.get(name, "")

    def span(self, name: str) -> LinearConverter | None:
        return LinearConverter(ADC.low, ADC.high, *ADC.span) if name == "ai1_v" else None

    def switch(self, *, on: bool) -> None:
        self.on = on


def test_objects_are_set_and_read_as_they_go_over_the_bus() -> None:
    board = Board()
    board("input", "2000:01", "3412")
    assert board.values["0x2000:1"] == 0x1234
    assert board("output", "2000:01") == "3412"
    assert board("output", "2007:00") == b"short".hex().upper()


def test_lines_of_a_module_are_set_eight_at_once() -> None:
    board = Board()
    board("input", "di1", "03")
    assert (board.values["di1"], board.values["di2"]) == (1, 1)
    board("input", "6000:01", "02")
    assert (board.values["di1"], board.values["di2"]) == (0, 1)
    with pytest.raises(NotAllowed, match="the device has no input di3"):
        board("input", "di1", "0F")
    assert board("output", "do1") == "5A"


@pytest.mark.parametrize("words", [("input", "ai1", "1000"), ("input", "6401:01", "E803")])
def test_counts_of_an_input_are_what_its_converter_makes(words: tuple[str, ...]) -> None:
    board = Board()
    board(*words)
    assert ADC.counts(float(board.values["ai1_v"])) == 1_000


def test_all_that_a_converter_makes_can_be_set() -> None:
    board = Board()
    for counts in range(0, 4_096 * 8, 8):
        board("input", "ai1", str(counts))
        assert ADC.counts(float(board.values["ai1_v"])) == counts


@pytest.mark.parametrize("counts", ["999", "-8", "32768"])
def test_counts_that_a_converter_never_makes_are_not_applicable(counts: str) -> None:
    with pytest.raises(NotAllowed, match=f"converter of ai1_v has no step of {counts} counts"):
        Board()("input", "ai1", counts)


def test_counts_that_nobody_tells_are_inconclusive() -> None:
    board = Board()
    board.values["ai2_v"] = 0
    with pytest.raises(Disturbed, match="ai2_v takes , and its counts are not known here"):
        board("input", "ai2", "1000")


def test_emergencies_and_the_supply_have_words_of_their_own() -> None:
    board = Board()
    board("emergency", "5000", "01")
    assert board.values["emergency"] == 0x5000
    with pytest.raises(NotAllowed, match="a second error at once"):
        board("emergency", "3100", "01")
    board("emergency-clear", "5000")
    assert board.values["emergency"] == 0
    board("power", "off")
    assert not board.on
    board("power", "on")
    assert board.on


@pytest.mark.parametrize(
    "words",
    [
        ("input", "7000:01", "01"),
        ("input", "ai2", "1000"),
        ("output", "nosuch"),
        ("power", "half"),
        ("node-id", "FF"),
    ],
)
def test_what_a_device_has_not_is_not_applicable(words: tuple[str, ...]) -> None:
    with pytest.raises(NotAllowed, match=" ".join(words)):
        Board()(*words)


def test_what_a_device_does_not_do_disturbs_the_check() -> None:
    with pytest.raises(Disturbed, match="input 6000:01 x"):
        Board()("input", "6000:01", "x")
    with pytest.raises(Disturbed, match="do takes something else"):
        Board()("input", "do", "high")


def test_a_command_says_that_it_has_no_such_input(tmp_path: Path) -> None:
    with pytest.raises(NotAllowed, match="has nothing of the kind"):
        command(tmp_path, "import sys; sys.exit(77)")("node-id", "FF")
