"""What a bus.yml says to the master."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.master.joints import MASTER, NO_PDOS, eds
from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.master.cia402.drive_driver import axes_of, is_drive, period_us_of
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.links.link import Link
from tickrig.testing import open_master
from tickrig.wire.canopen.drive import DriveState


def bus(folder: Path, node: str, master: str = MASTER) -> BusFile:
    (folder / "drive.eds").write_text(eds())
    (folder / "bus.yml").write_text(f"{master}{NO_PDOS}nodes:\n  one:\n    node_id: 2\n{node}")
    return read_bus_file(folder / "bus.yml")


def test_a_slave_is_expected_as_the_file_says(tmp_path: Path) -> None:
    more = (
        "    mandatory: true\n    reset_communication: false\n    serial_number: 7\n"
        "    restore_configuration: 1\n    heartbeat_multiplier: 2.5\n"
    )
    (slave,) = plan_of(bus(tmp_path, more)).slaves
    assert (slave.node_id, slave.name, slave.mandatory) == (2, "one", True)
    assert (slave.reset_communication, slave.restore_sub, slave.serial) == (False, 1, 7)
    assert (slave.device_type, slave.product_code) == (0x0002_0192, 0x6210)
    assert slave.heartbeat_us == 250_000
    assert slave.writes[0].index == 0x1017


def test_the_master_does_as_the_file_says(tmp_path: Path) -> None:
    more = "  start_nodes: false\n  start_all_nodes: true\n  boot_time: 500\n  sync_overflow: 10\n"
    text = MASTER.replace("defaults:", f"{more}defaults:")
    plan = plan_of(bus(tmp_path, "", text))
    assert (plan.node_id, plan.sync_us, plan.sync_overflow) == (1, 10_000, 10)
    assert (plan.heartbeat_us, plan.boot_time_us) == (100_000, 500_000)
    assert (plan.starts, plan.starts_nodes, plan.starts_all) == (True, False, True)


def test_a_master_that_does_not_watch_waits_for_no_heartbeat(tmp_path: Path) -> None:
    text = MASTER.replace("defaults:", "  heartbeat_consumer: false\ndefaults:")
    (slave,) = plan_of(bus(tmp_path, "", text)).slaves
    assert slave.heartbeat_us == 0


def test_software_is_read_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "program.bin").write_bytes(b"software")
    more = "    software_file: program.bin\n"
    (slave,) = plan_of(bus(tmp_path, f"{more}    software_version: 3\n")).slaves
    assert (slave.software_version, slave.program) == (3, b"software")
    (slave,) = plan_of(bus(tmp_path, more)).slaves
    assert slave.program == b""
    (tmp_path / "program.bin").unlink()
    with pytest.raises(FileNotFoundError):
        plan_of(bus(tmp_path, f"{more}    software_version: 3\n"))


def test_a_drive_is_driven_as_its_keys_say(tmp_path: Path) -> None:
    more = "    switching_state: 3\n    homing_timeout_seconds: 4\n"
    slave = bus(tmp_path, more, MASTER.replace("period: 10\n", "period: 20\n")).slaves["one"]
    (axis,) = axes_of(slave)
    assert is_drive(slave)
    assert (axis.switching_state, axis.homing_us) == (DriveState.READY_TO_SWITCH_ON, 4_000_000)
    assert period_us_of(slave) == 20_000
    assert period_us_of(bus(tmp_path, "    polling: false\n").slaves["one"]) == 0


@pytest.mark.parametrize(
    ("key", "period_us"),
    [
        *(("period: '20'", 20_000), ("polling: 'false'", 0), ("polling: n", 0)),
        *(("period: -5", 10_000), ("period: 0", 10_000), ("polling: maybe", 10_000)),
    ],
)
def test_a_setting_is_what_its_driver_makes_of_it(key: str, period_us: int, tmp_path: Path) -> None:
    slave = bus(tmp_path, f"    {key}\n", MASTER.replace("  period: 10\n", "")).slaves["one"]
    assert period_us_of(slave) == period_us


def test_a_slave_with_another_driver_is_no_drive(tmp_path: Path) -> None:
    assert not is_drive(bus(tmp_path, "", MASTER.replace("402", "Proxy")).slaves["one"])


def test_all_that_is_wrong_with_a_file_is_said(tmp_path: Path) -> None:
    bus(tmp_path, "    sdo: [{index: nine}]\n", MASTER.replace("drive.eds", "none.eds"))

    class NoBus:
        receive_stamped = None

    link: Link[object] = NoBus()  # type: ignore[assignment]
    with pytest.raises(ValueError, match=r"bus\.yml:\d+: error: ") as refused:
        open_master(link, tmp_path / "bus.yml")
    assert "none.eds" in str(refused.value)


def test_a_serial_line_is_no_bus(tmp_path: Path) -> None:
    bus(tmp_path, "")
    line: Link[object] = object()  # type: ignore[assignment]
    with pytest.raises(TypeError, match="a master needs a CAN bus, got object"):
        open_master(line, tmp_path / "bus.yml")
