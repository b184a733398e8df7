"""Activates nodes one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tickrig.host.rtc_canopen.node.served_node import Phase, ServedNode


class StartOrder:
    """Activates a node when it is to start, is ready, and all before it are Active.

    A node that does not come holds up those behind it.

    Args:
        nodes: by node-ID.
        order: all node-IDs.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], order: Sequence[int]) -> None:
        self._nodes = tuple(nodes[node_id] for node_id in order)

    def start(self) -> None:
        """Let all nodes start in their turn."""
        for node in self._nodes:
            node.to_start = True

    def go_on(self) -> None:
        """Activate the next node, if it is its turn."""
        for node in self._nodes:
            if node.proxy is None or not node.proxy.confirmed:
                self._activate(node)
                return

    def _activate(self, node: ServedNode) -> None:
        if node.to_start and node.phase is Phase.READY and node.proxy is not None:
            node.to_start = False
            node.proxy.contexts[0].activate_component(node.proxy)
