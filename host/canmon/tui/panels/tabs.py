"""The tabs of `canmon tui`: ours in their order, then those of installed packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.cli.extensions import ExtensionGroup
from tickrig.host.text.user_file import explain_error

HERE: Final = "tickrig.host.canmon.tui.panels"
TABS: Final = ExtensionGroup[type[Panel]](
    "tickrig.tabs",
    "tab",
    {
        "trace": f"{HERE}.trace_panel:TracePanel",
        "nodes_view": f"{HERE}.nodes_panel:NodesPanel",
        "statistics": f"{HERE}.statistics_panel:StatisticsPanel",
        "objects": f"{HERE}.dictionary_panel:DictionaryPanel",
        "transmit": f"{HERE}.transmit_panel:TransmitPanel",
        "sequence": f"{HERE}.sequence_panel:SequencePanel",
        "graph": f"{HERE}.graph_panel:GraphPanel",
        "alarms": f"{HERE}.alarms_panel:AlarmsPanel",
    },
    lambda found: isinstance(found, type) and issubclass(found, Panel) and bool(found.title),
    "a Panel with a title",
)
"""By their sections in a workspace; key 1 shows the first, and so on."""


def make_panels(session: Session, notify: Callable[[str], None]) -> list[Panel]:
    """Return all tabs; a foreign one that cannot be made is left out.

    Args:
        session: what they show.
        notify: takes a line for people about each that is left out.
    """
    return list(_panels(session, notify))


def _panels(session: Session, notify: Callable[[str], None]) -> Iterator[Panel]:
    for name, tab in TABS.load_all(notify).items():
        tasks = list(session.tasks)
        try:
            panel = tab(session)
            if panel.section != name:
                raise ValueError(f"its section is {panel.section!r}")
        except Exception as error:
            if name in TABS.built_in:
                raise
            session.tasks[:] = tasks
            notify(f"tab {name!r}: {explain_error(error)}")
            continue
        yield panel
