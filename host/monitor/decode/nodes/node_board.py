"""All nodes at a glance: states, heartbeats, boot-ups, EMCYs, SDO errors, drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.decode.drive_state import drive_state
from tickrig.host.monitor.decode.nodes.node_status import NodeStatus
from tickrig.host.monitor.frames.heard import Heard

STATUSWORD: Final = "statusword"
ERROR_CONTROL: Final = ("heartbeat", "guard")


class NodeBoard:
    """Keeps the status of every node that was heard.

    A node is on the board once it has told its state, sent an EMCY, answered an SDO request
    or sent a PDO that is known to be its own; and from the beginning where it has an EDS.

    Args:
        decoder: decodes what is taken here, too.
        expected: nodes with an EDS, on the first bus that is heard.
    """

    def __init__(self, decoder: Decoder, expected: Mapping[int, str] | None = None) -> None:
        self._decoder = decoder
        self._expected = dict(expected or {})
        self._nodes: dict[tuple[str, int], NodeStatus] = {}
        self.now_us = 0

    def rows(self) -> list[NodeStatus]:
        """Return the nodes by bus and node-ID."""
        return [self._nodes[key] for key in sorted(self._nodes)]

    def take(self, heard: Heard, decoded: Decoded) -> None:
        """Take a decoded frame."""
        self.now_us = max(self.now_us, heard.at_us)
        if self._expected:
            self._expect(heard.channel)
        kind, node = decoded.kind, decoded.node
        if kind == "nmt":
            self._command(heard.channel, decoded)
        elif node is None:
            return
        elif kind.startswith("tpdo"):
            self._process_data(heard.channel, node, decoded)
        elif kind == "sdo":
            self._transfers(heard.channel, node, decoded)
        elif kind == "emcy":
            self._status(heard.channel, node).emcy(heard.at_us, decoded)
        elif kind == "boot-up":
            self._status(heard.channel, node).boot(heard.at_us)
        elif kind in ERROR_CONTROL and decoded.signals:
            state = decoded.signals[0].value
            assert isinstance(state, int)
            self._status(heard.channel, node).beat(heard.at_us, state)

    def _status(self, channel: str, node: int) -> NodeStatus:
        status = self._nodes.get((channel, node))
        if status is None:
            memory = self._decoder.memory(channel, node)
            status = self._nodes[channel, node] = NodeStatus(channel, node, memory)
        return status

    def _expect(self, channel: str) -> None:
        for node, name in self._expected.items():
            self._status(channel, node).name = name
        self._expected.clear()

    def _command(self, channel: str, decoded: Decoded) -> None:
        if not decoded.signals:
            return
        specifier = decoded.signals[0].value
        assert isinstance(specifier, int)
        for (bus, node), status in self._nodes.items():
            if bus == channel and decoded.node in (None, node):
                status.command(specifier)

    def _process_data(self, channel: str, node: int, decoded: Decoded) -> None:
        status = self._status(channel, node)
        status.heard = True
        for signal in decoded.signals:
            if signal.name == STATUSWORD and isinstance(signal.value, int):
                status.drive_state = drive_state(signal.value)

    def _transfers(self, channel: str, node: int, decoded: Decoded) -> None:
        for transfer in decoded.transfers:
            answered = transfer.outcome.answered
            if answered or (channel, node) in self._nodes:
                self._status(channel, node).transfer(transfer)
            if transfer.name == STATUSWORD and isinstance(transfer.value, int):
                self._status(channel, node).drive_state = drive_state(transfer.value)
