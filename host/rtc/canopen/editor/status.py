"""The line at the bottom, and lines of events."""

from __future__ import annotations

from itertools import chain, repeat
from textwrap import wrap
from typing import Final

from tickrig.host.rtc.canopen.events import ServerEvent, ServerEventType
from tickrig.host.rtc.canopen.node.served_node import NodePhase
from tickrig.host.rtc.canopen.view import NodeView
from tickrig.host.tui.line_view import Line

DIM: Final = "bright_black"
MARK: Final = "bold yellow"
ALARM: Final = "bold red"

STAMP: Final = 12
"""Columns of a time."""

GOOD: Final = (
    ServerEventType.BOOT_UP,
    ServerEventType.PROXY_MADE,
    ServerEventType.STATE_CHANGED,
    ServerEventType.CONNECTED,
    ServerEventType.PDO_LINKED,
    ServerEventType.PDO_UNLINKED,
    ServerEventType.BUS_ON,
)
"""Events that are nothing to see to."""


def event_lines(event: ServerEvent, width: int) -> list[Line]:
    """Return an event as lines of so many columns, which cut no word."""
    at, _, rest = str(event).partition(" ")
    style = "" if event.kind in GOOD else ALARM
    stamps = chain([f"{at:>{STAMP}} "], repeat(" " * (STAMP + 1)))
    parts = wrap(rest, max(1, width - STAMP - 1)) or [""]
    return [((stamp, DIM), (part, style)) for stamp, part in zip(stamps, parts, strict=False)]


def status_line(nodes: tuple[NodeView, ...], file: str, bus: str, marked: str) -> Line:
    """Return what is served, where, and what is to be connected."""
    ready = sum(node.phase is NodePhase.READY for node in nodes)
    active = sum(node.proxy_state == "ACTIVE" for node in nodes)
    return (
        (f" {file} ", "bold"),
        (f" {bus}  {ready} of {len(nodes)} nodes ready, {active} active", ""),
        (f"  marked: {marked.partition(' ')[2]}" if marked else "", MARK),
    )
