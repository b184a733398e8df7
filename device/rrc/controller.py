"""The buttons of the VR2 controller as the RRC sees them while VR2 runs."""

from __future__ import annotations

from typing import Final

from tickrig.device.physical import InputBank
from tickrig.device.rrc.settings import Settings

SPEED_MODES: Final = range(1, 6)

BUTTON_MODES: Final = {(0, 0): 0, (1, 0): 1, (0, 1): 2, (1, 1): 3}
"""Reverse mode by held buttons, (down, up), when alarm is pressed (RRC manual, last page)."""


def count_button_edges(inputs: InputBank, settings: Settings) -> bool:
    """Count button edges and do what speed buttons do.

    A counter is odd while its button is pressed (RRC manual, SA #7 to #9); so a
    counter whose parity differs from the button is the edge itself. Edges count
    whether or not the lock is on (DECISION R23).

    Returns:
        Whether the alarm button has just been pressed.
    """
    up, down = inputs["speed_up_button"], inputs["speed_down_button"]
    if settings.speed_up_count & 1 != up:
        settings.speed_up_count = (settings.speed_up_count + 1) & 0xF
        _shift_speed(settings, up)
    if settings.speed_down_count & 1 != down:
        settings.speed_down_count = (settings.speed_down_count + 1) & 0xF
        _shift_speed(settings, -down)
    if settings.alarm_count & 1 != inputs["alarm_button"]:
        settings.alarm_count = (settings.alarm_count + 1) & 0xF
        return bool(inputs["alarm_button"])
    return False


def chosen_mode(inputs: InputBank) -> int:
    """Return the reverse mode that the held speed buttons choose (DECISION R8)."""
    return BUTTON_MODES[inputs["speed_down_button"], inputs["speed_up_button"]]


def _shift_speed(settings: Settings, step: int) -> None:
    mode = settings.speed_mode + step
    if not settings.speed_locked and mode in SPEED_MODES:
        settings.speed_mode = mode
