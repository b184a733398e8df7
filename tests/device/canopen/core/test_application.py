from __future__ import annotations

import pytest

from tests.device.canopen.objects import u8
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.models import f_palette
from tickrig.device.canopen.slave import Application, number_of
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.instant import NEVER


class Recorder(Application):
    """Notes when it is executed."""

    def start(self) -> None:
        self.executed: list[int] = []

    def on_execute(self, now_us: int) -> None:
        self.executed.append(now_us)


def test_it_is_executed_when_an_object_that_it_watches_has_changed() -> None:
    bus = Bus(make_slave(Dictionary([*u8(0x2000), *u8(0x2001)]), 5, application=Recorder))
    recorder = Recorder.of(bus.slave)
    recorder.watch([bus.slave.dictionary[0x2000, 0]])
    bus.run(3)
    recorder.executed.clear()
    bus.step("605#2F00200001000000")
    bus.step("605#2F01200001000000")
    bus.run(3)
    assert recorder.executed == [4_000]


def test_a_device_without_inputs_and_moving_parts_needs_nothing_without_power() -> None:
    application = Application.of(make_slave(Dictionary([]), 5, application=Application))
    with pytest.raises(ValueError, match="di1"):
        application.inputs.set("di1", 1)
    assert application.without_power(1_000) == NEVER


def test_an_object_that_the_device_does_not_have_gives_the_default() -> None:
    dictionary = Dictionary(u8(0x2000, 7))
    assert number_of(dictionary.find(0x2000), 1) == 7
    assert number_of(dictionary.find(0x2001), 1) == 1


def test_a_device_without_outputs_knows_none() -> None:
    slave = make_slave(f_palette.dictionary(), 16, application=Application)
    application = Application.of(slave)
    assert application.outputs == {}
    with pytest.raises(KeyError, match="do1"):
        application.read("do1")
