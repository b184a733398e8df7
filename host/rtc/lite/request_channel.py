"""Requests, replies and PINGs between a proxy and its device, one at a time (DECISION L8)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, Protocol

from tickrig.host.links.link import Link, LinkError
from tickrig.host.rtc.component import guarded
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_lite import codes, messages
from tickrig.wire.rtc_lite.frame import (
    REPLIES,
    WITH_STATE,
    Checksum,
    Framing,
    LiteDecoder,
    LiteFrame,
)
from tickrig.wire.rtc_lite.rtno import LETTERS, RtnoReplies, encode_request

# What a proxy tells beside its state.
# When to send a PING, when a device is lost (DECISION L14), and how PINGs went.

_SEQUENCE: Final = range(1, 256)
"""Numbers of PINGs; 0 is skipped."""


@dataclass(frozen=True, slots=True)
class PingStatistics:
    """How the PINGs of a proxy went.

    Attributes:
        sent: how many were sent.
        answered: how many of these were answered in time.
        lost: how many were not; the rest is under way.
        shortest_us: shortest round trip, 0 without one.
        longest_us: longest round trip, 0 without one.
        total_us: sum of all round trips.
    """

    sent: int = 0
    answered: int = 0
    lost: int = 0
    shortest_us: int = 0
    longest_us: int = 0
    total_us: int = 0

    @property
    def mean_us(self) -> int:
        """Mean round trip, 0 without one."""
        return self.total_us // self.answered if self.answered else 0

    def __str__(self) -> str:
        """Write it for people.

        >>> str(PingStatistics(5, 4, 1, 3_900, 5_000, 17_000))
        'PINGs: 5 sent, 4 answered, 1 lost; round trip 3.9/4.2/5.0 ms (min/mean/max)'
        """
        counts = f"PINGs: {self.sent} sent, {self.answered} answered, {self.lost} lost"
        if not self.answered:
            return counts
        times = (self.shortest_us, self.mean_us, self.longest_us)
        trips = "/".join(f"{time_us / 1_000:.1f}" for time_us in times)
        return f"{counts}; round trip {trips} ms (min/mean/max)"


@dataclass(slots=True)
class PingMonitor:
    """Counts PINGs. It sends nothing, and is told the time.

    A PING is due each `period_us` from `start` on, whatever else is on the line. One that is
    sent late, as the line was not free, does not shift the next one; nor does a burst, and what
    falls due inside a burst is part of it.

    Args:
        period_us: from one PING to the next.
        wait_us: how long an answer may take.
        most: so many unanswered ones in a row, and the device is lost.

    Attributes:
        awaiting: a PING waits for its answer.
        doubted: a reply is missing, and no PING was answered since.
        lost: the device does not answer any more; it stays so.
    """

    period_us: int
    wait_us: int
    most: int
    awaiting: bool = field(default=False, init=False)
    doubted: bool = field(default=False, init=False)
    lost: bool = field(default=False, init=False)
    _next_us: int = field(default=NEVER, init=False)
    _number: int = field(default=0, init=False)
    _unanswered: int = field(default=0, init=False)
    _pinged_us: int = field(default=0, init=False)
    _sent: int = field(default=0, init=False)
    _missed: int = field(default=0, init=False)
    _answered: int = field(default=0, init=False)
    _total_us: int = field(default=0, init=False)
    _shortest_us: int = field(default=0, init=False)
    _longest_us: int = field(default=0, init=False)

    @property
    def statistics(self) -> PingStatistics:
        """How the PINGs went up to now."""
        return PingStatistics(
            self._sent,
            self._answered,
            self._missed,
            self._shortest_us,
            self._longest_us,
            self._total_us,
        )

    @property
    def due_us(self) -> int:
        """When `tick` has something to do; `NEVER` for a device that is lost."""
        if self.lost:
            return NEVER
        return self._pinged_us + self.wait_us if self.awaiting else self._next_us

    @property
    def pending(self) -> bool:
        """Whether an answer is out to a PING that was sent as a matter of routine."""
        return self.awaiting and not self.doubted

    def start(self, now_us: int) -> None:
        """Let the first PING be due a period from now."""
        self._next_us = now_us + self.period_us

    def tick(self, now_us: int) -> int | None:
        """Return the number of a PING that is to be sent now, if one is."""
        if now_us < self.due_us:
            return None
        if self.awaiting:
            self.doubted, self.awaiting = True, False
            self._missed += 1
        self.lost = self._unanswered >= self.most
        return None if self.lost else self._ping(now_us)

    def doubt(self, now_us: int) -> int:
        """Begin a burst, as a reply is missing; return the number of its first PING."""
        self.doubted = True
        return self._ping(now_us)

    def let_go(self) -> None:
        """Wait no more for a routine PING: a request follows, whose reply tells as much."""
        if self.pending:
            self.awaiting = False
            self._missed += 1

    def replied(self) -> None:
        """Note that the device has replied to a request: it is there."""
        if not self.awaiting:
            self._unanswered = 0

    def answered(self, number: int, now_us: int) -> None:
        """Take an answer; that to an older PING is ignored."""
        if self.awaiting and number == self._number:
            round_trip_us = now_us - self._pinged_us
            first = not self._answered
            self._shortest_us = round_trip_us if first else min(self._shortest_us, round_trip_us)
            self._longest_us = max(self._longest_us, round_trip_us)
            self._total_us += round_trip_us
            self._answered += 1
            if self.doubted:
                self._advance(now_us)
            self.awaiting = self.doubted = False
            self._unanswered = 0

    def _ping(self, now_us: int) -> int:
        """Count a PING that is sent now, and return its number."""
        self._advance(now_us)
        self._number = self._number % _SEQUENCE[-1] + 1
        self._unanswered += 1
        self._sent += 1
        self.awaiting, self._pinged_us = True, now_us
        return self._number

    def _advance(self, now_us: int) -> None:
        """Pass over what has fallen due."""
        if self._next_us <= now_us:
            self._next_us += (now_us - self._next_us) // self.period_us * self.period_us
            self._next_us += self.period_us


class ProxyEventType(StrEnum):
    """What happened."""

    PASSIVE_ERROR = "PassiveError"  # the device reported an error, or one reply was lost
    FATAL_ERROR = "FatalError"  # no answer to any PING: power cut, dead link
    REMOVED = "Removed"  # the proxy was taken out of the system
    REDISCOVERED = "Rediscovered"  # the device is back, with a new proxy


@dataclass(frozen=True, slots=True)
class ProxyEvent:
    """Something that happened to a proxy.

    Attributes:
        at_us: when, on the clock of its link.
        kind: what.
        instance_name: to which proxy.
        reason: why it went to Error, for people; empty for other events.
        frames: the last ones before that, with their times on the clock of its link.
        pings: how its PINGs went; None unless it was removed.
    """

    at_us: int
    kind: ProxyEventType
    instance_name: str
    reason: str = ""
    frames: tuple[str, ...] = ()
    pings: PingStatistics | None = None

    def __str__(self) -> str:
        """Write it in a line for people."""
        why = f": {self.reason}" if self.reason else ""
        frames = f"; last frames: {', '.join(self.frames)}" if self.frames else ""
        pings = f"; {self.pings}" if self.pings else ""
        return f"{self.at_us / 1e6:.3f} s: {self.instance_name}: {self.kind}{why}{frames}{pings}"


ProxyListener = Callable[[ProxyEvent], None]
"""Told of events; what it raises is logged, and nothing else comes of it."""


def notify(listener: ProxyListener | None, event: ProxyEvent) -> None:
    """Log an event, and tell whoever listens."""
    _LOG.info("%s", event)

    def listen() -> ReturnCode:
        if listener is not None:
            listener(event)
        return ReturnCode.RTC_OK

    guarded(event.instance_name, listen)


# What differs from one proxy to another, and what the paper leaves open.


@dataclass(frozen=True, slots=True)
class ProxySettings:
    """How a proxy talks to its device, and what becomes of it when the device is lost.

    Attributes:
        framing: frames of RTC-Lite, or packets of RTno (bridge mode).
        checksum: how frames are summed up (DECISION L5); packets of RTno always by `sum8`.
        boot_us: silence after the link was opened; 3 s for boards that an open port resets.
        reply_us: how long a reply may take, 1 us or more (DECISION L13).
        ping_period_us: from one PING to the next, whatever else is on the line, 1 us or more
            (DECISION L14).
        pings: how many are unanswered when a device is lost, 1 or more.
        linger_us: how long a proxy stays in Error after that (DECISION L15).
        rediscover: whether the device is looked for afterwards.
        search_period_us: how often, 1 us or more.

    Raises:
        ValueError: a number that is too small, or another sum for packets of RTno.
    """

    framing: Framing = Framing.LITE
    checksum: Checksum = Checksum.SUM8
    boot_us: int = 0
    reply_us: int = 100_000
    ping_period_us: int = 1_000_000
    pings: int = 4
    linger_us: int = 1_000_000
    rediscover: bool = False
    search_period_us: int = 1_000_000

    def __post_init__(self) -> None:
        """Refuse what cannot be."""
        if self.framing is Framing.RTNO and self.checksum is not Checksum.SUM8:
            raise ValueError(f"checksum is {self.checksum}, packets of RTno have sum8")
        at_least = {"boot_us": 0, "linger_us": 0}
        for name in (
            "boot_us",
            "reply_us",
            "ping_period_us",
            "pings",
            "linger_us",
            "search_period_us",
        ):
            value, low = getattr(self, name), at_least.get(name, 1)
            if value < low:
                raise ValueError(f"{name} is {value}, at least {low} is needed")


# Frames over a byte link: those of RTC-Lite, or packets of RTno in their place.

_SILENCE_US: Final = 20_000
"""Silence after which the rest of a broken frame is not waited for."""

_KEPT: Final = 8
"""Frames that are kept, for who wants to know what was said last."""

_FRAMES_LOG: Final = log_of(__name__)


class ReplyDecoder(Protocol):
    """`Decoder` or `RtnoReplies`."""

    @property
    def lost(self) -> bool:
        """Whether all is thrown away until `clear`."""
        ...

    def clear(self) -> None:
        """Look for a header again."""

    def push(self, data: bytes, /) -> list[LiteFrame | codes.LiteLinkFault]:
        """Take bytes in; give frames and faults out."""
        ...


class FrameLink:
    """A `Link[LiteFrame]`, one way requests, the other way replies.

    A line that is gone is as silent as a device without power. What is no
    frame is left out; after an unknown command the next header is looked for
    at once, as the checksum tells what is a frame.

    Args:
        link: the line.
        encode: writes a request.
        decoder: reads the replies.

    Attributes:
        latest: the last frames with their times, as `1.234 > CX`, `1.238 < CX@I`.
    """

    def __init__(
        self, link: Link[bytes], encode: Callable[[LiteFrame], bytes], decoder: ReplyDecoder
    ) -> None:
        self._link, self._encode, self._decoder = link, encode, decoder
        self._byte_us = link.now_us
        self.latest: deque[str] = deque(maxlen=_KEPT)

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._link.now_us

    def send(self, frame: LiteFrame) -> None:
        """Send a frame; a broken one that came long before is not waited for any more."""
        if self.now_us - self._byte_us >= _SILENCE_US:
            self._decoder.clear()
        self._note(">", frame)
        try:
            self._link.send(self._encode(frame))
        except LinkError as error:
            _FRAMES_LOG.debug("not sent: %s", error)

    def receive(self, timeout_us: int) -> list[LiteFrame] | None:
        """Wait for bytes, and return the frames that they complete; None if the line is gone."""
        try:
            data = self._link.receive(timeout_us)
        except LinkError as error:
            _FRAMES_LOG.debug("not heard: %s", error)
            return None
        if data:
            self._byte_us = self.now_us
        if self._decoder.lost:
            self._decoder.clear()
        frames = [found for found in self._decoder.push(data) if isinstance(found, LiteFrame)]
        for frame in frames:
            self._note("<", frame)
        return frames

    def _note(self, arrow: str, frame: LiteFrame) -> None:
        _FRAMES_LOG.debug("%s %s", arrow, frame.body)
        self.latest.append(f"{self.now_us / 1e6:.3f} {arrow} {str(frame.body)[2:-1]}")


class _RtnoLink(FrameLink):
    """Says what RTno has a letter for, and makes up for the rest.

    | asked for | said instead |
    |---|---|
    | PING | `X`, the state; its answer is that to the PING, too |
    | abort | `D`, deactivate: the device is Inactive then, and only its proxy in Error |
    | initialize, finalize, on_startup, on_shutdown, rate, poll | nothing; the reply is `!` |

    Args:
        link: the line.
    """

    def __init__(self, link: Link[bytes]) -> None:
        super().__init__(link, encode_request, RtnoReplies())
        self._ping = b""  # number of the PING that waits for its answer
        self._aborts = False
        self._made_up: list[LiteFrame] = []

    def send(self, frame: LiteFrame) -> None:
        """Send a request, or what stands for it."""
        self._aborts = frame.command is codes.LiteCommand.ABORT
        if frame.command is codes.LiteCommand.PING:
            self._ping = frame.data
            super().send(LiteFrame(codes.LiteCommand.STATE))
        elif self._aborts:
            super().send(LiteFrame(codes.LiteCommand.DEACTIVATE))
        elif frame.command in LETTERS:
            super().send(frame)
        else:
            self._made_up.append(LiteFrame(frame.command, bytes([codes.LiteStatus.UNSUPPORTED])))

    def receive(self, timeout_us: int) -> list[LiteFrame] | None:
        """Wait for bytes, and return the frames that they complete; None if the line is gone."""
        made_up, self._made_up = self._made_up, []
        frames = super().receive(0 if made_up else timeout_us)
        if frames is None:
            return None
        for frame in frames:
            made_up += self._translate(frame)
        return made_up

    def _translate(self, frame: LiteFrame) -> list[LiteFrame]:
        if frame.command is codes.LiteCommand.STATE and self._ping:
            number, self._ping = self._ping, b""
            return [frame, LiteFrame(codes.LiteCommand.PING, bytes([codes.LiteStatus.OK]) + number)]
        if frame.command is codes.LiteCommand.DEACTIVATE and self._aborts:
            return [LiteFrame(codes.LiteCommand.ABORT, frame.data)]
        return [frame]


POLL_US: Final = 1_000
"""How often the answer to a PING is looked for."""

_PROFILE_US: Final = 10_000_000
"""How long all frames of a profile may take (RTnoProxy)."""

_FAULTS: Final = frozenset(codes.FAULT_COMMANDS)
"""What stands in the place of a status when a device could not read a request."""

RETRIES: Final = 3
"""For requests that may be repeated (DECISION L13)."""

_MEANINGS: Final[Mapping[int, str]] = {
    codes.LiteStatus.ERROR: "x: a callback failed",
    codes.LiteStatus.WRONG_STATE: "H: wrong state",
    codes.LiteStatus.NO_IN_PORT: "F: no such in-port",
    codes.LiteStatus.NO_OUT_PORT: "D: no such out-port",
    codes.LiteStatus.EMPTY: "I: nothing new",
    codes.LiteStatus.UNSUPPORTED: "!: not supported",
    codes.LiteLinkFault.TIMEOUT: "FK: broken off",
    codes.LiteLinkFault.CHECKSUM: "FH: wrong checksum",
    codes.LiteLinkFault.UNKNOWN: "FU: unknown",
}

_LOG: Final = log_of(__name__)


class RequestChannel:
    """What a proxy says and hears.

    `request` waits for a reply, for `reply_us` at most. A reply that does not come
    begins a burst of PINGs, which nobody waits for: `tick` goes on with it.
    While it lasts, and after a device was lost, nothing else is sent. As the
    device answers in order, an answered PING also means that no late reply is
    on its way.

    Args:
        link: the line to the device.
        settings: how long to wait, how to sum up.

    Attributes:
        ping_monitor: counts the PINGs.
        state: of the device, as far as its replies tell; None if nobody knows.
        pushed: data of out-ports, not yet taken, with the time at which they arrived.
        in_ports: in-ports that the device has described.
        out_ports: out-ports that it has described.
        trouble: why the last request was not done, empty if it was.
    """

    def __init__(self, link: Link[bytes], settings: ProxySettings) -> None:
        self._line, self._settings = _frames_over(link, settings), settings
        self.ping_monitor = PingMonitor(settings.ping_period_us, settings.reply_us, settings.pings)
        self.state: codes.LiteState | None = None
        self.pushed: list[tuple[int, messages.LitePortData]] = []
        self.in_ports: list[messages.LitePortProfile] = []
        self.out_ports: list[messages.LitePortProfile] = []
        self.trouble = ""
        self._reply: messages.LiteReply | None = None
        self._awaited: codes.LiteCommand | None = None
        self._polled_us = self._deadline_us = link.now_us

    @property
    def frames(self) -> tuple[str, ...]:
        """The last frames with their times, as `1.234 > CX`, `1.238 < CX@I`."""
        return tuple(self._line.latest)

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._line.now_us

    @property
    def due_us(self) -> int:
        """When `tick` has something to do."""
        due_us = self.ping_monitor.due_us
        return min(due_us, self._polled_us + POLL_US) if self.ping_monitor.awaiting else due_us

    def tick(self) -> None:
        """Take what has arrived, and send a PING if one is due.

        All that had arrived when a PING is overdue is read before that is judged: who looks
        late takes no device for lost.
        """
        now_us = self.now_us
        self.poll()
        if (number := self.ping_monitor.tick(now_us)) is not None:
            self._ping(number)

    def request(self, command: codes.LiteCommand, data: bytes = b"") -> messages.LiteReply | None:
        """Send a request and wait for its reply; None without one, or if nothing may be sent.

        A PING that has fallen due goes first.
        """
        if not self._free():
            return None
        reply = self._exchange(command, data)
        self.trouble = self._trouble(command, reply)
        if reply is None:
            _LOG.info("%s", self.trouble)
            self._ping(self.ping_monitor.doubt(self.now_us))
        else:
            self.ping_monitor.replied()
        return reply

    def request_again(self, command: codes.LiteCommand) -> messages.LiteReply | None:
        """Send a request until it is answered, 4 times at most; a missing reply has no effect.

        A fault is no answer: what was on the line before has spoilt the request.
        """
        reply = self._exchange(command)
        for _ in range(RETRIES):
            if reply is not None and reply.status not in _FAULTS:
                break
            if reply is not None:
                self.listen(_SILENCE_US)
            reply = self._exchange(command)
        return reply

    def send(self, command: codes.LiteCommand, data: bytes = b"") -> None:
        """Send a request and wait for nothing."""
        self._line.send(LiteFrame(command, data))

    def poll(self) -> None:
        """Take what has arrived."""
        self._polled_us = self.now_us
        self._receive(0)

    def listen(self, duration_us: int) -> None:
        """Take what arrives meanwhile."""
        until_us = self.now_us + duration_us
        while self.now_us < until_us and self._receive(until_us - self.now_us):
            continue

    def _free(self) -> bool:
        """Whether a request may be sent; waits for the answer to a PING that is under way."""
        ping_monitor = self.ping_monitor
        if not ping_monitor.awaiting and (number := ping_monitor.tick(self.now_us)) is not None:
            self._ping(number)
        while ping_monitor.pending and self.now_us < ping_monitor.due_us:
            if not self._receive(ping_monitor.due_us - self.now_us):
                return False
        ping_monitor.let_go()
        return not (ping_monitor.awaiting or ping_monitor.doubted or ping_monitor.lost)

    def _exchange(self, command: codes.LiteCommand, data: bytes = b"") -> messages.LiteReply | None:
        """Send a request and wait for its reply."""
        self.poll()  # what nobody waits for any more
        self._awaited, self._reply = command, None
        self.in_ports, self.out_ports = [], []
        if command in WITH_STATE:
            self.state = None
        self.send(command, data)
        reply = self._await_reply()
        self._awaited = None
        return reply

    def _await_reply(self) -> messages.LiteReply | None:
        limit_us = self.now_us + _PROFILE_US
        self._deadline_us = self.now_us + self._settings.reply_us
        while self._reply is None and self.now_us < min(self._deadline_us, limit_us):
            if not self._receive(self._deadline_us - self.now_us):
                break
        if self._reply is None:
            self._receive(0)  # it may have come while this process was stopped
        return self._reply

    def _trouble(self, command: codes.LiteCommand, reply: messages.LiteReply | None) -> str:
        name = command.value.decode()
        if reply is None:
            return f"no reply to {name} within {self._settings.reply_us // 1_000} ms"
        return "" if reply.ok else f"{name} was answered {_MEANINGS.get(reply.status, reply)}"

    def _ping(self, number: int) -> None:
        self.send(codes.LiteCommand.PING, bytes([number]))

    def _receive(self, timeout_us: int) -> bool:
        """Wait for bytes and take them; False if the line is gone."""
        frames = self._line.receive(timeout_us)
        for frame in frames or ():
            self._take(frame)
        return frames is not None

    def _take(self, frame: LiteFrame) -> None:
        """Note what a frame says."""
        match frame.command:
            case codes.LiteCommand.DATA:
                self.pushed.append((self.now_us, messages.parse_port_data(frame.data)))
            case codes.LiteCommand.IN_PROFILE | codes.LiteCommand.OUT_PROFILE:
                self._take_profile(frame)
            case command if command in codes.FAULT_COMMANDS.values():
                if self._awaited is not None:
                    self._reply = messages.LiteReply(
                        frame.data[0]
                    )  # no status, so nothing that is OK
            case command:
                self._take_reply(command, messages.parse_reply(frame))

    def _take_profile(self, frame: LiteFrame) -> None:
        if frame.data[0] and self._awaited is codes.LiteCommand.PROFILE:
            is_in = frame.command is codes.LiteCommand.IN_PROFILE
            ports = self.in_ports if is_in else self.out_ports
            ports.append(messages.parse_port_profile(frame.data))
            self._deadline_us = self.now_us + self._settings.reply_us

    def _take_reply(self, command: codes.LiteCommand, reply: messages.LiteReply) -> None:
        if command is codes.LiteCommand.PING and reply.ok:
            self.ping_monitor.answered(reply.fields[0], self.now_us)
        if command in WITH_STATE and reply.fields:
            self.state = _state(reply.fields[0])
        if command is self._awaited:
            self._reply = reply


def _frames_over(link: Link[bytes], settings: ProxySettings) -> FrameLink:
    if settings.framing is Framing.RTNO:
        return _RtnoLink(link)
    checksum = settings.checksum
    return FrameLink(link, lambda frame: frame.encode(checksum), LiteDecoder(REPLIES, checksum))


def _state(code: int) -> codes.LiteState | None:
    try:
        return codes.LiteState(code)
    except ValueError:
        return None
