"""Each mode of operation moves a joint, as ros2_canopen's 402 driver has it move."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.master.joints import NO_PDOS, PDOS, Cell, cell
from tests.host.canopen.master.network import NODE_ID, network
from tickrig.host.canopen.bus_file.bus_values import DriveChannel
from tickrig.host.canopen.master.assignment import SlaveAssignment
from tickrig.host.canopen.master.cia402.drive_driver import DriveNode, DriveSettings
from tickrig.host.canopen.master.nmt_master import ProcessData
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.host.canopen.master.waiting import DriveFailed
from tickrig.host.links.link import LinkClosed
from tickrig.wire.canopen.drive import DriveState
from tickrig.wire.canopen.nmt import NmtCommand

HOMING_35 = "  sdo: [{index: 0x6098, value: 35}]\n"
"""Home is where the motor is."""


def ready(drives: Cell, mode: str) -> None:
    """Enable the joint, and choose a mode."""
    drives.master.perform(drives.joint.init())
    drives.master.perform(drives.joint.choose(mode))


@pytest.fixture(params=[PDOS, NO_PDOS], ids=["by PDO", "by SDO"])
def pdos(request: pytest.FixtureRequest) -> str:
    text: str = request.param
    return text


def test_pp_goes_to_the_target_and_takes_the_next_one(tmp_path: Path, pdos: str) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos) as drives:
        ready(drives, "pp")
        for target in (5.0, -2.0):
            drives.joint.set_target(target)
            near = drives.master.wait_until(
                lambda goal=target: abs(drives.joint.position - goal) < 0.01,  # type: ignore[misc]
                "2s",
            )
            assert near, drives.joint.position


def test_pv_has_the_target_velocity_after_its_ramp(tmp_path: Path, pdos: str) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos) as drives:
        ready(drives, "pv")
        drives.joint.set_target(0.6)
        assert drives.master.wait_until(lambda: drives.joint.velocity > 0.55, "1s")
        drives.master.run_for("100ms")
        assert drives.joint.velocity == pytest.approx(0.6, abs=0.02)
        drives.joint.set_target(0.0)
        assert drives.master.wait_until(lambda: abs(drives.joint.velocity) < 0.005, "1s")


@pytest.mark.parametrize("mode", ["csp", "ip"])
def test_a_position_is_followed_from_period_to_period(tmp_path: Path, pdos: str, mode: str) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos) as drives:
        ready(drives, mode)
        for step in range(1, 101):
            drives.joint.set_target(step * 0.02)
            drives.master.run_for("10ms")
        drives.master.run_for("100ms")
        assert drives.joint.position == pytest.approx(2.0, abs=0.01)


def test_csv_has_the_target_velocity_within_a_period(tmp_path: Path, pdos: str) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos) as drives:
        ready(drives, "csv")
        drives.joint.set_target(0.5)
        drives.master.run_for("300ms")
        assert drives.joint.velocity == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("mode", ["cst", "tq"])
def test_a_torque_accelerates_the_joint(tmp_path: Path, pdos: str, mode: str) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos) as drives:
        ready(drives, mode)
        drives.joint.set_target(200)
        assert drives.master.wait_until(lambda: drives.joint.velocity > 0.5, "1s")
        assert drives.joint.effort == pytest.approx(0.2, abs=0.02)
        drives.joint.set_target(-200)
        assert drives.master.wait_until(lambda: drives.joint.velocity < 0, "5s")


def test_hm_finds_the_limit_switch_and_is_zero_there(tmp_path: Path, pdos: str) -> None:
    method_17 = "  sdo: [{index: 0x6098, value: 17}]\n"
    with cell(tmp_path, method_17, pdos=pdos) as drives:
        joint, bench = drives.joint, drives.bench["joint2"]
        bench.set("negative_limit_at", -20.0)
        drives.master.perform(joint.init())
        assert joint.position == pytest.approx(0.0, abs=0.01)
        assert float(bench.get("shaft_deg")) == pytest.approx(-20.0, abs=0.5)
        assert (joint.state, joint.mode) == (DriveState.OPERATION_ENABLED, 6)


@pytest.mark.parametrize("late_us", [0, 300_000])
@pytest.mark.parametrize("method", [35, 18])
def test_a_drive_that_has_homed_homes_again(tmp_path: Path, method: int, late_us: int) -> None:
    more = f"  sdo: [{{index: 0x6098, value: {method}}}]\n"
    with cell(tmp_path, more, late_us=late_us) as drives:
        drives.bench["joint2"].set("positive_limit_at", 30.0)
        ready(drives, "pp")
        drives.joint.set_target(-1.0)
        assert drives.master.wait_until(lambda: abs(drives.joint.position + 1.0) < 0.01, "3s")
        drives.master.perform(drives.joint.init())
        assert drives.joint.position == pytest.approx(0.0, abs=0.01)


LATE = [(PDOS, 0), (PDOS, 300_000), (NO_PDOS, 0)]


@pytest.mark.parametrize(("pdos", "late_us"), LATE, ids=["by PDO", "late", "by SDO"])
def test_a_joint_that_is_still_in_homing_mode_homes_again(
    tmp_path: Path, pdos: str, late_us: int
) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos, late_us=late_us) as drives:
        for _ in range(3):
            drives.master.perform(drives.joint.init())
            assert drives.joint.state is DriveState.OPERATION_ENABLED


@pytest.mark.parametrize(("pdos", "late_us"), LATE, ids=["by PDO", "late", "by SDO"])
@pytest.mark.parametrize("then", ["recover", "choose"])
def test_a_halt_is_seen_before_the_drive_is_enabled_again(
    tmp_path: Path, pdos: str, then: str, late_us: int
) -> None:
    with cell(tmp_path, HOMING_35, pdos=pdos, late_us=late_us) as drives:
        ready(drives, "pv")
        drives.joint.halt()
        drives.master.perform(
            drives.joint.recover() if then == "recover" else drives.joint.choose("pv")
        )
        drives.master.run_for("2s")
        assert drives.joint.state is DriveState.OPERATION_ENABLED


def test_homing_that_finds_nothing_is_given_up_in_its_time(tmp_path: Path) -> None:
    more = "  homing_timeout_seconds: 2\n  sdo: [{index: 0x6098, value: 17}]\n"
    with cell(tmp_path, more) as drives:
        start_us = drives.master.now_us
        with pytest.raises(DriveFailed, match="joint2: homing did not find home"):
            drives.master.perform(drives.joint.init())
        assert 2_000_000 < drives.master.now_us - start_us < 2_500_000


def test_method_0_does_not_home(tmp_path: Path) -> None:
    with cell(tmp_path, "  sdo: [{index: 0x6098, value: 0}]\n") as drives:
        drives.master.perform(drives.joint.init())
        assert drives.joint.state is DriveState.OPERATION_ENABLED


def test_several_joints_home_and_move_at_once(tmp_path: Path) -> None:
    nodes = (2, 3, 4)
    with cell(tmp_path, HOMING_35, nodes=nodes) as drives:
        joints = [drives.master.joints[f"joint{node}"] for node in nodes]
        start_us = drives.master.now_us
        drives.master.perform(*(joint.init() for joint in joints))
        drives.master.perform(*(joint.choose("csp") for joint in joints))
        assert drives.master.now_us - start_us < 500_000
        for step in range(1, 51):
            for number, joint in enumerate(joints, 1):
                joint.set_target(step * 0.01 * number)
            drives.master.run_for("10ms")
        drives.master.run_for("100ms")
        assert [round(joint.position, 2) for joint in joints] == [0.5, 1.0, 1.5]


def test_without_a_target_the_drive_is_halted(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pv")
        assert drives.joint.controlword == 0x010F
        drives.joint.set_target(0.1)
        drives.master.run_for("30ms")
        assert drives.joint.controlword == 0x000F


def test_halt_stops_quickly_and_a_recovery_goes_on(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pv")
        drives.joint.set_target(0.6)
        drives.master.run_for("300ms")
        drives.joint.halt()
        left = drives.master.wait_until(
            lambda: drives.joint.state is not DriveState.OPERATION_ENABLED, "100ms"
        )
        assert left
        drives.master.run_for("300ms")
        assert abs(drives.joint.velocity) < 0.005
        drives.master.perform(drives.joint.recover())
        assert drives.joint.state is DriveState.OPERATION_ENABLED


def test_a_fault_is_reset_by_a_recovery_once_its_cause_is_gone(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pv")
        drives.bench["joint2"].set("short_circuit", 1)
        drives.master.run_for("100ms")
        assert drives.joint.state is DriveState.FAULT
        assert drives.master.slave("joint2").emergencies == [0x2310]
        with pytest.raises(DriveFailed, match=r"no target in Fault \(statusword"):
            drives.joint.set_target(0.1)
        drives.bench["joint2"].set("short_circuit", 0)
        drives.master.perform(drives.joint.recover())
        drives.joint.set_target(0.1)


def test_a_drive_is_disabled_enabled_and_shut_down(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pp")
        for goal in (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED):
            drives.master.perform(drives.joint.switch_to(goal))
            assert drives.joint.state is goal
        drives.master.perform(drives.joint.shut_down())
        assert drives.joint.state is DriveState.SWITCH_ON_DISABLED


def test_no_way_leads_from_a_fault_to_a_quick_stop(tmp_path: Path) -> None:
    with cell(tmp_path) as drives:
        drives.bench["joint2"].set("short_circuit", 1)
        drives.master.run_for("100ms")
        drives.joint.halt()  # as ros2_canopen's: nothing to do in a fault
        with pytest.raises(DriveFailed, match="no way from"):
            drives.master.perform(drives.joint.switch_to(DriveState.QUICK_STOP_ACTIVE))


def test_modes_that_the_drive_has_not_and_words_that_are_none(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        drives.master.perform(drives.joint.init())
        with pytest.raises(DriveFailed, match="has no mode 2 "):
            drives.master.perform(drives.joint.choose("vl"))
        with pytest.raises(ValueError, match="no mode 'cps'"):
            drives.master.perform(drives.joint.choose("cps"))
        with pytest.raises(ValueError, match="no target"):
            drives.joint.set_target(1.0)
        drives.master.perform(drives.joint.choose("pp"))
        with pytest.raises(ValueError, match="nan is not a target"):
            drives.joint.set_target(float("nan"))


def test_words_that_are_no_joint_state_target_or_time_are_answered_by_those_there_are(
    tmp_path: Path,
) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        master, joint = drives.master, drives.joint
        with pytest.raises(KeyError, match="no joint 'joit2'; did you mean 'joint2'"):
            master.joints["joit2"]
        with pytest.raises(KeyError, match="no slave 'joit2'; did you mean 'joint2'"):
            master.explain("joit2")
        with pytest.raises(KeyError, match="no slave 7; known: 2"):
            master.explain(7)
        ready(drives, "pp")
        with pytest.raises(ValueError, match="no state 'Switch on'; did you mean 'Switched on'"):
            master.perform(joint.switch_to("Switch on"))
        with pytest.raises(ValueError, match=r"no mode '99'; known: none, pp"):
            master.perform(joint.choose(99))
        for target in ("x", None, [1.0]):
            with pytest.raises(ValueError, match=r"joint2: .* is not a target: expected a number"):
                joint.set_target(target)  # type: ignore[arg-type]
        master.perform(joint.switch_to("Switched on"))
        assert joint.state is DriveState.SWITCHED_ON
        master.perform(joint.choose(3))
        assert joint.mode == 3


@pytest.mark.parametrize("duration", [0.5, True, 500_000.5, None])
def test_a_time_without_a_unit_is_refused(tmp_path: Path, duration: object) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        with pytest.raises(TypeError, match="is not a time: write"):
            drives.master.run_for(duration)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="a duration is not negative, got -5 us"):
            drives.master.wait_until(lambda: False, -5)
        assert isinstance(drives.master.now_us, int)


def test_scales_and_offsets_are_those_of_the_file(tmp_path: Path) -> None:
    scales = (
        "  scale_pos_to_dev: 2000.0\n  scale_pos_from_dev: 0.0005\n"
        "  offset_pos_to_dev: 100.0\n  offset_pos_from_dev: -0.05\n"
    )
    with cell(tmp_path, scales + HOMING_35) as drives:
        ready(drives, "pp")
        drives.joint.set_target(1.5)
        assert drives.master.wait_until(lambda: abs(drives.joint.position - 1.5) < 0.002, "2s")
        assert drives.bench["joint2"].get("0x607A") == 3100


def test_a_drive_that_loses_its_supply_is_booted_and_initialised_anew(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pv")
        drives.bench["joint2"].fault("power_off", for_="500ms")
        drives.master.run_for("400ms")
        assert drives.master.slave("joint2").lost == 1
        drives.master.run_for("2s")
        ready(drives, "pv")
        drives.joint.set_target(0.3)
        drives.master.run_for("500ms")
        assert drives.joint.velocity == pytest.approx(0.3, abs=0.02)


def test_a_drive_that_missed_its_reset_is_unknown_and_no_recovery_succeeds(tmp_path: Path) -> None:
    consumer = "  heartbeat_consumer: true\n"
    with cell(tmp_path, HOMING_35 + consumer) as drives:
        ready(drives, "pp")
        drives.bench["joint2"].fault("unplugged", for_="600ms")
        drives.master.run_for("2s")
        assert drives.bench["joint2"].get("drive_state") == "Fault"
        assert drives.joint.state is None
        with pytest.raises(DriveFailed, match="joint2: no statusword since the node was lost"):
            drives.master.perform(drives.joint.recover())
        with pytest.raises(DriveFailed, match="joint2: no target in unknown"):
            drives.joint.set_target(1.0)
        drives.master.nmt.command(NmtCommand.RESET_NODE, 2)
        drives.master.run_for("1s")
        ready(drives, "pp")


def test_a_recovery_by_sdo_finds_the_fault_of_a_drive_that_was_unplugged(tmp_path: Path) -> None:
    consumer = "  heartbeat_consumer: true\n"
    with cell(tmp_path, HOMING_35 + consumer, pdos=NO_PDOS) as drives:
        ready(drives, "pp")
        drives.bench["joint2"].fault("unplugged", for_="600ms")
        states = []
        for _ in range(2):
            drives.master.run_for("590ms")
            states.append(drives.joint.state)
        assert states == [None, DriveState.FAULT]
        drives.master.perform(drives.joint.recover())
        assert drives.bench["joint2"].get("drive_state") == "Operation enabled"


def test_drives_that_are_read_by_sdo_leave_the_bus_to_those_that_boot(tmp_path: Path) -> None:
    with cell(tmp_path, pdos=NO_PDOS, nodes=tuple(range(2, 34))) as drives:
        assert all(slave.good for slave in drives.master.nmt.slaves.values())


def test_an_error_of_homing_is_told(tmp_path: Path) -> None:
    with cell(tmp_path, "  sdo: [{index: 0x6098, value: 17}]\n") as drives:
        for name in ("negative_limit_switch", "positive_limit_switch"):
            drives.bench["joint2"].set(name, 1)
        with pytest.raises(DriveFailed, match="joint2: homing error"):
            drives.master.perform(drives.joint.init())


def test_a_program_that_did_something_else_meanwhile_goes_on(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35, pdos=NO_PDOS) as drives:
        ready(drives, "pp")
        drives.bench.run_for("2s")
        drives.master.perform(drives.joint.choose("pv"))
        drives.bench.run_for("2s")
        drives.master.perform(drives.joint.recover())
        assert drives.master.slave("joint2").lost == 0


@pytest.mark.filterwarnings("error")
def test_operations_on_a_bus_that_is_gone_end(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        drives.master.close()
        with pytest.raises(LinkClosed):
            drives.master.perform(drives.joint.init(), drives.joint.choose("pp"))


def test_a_drive_that_is_gone_ends_what_waits_for_it(tmp_path: Path) -> None:
    with cell(tmp_path, HOMING_35) as drives:
        ready(drives, "pp")
        drives.bench["joint2"].switch_off()
        with pytest.raises(DriveFailed, match=r"joint2: (6502h:00 was not answered|the node was)"):
            drives.master.perform(drives.joint.choose("pv"))


def test_a_node_that_is_no_drive_says_so_by_what_it_refuses() -> None:
    with network(SlaveAssignment(NODE_ID)) as net:
        slave = net.master.slave(NODE_ID)
        image = ProcessImage((), net.master.nmt.send)
        node = DriveNode(slave, image, (DriveSettings(DriveChannel("none")),), 10_000)
        net.master.attach(ProcessData({NODE_ID: image}, (node,)))
        net.master.boot()
        joint = net.master.joints["none"]
        with pytest.raises(DriveFailed, match="Switch on disabled was not reached"):
            net.master.perform(joint.init())
        assert str(joint.refusals[0]) == "6040h:00 aborted: 06020000h NO_OBJECT"
        assert joint.effort == 0.0
        assert net.heard().count("605#4077600000000000") == 1  # once refused, never again
