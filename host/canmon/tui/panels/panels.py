"""The tabs of the monitor, in their order."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.tui.panels.alarms_panel import AlarmsPanel
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.panels.graph_panel import GraphPanel
from tickrig.host.canmon.tui.panels.nodes_panel import NodesPanel
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.panels.sequence_panel import SequencePanel
from tickrig.host.canmon.tui.panels.statistics_panel import StatisticsPanel
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitPanel

PANELS: Final[tuple[type[Panel], ...]] = (
    TracePanel,
    NodesPanel,
    StatisticsPanel,
    DictionaryPanel,
    TransmitPanel,
    SequencePanel,
    GraphPanel,
    AlarmsPanel,
)
"""Key 1 shows the first, and so on."""
