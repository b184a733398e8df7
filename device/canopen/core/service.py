"""What all services of a slave have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Self

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Copyable
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.core.entry import Entry
    from tickrig.device.canopen.core.slave import CanopenSlave

Handler = Callable[[CanFrame], None]

ALIVE = (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL)
ALWAYS = (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED)


@mypyc_attr(allow_interpreted_subclasses=True)
class Service(Copyable):
    """One communication service: SDO server, PDOs, SYNC, ...

    A service finds its objects in the dictionary when it is made and hangs its
    rules onto them (`Entry.guard`, `written`, `source`). An object that is not
    there switches the service off.

    Attributes:
        node: the slave that it belongs to.
        slot: its place in the order of a tick.
        asked_us: when it wants its `tick`, `NEVER` for not at all; `schedule` sets it.
    """

    __slots__ = ("asked_us", "node", "slot")

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        self.node, self.slot, self.asked_us = node, slot, NEVER

    @classmethod
    def of(cls, node: CanopenSlave) -> Self:
        """Look this service up in a slave.

        Args:
            node: the slave.

        Returns:
            Its first service of this class.

        Raises:
            StopIteration: it has none.
        """
        return next(service for service in node.services if isinstance(service, cls))

    def power_on(self) -> None:
        """Forget what only a power cut makes it forget."""

    def start(self) -> None:
        """Begin anew after Reset communication: the dictionary holds power-on values."""

    def booted(self) -> None:
        """Act at the end of Initialising, in a slave that has a node-ID."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Give the CAN-IDs of data frames that it wants.

        Args:
            state: in this NMT state.

        Yields:
            CAN-IDs, each with what handles its frames.
        """
        return iter(())

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Give the CAN-IDs of remote frames that it wants.

        Args:
            state: in this NMT state.

        Yields:
            CAN-IDs, each with what handles its frames.
        """
        return iter(())

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Give those of the CAN-IDs whose frames may change what the node listens to.

        An acceptance filter lets everything pass behind such a frame.

        Args:
            state: in this NMT state.

        Yields:
            CAN-IDs.
        """
        return iter(())

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """React to a change of the NMT state, after it was made.

        Args:
            old: the state before.
            new: the present state.
        """

    def emergency(self, code: int, register: int, text: bytes) -> None:
        """React to an error; `CanopenSlave.emergency` has the same arguments.

        Args:
            code: emergency error code.
            register: bits of the error register 1001h.
            text: manufacturer-specific bytes.
        """

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        """React to the end of an error.

        Args:
            code: emergency error code.
            text: its manufacturer-specific bytes; None for all errors of this code.
        """

    def communication_error(self) -> None:
        """React to a lost heartbeat, a life guarding event or bus-off (CiA 301, 1029h:01)."""

    def bus_state(self, state: ErrorState) -> None:
        """React to the CAN controller's fault confinement.

        Args:
            state: error active, error passive or bus-off.
        """

    def tick(self, now_us: int) -> None:
        """Do what is due; called in the tick for which it was scheduled.

        Args:
            now_us: time of the tick.
        """

    def follow_cob_id(self, entry: Entry) -> None:
        """Listen to another CAN-ID, as a watcher of a COB-ID does.

        Args:
            entry: the COB-ID, which has changed.
        """
        self.node.rewire()

    def schedule(self, due_us: int) -> None:
        """Ask for `tick`, instead of what was asked for before.

        Args:
            due_us: when; `NEVER` for not at all.
        """
        self.node.await_tick(self, due_us)
