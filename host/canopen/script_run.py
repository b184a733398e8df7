"""Runs a script to its end, for who has nothing else to do meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tickrig.host.canopen.dialogue import Dialogue, QueuedScript, Script
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.canopen.sdo_frame import RESPONSE_COB_ID

T = TypeVar("T")

_STATE_BITS = 0x7F

_Listen = Callable[[int], tuple[int, StampedFrames]]
"""Waits for a first frame until a time; returns a time, and all that had arrived by then."""


def run_script(talk: Dialogue, node_id: int, script: Script[T], now_us: int, listen: _Listen) -> T:
    """Run a script, and return or raise what it does.

    What came before is read first: an answer in the queue of the driver is not one to this script.

    Args:
        talk: says it; it has nothing else to say.
        node_id: whose answers and states count, 1..127; other frames are passed over.
        script: what is said.
        now_us: the time.
        listen: waits.

    Raises:
        LinkClosed: the bus is gone.
    """
    ended: list[T | Exception] = []
    now_us = _take(talk, node_id, listen(now_us))
    talk.start(now_us, QueuedScript("", script, ended.append, ended.append))
    while not ended:
        talk.tick(_take(talk, node_id, listen(talk.due_us)))
    if isinstance(ended[0], Exception):
        raise ended[0]
    return ended[0]


def _take(talk: Dialogue, node_id: int, received: tuple[int, StampedFrames]) -> int:
    """Hand over what was received; return the time of it."""
    now_us, frames = received
    for _, frame in frames:
        if not (frame.remote or frame.extended):
            _hand_over(talk, node_id, now_us, frame)
    return now_us


def _hand_over(talk: Dialogue, node_id: int, now_us: int, frame: CanFrame) -> None:
    if frame.can_id == RESPONSE_COB_ID + node_id:
        talk.receive_sdo(now_us, frame.data)
    elif frame.can_id == ERROR_CONTROL_COB_ID + node_id:
        state = state_of(frame)
        if state is not None:
            talk.receive_state(now_us, state)


def state_of(frame: CanFrame) -> NmtState | None:
    """Return what a frame of error control says; None if it says no state."""
    try:
        return NmtState(frame.data[0] & _STATE_BITS) if len(frame.data) == 1 else None
    except ValueError:
        return None
