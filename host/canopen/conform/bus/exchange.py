"""Frames to and from the node under test, checked by the time stamps of its bus."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from typing import Final

from tickrig.host.canopen.conform.bus.frame_pattern import can_id_of, matches, unlike, wanted_text
from tickrig.host.canopen.conform.verdict import Direction, FrameLine
from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.wire.can import CanFrame, data_frame, frame_bits, kept_bits
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID
from tickrig.wire.instant import NEVER

# Errors that end a check early.
#
# StepFailed      the node did not do what the step says
# NotAllowed      the level of the run does not allow what the step does
# Disturbed       no verdict is possible: the host, the bus or another node interfered


class StepFailed(Exception):  # noqa: N818 - what the step did
    """Raised if the node under test does not react as a step of a check expects.

    The message contains the received frame and the expected ones.

    Attributes:
        got: received frame in candump notation, empty if no frame was received.
        wanted: patterns of the frames that would have been correct, or an empty tuple if no frame
            was expected.
    """

    def __init__(self, text: str, got: str = "", wanted: Iterable[str] = ()) -> None:
        super().__init__(text)
        self.got, self.wanted = got, tuple(wanted)


class NotAllowed(Exception):  # noqa: N818 - what the step is
    """Raised if a step of a check needs more permissions than the user has given to the run.

    The message contains the step and the option that would allow it.
    """


class Disturbed(Exception):  # noqa: N818 - what the check was
    """A check that cannot be judged. The message contains the reason."""


# The evidence of a check: the frames on the bus, with their times.

FIRST_LINES: Final = 40
LAST_LINES: Final = 160
"""Numbers of first and last lines that are kept as evidence of a long check."""
LEFT_OUT: Final = "lines left out"
"""The end of the remark that replaces the omitted lines."""


_Line = tuple[int, Direction, CanFrame | str]


class Evidence:
    """Recorded frames and remarks of one attempt at a check, which reports show for a failure.

    If there are many lines, only the first and the last lines are kept. Frames are formatted when
    the lines are read.
    """

    def __init__(self) -> None:
        self._first: list[_Line] = []
        self._last: deque[_Line] = deque(maxlen=LAST_LINES)
        self._left_out = 0

    def add(self, at_us: int, direction: Direction, what: CanFrame | str) -> None:
        """Add a frame or a remark."""
        if len(self._first) < FIRST_LINES:
            self._first.append((at_us, direction, what))
            return
        self._left_out += len(self._last) == LAST_LINES
        self._last.append((at_us, direction, what))

    def lines(self) -> tuple[FrameLine, ...]:
        """Return the lines, with a remark in place of omitted ones."""
        left_out: list[_Line] = []
        if self._left_out:
            remark = f"{self._left_out} {LEFT_OUT}"
            left_out.append((self._last[0][0], Direction.REMARK, remark))
        lines = (*self._first, *left_out, *self._last)
        return tuple(FrameLine(at_us, way, str(what)) for at_us, way, what in lines)


# Check of the period of frames.

MS_US: Final = 1_000
PERIOD_TOLERANCE: Final = 0.05
"""Allowed relative error of the mean period.

