"""On which of several buses a panel sends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tickrig.host.canmon.tui.settings.settings import text_of
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.canmon.workspace import SettingError


def checked_bus(session: Session, settings: Mapping[str, Any]) -> str:
    """Return the bus that settings name, empty for the first; SettingError if it is not there.

    A log has no buses: then any name may stand there.
    """
    bus = text_of(settings, "bus", "")
    if bus and session.buses and bus not in session.buses:
        raise SettingError(("bus",), f"{bus!r} is none of {', '.join(session.buses)}")
    return bus


def next_bus(session: Session, bus: str) -> str:
    """Return the bus after one, the first after the last."""
    names = list(session.buses) or [""]
    place = names.index(bus) if bus in names else 0
    return names[(place + 1) % len(names)]
