"""Find out that two nodes have one node-ID, by what they differ in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Final

from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.canopen.sdo.sdo import UploadInitiateResponse, parse_response
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

NEARER: Final = 4
"""So many times nearer to one time than to the other is a heartbeat that belongs to it."""

STEADY: Final = 10
"""A heartbeat is in time within one part in so many of the producer time."""

APART: Final = 100
"""Times that part by less than one part in so many of the producer time are the same."""

CROWDED: Final = 10
"""Two heartbeats in each of so many producer times are of two nodes, or 1017h was changed."""

CREDIT: Final = 3
"""Commands that are kept in mind for a state that a node has not told yet."""

IDENTITY: Final = frozenset({0x1000, 0x1018})
"""Objects whose values no node changes."""

COMMANDED: Final[Mapping[int, NmtState]] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


class DuplicateNodeDetector:
    """Listens to what comes from a node-ID, by the time stamps of the bus.

    Two nodes show by what one alone cannot say:

    - a boot-up, and heartbeats that go on at the times of before;
    - Operational, or Pre-operational after Stopped, that nobody commanded, twice;
    - two answers to a question for the identity, as for the serial number.

    A count shows nothing: a node that was held up sends all at once what it owes. Two
    heartbeats in each producer time are a suspicion.

    Not seen: nodes that send the very same frames at the very same time.

    Args:
        period_us: producer heartbeat time.

    Attributes:
        sure_us: when a node that has booted has no twin, if there was no sign of one.
        sign: what shows that there are two, empty while nothing does.
        suspicion: what hints at it, empty while nothing does.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self.sure_us = NEVER
        self._booted_us = 0
        self._commanded = Counter[NmtState]()
        self._state: NmtState | None = None
        self.forget()

    def forget(self) -> None:
        """Begin anew: something may have been missed, or its producer time was written."""
        self._old_us, self._steady = 0, False
        self._clear()

    def _clear(self) -> None:
        self.sign = self.suspicion = ""
        self._strangers, self._doubt_us = 0, -NEVER
        self._identity: dict[tuple[int, int], bytes | None] = {}
        self._double = _DoubleHeartbeats(self._period_us)

    def command(self, command: int) -> None:
        """Hear an NMT command of anybody to the node."""
        if (state := COMMANDED.get(command)) is not None:
            self._commanded[state] = min(self._commanded[state] + 1, CREDIT)

    def answer(self, data: bytes) -> None:
        """Hear an SDO response."""
        try:
            answer = parse_response(data)
        except WireError:
            return
        if not isinstance(answer, UploadInitiateResponse) or answer.index not in IDENTITY:
            return
        first = self._identity.setdefault((answer.index, answer.sub), answer.data)
        if answer.data != first and first and answer.data:
            values = f"{first[::-1].hex().upper()}h and {answer.data[::-1].hex().upper()}h"
            self.sign = f"{answer.index:04X}h:{answer.sub:02X} is {values}"

    def receive(self, at_us: int, state: NmtState, *, listening: bool) -> None:
        """Take a boot-up or heartbeat.

        Args:
            at_us: when it was on the bus.
            state: what it says.
            listening: whether nothing was said to the node since it booted.
        """
        before, self._state = self._state, state
        if state is NmtState.INITIALISING:
            self._clear()
            self._steady &= at_us - self._old_us <= self._period_us * 5 // 4
            self._booted_us = at_us
            self.sure_us = at_us + self._period_us * 5 // 4
            return
        self._judge_state(at_us, before, state)
        if listening:
            self._judge_time(at_us)
            return
        late_us = abs(at_us - self._old_us - self._period_us)
        self._old_us, self._steady = at_us, STEADY * late_us <= self._period_us
        if self._double.receive(at_us):
            self.suspicion = f"two heartbeats in each {self._period_us // 1_000} ms"

    def _judge_state(self, at_us: int, before: NmtState | None, state: NmtState) -> None:
        """See whether a node alone can be there now."""
        if state is before:
            return
        commanded = self._commanded[state] > 0
        self._commanded[state] -= commanded
        if commanded or _goes_by_itself(before, state):
            return
        if at_us - self._doubt_us < CROWDED * self._period_us:
            self.sign = f"{state.name} in turn with {before.name if before else ''}, uncommanded"
        self._doubt_us = at_us

    def _judge_time(self, at_us: int) -> None:
        """See whether a heartbeat is one of before the boot-up."""
        if not self._steady:  # it was held up: its times say nothing
            return
        old_us, new_us = self._off_us(at_us - self._old_us), self._off_us(at_us - self._booted_us)
        if APART * new_us >= self._period_us and NEARER * old_us <= new_us:
            self._strangers += 1
            self.sure_us = max(self.sure_us, at_us + self._period_us * 5 // 4)
        if self._strangers > 1:
            self.sign = "a boot-up, and heartbeats at the times of before"

    def _off_us(self, span_us: int) -> int:
        """Return by how much a time is not one of whole periods."""
        over_us = span_us % self._period_us
        return min(over_us, self._period_us - over_us)


class _DoubleHeartbeats:
    """Says when two heartbeats came in each of many producer times on end."""

    def __init__(self, period_us: int) -> None:
        self._period_us, self._begin_us = period_us, -1
        self._window = self._count = self._run = 0

    def receive(self, at_us: int) -> bool:
        """Take a heartbeat; True if there are too many."""
        if self._begin_us < 0:
            self._begin_us = at_us - self._period_us // 2
        window = (at_us - self._begin_us) // self._period_us
        if window != self._window:
            on_end = window == self._window + 1 and self._count > 1
            self._run = self._run + 1 if on_end else 0
            self._window, self._count = window, 0
        self._count += 1
        return self._run >= CROWDED


def _goes_by_itself(before: NmtState | None, state: NmtState) -> bool:
    """Say whether a node may go there without a command (CiA 301: 1029h, and after its boot-up)."""
    if before in (None, NmtState.INITIALISING) or state is NmtState.STOPPED:
        return True
    return before is NmtState.OPERATIONAL