CiA 301 gives no limit, and crystals are far better.
"""


def _off_period(stamps: Sequence[int], each_ms: int, times: int, resolution_us: int) -> str:
    """Return the error in the mean period or the number of periods, or an empty text without error.

    Args:
        stamps: arrival times of frames in microseconds. Surplus times at the end are ignored.
        each_ms: the expected period.
        times: the expected number of periods, which is one less than the number of frames.
        resolution_us: resolution of the arrival times.

    >>> _off_period([0, 53_000, 106_000], 50, 2, 0)
    'each 53.0 ms, want 50 ms, 5 % off at most'
    >>> _off_period([0, 50_000], 50, 2, 0), _off_period([0, 50_000, 100_000], 50, 2, 0)
    ('came 2 times, want 2 periods of 50 ms', '')
    """
    stamps = stamps[: times + 1]
    seen = max(1, len(stamps) - 1)
    mean_ms = (stamps[-1] - stamps[0]) / seen / MS_US if stamps[1:] else each_ms
    if abs(mean_ms - each_ms) > each_ms * PERIOD_TOLERANCE + resolution_us / seen / MS_US:
        tolerance = f"{PERIOD_TOLERANCE * 100:g} % off at most"
        return f"each {mean_ms:.1f} ms, want {each_ms} ms, {tolerance}"
    if len(stamps) <= times:
        return f"came {len(stamps)} times, want {times} periods of {each_ms} ms"
    return ""


# The number of nodes that answer to one node-ID, determined from the answers to requests.

_LEAST: Final = 3
"""Number of requested objects from which the number of answers is significant."""
_ANSWERS: Final = (sdo_frame.ServerCommand.UPLOAD, sdo_frame.ServerCommand.ABORT)
_MULTIPLEXER: Final = slice(1, 4)
"""The bytes of an SDO frame that hold index and sub-index."""


class Presence(Enum):
    """The number of nodes with the node-ID under test."""

    NONE = 0
    ONE = 1
    TWO = 2


# The load that the tester may cause, and the load by other nodes.

ASSUMED_BIT_RATE: Final = 125_000
"""Default bit rate in bit/s. The low value keeps the load limit valid on any faster bus."""

_WINDOW_US: Final = 100_000
"""Length of the window over which the load is limited."""

_LONGEST_WAIT_US: Final = 1_000_000
"""Longest wait before a frame, so that a node that floods the bus cannot stop the tester."""

_PLENTY_BIT_S: Final = 12_500
"""Share of the bus in bit/s below which a check may take longer, because everything is slower."""

_FOREIGN_LOAD: Final = 0.5
"""Load by other nodes above which a late or missing answer proves nothing about the node."""


class _Allowance:
    """A limit that keeps the tester within its share of the bit rate, in windows of `_WINDOW_US`.

    Args:
        bit_rate: bit rate of the bus in bit/s.
        max_load: allowed share of the bit rate, above 0 to 1.

    Attributes:
        slowness: factor by which everything may take longer than usual.
        from_us: time before which no frame may be sent.
    """

    def __init__(self, bit_rate: int, max_load: float) -> None:
        self._bits_us, self.from_us = bit_rate * max_load / 1e6, float(-_WINDOW_US)
        self.slowness = max(1.0, _PLENTY_BIT_S / (bit_rate * max_load))

    def use(self, now_us: int, frame: CanFrame) -> None:
        """Count a frame of the tester, or an answer of the node, as bus load of the tester."""
        bits = kept_bits(frame) if type(frame[1]) is bytes else frame_bits(frame)
        self.from_us = max(self.from_us, now_us - _WINDOW_US) + bits / self._bits_us


class _ForeignLoad:
    """The load by other nodes, measured in windows of `_WINDOW_US`.

    Args:
        bit_rate: bit rate of the bus in bit/s.
    """

    def __init__(self, bit_rate: int) -> None:
        self._most_bits = bit_rate * _WINDOW_US * _FOREIGN_LOAD / 1e6
        self._window = self._bits = 0

    def add(self, at_us: int, frame: CanFrame) -> bool:
        """Count the bits of a frame of another node.

        Return True if such frames load the bus so much that the node under test cannot be judged.
        """
        window = at_us // _WINDOW_US
        if window != self._window:
            self._window, self._bits = window, 0
        self._bits += frame_bits(frame)
        return self._bits > self._most_bits


_SLICE_US: Final = 20_000
"""The longest single wait. A wait that lasts longer shows that the host was stopped."""

HOST_GAP_US: Final = 10_000
"""Excess duration of a wait, or of a pause between waits, above which the host counts as late."""

_HELD_US: Final = 20_000
"""Delay of a frame above which the node may act differently, and the check is inconclusive."""
_PAUSE_US: Final = 10_000
"""Pause after an SDO request that has no answer.

