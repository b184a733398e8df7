"""Requests, replies and PINGs between a proxy and its device, one at a time (DECISION L8)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.host.links.link import Link, LinkError
from tickrig.host.rtc.lite.events import PingMonitor
from tickrig.host.text.log import log_of
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

# Settings that differ between proxies, or that the paper does not define.


@dataclass(frozen=True, slots=True)
class ProxySettings:
    """The communication settings of a proxy, and its reaction to a lost device.

    Attributes:
        framing: protocol on the line, which is frames of RTC-Lite, or packets of RTno (bridge
            mode).
        checksum: checksum of frames (DECISION L5). Packets of RTno always use `sum8`.
        boot_us: pause after the link was opened. Use 3 s for boards that reset when the port is
            opened.
        reply_us: longest time until a reply, 1 us or more (DECISION L13).
        ping_period_us: time from one PING to the next, regardless of other traffic, 1 us or more
            (DECISION L14).
        pings: number of unanswered PINGs after which a device is lost, 1 or more.
        linger_us: time that a proxy stays in Error after the loss of its device (DECISION L15).
        rediscover: whether to search for the device after its loss.
        search_period_us: interval of the search, 1 us or more.

    Raises:
        ValueError: a number is too small, or packets of RTno have a checksum other than `sum8`.
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
        """Raise ValueError for invalid settings."""
        if self.framing is Framing.RTNO and self.checksum is not Checksum.SUM8:
            raise ValueError(f"checksum is {self.checksum}, packets of RTno have sum8")
        at_least = dict.fromkeys(("boot_us", "linger_us"), 0)
        at_least |= dict.fromkeys(("reply_us", "ping_period_us", "pings", "search_period_us"), 1)
        for name, low in at_least.items():
            if (value := getattr(self, name)) < low:
                raise ValueError(f"{name} is {value}, at least {low} is needed")


# Frames over a byte link: those of RTC-Lite, or packets of RTno in their place.

_SILENCE_US: Final = 20_000
"""Silence after which the rest of a broken frame is no longer expected."""

_KEPT: Final = 8
"""Number of frames that are kept, so that a report can show the last frames."""

_LOG: Final = log_of(__name__)


class _FrameLink:
    """A `Link[LiteFrame]` that sends requests and receives replies.

    A closed line behaves like a device without power. Bytes that are not a frame are skipped. After
    an unknown command, the search for the next header starts at once, because the checksum
    identifies a frame.

    Args:
        link: line to the device.
        encode: function that encodes a request.
        decoder: decoder that reads the replies.

    Attributes:
        latest: last frames with their times, such as `1.234 > CX`, `1.238 < CX@I`.
    """

    def __init__(
        self,
        link: Link[bytes],
        encode: Callable[[LiteFrame], bytes],
        decoder: LiteDecoder | RtnoReplies,
    ) -> None:
        self._link, self._encode, self._decoder = link, encode, decoder
        self._byte_us = link.now_us
        self.latest: deque[str] = deque(maxlen=_KEPT)

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._link.now_us

    def send(self, frame: LiteFrame) -> None:
        """Send a frame. Forget an incomplete frame that was received before."""
        if self.now_us - self._byte_us >= _SILENCE_US:
            self._decoder.clear()
        self._note(">", frame)
        try:
            self._link.send(self._encode(frame))
        except LinkError as error:
            _LOG.debug("not sent: %s", error)

    def receive(self, timeout_us: int) -> list[LiteFrame] | None:
        """Wait for bytes and return the frames that are complete, or None if the line is gone."""
        try:
            data = self._link.receive(timeout_us)
        except LinkError as error:
            _LOG.debug("not received: %s", error)
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
        _LOG.debug("%s %s", arrow, frame.body)
        self.latest.append(f"{self.now_us / 1e6:.3f} {arrow} {str(frame.body)[2:-1]}")


class _RtnoLink(_FrameLink):
    """A link that sends the requests for which RTno has a letter, and replaces the other requests.

    | request | replacement |
    |---|---|
    | PING | `X`, which requests the state; its answer also counts as that to the PING |
    | abort | `D`, deactivate: the device is Inactive then, and only its proxy in Error |
    | initialize, finalize, on_startup, on_shutdown, rate, poll | nothing; the reply is `!` |

    Args:
        link: line to the device.
    """

    def __init__(self, link: Link[bytes]) -> None:
        super().__init__(link, encode_request, RtnoReplies())
        self._ping = b""  # number of the PING that waits for its answer
        self._aborts = False
        self._made_up: list[LiteFrame] = []

    def send(self, frame: LiteFrame) -> None:
        """Send a request, or its replacement."""
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
        """Wait for bytes and return the frames that are complete, or None if the line is gone."""
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
"""Polling interval for the answer to a PING."""

