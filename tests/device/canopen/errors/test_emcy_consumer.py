from __future__ import annotations

from tests.device.canopen.objects import array, booted, write
from tickrig.device.canopen.errors import EmcyConsumer
from tickrig.wire.canopen.emcy import Emcy
from tickrig.wire.canopen.sdo_frame import AbortCode

OFF = 0x8000_0000
LOST = Emcy(0x8130, 0x11, b"\7\0\0\0\0")


def test_the_emcy_of_another_node_is_heard() -> None:
    bus = booted(array(0x1028, OFF, 0x82, OFF))
    consumer = EmcyConsumer.of(bus.slave)
    heard: list[tuple[int, Emcy]] = []
    consumer.on_emcy.append(lambda node_id, emcy: heard.append((node_id, emcy)))
    bus.step("082#3081110700000000", "083#3081110700000000")
    assert heard == [(2, LOST)]
    assert consumer.latest == {2: LOST}


def test_another_cob_id_is_heard_from_the_write_on() -> None:
    bus = booted(array(0x1028, OFF))
    assert write(bus, 0x1028, 0xC1, 1) is None
    bus.step("0C1#3081110700000000")
    assert EmcyConsumer.of(bus.slave).latest == {1: LOST}
    assert write(bus, 0x1028, 0xC2, 1) is AbortCode.VALUE_RANGE
    assert write(bus, 0x1028, OFF, 1) is None
    bus.step("0C1#0000000000000000")
    assert EmcyConsumer.of(bus.slave).latest == {1: LOST}


def test_what_is_no_emcy_is_ignored() -> None:
    bus = booted(array(0x1028, 0x81))
    bus.step("081#", "081#30811107000000", "081#R8")
    assert EmcyConsumer.of(bus.slave).latest == {}


def test_nothing_is_heard_in_stopped() -> None:
    bus = booted(array(0x1028, 0x81))
    bus.step("000#0205")
    bus.step("081#3081110700000000")
    assert EmcyConsumer.of(bus.slave).latest == {}


def test_a_reset_forgets_what_was_heard() -> None:
    bus = booted(array(0x1028, 0x81))
    bus.step("081#3081110700000000")
    bus.step("000#8205")
    assert EmcyConsumer.of(bus.slave).latest == {}


def test_sub_indices_may_be_missing() -> None:
    bus = booted(array(0x1028, OFF, OFF, 0x83)[3:])
    bus.step("083#3081110700000000")
    assert EmcyConsumer.of(bus.slave).latest == {3: LOST}
