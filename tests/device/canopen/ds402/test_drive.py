from __future__ import annotations

import pytest

from tests.device.canopen.profile_objects import DRIVE, make_dictionary
from tests.device.canopen.reference import I16, RW, U32
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary, SdoAbort
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.drive import DriveState
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.instant import NEVER

REACHED = 0x0400
BIT_12 = 0x1000
HOMING_ERROR = 0x2000


class Bench(Bus):
    def __init__(self, *added: EntryDescription) -> None:
        plain = make_dictionary([DRIVE])
        dictionary = Dictionary([*plain.description, *added], plain.objects)
        super().__init__(make_slave(dictionary, 5, application=Ds402))
        self.drive = Ds402.of(self.slave)
        self.step()

    def write(self, index: int, value: int) -> None:
        entry = self.slave.dictionary[index, 0]
        entry.download(entry.data_type.encode(value))

    def read(self, index: int) -> int:
        return self.slave.dictionary[index, 0].number

    def control(self, *controlwords: int) -> int:
        for controlword in controlwords:
            self.write(0x6040, controlword)
            self.step()
        return self.read(0x6041)

    def enable(self, mode: int) -> None:
        self.write(0x6060, mode)
        self.control(0x06, 0x07, 0x0F)
        assert self.drive.state is DriveState.OPERATION_ENABLED

    def settle(self) -> int:
        """Run until nothing is to be done any more; return for how many ms."""
        began_us = self.now_us
        while self.slave.due_us != NEVER:
            self.step()
            assert self.now_us < began_us + 60_000_000
        return (self.now_us - began_us) // 1_000


@pytest.fixture
def bench() -> Bench:
    return Bench()


SOD = DriveState.SWITCH_ON_DISABLED
READY = DriveState.READY_TO_SWITCH_ON
ON = DriveState.SWITCHED_ON
ENABLED = DriveState.OPERATION_ENABLED
QUICK_STOP = DriveState.QUICK_STOP_ACTIVE


@pytest.mark.parametrize(
    ("controlwords", "state"),
    [
        ([], SOD),
        ([0x06], READY),
        ([0x07], SOD),
        ([0x0F], SOD),
        ([0x06, 0x07], ON),
        ([0x06, 0x0F], ENABLED),
        ([0x06, 0x00], SOD),
        ([0x06, 0x02], SOD),
        ([0x06, 0x07, 0x0F], ENABLED),
        ([0x06, 0x07, 0x06], READY),
        ([0x06, 0x07, 0x00], SOD),
        ([0x06, 0x07, 0x02], SOD),
        ([0x06, 0x07, 0x0F, 0x07], ON),
        ([0x06, 0x07, 0x0F, 0x06], READY),
        ([0x06, 0x07, 0x0F, 0x00], SOD),
        ([0x06, 0x07, 0x0F, 0x02], SOD),
        ([0x06, 0x86], READY),
    ],
)
def test_the_controlword_moves_the_state(
    bench: Bench, controlwords: list[int], state: DriveState
) -> None:
    bench.control(*controlwords)
    bench.settle()
    assert bench.read(0x6041) & 0x6F == state


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("option", "state", "resumed"),
    [
        (0, SOD, SOD),
        (1, SOD, SOD),
        (2, SOD, SOD),
        (5, QUICK_STOP, ENABLED),
        (6, QUICK_STOP, ENABLED),
    ],
)
def test_quick_stop_ramps_down_and_stays_if_605ah_says_so(
    bench: Bench, option: int, state: DriveState, resumed: DriveState
) -> None:
    bench.write(0x605A, option)
    bench.write(0x60FF, 1_000)
    bench.enable(3)
    bench.run(200)
    assert bench.read(0x606C) == 1_000
    bench.control(0x02)
    assert bool(bench.read(0x606C)) == bool(option)
    bench.settle()
    assert (bench.drive.state, bench.read(0x606C)) == (state, 0)
    bench.control(0x0F)
    assert bench.drive.state is resumed


def test_a_quick_stop_that_does_not_stay_cannot_be_left(bench: Bench) -> None:
    bench.write(0x60FF, 10_000)
    bench.enable(3)
    bench.run(1_100)
    bench.control(0x02, 0x0F)
    assert bench.drive.state is QUICK_STOP


