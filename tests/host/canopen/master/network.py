"""Networks of the master's tests: slaves of ours on a bench in virtual time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tickrig import Bench
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import Application, CanopenSlave, ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.host.canopen.master.assignment import MasterPlan, ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RO, ROT, RW, Element, ObjectTable

NODE_ID = 5
DEVICE_TYPE = 0x0002_0192
SOFTWARE = 0x0001_0002
VENDOR, PRODUCT, REVISION, SERIAL = 0x7469, 0x6210, 0x0001_0000, 77
HEARTBEAT = ObjectWrite(0x1017, 0, (50).to_bytes(2, "little"))


def plain_slave(node_id: int = NODE_ID, application: ServiceMaker = Application) -> CanopenSlave:
    """A slave with what a boot-up may ask for."""
    u16, u32 = DataType.UNSIGNED16, DataType.UNSIGNED32
    objects = ObjectTable()
    objects.variable(0x1000, "Device type", u32, RO, DEVICE_TYPE)
    objects.variable(0x1001, "Error register", DataType.UNSIGNED8, ROT)
    objects.variable(0x1006, "Communication cycle period", u32, RW)
    objects.variable(0x1007, "Synchronous window length", u32, RW)
    objects.variable(0x100C, "Guard time", u16, RW)
    objects.variable(0x100D, "Life time factor", DataType.UNSIGNED8, RW)
    objects.array(0x1010, "Store parameters", 1, u32, RW, 1)
    objects.array(0x1011, "Restore default parameters", 2, u32, RW, 1)
    objects.variable(0x1017, "Producer heartbeat time", u16, RW)
    identity = enumerate((VENDOR, PRODUCT, REVISION, SERIAL), 1)
    rows = [Element(sub, f"Identity {sub}", u32, RO, value) for sub, value in identity]
    objects.record(0x1018, "Identity object", rows)
    objects.array(0x1020, "Verify configuration", 2, u32, RW)
    objects.array(0x1F56, "Program software identification", 1, u32, RO, SOFTWARE)
    objects.array(0x1F50, "Program data", 1, DataType.DOMAIN, RW)
    objects.array(0x1F51, "Program control", 1, DataType.UNSIGNED8, RW)
    objects.array(0x1F57, "Flash status identification", 1, u32, RO)
    return make_slave(Dictionary(objects, objects.objects), node_id, application=application)


@dataclass
class Network:
    """A bench with slaves, and the master on it."""

    bench: Bench
    master: CanopenMaster

    def status(self, node_id: int = NODE_ID) -> str:
        """The letter with which the latest boot-up ended."""
        outcome = self.master.slave(node_id).outcome
        assert outcome is not None, "no boot-up has ended"
        return outcome.status.value

    def heard(self) -> list[str]:
        """All frames so far, without their times."""
        return [line.split()[-1] for line in self.bench.transcript().splitlines()]


@contextmanager
def network(
    *assignments: SlaveAssignment, slaves: tuple[CanopenSlave, ...] = (), **plan: Any
) -> Iterator[Network]:
    """Put the slaves on a bench, and a master that expects these."""
    devices = slaves or tuple(plain_slave(each.node_id) for each in assignments)
    named: dict[str, Any] = {f"node{slave.node_id}": slave for slave in devices}
    with (
        Bench(**named) as bench,
        CanopenMaster(bench.link, MasterPlan(assignments, **plan)) as master,
    ):
        yield Network(bench, master)
