"""The tabs of the monitor, in their order."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.tui.nodes_panel import NodesPanel
from tickrig.host.canmon.tui.panel import Panel

PANELS: Final[tuple[type[Panel], ...]] = (NodesPanel,)
"""Key 1 shows the first, and so on."""