_PROFILE_US: Final = 10_000_000
"""Longest time for all frames of a profile (RTnoProxy)."""

_FAULTS: Final = frozenset(codes.FAULT_COMMANDS)
"""Codes in place of a status if a device could not read a request."""

RETRIES: Final = 3
"""Number of repetitions of requests that may be repeated (DECISION L13)."""

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


class RequestChannel:
    """A channel that sends the requests of a proxy, and receives the replies of the device.

    `request` waits for a reply, for `reply_us` at most. A missing reply starts a burst of PINGs,
    which `tick` continues without blocking. During the burst, and after a device was lost, no
    requests are sent. The device answers in order, so after an answered PING no late reply can
    follow.

    Args:
        link: line to the device.
        settings: settings with time limits and checksum.

    Attributes:
        ping_monitor: monitor that schedules and counts the PINGs.
        state: state of the device according to its replies, or None if unknown.
        pushed: data of out-ports that were not taken yet, with their time of arrival.
        in_ports: in-ports that the device described.
        out_ports: out-ports that the device described.
        trouble: reason why the last request failed, empty if it succeeded.
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
        """The last frames with their times, such as `1.234 > CX`, `1.238 < CX@I`."""
        return tuple(self._line.latest)

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._line.now_us

    @property
    def due_us(self) -> int:
        """Time at which `tick` has work to do."""
        due_us = self.ping_monitor.due_us
        return min(due_us, self._polled_us + POLL_US) if self.ping_monitor.awaiting else due_us

    def tick(self) -> None:
        """Process the received frames, then send a PING if one is due.

        All received frames are read before a PING counts as unanswered. Therefore a late call of
        this method does not make a present device count as lost.
        """
        now_us = self.now_us
        self.poll()
        if (number := self.ping_monitor.tick(now_us)) is not None:
            self._ping(number)

    def request(self, command: codes.LiteCommand, data: bytes = b"") -> messages.LiteReply | None:
        """Send a request to the device and return its reply.

        If a PING is due, it is sent first. The result is None if there is no reply in time, or if
        the request may not be sent because the device does not answer PINGs.
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
        """Send a request up to 4 times until the device replies, and return the reply or None.

        The request is also sent again after a fault reply, because earlier bytes on the line have
        then corrupted the request. Unlike `request`, this method never sends PINGs.
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
        """Send a request without waiting."""
        self._line.send(LiteFrame(command, data))

    def poll(self) -> None:
        """Process the received frames."""
        self._polled_us = self.now_us
        self._receive(0)

    def listen(self, duration_us: int) -> None:
        """Process frames that arrive."""
        until_us = self.now_us + duration_us
        while self.now_us < until_us and self._receive(until_us - self.now_us):
            continue

    def _free(self) -> bool:
        """Return whether a request may be sent, after the answer to a running PING."""
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
        self.poll()  # late replies
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
        """Wait for bytes and process them. Return False if the line is gone."""
        frames = self._line.receive(timeout_us)
        for frame in frames or ():
            self._take(frame)
        return frames is not None

    def _take(self, frame: LiteFrame) -> None:
        """Process a frame."""
        match frame.command:
            case codes.LiteCommand.DATA:
                self.pushed.append((self.now_us, messages.parse_port_data(frame.data)))
            case codes.LiteCommand.IN_PROFILE | codes.LiteCommand.OUT_PROFILE:
                self._take_profile(frame)
            case command if command in codes.FAULT_COMMANDS.values():
                if self._awaited is not None:  # it is no status, so nothing that is OK
                    self._reply = messages.LiteReply(frame.data[0])
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


def _frames_over(link: Link[bytes], settings: ProxySettings) -> _FrameLink:
    if settings.framing is Framing.RTNO:
        return _RtnoLink(link)
    checksum = settings.checksum
    return _FrameLink(link, lambda frame: frame.encode(checksum), LiteDecoder(REPLIES, checksum))


def _state(code: int) -> codes.LiteState | None:
    try:
        return codes.LiteState(code)
    except ValueError:
        return None
