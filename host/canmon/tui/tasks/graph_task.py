"""Curves of what a session hears."""

from __future__ import annotations

from collections.abc import Sequence

from tickrig.host.canmon.tui.tasks.model import Meant
from tickrig.host.monitor.graph.live_graph import LiveGraph
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


class GraphTask:
    """Takes the values of signals; it sends nothing.

    Args:
        graph: the curves.
    """

    channel = ""
    due_us = NEVER

    def __init__(self, graph: LiveGraph) -> None:
        self._graph = graph

    def tick(self, now_us: int, heard: Sequence[Meant], /) -> Frames:
        """Take what was heard."""
        if self._graph.words:
            for one, decoded in heard:
                self._graph.take(one, decoded)
        return ()

    def stop(self) -> None:
        """Do nothing: it sends nothing."""
