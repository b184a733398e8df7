from __future__ import annotations

import pytest

from tests.device.canopen.objects import U8, array, booted, errors, u8, u16, write
from tickrig.wire.canopen.nmt import NmtState

LOST = "085#3081110000000000"
BACK = "085#0000000000000000"


def test_a_request_is_answered_with_state_and_toggle() -> None:
    bus = booted(u16(0x100C))
    assert bus.step("705#R1") == ["705#7F"]
    assert bus.step("705#R") == ["705#FF"]
    assert bus.step("705#R1") == ["705#7F"]


def test_the_toggle_goes_on_when_the_state_changes() -> None:
    bus = booted(u16(0x100C))
    assert bus.step("705#R1", "000#0105", "705#R1") == ["705#7F", "705#85"]
    assert bus.step("000#0205", "705#R1") == ["705#04"]


def test_the_toggle_changes_no_bit_of_the_state() -> None:
    bus = booted(u16(0x100C))
    bus.step("000#0205", "705#R1")
    assert bus.step("705#R1") == ["705#84"]


def test_reset_communication_resets_the_toggle() -> None:
    bus = booted(u16(0x100C))
    bus.step("705#R1")
    bus.step("000#8205")
    assert bus.step("705#R1") == ["705#7F"]


def test_without_guard_time_or_for_another_node_there_is_no_answer() -> None:
    assert booted().step("705#R1") == []
    assert booted(u16(0x100C)).step("706#R1", "705#7F") == []


def test_the_heartbeat_has_priority() -> None:
    bus = booted(u16(0x100C), u16(0x1017))
    assert bus.step("705#R1") == ["705#7F"]
    write(bus, 0x1017, 1000)
    assert bus.step("705#R1") == []
    write(bus, 0x1017, 0)
    assert bus.step("705#R1") == ["705#FF"]


def test_the_shortest_heartbeat_time_has_priority() -> None:
    bus = booted(u16(0x100C), u16(0x1017))
    write(bus, 0x1017, 1)
    assert bus.step("705#R1") == []


def test_life_guarding_begins_with_the_first_request() -> None:
    bus = booted(errors(), u16(0x100C, 100), u8(0x100D, 2))
    assert bus.run(500) == []
    bus.step("705#R1")
    assert bus.run(199) == []
    assert bus.step() == [LOST]
    assert bus.run(500) == []
    assert bus.step("705#R1") == [BACK, "705#FF"]
    assert bus.run(200) == [LOST]


def test_requests_in_time_are_no_error() -> None:
    bus = booted(errors(), u16(0x100C, 100), u8(0x100D, 2))
    for _ in range(10):
        assert len(bus.step("705#R1")) == 1
        assert bus.run(199) == []


def test_a_heartbeat_ends_life_guarding() -> None:
    bus = booted(errors(), u16(0x100C, 100), u8(0x100D, 2), u16(0x1017))
    bus.step("705#R1")
    write(bus, 0x1017, 1000)
    assert bus.run(500) == []


def test_another_life_time_waits_for_the_next_request() -> None:
    bus = booted(errors(), u16(0x100C, 100), u8(0x100D, 2))
    bus.step("705#R1")
    assert bus.run(200) == [LOST]
    write(bus, 0x100D, 3)
    assert bus.run(500) == [BACK]
    bus.step("705#R1")
    assert bus.run(299) == []
    assert bus.step() == [LOST]


def test_a_life_time_of_nothing_is_not_watched() -> None:
    bus = booted(errors(), u16(0x100C, 100), u8(0x100D, 0))
    bus.step("705#R1")
    assert bus.run(500) == []


def test_without_a_life_time_factor_no_request_is_late() -> None:
    bus = booted(errors(), u16(0x100C, 100))
    bus.step("705#R1")
    assert bus.run(500) == []


@pytest.mark.parametrize(
    ("behaviour", "state"),
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
def test_a_late_request_is_a_communication_error(behaviour: int, state: NmtState) -> None:
    guarded = u16(0x100C, 100), u8(0x100D, 2)
    bus = booted(errors(), *guarded, array(0x1029, behaviour, kind=U8))
    bus.step("000#0105", "705#R1")
    assert bus.run(200) == [LOST]
    assert bus.slave.state is state
