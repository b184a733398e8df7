"""Demands on the form of frames: their length, the toggle bit of guarding."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.check.expression.demand import Demand
from tickrig.host.canmon.model.check.expression.event import Event, said
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.frames.record import Record
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


Pair = tuple[str, int | None]
"""A bus and a node."""


class Dlc(Demand):
    """Frames are as long as CiA 301, or the mapping of a PDO, says; remote frames are free.

    A PDO whose mapping nobody told is not judged.

    Args:
        event: the frames.
    """

    def __init__(self, event: Event) -> None:
        self._matches = event.matches
        self.doubt = f"no frame of {event.text} came whose length is known"

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the length."""
        frame = record.frame
        if not isinstance(frame, CanFrame) or frame.remote:
            return None
        size = decoded.size
        right = LENGTHS.get(decoded.kind, ()) if size is None else (size,)
        length = len(frame.data)
        if not right or (length in right and self.judged) or not self._matches(record, decoded):
            return None
        self.judged = True
        if length in right:
            return None
        node = "" if decoded.node is None else f" of node {decoded.node}"
        wanted, why = " or ".join(map(str, right)), "" if size is None else " by its mapping"
        return f"{decoded.kind}{node} has {length} B, {wanted} is right{why}"


UNASKED: Final = 2
"""So many heartbeats without a request: the node produces them, and answers none."""


@dataclass(slots=True)
class _Guarding:
    """What is known of the guarding of a node.

    Attributes:
        last: toggle bit of its latest answer; None before the first.
        requested: a request waits for its answer; None where none was heard.
    """

    last: int | None = None
    requested: bool | None = None


class Toggle(Demand):
    """The toggle bit of guarding changes with each answer, from 0 after a boot-up on.

    An answer follows a request. Where a log has no requests, what follows a frame with the bit
    set is an answer. A node that produces heartbeats answers none.

    Args:
        event: the answers; those of a node that was guarded before belong to them.
    """

    def __init__(self, event: Event) -> None:
        self._matches = event.matches
        self._nodes: dict[Pair, _Guarding] = {}
        self._unasked: Counter[Pair] = Counter()
        self.doubt = f"no two answers of {event.text} to guarding came"

    def begin(self, at_us: int) -> None:
        """Forget what was before."""
        self._nodes.clear()
        self._unasked.clear()

    def judge(self, record: Record, decoded: Decoded) -> str | None:
        """Compare the bit with the one before."""
        frame, key = record.frame, (record.channel, decoded.node)
        if decoded.kind == "boot-up":
            self._boot(key)
        if decoded.kind not in ("guard", "heartbeat") or not isinstance(frame, CanFrame):
            return None
        if key not in self._nodes and self._matches(record, decoded):
            self._nodes[key] = _Guarding()
        node = self._nodes.get(key)
        if frame.remote:
            if node is not None:
                node.requested = True
        elif len(frame.data) == 1 and self._is_answer(key, node, frame.data[0] >> 7):
            return self._compare(self._nodes[key], frame.data[0] >> 7, decoded)
        return None

    def _boot(self, key: Pair) -> None:
        self._unasked[key] = 0
        if key in self._nodes:
            requested = None if self._nodes[key].requested is None else False
            self._nodes[key] = _Guarding(1, requested)

    def _is_answer(self, key: Pair, node: _Guarding | None, toggle: int) -> bool:
        """Say whether a frame with this bit answers a request; the request is gone then."""
        requested = False if node is None else node.requested
        if node is not None and requested:
            node.requested = False
        if toggle:
            self._unasked[key] = 0
        elif requested is False:
            self._unasked[key] += 1
        return node is not None and (
            bool(toggle) or requested is None or (requested and self._unasked[key] < UNASKED)
        )

    def _compare(self, node: _Guarding, toggle: int, decoded: Decoded) -> str | None:
        last, node.last = node.last, toggle
        self.judged |= last is not None
        return f"{said(decoded)}: toggle {1 - toggle} is right" if toggle == last else None
