"""A bus outside on which a node may be a second time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.device.canopen.core.slave import UNCONFIGURED
from tickrig.emulators.can.outside.bridge import CountingPort, PortBefore
from tickrig.emulators.canopen.node.node import Node
from tickrig.host.text.log import log_of
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID

ERROR_CONTROL: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + UNCONFIGURED)

_logger = log_of(__name__)


class SecondNodeAlarm(PortBefore):
    """A port that warns, once for each node, of somebody outside who has its node-ID.

    It hears boot-ups, heartbeats and answers to guarding. A second node that sends none of them
    is not noticed; nor is one while ours is without power.

    Args:
        port: the port behind it.
        nodes: ours.
    """

    def __init__(self, port: CountingPort, nodes: Sequence[Node]) -> None:
        super().__init__(port)
        self._alone = list(nodes)

    def poll(self, now_us: int, /) -> Frames:
        """Read what others have sent."""
        frames = super().poll(now_us)
        for frame in frames:
            if frame.can_id in ERROR_CONTROL and self._alone:
                self._look(frame)
        return frames

    def _look(self, frame: CanFrame) -> None:
        if frame.extended or not frame.data:
            return
        node_id = frame.can_id - ERROR_CONTROL_COB_ID
        for node in self._alone:
            if node.slave.node_id == node_id and node.is_on:
                self._alone.remove(node)
                text = "node-ID %d is on the bus twice: somebody else sent %s; end one of the two"
                _logger.warning(text, node_id, frame)
                return
