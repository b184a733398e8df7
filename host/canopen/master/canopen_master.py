"""A CANopen master on a bus, for tests and scripts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.master.assignment import MasterPlan
from tickrig.host.canopen.master.boot_slave import BootStep, state_text
from tickrig.host.canopen.master.cia402 import drive_driver
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.canopen.master.network_slave import NetworkSlave
from tickrig.host.canopen.master.nmt_master import NmtMaster, ProcessData
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.host.canopen.master.waiting import Operation, perform
from tickrig.host.links.link import Closing, Link, StampedLink
from tickrig.host.text.names import known, near
from tickrig.host.text.values import us_of

_Duration = int | str
"""Duration in microseconds, or as a text such as `"100ms"`."""

_STARTED_US: Final = 2_000
"""Time within which slaves have received a start command."""


V = TypeVar("V")


class _Named(dict[str, V]):
    """A mapping by name. For an unknown name, the error lists the known names.

    Args:
        kind: kind of the items, such as `joint`.
        items: items by name.
    """

    def __init__(self, kind: str, items: Mapping[str, V]) -> None:
        super().__init__(items)
        self._kind = kind

    def __missing__(self, name: str) -> V:
        """Raise KeyError with the name that the caller may mean."""
        raise KeyError(f"no {self._kind} {name!r}; {near(str(name), self)}")


class CanopenMaster(Closing):
    """CANopen master that boots, starts and monitors the slaves of a bus, with PDOs and drives.

    The master works only while one of its methods runs, such as `boot` or `wait_until`. Such a
    method does all work that is due in the meantime.

    Args:
        link: connection to the bus, such as `bench.link` or a `CanLink`. The master closes it at
            the end.
        plan: settings of the master and of its slaves.

    Attributes:
        nmt: NMT master that does the work.
        joints: drive axes by name of the joint.

    Raises:
        TypeError: the link is a serial line.
    """

    def __init__(self, link: Link[Any], plan: MasterPlan) -> None:
        if not hasattr(link, "receive_stamped"):
            raise TypeError(f"a master needs a CAN bus, got {type(link).__name__}")
        self._link = cast(StampedLink, link)  # any object with receive_stamped is a CAN link
        self.nmt = NmtMaster(plan)
        self.joints = _Named[drive_driver.DriveDriver]("joint", {})
        slaves = {slave.assignment.name: slave for slave in self.nmt.slaves.values()}
        self._by_name = _Named("slave", slaves)

    def close(self) -> None:
        """Close the bus. The slaves keep their state."""
        self._link.close()

    @property
    def now_us(self) -> int:
        """The time on the clock of the bus."""
        return self._link.now_us

    def slave(self, name: str | int) -> NetworkSlave:
        """Return a slave by its name or node-ID. Raise KeyError if there is none."""
        if not isinstance(name, int):
            return self._by_name[name]
        if name not in self.nmt.slaves:
            raise KeyError(f"no slave {name}; known: {known(map(str, self.nmt.slaves))}")
        return self.nmt.slaves[name]

    def attach(self, process_data: ProcessData) -> None:
        """Make the master exchange process data and operate the drives from now on."""
        self.nmt.process_data = process_data
        drivers = [driver for node in process_data.drives for driver in node.drivers]
        self.joints = _Named("joint", {driver.name: driver for driver in drivers})

    def boot(self, within: _Duration = "10s") -> None:
        """Start the network, and let time pass until each slave has booted.

        Args:
            within: time limit in microseconds, or as a text such as `"100ms"`.

        Raises:
            BootFailed: a slave has not booted in time. The message lists all such slaves and the
                reasons.
        """
        self.wait_until(self._all_booted, within)
        if failed := [slave for slave in self.nmt.slaves.values() if not slave.good]:
            raise BootFailed(failed)
        self.run_for(_STARTED_US)

    def run_for(self, duration: _Duration) -> None:
        """Let time pass, given in microseconds or as a text such as `"100ms"`."""
        self.wait_until(lambda: False, duration)

    def wait_until(self, done: Callable[[], bool], within: _Duration) -> bool:
        """Let time pass until a condition holds, or until a time limit.

        The master does its work during this time.

        Args:
            done: function that returns whether the condition holds.
            within: time limit in microseconds, or as a text such as `"100ms"`.

        Returns:
            True if the condition holds, or False if the time limit came first.

        Raises:
            LinkClosed: the connection to the bus is lost.
            TypeError: the time is neither a whole number nor a text.
            ValueError: the text is not a time, or the time is negative.
        """
        until_us = self.now_us + us_of(within)
        while not done():
            if self.now_us >= until_us:
                return False
            self._step(until_us)
        return True

    def perform(self, *operations: Operation) -> None:
        """Run operations of drives in parallel: `master.perform(left.init(), right.init())`.

        The method returns when all operations have ended.

        Raises:
            DriveFailed: a drive did not complete its operation in time, or reported an error.
            LinkClosed: the connection to the bus is lost.
        """
        try:
            self._step(self.now_us)  # so that no time-out counts from the last call of this master
            perform(operations, lambda: self.now_us, self.wait_until)
        finally:
            for operation in operations:
                operation.close()

    def explain(self, name: str | int) -> str:
        """Return a text that explains the latest boot-up of a slave, and when the slave was lost.

        The text has a line for each request of the boot-up with its answer, and a line for the
        outcome. Further lines report each loss of the slave, and the first boot-up or heartbeat
        message that the slave sends after a loss. All lines are in the order of time.

        Args:
            name: name or node-ID of the slave.
        """
        slave = self.slave(name)
        steps, events = slave.steps, slave.events
        began_us = steps[0][0] if steps else 0
        before = [event for event in events if event[0] < began_us]
        after = events[len(before) :]
        first_us = min((at_us for at_us, _ in (*events, *steps)), default=0)
        lines = [_line(first_us, one) for one in (*before, *steps)]
        lines.append(_verdict(slave))
        if after:
            lines += [_line(first_us, one) for one in after]
            state = "lost" if slave.state is None else state_text(slave.state)
            lines.append(f"{_who(slave)}: now {state}")
        return "\n".join(lines)

    def _all_booted(self) -> bool:
        return all(slave.outcome is not None for slave in self.nmt.slaves.values())

    def _step(self, until_us: int) -> None:
        """Wait for the next frame or the next due time. Process the frame and the due work."""
        wait_us = min(self.nmt.due_us, until_us) - self.now_us
        now_us, received = self._link.receive_stamped(max(0, wait_us))
        if sent := self.nmt.tick(now_us, received):
            self._link.send(sent)


class BootFailed(Exception):  # noqa: N818 - what the network did
    """Some slaves did not boot.

    Attributes:
        slaves: the slaves that did not boot.
    """

    def __init__(self, slaves: list[NetworkSlave]) -> None:
        super().__init__("\n".join(map(_failure, slaves)))
        self.slaves = slaves


def _line(first_us: int, step_at: tuple[int, BootStep]) -> str:
    at_us, step = step_at
    return f"{(at_us - first_us) / 1e3:8.1f} ms  {step}"


def _who(slave: NetworkSlave) -> str:
    assignment = slave.assignment
    return f"node {assignment.node_id}" + (f" {assignment.name}" if assignment.name else "")


def _verdict(slave: NetworkSlave) -> str:
    """Return how a boot-up ended, in one line."""
    who = _who(slave)
    if slave.outcome is None:
        why = ", still tried" if slave.booting else "; no message received"
        return f"{who}: not booted{why}"
    status = slave.outcome.status
    return f"{who}: {status.value} {status.text}" if status.value else f"{who}: {status.text}"


def _failure(slave: NetworkSlave) -> str:
    """Return why a slave did not boot, in one line."""
    if not slave.steps:
        return _verdict(slave)
    step = slave.steps[-1][1]
    return f"{_verdict(slave)}; {step.request}: {step.answer}"


# The master that a bus.yml describes, on a bus.

SDO_TIMEOUT_US: Final = 100_000
"""Default time to wait for an SDO response, as in Lely's master."""


