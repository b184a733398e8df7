"""The f-palette: its object table (decision K22) and the potentiometer of Fig. 120."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.models import f_palette
from tickrig.device.canopen.slave import Application
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.eds.object_table import Access

GOLDEN = Path(__file__).parents[3] / "golden" / "fig120_pot.json"
POTENTIOMETER = json.loads(GOLDEN.read_text())["fig120_pot"]

TABLE: dict[tuple[int, int], tuple[str, int]] = {
    (0x1000, 0): ("ro", 0x0007_0191),
    (0x1005, 0): ("rw", 0x80),
    (0x1014, 0): ("rw", 0x90),
    (0x1017, 0): ("rw", 0),
    (0x1018, 1): ("ro", 0),
    (0x1029, 1): ("rw", 0),
    (0x1200, 1): ("ro", 0x610),
    (0x1400, 1): ("rw", 0x210),
    (0x1400, 2): ("rw", 255),
    (0x1600, 1): ("rw", 0x6200_0108),
    (0x1800, 1): ("rw", 0x190),
    (0x1800, 2): ("rw", 255),
    (0x1A00, 1): ("rw", 0x6000_0108),
    (0x1801, 1): ("rw", 0x290),
    (0x1A01, 4): ("rw", 0x6401_0410),
    (0x1802, 1): ("rw", 0x390),
    (0x1A02, 0): ("rw", 4),
    (0x1A02, 1): ("rw", 0x6401_0510),
    (0x2000, 0): ("const", 5_000),
    (0x6000, 1): ("ro", 0),
    (0x6002, 1): ("rw", 0),
    (0x6003, 1): ("rw", 0),
    (0x6005, 0): ("rw", 1),
    (0x6006, 1): ("rw", 0xFF),
    (0x6007, 1): ("rw", 0),
    (0x6008, 1): ("rw", 0),
    (0x6200, 1): ("rw", 0),
    (0x6202, 1): ("rw", 0),
    (0x6206, 1): ("rw", 0xFF),
    (0x6207, 1): ("rw", 0),
    (0x6208, 1): ("rw", 0xFF),
    (0x6401, 8): ("ro", 0),
    (0x6421, 8): ("rw", 7),
    (0x6422, 1): ("ro", 0),
    (0x6423, 0): ("rw", 0),
    (0x6424, 8): ("rw", 0),
    (0x6425, 8): ("rw", 0),
    (0x6426, 8): ("rw", 0),
    (0x6427, 8): ("rw", 0),
    (0x6428, 8): ("rw", 0),
}


class Palette(Bus):
    """A palette after boot."""

    def __init__(self) -> None:
        make = f_palette.make_application
        slave = make_slave(f_palette.dictionary(), f_palette.NODE_ID, application=make)
        super().__init__(slave)
        assert self.step() == ["710#00"]
        self.inputs = Application.of(slave).inputs

    def turn(self, volt: float) -> list[str]:
        """Turn the potentiometer and run a tick."""
        self.inputs.set("ai1_v", volt)
        return self.step()


@pytest.fixture
def palette() -> Palette:
    return Palette()


@pytest.fixture
def linked(palette: Palette) -> Palette:
    """Return a palette set up as for Fig. 120, running, 1 s after its start."""
    writes = [
        "2301180190020080",
        "2F011A0000000000",
        "23011A0110010164",
        "2F011A0001000000",
        "2B01180364000000",
        "2B01180532000000",
        "2326640108000000",
        "2F23640001000000",
        "2301180190020000",
    ]
    for write in writes:
        assert palette.step(f"610#{write}")[0].startswith("590#60")
    palette.step("000#0110")
    palette.run(999)
    return palette


@pytest.mark.unmeasured
@pytest.mark.parametrize("at", TABLE, ids=lambda at: f"{at[0]:04X}h:{at[1]:02X}")
def test_the_objects_are_those_of_its_table(palette: Palette, at: tuple[int, int]) -> None:
    entry, (access, default) = palette.slave.dictionary[at], TABLE[at]
    assert entry.value == default
    assert (Access.WRITE in entry.description.access) == (access == "rw")


def test_it_says_its_name(palette: Palette) -> None:
    assert palette.slave.dictionary[0x1008, 0].value == "f-palette"


@pytest.mark.parametrize("row", POTENTIOMETER, ids=lambda row: f"{row['volt']}V")
def test_the_potentiometer_sends_the_value_of_the_table(
    linked: Palette, row: dict[str, float | str]
) -> None:
    linked.turn(0.1)
    linked.run(60)
    volt, frame = float(row["volt"]), str(row["tpdo2_290"]).replace(" ", "")
    sent = [*linked.turn(volt), *linked.run(10)]
    assert f"290#{frame}" in sent
    assert linked.slave.dictionary[0x6401, 1].value == row["ai16"]
    assert f_palette.ADC.counts(volt) >> 3 == row["adc12"]


def test_a_wobble_of_one_step_is_sent_by_the_event_timer_alone(linked: Palette) -> None:
    linked.turn(2.5)
    linked.run(200)
    wobble = [
        frame for _ in range(50) for volt in (2.5 + 5 / 4095, 2.5) for frame in linked.turn(volt)
    ]
    assert len(wobble) == 2  # 100 ms, each 50 ms one


def test_two_steps_are_sent_at_once(linked: Palette) -> None:
    linked.turn(2.5)
    linked.run(75)
    assert linked.turn(2.5 + 10 / 4095) == ["290#1040"]


def test_a_step_is_sent_in_the_same_tick(linked: Palette) -> None:
    linked.run(20)
    assert linked.turn(2.5) == ["290#0040"]


def test_a_stopped_palette_sends_no_values(linked: Palette) -> None:
    linked.step("000#0210")
    assert [*linked.turn(5.0), *linked.run(200)] == []


def test_eight_lines_go_in_and_out(palette: Palette) -> None:
    palette.step("000#0110")
    for line, level in zip(palette.inputs.groups["di"], (1, 0, 1, 0, 0, 1, 0, 1), strict=True):
        palette.inputs.set(line, level)
    assert palette.step() == ["190#A5"]
    palette.step("210#5A")
    assert Application.of(palette.slave).read("do") == 0x5A


@pytest.mark.parametrize("volt", [-0.1, 5.1])
def test_voltages_are_those_of_the_converter(palette: Palette, volt: float) -> None:
    with pytest.raises(ValueError, match=r"not in 0\.0\.\.5\.0 V"):
        palette.turn(volt)