def test_a_fault_stops_at_once_and_needs_a_rising_edge(bench: Bench) -> None:
    bench.write(0x60FF, 1_000)
    bench.enable(3)
    bench.run(50)
    bench.drive.fault(0x2310)
    assert bench.step() == ["085#1023030000000000"]
    assert (bench.read(0x6041) & 0x4F, bench.read(0x606C)) == (0x08, 0)
    bench.control(0x06)
    assert bench.drive.state is DriveState.FAULT
    bench.write(0x6040, 0x80)
    assert bench.step() == ["085#0000000000000000"]
    assert bench.drive.state is SOD
    bench.drive.fault(0x7300)
    assert bench.step() == ["085#0073210000000000"]
    bench.drive.fault(0x2310)
    bench.control(0x81)
    assert bench.drive.state is DriveState.FAULT


def test_the_error_code_object_shows_the_fault() -> None:
    bench = Bench(EntryDescription(0x603F, 0, "Error code", U32, RW))
    bench.drive.fault(0x2310)
    assert bench.read(0x603F) == 0x2310
    bench.step()
    bench.control(0x80)
    assert bench.read(0x603F) == 0


@pytest.mark.parametrize(
    ("option", "state"),
    [(0, ENABLED), (1, DriveState.FAULT), (2, SOD), (3, SOD)],
)
def test_a_lost_connection_acts_as_6007h_says(bench: Bench, option: int, state: DriveState) -> None:
    bench.write(0x6007, option)
    bench.enable(3)
    bench.slave.communication_error()
    bench.settle()
    assert bench.drive.state is state


def test_a_lost_connection_does_nothing_without_power(bench: Bench) -> None:
    bench.slave.communication_error()
    bench.step()
    assert bench.drive.state is SOD


def test_nmt_stop_is_a_lost_connection(bench: Bench) -> None:
    bench.enable(3)
    bench.step("000#0105")
    assert bench.drive.state is ENABLED
    bench.step("000#0205")
    assert bench.drive.state is DriveState.FAULT


def test_a_reset_of_the_node_switches_off(bench: Bench) -> None:
    bench.write(0x60FF, 1_000)
    bench.enable(3)
    bench.run(10)
    bench.step("000#8105")
    assert (bench.drive.state, bench.read(0x606C), bench.read(0x6061)) == (SOD, 0, 0)


def test_profile_position_goes_there_and_tells(bench: Bench) -> None:
    bench.write(0x607A, 1_000)
    bench.enable(1)
    assert bench.read(0x6041) & (REACHED | BIT_12) == REACHED
    assert bench.control(0x1F) & (REACHED | BIT_12) == BIT_12
    assert bench.control(0x0F) & (REACHED | BIT_12) == 0
    assert 500 < bench.settle() < 1_000
    assert bench.read(0x6064) == 1_000
    assert bench.read(0x6041) & (REACHED | BIT_12) == REACHED


def test_a_second_set_point_waits_or_acts_at_once(bench: Bench) -> None:
    bench.write(0x607A, 100)
    bench.enable(1)
    bench.control(0x1F, 0x0F)
    bench.write(0x607A, -50)
    bench.control(0x1F, 0x0F)
    seen = []
    while bench.slave.due_us != NEVER:
        bench.step()
        seen.append(bench.read(0x6064))
    assert (max(seen), seen[-1]) == (100, -50)
    bench.write(0x607A, 1_000)
    bench.control(0x1F, 0x0F)
    bench.write(0x607A, -60)
    bench.control(0x3F, 0x0F)
    bench.settle()
    assert bench.read(0x6064) == -60


def test_a_relative_set_point_is_added(bench: Bench) -> None:
    bench.write(0x607A, 100)
    bench.enable(1)
    bench.control(0x5F, 0x0F)
    bench.settle()
    bench.control(0x5F, 0x0F)
    bench.settle()
    assert bench.read(0x6064) == 200


def test_halt_brakes_and_goes_on(bench: Bench) -> None:
    bench.write(0x607A, 1_000)
    bench.enable(1)
    bench.control(0x1F)
    bench.run(100)
    bench.control(0x11F)
    bench.settle()
    assert 0 < bench.read(0x6064) < 1_000
    bench.control(0x1F)
    bench.settle()
    assert bench.read(0x6064) == 1_000


def test_profile_velocity_ramps_and_halts(bench: Bench) -> None:
    bench.write(0x60FF, -500)
    bench.enable(3)
    assert bench.read(0x6041) & BIT_12 == 0
    bench.run(60)
    assert (bench.read(0x606C), bench.read(0x6041) & REACHED) == (-500, REACHED)
    bench.control(0x10F)
    bench.settle()
    assert (bench.read(0x606C), bench.read(0x6041) & BIT_12) == (0, BIT_12)


