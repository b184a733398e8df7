"""What is expected of a node at its boot-up: by a bus.yml, by its EDS or DCF, or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tickrig.host.canmon.eds_document import read_device_document
from tickrig.host.canmon.net.node_objects import DEVICE_TYPE, NodeObjects
from tickrig.host.canmon.risks import nmt_risk, write_risk
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.canopen.commissioning.configuration import dcf_values, writes
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.text.values import counted
from tickrig.wire.canopen.nmt import NmtCommand

HEARTBEAT: Final = (0x1017, 0)
U16_BYTES: Final = 2
U32: Final = 0xFFFF_FFFF
PERIODS: Final = 3
"""So many periods of its heartbeat are waited for it."""


def of_bus_file(path: Path, node_id: int) -> SlaveAssignment:
    """Return what a bus.yml expects of a slave.

    Raises:
        Refused: it cannot be read, is wrong, or has no such slave.
    """
    try:
        bus = read_bus_file(path)
        if bus.errors:
            raise ValueError("; ".join(map(str, bus.errors)))
        plan = plan_of(bus)
    except OSError as error:
        refuse_path("--bus", error)
    except (ImportError, ValueError) as error:
        raise Refused(f"--bus {error}") from None
    slaves = {slave.node_id: slave for slave in plan.slaves}
    if node_id not in slaves:
        there = ", ".join(map(str, slaves)) or "none"
        raise Refused(f"--bus {path} has no slave {node_id}; its slaves: {there}")
    return slaves[node_id]


def of_eds(path: Path, node_id: int) -> SlaveAssignment:
    """Return what an EDS expects: the device, and of a DCF its configuration; Refused if none.

    Revision and serial number of an EDS are those of one device: any will do.
    """
    objects = NodeObjects(node_id, read_device_document(path, "--eds").file)
    file, device = objects.file, objects.device
    assert file is not None
    assert device is not None
    values = dcf_values(file, device, node_id)
    power_on = {at: row.power_on_data(node_id) for at, row in objects.rows.items()}

    def number(at: tuple[int, int]) -> int:
        return int.from_bytes(power_on.get(at, b""), "little")

    writable = {at for at, row in objects.rows.items() if row.writable}
    try:
        steps = writes(values, number, writable)
    except ValueError as error:
        raise Refused(f"--eds {path}: {error}") from None
    period_ms = int.from_bytes(values.get(HEARTBEAT, b"")[:U16_BYTES], "little")
    return SlaveAssignment(
        node_id,
        writes=tuple(ObjectWrite(*at, data) for at, data in steps),
        heartbeat_us=PERIODS * period_ms * 1_000,
        device_type=number((0x1000, 0)) & U32,
        vendor_id=number((0x1018, 1)) & U32,
        product_code=number((0x1018, 2)) & U32,
    )


def risk(assignment: SlaveAssignment) -> str:
    """Say what the boot-up may move."""
    resets = not assignment.reset_communication or assignment.restore_sub or assignment.program
    if resets:
        return nmt_risk(NmtCommand.RESET_NODE, assignment.device_type or None)
    objects = NodeObjects(assignment.node_id)
    objects.learn(DEVICE_TYPE, assignment.device_type.to_bytes(4, "little"))
    return write_risk(objects.is_drive, [(write.index, write.sub) for write in assignment.writes])


def changes(assignment: SlaveAssignment) -> list[str]:
    """Say what the boot-up does to the node, beside reading."""
    found = []
    if not assignment.reset_communication:
        found.append("reset communication, unless it is Operational")
    if assignment.program:
        found.append("program download, if its software is another")
    if assignment.restore_sub:
        found.append("restore and reset")
    if assignment.writes:
        found.append(counted(len(assignment.writes), "write"))
    return found


def nothing_expected(node_id: int) -> SlaveAssignment:
    """Return what is expected where nobody says anything: that it answers."""
    say("no --bus and no --eds: nothing is expected of the node but that it answers")
    return SlaveAssignment(node_id)
