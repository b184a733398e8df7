"""A drive that follows its target position, from where it is."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.conform.bus.sdo_frames import SdoFrames
from tickrig.host.canopen.conform.bus.step_failed import Disturbed, StepFailed
from tickrig.host.canopen.conform.notation.names import Address

POLL_MS: Final = 20
NOISE: Final = 1
"""By so many counts the position of a drive that stands may differ."""
POSITION_BYTES: Final = 4
"""Positions are INTEGER32 (CiA 402-2, 607Ah and 6064h)."""


def follow(  # noqa: PLR0913, PLR0917 - the words of the macro
    sdo: SdoFrames, target: Address, actual: Address, step: str, tolerance: str, within_ms: str
) -> None:
    """Set a target beside the actual position, and wait until the drive is there.

    Args:
        sdo: the drive.
        target: 607Ah.
        actual: 6064h.
        step: from the actual position, in counts; small, so that no drive sees a jump.
        tolerance: by so many counts it may be beside the target.
        within_ms: so long may it take, and so long may the drive turn before.

    Raises:
        StepFailed: it is not there in time.
        Disturbed: it turns all the time, as something else moves it.
    """
    wanted = _rest(sdo, actual, int(within_ms)) + int(step)
    sdo.write(target, (wanted & 0xFFFF_FFFF).to_bytes(POSITION_BYTES, "little"))
    for waited_ms in range(0, int(within_ms) + 1, POLL_MS):
        got = _position(sdo, actual)
        if abs(got - wanted) <= int(tolerance):
            return
        if waited_ms + POLL_MS <= int(within_ms):
            sdo.exchange.wait(POLL_MS)
    raise StepFailed(f"at {got} after {within_ms} ms, want {wanted}, {tolerance} off at most")


def _rest(sdo: SdoFrames, actual: Address, within_ms: int) -> int:
    """Wait until the drive stands; return where."""
    before = _position(sdo, actual)
    for _ in range(0, within_ms, POLL_MS):
        sdo.exchange.wait(POLL_MS)
        now = _position(sdo, actual)
        if abs(now - before) <= NOISE:
            return now
        before = now
    raise Disturbed(f"the drive does not come to rest within {within_ms} ms")


def _position(sdo: SdoFrames, at: Address) -> int:
    return int.from_bytes(sdo.read_data(at, POSITION_BYTES), "little", signed=True)
