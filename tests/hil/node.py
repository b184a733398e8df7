"""A CANopen node on a bench, as a test's host sees it: by the canopen library."""

from __future__ import annotations

from typing import Any

import canopen

from tickrig import Bench

PATIENCE = "2s"
"""For what takes a node milliseconds."""


class NodeUnderTest:
    """A node, its network, and the frames that it sent.

    Args:
        bench: where it is.
        node_id: its node-ID.

    Attributes:
        network: of the canopen library.
        node: the library's.
        emergencies: error codes of the EMCYs that came.
    """

    def __init__(self, bench: Bench, node_id: int) -> None:
        self.bench, self.node_id = bench, node_id
        self.network = bench.canopen_network()
        objects: Any = canopen.ObjectDictionary
        self.node: Any = self.network.add_node(node_id, objects())
        self.node.sdo.RESPONSE_TIMEOUT = 2
        self.emergencies: list[int] = []
        self.boots = 0
        self.node.emcy.add_callback(lambda error: self.emergencies.append(error.code))
        self.network.subscribe(0x700 + node_id, self._heartbeat)
        self.node.nmt.send_command(0x82)  # reset communication: it boots for us
        assert bench.wait_until(lambda: self.boots > 0, within=PATIENCE)
        bench.run_for("50ms")

    def read(self, index: int, sub: int = 0, *, signed: bool = False) -> int:
        """Read a number by SDO."""
        return int.from_bytes(self.node.sdo.upload(index, sub), "little", signed=signed)

    def write(self, index: int, value: int, size: int, sub: int = 0) -> None:
        """Write a number by SDO."""
        data = value.to_bytes(size, "little", signed=value < 0)
        self.node.sdo.download(index, sub, data)

    def start(self) -> None:
        """Bring it to Operational, by NMT."""
        self.node.nmt.state = "OPERATIONAL"
        self.bench.run_for("100ms")

    def _heartbeat(self, can_id: int, data: bytearray, timestamp: float) -> None:
        self.boots += bytes(data) == b"\0"
