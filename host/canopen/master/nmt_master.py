"""The NMT master, which boots, starts and monitors its slaves (CiA 302-2, NMT start-up)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootStatus
from tickrig.host.canopen.master.cia402.drive_driver import DriveNode
from tickrig.host.canopen.master.network_slave import NetworkSlave
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.host.canopen.network import state_of
from tickrig.host.canopen.periodic_timer import PeriodicTimer
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame, Frames, data_frame
from tickrig.wire.canopen import nmt
from tickrig.wire.canopen.sdo_frame import RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

# The PDOs of all slaves, and the drives that process them in periods.


class ProcessData:
    """Process data (PDOs) of all slaves.

    The master passes the received frames and the SYNCs to this object.

    Args:
        images: process image of each slave, by node-ID.
        drives: nodes with drive axes.
    """

    def __init__(
        self, images: Mapping[int, ProcessImage], drives: tuple[DriveNode, ...] = ()
    ) -> None:
        self.images, self.drives = images, drives
        self._began = False
        self._by_cob_id = {cob_id: image for image in images.values() for cob_id in image.cob_ids}

    @property
    def due_us(self) -> int:
        """Time of the next call of `tick`."""
        return min((drive.due_us for drive in self.drives), default=NEVER)

    def receive(self, frame: CanFrame) -> None:
        """Process a data frame. Ignore frames that are not TPDOs of a slave."""
        if (image := self._by_cob_id.get(frame.can_id)) is not None:
            image.receive(frame.can_id, frame.data)

    def sync(self) -> None:
        """Send the RPDOs that belong to a SYNC."""
        for image in self.images.values():
            image.sync()

    def tick(self, now_us: int, *, sync: bool) -> None:
        """Read and write the drives whose period begins now.

        A drive is read and written once in each period. The period is a fixed time, or the time
        from one SYNC to the next. No period begins before the slaves have booted for the first
        time. This behaviour is as in ros2_canopen, whose drivers wait for the slaves.

        Args:
            now_us: current time in microseconds.
            sync: whether a SYNC was just sent.
        """
        if not self._began:
            if any(drive.is_awaited(now_us) for drive in self.drives):
                return
            self._began = any(drive.is_booted for drive in self.drives)
        for drive in self.drives:
            drive.tick(now_us, sync=sync)


_SYNC_COB_ID: Final = 0x080
_EMCY_COB_ID: Final = 0x080
"""CAN-ID base of EMCY messages, to which the node-ID is added."""

_NODE_IDS: Final = range(1, 128)
_FUNCTION: Final = 0x780
"""The bits of a CAN-ID that are not the node-ID."""


class NmtMaster:
    """NMT master that boots and starts slaves as Lely's master does.

    The master has no clock and no bus. It is driven by `tick`.

    Not emulated: flying master, LSS, TIME, the inhibit time of NMT (102Ah), and an object
    dictionary that other nodes can read.

    Args:
        plan: behaviour of the master, with its slaves.

    Attributes:
        plan: behaviour of the master.
        slaves: slaves by node-ID.
        state: NMT state of the master.
        halted: whether a mandatory slave could not be booted. The master then starts no more
            slaves.
        strangers: node-IDs that booted but do not belong to a slave (error status A).
        process_data: receiver of all other data frames, which also starts the periods of drives.
        now_us: time of the last `tick`.
    """

    def __init__(self, plan: MasterPlan) -> None:
        self.plan, self._out = plan, list[CanFrame]()
        self.slaves = {slave.node_id: self._slave(slave) for slave in plan.slaves}
        self.state, self.halted = nmt.NmtState.INITIALISING, False
        self.strangers: list[int] = []
        self.process_data = ProcessData({})
        self._heartbeat, self._sync = PeriodicTimer(plan.heartbeat_us), PeriodicTimer(plan.sync_us)
        self.now_us = self._sync_count = 0

    def _slave(self, slave: SlaveAssignment) -> NetworkSlave:
        return NetworkSlave(slave, self.send, self._guard, self.plan, self._booted)

    @property
    def due_us(self) -> int:
        """Time of the next call of `tick`."""
        if self._out or self.state is nmt.NmtState.INITIALISING:
            return self.now_us
        slaves = min((slave.due_us for slave in self.slaves.values()), default=NEVER)
        return min(slaves, self._heartbeat.due_us, self._sync.due_us, self.process_data.due_us)

    def tick(self, now_us: int, rx: StampedFrames, /) -> Frames:
        """Process received frames, and do the work that is due. Return the frames to send."""
        self.now_us = now_us
        if self.state is nmt.NmtState.INITIALISING:
            self._start_up()
        for at_us, frame in rx:
            self._hear(at_us, frame)
        for slave in self.slaves.values():
            if slave.tick(now_us):
                self._lose(slave)
        self.process_data.tick(now_us, sync=self._produce())
        out, self._out = tuple(self._out), []
        return out

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame with this tick."""
        self._out.append(data_frame(can_id, data))

    def command(self, command: nmt.NmtCommand, node_id: int = nmt.ALL_NODES) -> None:
        """Send an NMT command, and record the commanded state of the slaves."""
        self.send(nmt.NMT_COB_ID, bytes((command, node_id)))
        for slave in self.slaves.values():
            if node_id in (nmt.ALL_NODES, slave.assignment.node_id) and command in nmt.COMMANDED:
                slave.expect(nmt.COMMANDED[command])

    def _guard(self, can_id: int) -> None:
        self._out.append(CanFrame(can_id, remote=True, remote_length=1))

    def _start_up(self) -> None:
        """Boot the master, reset the slaves, and boot slaves for which the master does not wait."""
        self.send(nmt.ERROR_CONTROL_COB_ID + self.plan.node_id, bytes((nmt.NmtState.INITIALISING,)))
        self.state = nmt.NmtState.PRE_OPERATIONAL
        self._heartbeat.start(self.now_us)
        self._sync.start(self.now_us)
        self._reset_slaves()
        for slave in self.slaves.values():
            slave.forget()
            if slave.assignment.mandatory or not slave.assignment.reset_communication:
                slave.boot(self.now_us)
        self._go_on()

    def _reset_slaves(self) -> None:
        """Reset the communication of all nodes, one by one if a slave must not be reset."""
        slaves = self.plan.slaves
        kept = {slave.node_id for slave in slaves if not slave.reset_communication}
        if not kept:
            self.command(nmt.NmtCommand.RESET_COMMUNICATION)
            return
        for node_id in _NODE_IDS:
            if node_id not in kept and node_id != self.plan.node_id:
                self.command(nmt.NmtCommand.RESET_COMMUNICATION, node_id)

    def _hear(self, at_us: int, frame: CanFrame) -> None:
        if frame.extended or frame.remote:
            return
        function, node_id = frame.can_id & _FUNCTION, frame.can_id & ~_FUNCTION
        slave = self.slaves.get(node_id)
        if slave is not None and function in (nmt.ERROR_CONTROL_COB_ID, RESPONSE_COB_ID):
            slave.receive(at_us, frame)
        elif function == nmt.ERROR_CONTROL_COB_ID:
            if node_id != self.plan.node_id and state_of(frame) is nmt.NmtState.INITIALISING:
                self.strangers.append(node_id)
        elif function == _EMCY_COB_ID and slave is not None:
            slave.emergencies.append(int.from_bytes(frame.data[:2], "little"))
        else:
            self.process_data.receive(frame)

    def _booted(self, slave: NetworkSlave) -> None:
        """Start a slave that has booted, and continue if the master waited for it."""
        assignment, outcome, plan = slave.assignment, slave.outcome, self.plan
        assert outcome is not None
        alone = not plan.starts_all or self.state is nmt.NmtState.OPERATIONAL
        if outcome.status is BootStatus.BOOTED and assignment.boots and plan.starts_nodes and alone:
            self.command(nmt.NmtCommand.START, assignment.node_id)
        self.halted |= assignment.mandatory and not outcome.status.good
        self._go_on()

    def _go_on(self) -> None:
        """Enter Operational when the master waits for no more mandatory slaves."""
        waits = any(slave.booting and slave.assignment.mandatory for slave in self.slaves.values())
        if self.halted or waits or self.state is not nmt.NmtState.PRE_OPERATIONAL:
            return
        if self.plan.starts:
            self.state = nmt.NmtState.OPERATIONAL
            if self.plan.starts_all and self.plan.starts_nodes:
                self._start_all()

    def _start_all(self) -> None:
        """Start all slaves at once if none must be booted, else each booted slave, as Lely does."""
        slaves = self.slaves.values()
        if all(slave.good and not slave.assignment.boots for slave in slaves):
            self.command(nmt.NmtCommand.START)
            return
        for slave in slaves:
            if (
                slave.assignment.boots
                and slave.good
                and slave.state is not nmt.NmtState.OPERATIONAL
            ):
                self.command(nmt.NmtCommand.START, slave.assignment.node_id)

    def _lose(self, slave: NetworkSlave) -> None:
        """React to the loss of a slave as 1F80h requires (CiA 302-2, error handling)."""
        mandatory = slave.assignment.mandatory
        if mandatory and self.plan.stops_all:
            slave.note_loss("all nodes are stopped")
            self.command(nmt.NmtCommand.STOP)
            self.state = nmt.NmtState.STOPPED
        elif mandatory and self.plan.resets_all:
            slave.note_loss("all nodes are reset")
            self.command(nmt.NmtCommand.RESET_NODE)
            self.state, self.halted = nmt.NmtState.INITIALISING, False
        else:
            slave.note_loss("reset node is sent, once")
            self.command(nmt.NmtCommand.RESET_NODE, slave.assignment.node_id)

    def _produce(self) -> bool:
        """Send due heartbeat and SYNC, each once after a pause. Return True after a SYNC."""
        if self._heartbeat.advance(self.now_us):
            self.send(nmt.ERROR_CONTROL_COB_ID + self.plan.node_id, bytes((self.state,)))
        if self._sync.advance(self.now_us):
            self.send(_SYNC_COB_ID, self._count())
            if self.state is nmt.NmtState.OPERATIONAL:
                self.process_data.sync()
            return True
        return False

    def _count(self) -> bytes:
        """Return the counter of a SYNC, or nothing if the SYNC has no counter."""
        if not self.plan.sync_overflow:
            return b""
        self._sync_count = self._sync_count % self.plan.sync_overflow + 1
        return bytes((self._sync_count,))
