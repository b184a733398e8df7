from __future__ import annotations

import pytest

from tests.device.canopen.profile_objects import GENERIC_IO, make_dictionary
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds401.digital import FILTER_US
from tickrig.device.canopen.slave import Application
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.instant import NEVER


class Bench(Bus):
    def __init__(self) -> None:
        super().__init__(make_slave(make_dictionary([GENERIC_IO]), 5, application=Ds401))
        self.module = Ds401.of(self.slave)
        self.step()

    def write(self, index: int, sub: int, value: int) -> None:
        entry = self.slave.dictionary[index, sub]
        entry.download(entry.data_type.encode(value))

    def read(self, index: int, sub: int) -> object:
        return self.slave.dictionary[index, sub].value

    def digital(self, level: int) -> list[str]:
        for bit in range(8):
            self.module.inputs.set(f"di{bit + 1}", level >> bit & 1)
        return self.step()

    def analogue(self, level: int) -> list[str]:
        self.module.inputs.set("ai1", level)
        return self.step()

    @property
    def output(self) -> int:
        return int(self.module.read("do")) & 0xFF

    @property
    def analogue_output(self) -> float:
        return self.module.read("ao1")


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def running(bench: Bench) -> Bench:
    assert bench.step("000#0105") == ["185#0000", "285#0000000000000000"]
    return bench


def test_by_default_each_change_of_a_line_is_sent(running: Bench) -> None:
    assert running.digital(0x01) == ["185#0100"]
    assert running.digital(0x01) == []
    assert running.digital(0x00) == ["185#0000"]


def test_only_masked_edges_are_sent(running: Bench) -> None:
    running.write(0x6006, 1, 0)
    running.write(0x6007, 1, 0x01)
    running.write(0x6008, 1, 0x02)
    assert running.digital(0x01) == ["185#0100"]
    assert running.digital(0x02) == []
    assert running.digital(0x00) == ["185#0000"]
    assert running.read(0x6000, 1) == 0


def test_6005h_disables_all_digital_interrupts(running: Bench) -> None:
    running.write(0x6005, 0, 0)
    assert running.digital(0xFF) == []
    assert running.read(0x6000, 1) == 0xFF


def test_polarity_acts_when_it_is_written(bench: Bench) -> None:
    bench.digital(0x0F)
    bench.write(0x6002, 1, 0xFF)
    bench.step()
    assert bench.read(0x6000, 1) == 0xF0


def test_a_filtered_line_must_be_stable(running: Bench) -> None:
    running.write(0x6003, 1, 0x01)
    assert running.digital(0x03) == ["185#0200"]
    assert running.digital(0x02) == []
    assert running.digital(0x03) == []
    assert running.run(FILTER_US // 1_000 - 1) == []
    assert running.step() == ["185#0300"]
    assert running.slave.due_us == NEVER


def test_analogue_changes_are_sent_only_if_6423h_says_so(running: Bench) -> None:
    assert running.analogue(100) == []
    assert running.read(0x6401, 1) == 100
    running.write(0x6423, 0, 1)
    assert running.analogue(101) == ["285#6500000000000000"]
    assert running.analogue(101) == []


def test_an_analogue_event_waits_for_6423h(running: Bench) -> None:
    assert running.analogue(100) == []
    running.write(0x6423, 0, 1)
    assert running.step() == ["285#6400000000000000"]


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("trigger", "objects", "quiet", "loud"),
    [
        (1, {0x6424: 1000}, 999, 1000),
        (2, {0x6425: -100}, -100, -101),
        (4, {0x6426: 10}, -10, 11),
        (8, {0x6427: 10}, 50, -11),
        (16, {0x6428: 10}, -50, 11),
        (5, {0x6424: 100, 0x6426: 150}, 99, 100),
        (5, {0x6424: 1000, 0x6426: 150}, 150, 151),
        (0x40, {}, 0, 0),
    ],
)
def test_triggers_select_what_is_sent(
    running: Bench, trigger: int, objects: dict[int, int], quiet: int, loud: int
) -> None:
    running.write(0x6423, 0, 1)
    running.write(0x6421, 1, trigger)
    for index, value in objects.items():
        running.write(index, 1, value)
    assert running.analogue(quiet) == []
    assert bool(running.analogue(loud)) == (loud != 0)


def test_without_trigger_nothing_is_sent(running: Bench) -> None:
    running.write(0x6423, 0, 1)
    running.write(0x6421, 1, 0)
    assert running.analogue(5) == []


def test_an_rpdo_puts_out_with_polarity_and_mask(running: Bench) -> None:
    running.write(0x6202, 1, 0x0F)
    running.write(0x6208, 1, 0x3F)
    running.step("205#5A00")
    assert running.output == (0x5A ^ 0x0F) & 0x3F


def test_analogue_outputs_are_put_out(running: Bench) -> None:
    running.step("305#9CFF000000000000")
    assert running.analogue_output == -100


def test_stop_puts_error_values_out_and_start_takes_them_back(running: Bench) -> None:
    running.write(0x6206, 1, 0x0F)
    running.write(0x6207, 1, 0x33)
    running.write(0x6444, 1, 100_000)
    running.write(0x6443, 2, 0)
    running.step("205#5A00", "305#0100020000000000")
    running.step("000#0205")
    assert running.output == 0x53
    assert [running.module.read(name) for name in ("ao1", "ao2")] == [32767, 2]
    running.step("000#0105")
    assert (running.output, running.analogue_output) == (0x5A, 1)


def test_a_new_value_takes_an_output_out_of_its_error_value(running: Bench) -> None:
    running.write(0x6207, 1, 0x33)
    running.step("205#5A00")
    running.slave.communication_error()
    running.step()
    assert running.output == 0x33
    running.write(0x6200, 1, 0x11)
    running.step()
    assert running.output == 0x11


def test_pre_operational_keeps_the_outputs(running: Bench) -> None:
    running.step("205#5A00")
    running.step("000#8005")
    assert running.output == 0x5A


def test_a_module_of_inputs_alone_has_no_outputs() -> None:
    plain = make_dictionary([])
    entries = [
        entry for entry in plain.description if entry.index < 0x6000 and entry.index != 0x2000
    ]
    bus = Bus(make_slave(Dictionary(entries), 5, application=Ds401))
    assert bus.step() == ["705#00"]
    assert bus.slave.due_us == NEVER


def test_a_device_without_application_does_nothing() -> None:
    bus = Bus(make_slave(make_dictionary([]), 5))
    bus.step()
    Application.of(bus.slave).request()
    assert bus.step() == []
