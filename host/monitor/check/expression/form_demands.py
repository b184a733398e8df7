"""Demands on the form of frames: their length, the toggle bit of guarding."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.check.expression.demand import Demand
from tickrig.host.monitor.check.expression.event import Event, said
from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.frames.record import Record
from tickrig.wire.can import CanFrame

LENGTHS: Final = {
    "nmt": (2,),
    "sync": (0, 1),
    "time": (6,),
    "emcy": (8,),
    "sdo": (8,),
    "boot-up": (1,),
    "heartbeat": (1,),
    "guard": (1,),
    "lss": (8,),
}
"""Bytes of the data frames of a kind (CiA 301; CiA 305)."""


class Dlc(Demand):
    """Frames are as long as CiA 301, or the mapping of a PDO, says; remote frames are free.

    A PDO whose mapping nobody told is not judged.

    Args:
        event: the frames.
    """

    def __init__(self, event: Event) -> None:
        self._matches = event.matches

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the length."""
        frame = record.frame
        if not isinstance(frame, CanFrame) or frame.remote:
            return None
        size = decoded.size
        right = LENGTHS.get(decoded.kind, ()) if size is None else (size,)
        length = len(frame.data)
        if not right or length in right or not self._matches(record, decoded):
            return None
        node = "" if decoded.node is None else f" of node {decoded.node}"
        wanted, why = " or ".join(map(str, right)), "" if size is None else " by its mapping"
        return f"{decoded.kind}{node} has {length} B, {wanted} is right{why}"


class Toggle(Demand):
    """The toggle bit of guarding changes with each answer, from 0 after a boot-up on.

    Args:
        event: the answers; those of a node that was guarded before belong to them.
    """

    def __init__(self, event: Event) -> None:
        self._matches = event.matches
        self._last: dict[tuple[str, int | None], int | None] = {}

    def begin(self, at_us: int) -> None:
        """Forget what was before."""
        self._last.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the bit with the one before."""
        frame, key = record.frame, (record.channel, decoded.node)
        if decoded.kind == "boot-up" and key in self._last:
            self._last[key] = 1
        if decoded.kind not in ("guard", "heartbeat") or not isinstance(frame, CanFrame):
            return None
        if key not in self._last and not self._matches(record, decoded):
            return None
        last = self._last.setdefault(key, None)
        if frame.remote or len(frame.data) != 1:
            return None
        toggle = self._last[key] = frame.data[0] >> 7
        return f"{said(decoded)}: toggle {1 - toggle} is right" if toggle == last else None
