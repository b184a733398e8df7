"""States of a drive, out of its statusword (CiA 402, state machine).

>>> drive_state(0x0237), drive_state(0x0250), drive_state(0x0010)
('operation enabled', 'switch on disabled', 'not ready to switch on')
"""

from __future__ import annotations

from typing import Final

_STATES: Final = (
    (0x4F, 0x00, "not ready to switch on"),
    (0x4F, 0x40, "switch on disabled"),
    (0x6F, 0x21, "ready to switch on"),
    (0x6F, 0x23, "switched on"),
    (0x6F, 0x27, "operation enabled"),
    (0x6F, 0x07, "quick stop active"),
    (0x4F, 0x0F, "fault reaction active"),
    (0x4F, 0x08, "fault"),
)
"""Mask, value, state."""

STATUSWORD_BITS: Final = {
    "ready_to_switch_on": 0,
    "switched_on": 1,
    "operation_enabled": 2,
    "fault": 3,
    "voltage_enabled": 4,
    "quick_stop": 5,
    "switch_on_disabled": 6,
    "warning": 7,
    "remote": 9,
    "target_reached": 10,
    "internal_limit_active": 11,
}
CONTROLWORD_BITS: Final = {
    "switch_on": 0,
    "enable_voltage": 1,
    "quick_stop": 2,
    "enable_operation": 3,
    "fault_reset": 7,
    "halt": 8,
}
BITS: Final = {"statusword": STATUSWORD_BITS, "controlword": CONTROLWORD_BITS}
"""Bits by name, of the objects whose bits have names."""


def _find(bits: int) -> str:
    return next((state for mask, value, state in _STATES if bits & mask == value), "")


_BY_BITS: Final = tuple(_find(bits) for bits in range(0x80))


def drive_state(statusword: int) -> str:
    """Return the state; empty for bits that are none."""
    return _BY_BITS[statusword & 0x7F]
