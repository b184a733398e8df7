"""What becomes of a value that is written (OpenRTM-aist 1.x, DataPortStatus)."""

from __future__ import annotations

from enum import IntEnum


class PortStatus(IntEnum):
    """Result of a write, with the numbers of OpenRTM; those that cannot come are left out."""

    PORT_OK = 0
    BUFFER_FULL = 3
    BUFFER_TIMEOUT = 5
    INVALID_ARGS = 10
