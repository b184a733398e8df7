"""Wait until a component is where it was asked to go."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.rtc.at import components

POLL_S: Final = 0.01
ERROR: Final = "ERROR"


def settle(socket: Path, name: str, wanted: str, wait_us: int) -> None:
    """Return when a component is in the wanted state.

    Args:
        socket: control socket of its system.
        name: the component.
        wanted: name of a life-cycle state.
        wait_us: how long to wait; with 0 not at all.

    Raises:
        Refused: the component or its system is gone.
        click.ClickException: it went to Error instead, or needs longer.
    """
    start_s = time.monotonic()
    while wait_us:
        (component,) = components(socket, name)
        if (state := component["state"]) == wanted:
            return
        waited_us = (time.monotonic() - start_s) * 1e6
        if waited_us > wait_us or (state == ERROR and waited_us > _periods_us(component)):
            raise click.ClickException(f"{name} is {state}, not {wanted}")
        time.sleep(POLL_S)


def _periods_us(component: Any) -> float:
    """Return how long a move takes at most: two periods, and a moment for the way there."""
    rate_hz: float = component["contexts"][0]["rate_hz"]
    return 2e6 / rate_hz + 100_000
