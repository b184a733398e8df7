"""How homing goes, by bits 10, 12 and 13 of the statusword (CiA 402-2, homing mode)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from tickrig.host.canopen.master.cia402.drive_mode import HomingMode
from tickrig.host.canopen.master.cia402.drive_state import Statusword
from tickrig.host.canopen.master.waiting import DriveFailed, Operation, Until

START_US: Final = 1_000_000
"""So soon the drive is at rest before homing, and homing has begun."""

SEEN_US: Final = 100_000
"""By then a drive that has homed before shows that it homes again."""

REACHED: Final = Statusword.TARGET_REACHED
ATTAINED: Final = Statusword.MODE_12
ERROR: Final = Statusword.MODE_13


async def home(
    name: str, mode: HomingMode, within_us: int, caught_up: Callable[[], Operation]
) -> None:
    """Start homing in a drive that is in this mode, and wait for its end.

    Args:
        name: of the joint.
        mode: what the drive is in.
        within_us: how long homing may take.
        caught_up: waits until the statusword is of after the controlword.

    Raises:
        DriveFailed: it does not start, does not end in time, or reports an error.
    """
    try:
        await _home(name, mode, within_us, caught_up)
    finally:
        mode.runs = False


async def _home(
    name: str, mode: HomingMode, within_us: int, caught_up: Callable[[], Operation]
) -> None:
    await _await(name, mode, ERROR | REACHED, 0, START_US, "is not at rest")
    mode.runs = True
    every = ERROR | ATTAINED | REACHED
    if mode.status & ATTAINED:  # by the homing before: the bit may fall and rise unseen
        await caught_up()
        with suppress(DriveFailed):
            await Until(lambda: not mode.status & ATTAINED, SEEN_US, "")
    else:
        await _await(name, mode, every, REACHED, START_US, "did not start")
    await _await(name, mode, ERROR | ATTAINED, 0, within_us, "did not find home")
    await _await(name, mode, ERROR | REACHED, 0, within_us, "did not come to rest")


async def _await(  # noqa: PLR0913, PLR0917 - a row of what is awaited
    name: str, mode: HomingMode, mask: int, before: int, within_us: int, complaint: str
) -> None:
    """Wait until some bits are no longer as before; raise DriveFailed where they say error."""
    await Until(lambda: mode.status & mask != before, within_us, f"{name}: homing {complaint}")
    if mode.status & ERROR:
        raise DriveFailed(f"{name}: homing error (bit 13 of the statusword)")
