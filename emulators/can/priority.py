"""Arbitration: the bits that nodes compare on the bus, as a number."""

from __future__ import annotations

from collections.abc import Sequence

from tickrig.wire.can import CanFrame


def priority(frame: CanFrame) -> int:
    """Return the arbitration field as a number; the smallest wins, dominant bits being 0.

    With equal identifiers data come before remote frames, and 11-bit before
    29-bit identifiers (ISO 11898-1, arbitration).

    >>> frames = [CanFrame.parse(t) for t in ("101#", "100#", "100#R", "04000000#", "04000000#R")]
    >>> [str(frame) for frame in sorted(frames, key=priority)]
    ['100#', '100#R', '04000000#', '04000000#R', '101#']
    """
    can_id, _, remote, extended, _ = frame
    if extended:
        return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3_FFFF) << 1 | remote
    return can_id << 21 | remote << 20


def first_difference(frames: Sequence[CanFrame]) -> int:
    """Return at which bit, counted without stuff bits, frames of one priority begin to differ."""
    control = 39 if frames[0].extended else 19
    if len({frame.dlc for frame in frames}) > 1:
        return control
    least, most = (int.from_bytes(pick(f.data for f in frames), "big") for pick in (min, max))
    return control + 8 * frames[0].dlc - (least ^ most).bit_length()


def dominant(frames: Sequence[CanFrame]) -> CanFrame:
    """Return the frame that would be heard if the other senders gave way."""
    return min(frames, key=lambda frame: (frame.dlc, frame.data))