@pytest.mark.parametrize(
    ("method", "position", "bits"),
    [(35, 77, REACHED | BIT_12), (37, 77, REACHED | BIT_12)],
)
def test_homing_takes_the_present_position(
    bench: Bench, method: int, position: int, bits: int
) -> None:
    bench.write(0x6098, method)
    bench.write(0x607C, 77)
    bench.enable(6)
    assert bench.control(0x1F) & (REACHED | BIT_12 | HOMING_ERROR) == bits
    assert bench.control(0x0F) & (REACHED | BIT_12 | HOMING_ERROR) == bits
    assert bench.read(0x6064) == position


def test_cyclic_modes_follow_their_targets(bench: Bench) -> None:
    bench.enable(8)
    bench.write(0x607A, -5)
    bench.step()
    assert (bench.read(0x6064), bench.read(0x6041) & BIT_12) == (-5, BIT_12)
    bench.write(0x6060, 9)
    bench.write(0x60FF, 1_000)
    bench.run(10)
    assert (bench.read(0x6064), bench.read(0x606C), bench.read(0x6061)) == (4, 1_000, 9)


def test_an_unknown_mode_is_refused_and_never_taken(bench: Bench) -> None:
    with pytest.raises(SdoAbort, match="VALUE_RANGE"):
        bench.write(0x6060, 2)
    bench.write(0x6060, 8)
    bench.slave.dictionary[0x6060, 0].value = 2
    bench.step()
    assert bench.read(0x6061) == 8


def test_without_objects_the_drive_stays_off() -> None:
    bus = Bus(make_slave(make_dictionary([]), 5, application=Ds402))
    assert bus.step() == ["705#00"]
    assert Ds402.of(bus.slave).state is SOD


def test_a_value_that_an_object_cannot_hold_is_cut() -> None:
    bench = Bench(EntryDescription(0x6077, 0, "Torque actual value", I16, RW))
    bench.write(0x60FF, 2**31 - 1)
    bench.enable(9)
    bench.write(0x6060, 10)
    bench.drive.axis.reference.current_a = 1e6
    bench.drive.axis.motor.drive_current(1e6)
    bench.drive.actual_values.renew()
    assert bench.read(0x6077) == 2**15 - 1


def test_the_supported_modes_are_shown() -> None:
    bench = Bench(EntryDescription(0x6502, 0, "Supported drive modes", U32, RW))
    assert bench.read(0x6502) == 0x3ED


def test_the_modes_that_an_eds_lists_are_those_that_it_has() -> None:
    listed = EntryDescription(0x6502, 0, "Supported drive modes", U32, Access.READ, default=0b111)
    bench = Bench(listed)
    assert bench.read(0x6502) == 0b111  # mode 2 is listed, but no drive here has it
    bench.write(0x6060, 3)
    assert bench.read(0x6061) == 3
    for mode in (2, 4):
        with pytest.raises(SdoAbort, match="VALUE_RANGE"):
            bench.write(0x6060, mode)


def test_a_limit_switch_stops_a_plain_drive_without_a_fault(bench: Bench) -> None:
    bench.write(0x60FF, 1_000)
    bench.enable(3)
    bench.run(200)
    bench.drive.inputs.set("positive_limit_switch", 1)
    bench.run(20)
    assert (bench.drive.state, bench.read(0x606C)) == (ENABLED, 0)
    assert bench.read(0x6041) & 0x0800
    bench.write(0x60FF, -1_000)
    bench.run(200)
    assert bench.read(0x606C) == -1_000


def test_the_connection_may_be_lost_without_an_error(bench: Bench) -> None:
    bench.drive.emergency(0x8130, 0x11, b"")
    bench.drive.emergency_clear(0x8130, None)
    bench.enable(3)
    bench.slave.communication_error()
    bench.settle()
    bench.control(0x80)
    assert bench.drive.state is SOD


def test_without_power_a_drive_lets_go_and_sees_its_inputs(bench: Bench) -> None:
    bench.write(0x60FF, 1_000)
    bench.enable(3)
    bench.run(200)
    bench.drive.inputs.set("home_switch", 1)
    assert bench.drive.without_power(bench.now_us + 1_000) == NEVER
    assert bench.drive.without_power(bench.now_us + 2_000) == NEVER
    assert bench.drive.switches.home
