"""A CAN bus as a commissioning tool uses it: one thing after the other, each waited for."""

from __future__ import annotations

from contextlib import suppress
from typing import Final, TypeVar

from tickrig.host.canopen.dialogue import SDO_TIMEOUT_US, Dialogue, Script
from tickrig.host.canopen.script_run import run_script, state_of
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.wire.can import CanFrame, data_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.canopen.sdo.abort import AbortCode

T = TypeVar("T")

ERROR_CONTROL: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + 128)


class NodeBus:
    """SDO, NMT and single frames on a bus, from one thread.

    Who ends it in the middle of an SDO transfer, as Ctrl-C does, has the transfer aborted.

    Args:
        link: the bus.
        timeout_us: how long an SDO response is waited for.

    Attributes:
        states: what each node reported last, by node-ID; a boot-up counts as one.
    """

    def __init__(self, link: StampedLink, timeout_us: int = SDO_TIMEOUT_US) -> None:
        self._link, self._timeout_us = link, timeout_us
        self._talks: dict[int, Dialogue] = {}
        self.states: dict[int, NmtState] = {}

    @property
    def now_us(self) -> int:
        """Time of the bus."""
        return self._link.now_us

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame; LinkClosed if the bus is gone."""
        self._link.send((data_frame(can_id, data),))

    def listen(self, until_us: int) -> tuple[int, StampedFrames]:
        """Wait for a first frame; return a time, and all that had arrived by then.

        Raises:
            LinkClosed: the bus is gone.
        """
        now_us, frames = self._link.receive_stamped(max(0, until_us - self._link.now_us))
        for _, frame in frames:
            if frame.can_id in ERROR_CONTROL and not (frame.remote or frame.extended):
                self._note(frame)
        return now_us, frames

    def gather(self, span_us: int) -> list[CanFrame]:
        """Let so much time pass; return what came meanwhile."""
        until_us, found = self.now_us + span_us, list[CanFrame]()
        now_us = self.now_us
        while now_us < until_us:
            now_us, frames = self.listen(until_us)
            found += (frame for _, frame in frames)
        return found

    def command(self, command: NmtCommand, node_id: int) -> None:
        """Send an NMT command; to all nodes for node-ID 0."""
        self.send(NMT_COB_ID, bytes((command, node_id)))

    def await_state(
        self, node_id: int, wanted: tuple[NmtState, ...], within_us: int
    ) -> NmtState | None:
        """Wait until a node reports one of some states; return what it reported last meanwhile."""
        until_us, now_us = self.now_us + within_us, self.now_us
        self.states.pop(node_id, None)
        while self.states.get(node_id) not in wanted and now_us < until_us:
            now_us, _ = self.listen(until_us)
        return self.states.get(node_id)

    def run(self, node_id: int, script: Script[T], timeout_us: int = 0) -> T:
        """Run a script, and return or raise what it does.

        Args:
            node_id: the node that it speaks with.
            script: what is said.
            timeout_us: how long a response is waited for; 0 for as long as usual.

        Raises:
            LinkClosed: the bus is gone.
        """
        if node_id not in self._talks:
            self._talks[node_id] = Dialogue(node_id, self.send, self._guard)
        talk = self._talks[node_id]
        talk.sdo_timeout_us = max(timeout_us, self._timeout_us)
        try:
            return run_script(talk, node_id, script, self.now_us, self.listen)
        except BaseException:
            with suppress(LinkClosed):
                talk.abort(AbortCode.GENERAL)
            raise

    def read(self, node_id: int, index: int, sub: int, size: int = 0) -> bytes:
        """Read an object.

        Args:
            node_id: the node.
            index: of the object.
            sub: its sub-index.
            size: of the object in bytes, 0 if nobody knows.

        Raises:
            SdoFailed: the node refuses, or does not answer.
            LinkClosed: the bus is gone.
        """
        return self.run(node_id, upload(index, sub, size))

    def write(self, node_id: int, index: int, sub: int, data: bytes, timeout_us: int = 0) -> None:
        """Write an object; raises as `read`."""
        self.run(node_id, download(index, sub, data), timeout_us)

    def _guard(self, can_id: int) -> None:
        self._link.send((CanFrame(can_id, remote=True, remote_length=1),))

    def _note(self, frame: CanFrame) -> None:
        state = state_of(frame)
        if state is not None:
            self.states[frame.can_id - ERROR_CONTROL_COB_ID] = state