A server may accept one frame at a time, and CiA 301 does not specify when it must be ready for the
next frame.
"""
_UNANSWERED: Final = (sdo_frame.ClientCommand.ABORT, sdo_frame.BLOCK_ENDED)
_TOO_LOW: Final = "your --max-load is too low for this check"

_NODE_ID_MASK: Final = 0x7F
"""The node-ID bits of a CAN-ID, in the pre-defined connection set."""

_HEARTBEATS: Final[tuple[range, ...]] = (range(0x701, 0x780),)
_NODES: Final[tuple[range, ...]] = (range(0x081, 0x100), range(0x181, 0x680), range(0x701, 0x780))
"""CAN-IDs of the pre-defined connection set that belong to a node."""

_BEGINNING: Final = (
    sdo_frame.ClientCommand.DOWNLOAD,
    sdo_frame.ClientCommand.UPLOAD,
    sdo_frame.ClientCommand.BLOCK_UPLOAD,
    sdo_frame.ClientCommand.BLOCK_DOWNLOAD,
)
"""Requests that name an object. Some block segments look the same, which does no harm."""

_NAMING: Final = frozenset((*range(0x40, 0x50), 0x60, 0x80, 0xA0, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6))
"""Commands of answers that name an object. Some block segments look the same, without harm."""

_UNREAD_FRAMES: Final = 2_000
"""Number of unread frames kept per CAN-ID. If a node floods the bus, the oldest frames are lost."""


class BusExchange:
    """The bus as a check sees it. Frames are text, and each CAN-ID has a queue of unread frames.

    Args:
        link: connection to the bus. Checks use the time stamps of this bus.
        node_id: node-ID of the node under test, 1..127.
        bit_rate: bit rate of the bus in bit/s.
        max_load: share of the bit rate that the tester may use, above 0 to 1.
        permit: function that checks each frame before it is sent, and raises NotAllowed.
        resolution_us: resolution of the time stamps. A frame may be late by this time.
        shared_host: whether the node may be a process of this machine.

    Attributes:
        evidence: the evidence of the running check.
        disturbances: reasons to make the running check inconclusive instead of failed, without
            duplicates.
        crashes: reasons why the running check fails in any case, without duplicates.
        boots: number of boot-up messages that the node has sent since the start of the run.
        others: node-IDs of other nodes seen on the bus. 0 stands for frames that belong to no node.
        deadline_us: time at which the running check must have ended.
        transfer: answer of the node to the last SDO request that names an object.
        played: node-ID that no other node has. The tester simulates a node with this node-ID, or
            assigns it to the node under test.
        unanswered: requests that name an object and were not answered, in the order of sending.
    """

    def __init__(  # noqa: PLR0913 - a bus, by keyword
        self,
        link: StampedLink,
        node_id: int,
        *,
        bit_rate: int,
        max_load: float,
        permit: Callable[[CanFrame], None],
        resolution_us: int = MS_US,
        shared_host: bool = False,
    ) -> None:
        self._link, self._node_id, self.resolution_us = link, node_id, resolution_us
        self._allowance, self._foreign = _Allowance(bit_rate, max_load), _ForeignLoad(bit_rate)
        self._permit = permit
        self._boot_up = data_frame(ERROR_CONTROL_COB_ID + node_id, bytes(1))
        self.start_us = self._known_us = self._busy_us = link.now_us
        self.deadline_us, self.boots, self.others = NEVER, 0, set[int]()
        self._request = sdo_frame.REQUEST_COB_ID + node_id
        self._response = sdo_frame.RESPONSE_COB_ID + node_id
        self._reserved = frozenset(("000", f"{self._request:03X}"))
        self._origins: dict[tuple[int, bool], tuple[str, bool]] = {}
        self._multiplexer, self.transfer, self._ready_us = b"", bytes(sdo_frame.FRAME_BYTES), 0
        self.unanswered: list[bytes] = []
        self._uploads, self._answered = defaultdict[bytes, int](int), defaultdict[bytes, int](int)
        self._is_silent, self._others_by = True, _NODES
        self.played: int | None = None
        self._shared_host, self._late_us = shared_host, 0
        self._unread: defaultdict[str, deque[tuple[int, CanFrame]]] = defaultdict(_queue)
        self._watched, self._keeps = frozenset[str](), False
        self.evidence, self.disturbances = Evidence(), dict[str, None]()
        self.crashes: dict[str, None] = {}

    @property
    def now_us(self) -> int:
        """Bus time in microseconds."""
        return self._link.now_us

    def begin(self, within_us: int, watched: frozenset[str] | None = None) -> None:
        """Begin a check, or the work between two checks.

        The recorded frames of the previous check are dropped.

        Args:
            within_us: longest duration of the check or of the work, in microseconds.
            watched: CAN-IDs whose frames are recorded, in addition to the CAN-IDs of the node under
                test. An empty set adds no CAN-IDs. None stands for the work between two checks: no
                frames are recorded.
        """
        self.deadline_us = NEVER
        self._listen(self.now_us)
        within_us = round(within_us * self._allowance.slowness)
        self.deadline_us, self._watched = self.now_us + within_us, watched or frozenset()
        self._keeps = watched is not None
        self._unread.clear()
        self.evidence, self.disturbances, self.crashes = Evidence(), {}, {}
        self._busy_us, self._late_us = self.now_us, 0

    @property
    def presence(self) -> Presence:
        """Number of nodes with the tested node-ID that have answered: none, one or two.

        If most SDO requests got two answers, two nodes have this node-ID.
        """
        if self._is_silent:
            return Presence.NONE
        told = self._answered
        twice = sum(told.get(at, 0) == 2 * times for at, times in self._uploads.items())
        many = len(self._uploads) >= _LEAST and 2 * twice > len(self._uploads)
        return Presence.TWO if many else Presence.ONE

    def end_listening(self) -> None:
        """Detect other nodes only by their heartbeat from now on.

        Before this call, a frame with a CAN-ID of another node shows that the other node exists.
        During the checks, the node under test may send frames with such CAN-IDs itself. So, apart
        from heartbeats, they are no longer evidence of another node.
        """
        self._others_by = _HEARTBEATS

    def remark(self, text: str) -> None:
        """Add a remark of the tester to the evidence."""
        self.evidence.add(self.now_us - self.start_us, Direction.REMARK, text)

    def disturb(self, reason: str) -> None:
        """Make the running check inconclusive instead of failed."""
        if reason not in self.disturbances:
            self.disturbances[reason] = None
            self.remark(reason)

    def crash(self, reason: str, where: Iterable[str] = ()) -> None:
        """Make the running check fail, because the program of the node crashed and starts again.

        Args:
            reason: exception of the crash in one line.
            where: lines of the traceback, recorded as remarks.
        """
        self.crashes[reason] = None
        for line in (reason, *where):
            self.remark(line)

    def send(self, frame: CanFrame) -> None:
        """Send a frame to the bus, as soon as the allowed bus load permits.

        Raises:
            NotAllowed: the level of the run does not allow the frame.
        """
        self._permit(frame)
        link, is_request = self._link, frame.can_id == self._request
        now_us = link.now_us
        if now_us > self._known_us:  # never in virtual time: this is half of all polls of the bus
            self._listen(now_us)
            now_us = link.now_us
        if is_request and self._known_us < self._ready_us:
            self._listen_until(self._ready_us)
            now_us = link.now_us
        if now_us < self._allowance.from_us:
            held_us = min(_LONGEST_WAIT_US, int(self._allowance.from_us - now_us) + 1)
            self._listen_until(now_us + held_us)
            now_us = link.now_us
            if held_us > _HELD_US and self._allowance.slowness > 1:
                self.disturb(_TOO_LOW)
        if self._keeps:
            self.evidence.add(now_us - self.start_us, Direction.SENT, frame)
        self._allowance.use(now_us, frame)
        if is_request:
            data = frame.data
            self._multiplexer = data[_MULTIPLEXER]
            if data and data[0] in _UNANSWERED:
                self._ready_us = now_us + _PAUSE_US
            specifier = data[0] & sdo_frame.SPECIFIER if data else None
            if specifier == sdo_frame.ClientCommand.UPLOAD:
                self._uploads[self._multiplexer] += 1
            if len(data) >= _MULTIPLEXER.stop and specifier in _BEGINNING:
                self.unanswered.append(data)
        link.send((frame,))

    def expect(self, patterns: Sequence[str], within_ms: int) -> str:
        """Wait for the next frame with the CAN-ID of the patterns. It must match one of them.

        Args:
            patterns: patterns of the allowed frames. All patterns have the same CAN-ID.
            within_ms: time limit in milliseconds.

        Returns:
            The received frame in candump notation.

        Raises:
            StepFailed: no frame arrives within the time limit, or the frame matches no pattern.
        """
        queue = self._unread[can_id_of(patterns[0])]
        until_us = self.now_us + within_ms * MS_US + self.resolution_us
        while not queue and self._known_us < until_us:
            self._listen(until_us)
        if not queue:
            text = f"no {wanted_text(patterns)} within {within_ms} ms"
            raise StepFailed(text, wanted=patterns)
        at_us, frame = queue.popleft()
        got = str(frame)
        if at_us > until_us:
            late_ms = (at_us - until_us + self.resolution_us) / MS_US
            raise StepFailed(f"{got} came {late_ms:.1f} ms after the {within_ms} ms allowed")
        if not any(matches(pattern, got) for pattern in patterns):
            raise StepFailed(unlike(got, patterns), got, patterns)
        return got

    def none(self, can_id: str, for_ms: int) -> None:
        """Wait. Raise StepFailed if a frame with the CAN-ID arrives or is unread."""
        until_us = self.now_us + for_ms * MS_US
        self._listen_until(until_us)
        unread = self._unread[can_id]
        if unread and unread[0][0] <= until_us:
            raise StepFailed(f"unexpected {unread[0][1]}, want none on {can_id} for {for_ms} ms")

    def count(self, pattern: str, for_ms: int, least: int, most: int) -> None:
        """Wait. Raise StepFailed unless `least` to `most` matching frames arrive."""
        got = len(self.collect(pattern, for_ms))
        if not least <= got <= most:
            raise StepFailed(f"{got} x {pattern} in {for_ms} ms, want {least}..{most}")

    def period(self, pattern: str, each_ms: int, times: int) -> None:
        """Measure the period of frames that match a pattern, for example of a heartbeat.

        Args:
            pattern: pattern of the frames.
            each_ms: expected period in milliseconds.
            times: number of periods to measure.

        Raises:
            StepFailed: the mean period is not the expected one, or too few frames arrive.
        """
        stamps = self.collect(pattern, each_ms * (times + 2))
        if wrong := _off_period(stamps, each_ms, times, self.resolution_us):
            periods = max(1, len(stamps) - 1)
            late_us = (stamps[-1] - stamps[0]) // periods - each_ms * MS_US if stamps else 0
            if self._shared_host and 0 < late_us <= self._late_us:
                late = f"this host was late by {self._late_us / MS_US:.1f} ms"
                raise Disturbed(f"{pattern} {wrong}; {late}, and the node runs on it")
            raise StepFailed(f"{pattern} {wrong}")

    def collect(self, pattern: str, for_ms: int) -> list[int]:
        """Wait. Return the arrival times of the matching frames."""
        unread = self._unread[can_id_of(pattern)]
        unread.clear()
        until_us = self.now_us + for_ms * MS_US
        self._listen_until(until_us)
        times = [at for at, frame in unread if at <= until_us and matches(pattern, str(frame))]
        unread.clear()
        return times

    def forget(self, can_id: str) -> None:
        """Drop the received frames of a CAN-ID."""
        self._listen(self.now_us)
        self._unread[can_id].clear()

    def forget_all(self) -> None:
        """Drop all received frames."""
        self._listen(self.now_us)
        self._unread.clear()

    def excuse(self) -> None:
        """Do not count the time since the last poll of the bus as a delay of this host.

        The caller has waited for the user, for example for the answer to a question.
        """
        self._busy_us = self.now_us

    def wait(self, for_ms: int) -> None:
        """Let time pass."""
        self._listen_until(self.now_us + for_ms * MS_US)

    def unread(self, can_id: str) -> deque[tuple[int, CanFrame]]:
        """Return the unread frames of a CAN-ID with their arrival times."""
        return self._unread[can_id]

    def _listen_until(self, until_us: int) -> None:
        while self._known_us < until_us:
            self._listen(until_us)

    def listen(self, until_us: int) -> tuple[int, StampedFrames]:
        """Wait for the next frames.

        The result is a time in microseconds, and all frames that have arrived up to this time.
        """
        if until_us <= self._known_us == self._link.now_us:
            return self._known_us, ()  # in virtual time; a poll costs as much as a request
        received = self._listen(until_us)
        while not received and self._known_us < until_us:
            received = self._listen(until_us)
        return self._known_us, received

    def _listen(self, until_us: int) -> StampedFrames:
        """Receive frames until a time at the latest. Detect whether the host was late."""
        link = self._link
        before_us = link.now_us
        if before_us > self.deadline_us:
            raise StepFailed("the node kept the check running beyond its time")
        wait_us = max(0, min(until_us - before_us, _SLICE_US))
        self._known_us, received = link.receive_stamped(wait_us)
        after_us = link.now_us
        first_us = received[0][0] if received else before_us + wait_us
        self._late_us = max(self._late_us, after_us - first_us)
        gap_us = max(before_us - self._busy_us, after_us - before_us - wait_us)
        self._busy_us = after_us
        if gap_us > HOST_GAP_US:
            self.disturb(f"this host was late by {gap_us / MS_US:.0f} ms")
        for at_us, frame in received:
            self._take(at_us, frame)
        return received

    def _take(self, at_us: int, frame: CanFrame) -> None:
        can_id, own = self._origins.get((frame[0], frame[3])) or self._origin(frame)
        if own or can_id in self._watched:
            self._unread[can_id].append((at_us, frame))
            if self._keeps:
                self.evidence.add(at_us - self.start_us, Direction.RECEIVED, frame)
        if own:
            if frame.can_id == self._response:
                self._allowance.use(at_us, frame)
                self._take_response(frame.data)
            elif frame == self._boot_up:
                self.boots += 1
            return
        if not frame.extended and any(frame.can_id in ids for ids in self._others_by):
            self.others.update({frame.can_id & _NODE_ID_MASK} - {self.played})
        if can_id in self._reserved:
            self.disturb(f"another node sent {frame}")
        if self._foreign.add(at_us, frame):
            self.disturb("other nodes load the bus too much")

    def _origin(self, frame: CanFrame) -> tuple[str, bool]:
        """Return the CAN-ID of a frame in text, and whether the node sent it.

        Results are cached.
        """
        can_id = can_id_of(str(frame))
        own = frame.can_id & _NODE_ID_MASK == self._node_id and not frame.extended
        origin = can_id, own and can_id not in self._reserved
        self._origins[frame.can_id, frame.extended] = origin
        return origin

    def _take_response(self, data: bytes) -> None:
        self._is_silent, multiplexer = False, data[_MULTIPLEXER]
        if data and data[0] & sdo_frame.SPECIFIER in _ANSWERS:
            self._answered[multiplexer] += 1
        if len(data) < _MULTIPLEXER.stop:
            return
        if multiplexer == self._multiplexer:
            self.transfer = data
        # The node has answered these requests, or will not answer them any more.
        for number, request in enumerate(self.unanswered, 1):
            if request[_MULTIPLEXER] == multiplexer:  # and those before it
                del self.unanswered[:number]
                return
        if data[0] in _NAMING:  # the node names another object
            del self.unanswered[:1]


def _queue() -> deque[tuple[int, CanFrame]]:
    return deque(maxlen=_UNREAD_FRAMES)
