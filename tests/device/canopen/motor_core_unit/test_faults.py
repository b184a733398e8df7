"""Each fault from its physical cause to the EMCY, and back."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.device.canopen.motor_core_unit.bench import (
    ANGLE,
    CURRENT,
    FAULT,
    FREE,
    LIMITED,
    ON,
    PRE_OPERATIONAL,
    REACHED,
    RESET,
    START,
    VELOCITY,
    UnitBench,
)

WARM_C = 107
"""Air in which 15 Nm are too much for the winding, and 30 Nm at once are given less."""

CONTINUOUS, PEAK = 5_461, 10_922
"""References for 15 Nm and 30 Nm in current mode: 1.67 A and 3.33 A of 10 A."""


def cause_short_circuit(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 8_192)
    bench.pass_ms(200)
    bench.set("short_circuit", 1)
    bench.pass_ms(1)


def cause_under_voltage(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 8_192)
    bench.set("supply_v", 9.9)
    bench.pass_ms(6)


def cause_over_voltage(bench: UnitBench) -> None:
    bench.set("supply_v", 66.1)
    bench.pass_ms(1)


def cause_hot_housing(bench: UnitBench) -> None:
    bench.set("ambient_c", 115)
    bench.pass_ms(3_600_000)


def cause_hot_winding(bench: UnitBench) -> None:
    bench.set("ambient_c", WARM_C)
    bench.pass_ms(7_200_000)
    bench.set("shaft_blocked", 1)
    bench.begin(CURRENT, CONTINUOUS)
    bench.pass_ms(60_000)


def cause_encoder_loss(bench: UnitBench) -> None:
    bench.begin(ANGLE, 0)
    bench.set("encoder_unplugged", 1)
    bench.pass_ms(500)
    assert bench.emergencies == []  # it shows when the shaft turns
    bench.refer(16_384)
    bench.pass_ms(100)


def cause_open_phase(bench: UnitBench) -> None:
    bench.begin(ANGLE, 0)
    bench.set("motor_phase_open", 1)
    bench.refer(16_384)
    bench.pass_ms(200)


def cause_stall(bench: UnitBench) -> None:
    bench.begin(ANGLE, 16_384)
    bench.pass_ms(100)
    bench.set("shaft_blocked", 1)
    bench.pass_ms(700)


def cause_overload(bench: UnitBench) -> None:
    bench.begin(ANGLE, 0)
    bench.set("shaft_load_nm", -29)
    bench.pass_ms(6_000)


def cure(bench: UnitBench) -> None:
    """Let the world be as it was."""
    for item in bench.unit.inputs.table.values():
        bench.set(item.name, item.initial)
    bench.pass_ms(3_600_000)


FAULTS = [
    (cause_short_circuit, "202303", "short circuit"),
    (cause_under_voltage, "203205", "under-voltage"),
    (cause_over_voltage, "103205", "over-voltage"),
    (cause_hot_housing, "104209", "over-temperature of the housing"),
    (cause_hot_winding, "104309", "over-temperature of the motor"),
    (cause_encoder_loss, "057321", "motor encoder"),
    (cause_open_phase, "227121", "motor commutation"),
    (cause_stall, "217121", "motor blocked"),
    (cause_overload, "102303", "continuous over-current"),
]
"""Cause, EMCY with its error register, what the observer reads."""


@pytest.mark.unmeasured
@pytest.mark.parametrize(("cause", "emcy", "name"), FAULTS)
def test_a_fault_takes_the_power_off_and_is_told(
    bench: UnitBench, cause: Callable[[UnitBench], None], emcy: str, name: str
) -> None:
    cause(bench)
    assert bench.emergencies == [emcy]
    assert (bench.status, bench.unit.read("status")) == (FAULT, name)
    assert bench.read(0x1001) == int(emcy[4:], 16)
    assert bench.read(0x1003, 1) == int.from_bytes(bytes.fromhex(emcy[:4]), "little")
    bench.pass_ms(10)
    assert bench.see("current_a") == 0
    assert bench.emergencies == [emcy]


@pytest.mark.unmeasured
@pytest.mark.parametrize(("cause", "emcy", "name"), FAULTS)
def test_a_fault_whose_cause_is_gone_is_cleared_by_a_write_to_the_mode(
    bench: UnitBench, cause: Callable[[UnitBench], None], emcy: str, name: str
) -> None:
    cause(bench)
    cure(bench)
    assert bench.status == FAULT
    bench.send(START)
    bench.write(0x2000, ANGLE)
    bench.pass_ms(2)
    assert bench.emergencies == [emcy, "000000"]
    bench.refer(8_192)
    bench.pass_ms(3_000)
    assert bench.status == ON | REACHED
    assert bench.read(0x6401, 1) == pytest.approx(8_192, abs=2)
    assert (bench.read(0x1001), bench.emergencies) == (0, [emcy, "000000"])


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "cause", [cause_under_voltage, cause_over_voltage, cause_hot_housing, cause_hot_winding]
)
def test_a_fault_whose_cause_is_seen_cannot_be_cleared(
    bench: UnitBench, cause: Callable[[UnitBench], None]
) -> None:
    cause(bench)
    told = bench.emergencies
    bench.write(0x2000, FREE)
    bench.pass_ms(20)
    assert (bench.status, bench.emergencies) == (FAULT, told)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("cause", "emcy"),
    [(cause_short_circuit, "202303"), (cause_stall, "217121"), (cause_open_phase, "227121")],
)
def test_a_fault_that_shows_only_under_power_comes_back(
    bench: UnitBench, cause: Callable[[UnitBench], None], emcy: str
) -> None:
    cause(bench)
    bench.write(0x2000, VELOCITY)
    bench.refer(8_192)
    bench.pass_ms(2_000)
    assert bench.emergencies == [emcy, "000000", emcy]
    assert bench.status == FAULT


def test_a_reset_of_the_node_clears_a_fault_and_finds_a_cause_that_is_still_there(
    bench: UnitBench,
) -> None:
    cause_under_voltage(bench)
    bench.send(RESET)
    bench.pass_ms(2)
    assert bench.status == 0
    bench.pass_ms(20)
    assert bench.emergencies == ["203205", "203205"]
    bench.set("supply_v", 60)
    bench.send(RESET)
    bench.pass_ms(100)
    assert (bench.status, bench.read(0x1001)) == (0, 0)


def test_a_short_dip_of_the_supply_is_ridden_through(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 8_192)
    bench.pass_ms(200)
    bench.set("supply_v", 5)
    bench.pass_ms(4)
    bench.set("supply_v", 60)
    bench.pass_ms(500)
    assert bench.emergencies == []
    assert bench.see("velocity_deg_s") == pytest.approx(90, rel=0.01)


def test_the_supply_must_be_well_back_before_a_dip_is_over(bench: UnitBench) -> None:
    cause_under_voltage(bench)
    for supply_v, status in ((10.9, FAULT), (11.0, ON)):
        bench.set("supply_v", supply_v)
        bench.write(0x2000, VELOCITY)
        bench.pass_ms(20)
        assert bench.status & (ON | FAULT) == status


def test_two_faults_are_told_one_by_one_and_cleared_when_their_causes_are_gone(
    bench: UnitBench,
) -> None:
    cause_short_circuit(bench)
    bench.set("supply_v", 70)
    bench.pass_ms(2)
    assert bench.emergencies == ["202303", "103207"]
    assert bench.unit.read("status") == "short circuit, over-voltage"
    bench.write(0x2000, FREE)
    bench.pass_ms(2)
    assert bench.emergencies == ["202303", "103207", "000005"]
    bench.set("supply_v", 60)
    bench.write(0x2000, FREE)
    bench.pass_ms(20)
    assert bench.emergencies[3:] == ["000000"]
    assert bench.status == 0


def test_a_short_circuit_without_power_is_not_seen(bench: UnitBench) -> None:
    bench.set("short_circuit", 1)
    bench.pass_ms(1_000)
    assert bench.emergencies == []


def test_a_blocked_shaft_is_no_fault_while_a_current_is_wanted(bench: UnitBench) -> None:
    bench.set("shaft_blocked", 1)
    bench.begin(CURRENT, CONTINUOUS)
    bench.pass_ms(3_000)
    assert bench.emergencies == []
    assert bench.see("current_a") == pytest.approx(1.67, rel=0.01)


@pytest.mark.unmeasured
def test_i2t_cuts_the_peak_current_to_the_continuous_one(bench: UnitBench) -> None:
    bench.set("shaft_blocked", 1)
    bench.begin(CURRENT, 32_767)
    bench.pass_ms(1_900)
    assert bench.see("current_a") == pytest.approx(30 / 9, rel=0.01)
    bench.pass_ms(300)
    assert bench.see("current_a") == pytest.approx(15 / 9, rel=0.01)
    assert bench.status == ON | LIMITED


@pytest.mark.unmeasured
def test_a_hot_winding_gets_less_current(bench: UnitBench) -> None:
    bench.set("ambient_c", WARM_C)
    bench.pass_ms(7_200_000)
    bench.set("shaft_blocked", 1)
    bench.begin(CURRENT, PEAK)
    bench.pass_ms(100)
    assert bench.see("current_a") == pytest.approx(30 / 9, rel=0.01)
    bench.pass_ms(1_400)
    assert 2.5 < bench.see("current_a") < 3.2
    assert bench.status == ON | LIMITED


def test_a_fault_leaves_the_node_operational(bench: UnitBench) -> None:
    cause_stall(bench)
    bench.write(0x1017, 10)
    bench.pass_ms(15)
    assert "720#05" in bench.heard


@pytest.mark.unmeasured
@pytest.mark.parametrize(("error_mode", "angle_deg"), [(1, -90.0027), (0, 90.0027)])
def test_after_a_fault_6443h_and_6444h_give_the_reference_until_another_comes(
    bench: UnitBench, error_mode: int, angle_deg: float
) -> None:
    bench.write(0x6443, error_mode, sub=1)
    bench.write(0x6444, -16_384, sub=1)
    cause_stall(bench)
    bench.set("shaft_blocked", 0)
    bench.write(0x2000, ANGLE)
    bench.pass_ms(2_000)
    assert bench.see("angle_deg") == pytest.approx(angle_deg, abs=0.01)
    bench.refer(8_192)
    bench.pass_ms(2_000)
    assert bench.see("angle_deg") == pytest.approx(45.0014, abs=0.01)


def test_after_a_fault_an_sdo_gives_another_reference_too(bench: UnitBench) -> None:
    cause_stall(bench)
    bench.set("shaft_blocked", 0)
    bench.write(0x6411, 16_384, sub=1)
    bench.write(0x2000, ANGLE)
    bench.pass_ms(2_000)
    assert bench.see("angle_deg") == pytest.approx(90.0027, abs=0.01)


class WithMaster(UnitBench):
    """A unit that watches the heartbeat of node 127, which then stops."""

    def __init__(self, behaviour: int) -> None:
        super().__init__()
        self.write(0x1016, 0x7F_0064, sub=1)
        self.write(0x1029, behaviour, sub=1)
        self.send("77F#05")

    def hear_master(self, ms: int) -> None:
        for _ in range(ms // 50):
            self.send("77F#05")
            self.pass_ms(49)

    def lose_master(self) -> None:
        self.hear_master(500)
        self.pass_ms(600)


def test_a_lost_heartbeat_stops_the_motor() -> None:
    bench = WithMaster(behaviour=0)
    bench.begin(VELOCITY, 8_192)
    bench.lose_master()
    assert bench.emergencies == ["308111"]
    assert bench.status == ON
    assert bench.see("velocity_deg_s") == pytest.approx(0, abs=0.1)
    bench.send("77F#05", START)
    bench.hear_master(500)
    assert bench.emergencies == ["308111", "000000"]
    assert bench.see("velocity_deg_s") == pytest.approx(90, rel=0.01)


def test_a_lost_heartbeat_that_changes_no_state_gives_the_error_value() -> None:
    bench = WithMaster(behaviour=1)
    bench.begin(VELOCITY, 8_192)
    bench.lose_master()
    assert bench.status == ON | REACHED
    assert bench.see("velocity_deg_s") == pytest.approx(0, abs=0.1)
    bench.refer(8_192)
    bench.pass_ms(500)
    assert bench.see("velocity_deg_s") == pytest.approx(90, rel=0.01)


def test_a_fault_outside_operational_is_told_as_well(bench: UnitBench) -> None:
    bench.send(PRE_OPERATIONAL)
    cause_over_voltage(bench)
    assert bench.emergencies == ["103205"]