def open_master(
    link: Link[Any], path: Path | str, *, sdo_timeout_us: int = SDO_TIMEOUT_US
) -> CanopenMaster:
    """Return the CANopen master that a bus.yml describes. It has not sent any frame yet.

    Args:
        link: connection to the bus, such as `bench.link` or `CanLink.open("can0", "socketcan")`.
        path: path of the bus.yml.
        sdo_timeout_us: time to wait for an SDO response, in microseconds. Use a longer time on a
            loaded machine.

    Returns:
        The master. Close it, or use it in a `with` block.

    Raises:
        OSError: the bus.yml cannot be read. Another cause is that the bus.yml names a file with
            software for a slave, and this file cannot be read.
        ImportError: PyYAML is not installed.
        ValueError: the file has errors. The message lists all errors, each with its line.
        TypeError: the link is a serial line.
    """
    bus = read_bus_file(Path(path))
    if bus.errors:
        raise ValueError("\n".join(str(one) for one in bus.errors))
    return _master_of(link, bus, sdo_timeout_us)


def _master_of(
    link: Link[Any], bus: BusFile, sdo_timeout_us: int = SDO_TIMEOUT_US
) -> CanopenMaster:
    """Return the master of a bus.yml that was read."""
    master = CanopenMaster(link, replace(plan_of(bus), sdo_timeout_us=sdo_timeout_us))
    slaves = bus.slaves.values()
    images = {slave.node_id: ProcessImage(slave.pdos, master.nmt.send) for slave in slaves}
    drives = tuple(
        drive_driver.DriveNode(
            master.nmt.slaves[slave.node_id],
            images[slave.node_id],
            drive_driver.axes_of(slave),
            drive_driver.period_us_of(slave),
        )
        for slave in slaves
        if drive_driver.is_drive(slave)
    )
    master.attach(ProcessData(images, drives))
    return master
