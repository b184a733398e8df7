from __future__ import annotations

import pytest

from tests.device.canopen.objects import U8, array, booted, errors, write
from tests.device.canopen.slave_bench import Bus
from tickrig.wire.can import ErrorState
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode

PASSIVE = "085#2081110000000000"
RECOVERED = "085#4081110000000000"
CLEAR = "085#0000000000000000"


def bus_with(behaviour: int) -> Bus:
    return booted(errors(), array(0x1016, 0x0007_00C8), array(0x1029, behaviour, kind=U8))


@pytest.mark.parametrize(
    ("behaviour", "before", "after"),
    [
        (0, "01", NmtState.PRE_OPERATIONAL),
        (0, "80", NmtState.PRE_OPERATIONAL),
        (0, "02", NmtState.STOPPED),
        (1, "01", NmtState.OPERATIONAL),
        (1, "80", NmtState.PRE_OPERATIONAL),
        (2, "01", NmtState.STOPPED),
        (2, "80", NmtState.STOPPED),
        (2, "02", NmtState.STOPPED),
    ],
)
def test_a_lost_heartbeat_changes_the_state(behaviour: int, before: str, after: NmtState) -> None:
    bus = bus_with(behaviour)
    bus.step(f"000#{before}05", "707#05")
    bus.run(200)
    assert bus.slave.state is after


def test_without_1029h_operational_becomes_pre_operational() -> None:
    bus = booted()
    bus.step("000#0105")
    bus.slave.communication_error()
    bus.step()
    assert bus.slave.state is NmtState.PRE_OPERATIONAL


def test_the_emcy_is_sent_before_the_slave_is_stopped() -> None:
    bus = bus_with(2)
    bus.step("707#05")
    assert bus.run(200) == ["085#3081110700000000"]
    assert bus.slave.state is NmtState.STOPPED


@pytest.mark.parametrize("value", [0, 1, 2])
def test_a_behaviour_may_be_written(value: int) -> None:
    assert write(bus_with(0), 0x1029, value, 1) is None


@pytest.mark.parametrize("value", [3, 127, 128, 255])
def test_an_unknown_behaviour_is_refused(value: int) -> None:
    assert write(bus_with(0), 0x1029, value, 1) is AbortCode.VALUE_RANGE


def test_bus_off_is_a_communication_error() -> None:
    bus = bus_with(2)
    bus.slave.bus_state(ErrorState.BUS_OFF)
    bus.step()
    assert bus.slave.state is NmtState.STOPPED


def test_the_end_of_bus_off_is_told() -> None:
    bus = bus_with(1)
    bus.slave.bus_state(ErrorState.BUS_OFF)
    assert bus.run(10) == []
    bus.slave.bus_state(ErrorState.ACTIVE)
    assert bus.run(10) == [RECOVERED, CLEAR]


def test_error_passive_is_told_until_it_is_over() -> None:
    bus = bus_with(1)
    bus.slave.bus_state(ErrorState.PASSIVE)
    bus.slave.bus_state(ErrorState.PASSIVE)
    assert bus.run(10) == [PASSIVE]
    bus.slave.bus_state(ErrorState.ACTIVE)
    assert bus.run(10) == [CLEAR]


def test_error_passive_is_told_anew_after_a_reset() -> None:
    bus = bus_with(1)
    bus.slave.bus_state(ErrorState.PASSIVE)
    bus.step()
    assert bus.step("000#8205") == ["705#00"]
    assert bus.run(10) == [PASSIVE]
    bus.slave.reset()
    assert bus.run(10) == ["705#00"]


def test_bus_off_ends_error_passive() -> None:
    bus = bus_with(1)
    bus.slave.bus_state(ErrorState.PASSIVE)
    assert bus.step() == [PASSIVE]
    bus.slave.bus_state(ErrorState.BUS_OFF)
    assert bus.run(10) == []
    bus.slave.bus_state(ErrorState.ACTIVE)
    assert bus.run(10) == [RECOVERED, "085#0000110000000000", CLEAR]
