"""Frames to and from the node under test, judged by the time stamps of its bus."""

from __future__ import annotations

import re
from collections import defaultdict, deque
from functools import cache
from typing import Final

from tickrig.host.canopen.conform.bus.evidence import Evidence
from tickrig.host.canopen.conform.bus.step_failed import StepFailed
from tickrig.host.canopen.conform.bus.traffic import Allowance, ForeignLoad
from tickrig.host.canopen.conform.verdict import Direction
from tickrig.host.links.link import StampedLink
from tickrig.wire.can import CanFrame

MS_US: Final = 1_000

SLICE_US: Final = 20_000
"""So long a wait at most: a host that was stopped meanwhile sees that it lasted longer."""

HOST_GAP_US: Final = 10_000
"""By so much a wait, or what is between two waits, may last too long before the host is late."""

NODE_ID_MASK: Final = 0x7F
"""These bits of a CAN-ID are the node-ID, in the pre-defined connection set."""

UNREAD_FRAMES: Final = 2_000
"""So many frames of a CAN-ID are kept unread; a node that floods the bus loses the oldest."""


class Exchange:
    """The bus as a check sees it: frames are text, and stay unread, per CAN-ID, until taken.

    Args:
        link: the bus; its time stamps are what is judged.
        node_id: of the node under test, 1..127.
        allowance: how much may be sent.
        foreign: the load by others.
        resolution_us: of the time stamps; a frame may be so much late.

    Attributes:
        evidence: of the check under way.
        disturbances: why the check under way cannot fail, each once.
    """

    def __init__(
        self,
        link: StampedLink,
        node_id: int,
        allowance: Allowance,
        foreign: ForeignLoad,
        resolution_us: int = MS_US,
    ) -> None:
        self._link, self._node_id, self.resolution_us = link, node_id, resolution_us
        self._allowance, self._foreign = allowance, foreign
        self.start_us = self._known_us = self._busy_us = link.now_us
        self._unread: defaultdict[str, deque[tuple[int, str]]] = defaultdict(_queue)
        self._watched: frozenset[str] = frozenset()
        self.evidence, self.disturbances = Evidence(), dict[str, None]()

    @property
    def now_us(self) -> int:
        """Bus time."""
        return self._link.now_us

    def begin(self, watched: frozenset[str] = frozenset()) -> None:
        """Begin a check: read what is there, and forget it.

        Args:
            watched: CAN-IDs of which frames are kept, beside those of the node.
        """
        self._listen(self.now_us)
        self._watched = watched
        self._unread.clear()
        self.evidence, self.disturbances = Evidence(), {}
        self._busy_us = self.now_us

    def remark(self, text: str) -> None:
        """Add a line of our own to the evidence."""
        self.evidence.add(self.now_us - self.start_us, Direction.REMARK, text)

    def disturb(self, reason: str) -> None:
        """Let the check under way be inconclusive instead of failed."""
        if reason not in self.disturbances:
            self.disturbances[reason] = None
            self.remark(reason)

    def send(self, frame: CanFrame) -> None:
        """Send a frame, when the load allows it."""
        self._listen(self.now_us)
        while (wait_us := self._allowance.wait_us(self.now_us)) > 0:
            self._listen(self.now_us + wait_us)
        self.evidence.add(self.now_us - self.start_us, Direction.SENT, str(frame))
        self._allowance.use(self.now_us, frame)
        self._link.send((frame,))

    def expect(self, patterns: list[str], within_ms: int) -> str:
        """Wait for the next frame on a CAN-ID, which must match one of the patterns.

        Returns:
            The frame.

        Raises:
            StepFailed: none came in time, or another one.
        """
        queue = self._unread[can_id_of(patterns[0])]
        until_us = self.now_us + within_ms * MS_US + self.resolution_us
        while not queue and self._known_us < until_us:
            self._listen(until_us)
        wanted = " or ".join(patterns)
        if not queue:
            raise StepFailed(f"no {wanted} within {within_ms} ms")
        at_us, got = queue.popleft()
        if at_us > until_us:
            late_ms = (at_us - until_us + self.resolution_us) / MS_US
            raise StepFailed(f"{got} came {late_ms:.1f} ms after the {within_ms} ms allowed")
        if not any(matches(pattern, got) for pattern in patterns):
            raise StepFailed(f"got {got}, want {wanted}")
        return got

    def none(self, can_id: str, for_ms: int) -> None:
        """Wait; StepFailed if a frame on the CAN-ID comes, or is unread."""
        until_us = self.now_us + for_ms * MS_US
        self._listen_until(until_us)
        unread = self._unread[can_id]
        if unread and unread[0][0] <= until_us:
            raise StepFailed(f"unexpected {unread[0][1]}, want none on {can_id} for {for_ms} ms")

    def count(self, pattern: str, for_ms: int, least: int, most: int) -> None:
        """Wait; StepFailed unless so many frames that match come meanwhile."""
        got = len(self.collect(pattern, for_ms))
        if not least <= got <= most:
            raise StepFailed(f"{got} x {pattern} in {for_ms} ms, want {least}..{most}")

    def collect(self, pattern: str, for_ms: int) -> list[int]:
        """Wait; return the times of the frames that match and come meanwhile."""
        unread = self._unread[can_id_of(pattern)]
        unread.clear()
        until_us = self.now_us + for_ms * MS_US
        self._listen_until(until_us)
        times = [at_us for at_us, text in unread if at_us <= until_us and matches(pattern, text)]
        unread.clear()
        return times

    def wait(self, for_ms: int) -> None:
        """Let time pass."""
        self._listen_until(self.now_us + for_ms * MS_US)

    def unread(self, can_id: str) -> deque[tuple[int, str]]:
        """Return the frames of a CAN-ID, with their times, that nobody has taken."""
        return self._unread[can_id]

    def _listen_until(self, until_us: int) -> None:
        while self._known_us < until_us:
            self._listen(until_us)

    def _listen(self, until_us: int) -> None:
        """Take what arrives, at most until a time, and see whether the host was late."""
        before_us = self.now_us
        wait_us = max(0, min(until_us - before_us, SLICE_US))
        self._known_us, received = self._link.receive_stamped(wait_us)
        after_us = self.now_us
        gap_us = max(before_us - self._busy_us, after_us - before_us - wait_us)
        self._busy_us = after_us
        if gap_us > HOST_GAP_US:
            self.disturb(f"this host was late by {gap_us / MS_US:.0f} ms")
        for at_us, frame in received:
            self._take(at_us, frame)

    def _take(self, at_us: int, frame: CanFrame) -> None:
        text = str(frame)
        can_id = can_id_of(text)
        own = frame.can_id & NODE_ID_MASK == self._node_id and not frame.extended
        if own or can_id in self._watched:
            self._unread[can_id].append((at_us, text))
            self.evidence.add(at_us - self.start_us, Direction.RECEIVED, text)
        if own:
            self._allowance.use(at_us, frame)
        elif self._foreign.add(at_us, frame):
            self.disturb("other nodes load the bus too much")


def can_id_of(pattern: str) -> str:
    """Return the CAN-ID of a frame or a pattern in text."""
    return pattern.partition("#")[0]


def matches(pattern: str, text: str) -> bool:
    """Compare frames; a dot stands for any digit, [..] for one of some, * for any rest.

    >>> matches("585#4F011000........", "585#4F01100003000000"), matches("185#*", "185#0100")
    (True, True)
    """
    return _compiled(pattern).fullmatch(text) is not None


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern.replace("*", ".*"))


def _queue() -> deque[tuple[int, str]]:
    return deque(maxlen=UNREAD_FRAMES)
