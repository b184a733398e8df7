"""One node of a network as the host sees it, with requests to the node and frames of the node."""

# Theory of operation.
#
# A node session. Code that talks to a node for some time holds a `NodeSession`: the test master for
# each of its slaves, `canmon net` and the gateway for each node they talk to, the tester
# for the node under test. It has three parts, which go together because one frame can concern all
# three:
#
# - the `Dialogue`: the scripts that run, and which questions the server may still answer. It must
#   live as long as the session. A new dialogue would mistake a late answer to an old question for
#   the answer to its own.
# - the NMT state that the node reported last. A boot-up reports INITIALISING; the node then enters
#   Pre-operational by itself (CiA 301, 7.3.2.2.2), so the holder decides what to store.
# - `ErrorControl`, if the holder supervises the node.
#
# One frame, one order. `receive` first stores the state, then passes the frame to the dialogue: a
# script that waits for a state may end with this frame, and its holder reads `state` in the
# callback.
#
# Time. The session has no clock. A frame carries the time at which it was on the bus, `tick` gets
# the current time, and `due_us` is the time of the next `tick`. A holder with one node calls `run`,
# which waits by itself; one with many nodes calls `tick` for each that is due.
#
# Before a script starts, `run` receives all earlier frames: an answer in the queue of a driver does
# not belong to this script.
#
# Error control (CiA 301, 7.2.8.2.2). A node has heartbeat or node guarding, never both; if the
# holder expects a heartbeat, guarding is off. A node that stops answering is reported lost once,
# not in each period: the next loss needs a heartbeat or an answer before it. Guarding counts
# requests without an answer that has the other toggle bit: an answer that repeats the toggle bit is
# the copy of an old one.
#
# Boot-up. A boot procedure is a script like any other, so a session can run that of CiA 302-2
# (`master.boot_slave.SlaveBoot`, also behind `canmon net boot`) or another one.

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar

from tickrig.host.canopen import dialogue
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.canopen.sdo_frame import RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

T = TypeVar("T")

_STATE_BITS: Final = 0x7F
_TOGGLE: Final = 0x80

_Listen = Callable[[int], tuple[int, StampedFrames]]
"""Function that waits for a first frame until a time. It returns a time, and all frames so far."""


def state_of(frame: CanFrame) -> NmtState | None:
    """Return the NMT state in a heartbeat, boot-up or node guarding frame, or None if invalid."""
    try:
        return NmtState(frame.data[0] & _STATE_BITS) if len(frame.data) == 1 else None
    except ValueError:
        return None


class ErrorControl:
    """Monitor that detects the loss of one node by its heartbeat or by node guarding.

    Args:
        heartbeat_us: time without a heartbeat after which the node is lost, in microseconds. 0
            disables the monitoring of heartbeats.
        guard_us: period of node guarding requests in microseconds, or 0 for none.
        life_time_factor: number of requests without an answer after which the node is lost.
        request: function that sends a node guarding request.

    Attributes:
        due_us: time at which `tick` must be called next.
        what: name of the protocol, `heartbeat` or `guarding`.
        silence_us: time without a frame of the node after which the node is lost, in microseconds.
    """

    def __init__(
        self, heartbeat_us: int, guard_us: int, life_time_factor: int, request: Callable[[], None]
    ) -> None:
        self._heartbeat_us, self._request = heartbeat_us, request
        self._factor = 0 if heartbeat_us else life_time_factor
        self._guard_us = guard_us if self._factor else 0
        self.what = "heartbeat" if heartbeat_us else "guarding"
        self.silence_us = heartbeat_us or guard_us * life_time_factor
        self.due_us, self._unanswered, self._toggle = NEVER, 0, -1

    def stop(self) -> None:
        """Stop supervision until `begin` or the next heartbeat."""
        self.due_us = NEVER

    def begin(self, now_us: int) -> None:
        """Begin to guard. The supervision of a heartbeat starts with the first heartbeat."""
        if self._guard_us:
            self.due_us, self._unanswered = now_us + self._guard_us, 0

    def hear(self, at_us: int, frame: CanFrame) -> None:
        """Process a heartbeat or an answer to guarding."""
        toggle = frame.data[0] & _TOGGLE
        if self._heartbeat_us:
            self.due_us = at_us + self._heartbeat_us
        elif self.due_us < NEVER and toggle != self._toggle:
            self._toggle, self._unanswered = toggle, 0

    def tick(self, now_us: int) -> bool:
        """Do the work that is due. Return True if the node is now lost."""
        if now_us < self.due_us:
            return False
        if self._heartbeat_us:
            self.due_us = NEVER
            return True
        self.due_us += self._guard_us
        if self._unanswered < self._factor:
            self._unanswered += 1
            if self._unanswered == self._factor:
                return True
        self._request()
        return False


class NodeSession:
    """Communication of a host with one node: SDO requests, node guarding and NMT states.

    Args:
        node_id: node-ID of the node, 1..127.
        send: function that sends a data frame. Its arguments are CAN-ID and data.
        guard: function that sends a remote frame. Its argument is the CAN-ID.
        sdo_timeout_us: time to wait for an SDO response, in microseconds.
        on_misnamed: function that is called with each SDO answer that names another object than the
            request; see `Dialogue`.

    Attributes:
        node_id: node-ID of the node.
        dialogue: dialogue that runs the scripts with this node.
        state: last NMT state that the node has reported, or None if it has reported none.
    """

    def __init__(
        self,
        node_id: int,
        send: dialogue.Send,
        guard: Callable[[int], None] = dialogue.nothing,
        sdo_timeout_us: int = dialogue.SDO_TIMEOUT_US,
        on_misnamed: dialogue.Misnamed | None = None,
    ) -> None:
        self.node_id = node_id
        self.dialogue = dialogue.Dialogue(node_id, send, guard, sdo_timeout_us, on_misnamed)
        self.state: NmtState | None = None
        self._response = RESPONSE_COB_ID + node_id
        self._error_control = ERROR_CONTROL_COB_ID + node_id

    def receive(self, now_us: int, frame: CanFrame) -> NmtState | None:
        """Process a received frame. Frames of other nodes are ignored.

        Return the NMT state that the frame reports, or None if it reports none.
        """
        can_id, data, remote, extended, _ = frame
        if remote or extended:
            return None
        if can_id == self._response:
            self.dialogue.receive_sdo(now_us, data)
        elif can_id == self._error_control and (state := state_of(frame)) is not None:
            self.state = state
            self.dialogue.receive_state(now_us, state)
            return state
        return None

    def run(self, script: dialogue.Script[T], listen: _Listen) -> T:
        """Send the requests of a script to the node, and wait until the script ends.

        Return the result of the script. If the script ends with an error, raise this error.

        Args:
            script: script to run. No other script runs at the same time.
            listen: function that waits for frames and returns them with the time.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        ended: list[T | Exception] = []
        job = dialogue.QueuedScript("", script, ended.append, ended.append)
        now_us, frames = listen(0)
        for _, frame in frames:
            self.receive(now_us, frame)
        self.dialogue.start(now_us, job)
        while not ended:
            now_us, frames = listen(self.dialogue.due_us)
            for _, frame in frames:
                self.receive(now_us, frame)
            if not ended:
                self.dialogue.tick(now_us)
        if isinstance(ended[0], Exception):
            raise ended[0]
        return ended[0]
