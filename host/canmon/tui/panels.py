"""The tabs of the monitor, in their order."""

from __future__ import annotations

from typing import Final

from tickrig.host.canmon.tui.alarms_panel import AlarmsPanel
from tickrig.host.canmon.tui.dictionary_panel import DictionaryPanel
from tickrig.host.canmon.tui.graph_panel import GraphPanel
from tickrig.host.canmon.tui.nodes_panel import NodesPanel
from tickrig.host.canmon.tui.panel import Panel
from tickrig.host.canmon.tui.sequence_panel import SequencePanel
from tickrig.host.canmon.tui.statistics_panel import StatisticsPanel
from tickrig.host.canmon.tui.trace_panel import TracePanel
from tickrig.host.canmon.tui.transmit_panel import TransmitPanel

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
