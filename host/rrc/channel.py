"""The line to one RRC, with pace of sending, renewal of the watchdog, and stop after refusals.

Errors besides LinkTimeout and LinkClosed:

DeviceRefused            (tickrig.host.links.link)
 +-- RrcRefused          ER: came for one command
 +-- RrcStopped          ER: came too many times in a row; the client sends no more
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from tickrig.host.links.link import DeviceRefused, Link, LinkTimeout
from tickrig.host.rrc.inbox import Answer, Exchange, Inbox
from tickrig.host.rrc.reply_matcher import OnRefusals, ReplyMatcher
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import message
from tickrig.wire.rrc.commands import Command, PowerOff, Watchdog
from tickrig.wire.rrc.replies import (
    COMMAND_CHECKSUM,
    COMMAND_UNKNOWN,
    RECEIVE_BUFFER_OVERFLOW,
    Event,
    Ok,
    Refusal,
    RrcEvent,
    StatusA,
)

# Theory of operation
# ===================
#
# The lines of the RRC are text without sequence numbers. From them a channel determines
# four things: whose answer a line is, how busy the RRC is, whether the watchdog needs a
# renewal, and whether the RRC refuses so often that it is safer to stop. There is no
# background thread: all work is done while the program waits in `_listen`.
#
# - Answers (reply_matcher.py). The RRC answers in the order of the lines, an OK names its
#   command, an ER often does not. A reply belongs to the oldest command of its name that is
#   not settled; one that nobody waits for is settled after 100 ms without an ER. After
#   EV:Initialized commands may still wait in the receive buffer of the RRC: until that
#   doubt ends (`doubt_ends_us`) `_wait_turn` lets only `poweroff` pass. With stablemode
#   there is no OK at all, so a request is followed by `device`, whose answer comes in any
#   mode and proves that the line before it was worked on (inbox.py, `Exchange`).
# - Pace. `_free_us` is when the RRC will have worked on all that was sent. Each line adds
#   what it costs by the load model of the RRC (DECISION R27, `wire/rrc/message.py`) out of
#   the 40 % of a period that its own work, a status line and a margin of 10 % leave: 6.25
#   ms a line, 3.75 ms an answer. An overflow or an ER with stablemode was not planned for
#   and is added when it comes.
# - Watchdog. `_renewed_us` is the latest line that may have renewed it; a third of its time
#   later `watchdog` is sent again with the same value. An ER sets it to long ago, because a
#   refused command renews nothing. While a request that changes the protocol is open
#   (`changes_protocol`) no renewal is sent, because the mode in which it must be written
#   is unknown.
# - Refusals. Too many in a row of one command set `_alarm`, which `request` or `step`
#   raises, once, after all bytes of this read are delivered. From then on only `poweroff`
#   passes. Stopping sends it, too; with `OnRefusals.WATCHDOG` and a watchdog it is left to
#   trip, because nothing renews it.
#
# `_receive` reads all available data before `settle` decides that the time of a command is
# over. Otherwise an ER that is still unread in the buffer of this machine would count as
# silence.
#
# EV:PowerOffFinished and EV:Initialized mean that the RRC has lost its settings (DECISION
# R5). Therefore the matcher drops its own copy of them, including stablemode and watchdog.
#
# All times are times of the link, so simulated and real time need no distinction.

_ONLY_WHILE_ON: Final = (
    "allowed only while VR2 is on, from EV:PowerOnSuccess up to EV:PowerOffWaitBy...;"
    " was its power button pressed?"
)
_BAD_PARAMETERS: Final = (
    "bad parameters as the RRC sees them: noise on the line, or the RRC was restarted and wants"
    " no CHECK any more (then call start() again)"
)
_HINTS: Final = {
    COMMAND_CHECKSUM: (
        "CHECK was missing or wrong: noise on the line, or stablemode was on before this client"
        " came (then call start() again)"
    ),
    COMMAND_UNKNOWN: "allowed are the 12 commands of the manual: noise on the line?",
    RECEIVE_BUFFER_OVERFLOW: (
        "send at most 160 lines a second with stablemode, 100 without, and 45 while VR2 is off"
    ),
    **dict.fromkeys(("limit", "output", "poweroff"), _ONLY_WHILE_ON),
}


class RrcRefused(DeviceRefused):
    """The RRC refused a command, which means that it answered with an `ER:` line.

    Attributes:
        code: reason given by the RRC: the name of the refused command, or a general reason such as
            `CommandChecksum`.
        sent: line that was refused, without LF.
    """

    def __init__(self, sent: str, code: str) -> None:
        hint = _HINTS.get(code, _BAD_PARAMETERS)
        super().__init__(f"sent {sent!r}, the RRC answered ER:{code}: {hint}", code)
        self.sent = sent


class RrcStopped(DeviceRefused):
    """The RRC refused too many commands in a row, so the client has stopped sending.

    The client sends again after EV:Initialized, EV:PowerOffFinished or `RrcClient.resume()`.

    Attributes:
        code: reason that the RRC gave for the last refusal.
    """

    def __init__(self, what: str, code: str) -> None:
        super().__init__(f"{what} (last answer ER:{code}); resume() lifts the stop", code)


_PCT_US: Final = message.PERIOD_US // (message.SAFE_PCT - message.BASE_PCT - message.STATUS_PCT)
"""Time of 1 % of the RRC's period, without its own work and a status line."""

_LINE_US: Final = message.LINE_FEED_PCT * _PCT_US
_REPLY_US: Final = message.REPLY_PCT * _PCT_US
"""Cost of a line to the RRC, which is 6.25 ms, and of its answer, which is 3.75 ms."""

_SECOND_US: Final = 1_000_000

_RENEWALS: Final = 3
"""Number of renewals within the time of the watchdog, so that one renewal may be lost."""

_FORGETTING: Final = (RrcEvent.POWER_OFF_FINISHED, RrcEvent.INITIALIZED)
"""Events after which the RRC has lost its settings (RRC manual, notes)."""

_log = log_of(__name__)


@dataclass(frozen=True, slots=True)
class RrcLoad:
    """Processing load of an RRC, estimated from the lines that the client sent in the last second.

    The values apply while the wheelchair (VR2) is on. Lines that other programs send to the same
    RRC are not included.

    Attributes:
        load_pct: load in per cent: 30 % for the RRC's own work, plus the load that the lines cause.
        margin_pct: remaining capacity in per cent, 100 minus `load_pct`. The client keeps at least
            10 % free.
        pace_lines_s: maximum number of lines per second that the client sends if it does not wait
            for answers.
    """

    load_pct: int
    margin_pct: int
    pace_lines_s: int


class Channel:
    """A channel that sends commands no faster than the RRC can process, and sorts received lines.

    To renew the watchdog, the channel sends `watchdog` again with the same value. This is the only
    command that changes no setting. With stablemode the RRC does not answer it. The channel renews
    the watchdog only while the program waits in the client. If the program hangs, the watchdog
    trips.

    Every other command that is not refused also renews the watchdog. Therefore the channel sends
    `watchdog` only if no other command was sent for a third of the time.

    Args:
        link: line to the RRC.
        inbox: inbox for the lines that no request waits for.
        max_refusals: number of refusals in a row after which the channel stops, 1 or more.
        on_refusals: reaction to too many refusals.

    Attributes:
        matcher: state of the RRC and of the commands sent to it.
    """

    def __init__(
        self, link: Link[bytes], inbox: Inbox, max_refusals: int, on_refusals: OnRefusals
    ) -> None:
        self.matcher = ReplyMatcher(max_refusals)
        self._link, self._inbox, self._on_refusals = link, inbox, on_refusals
        self._renewed_us = 0  # when the last command was sent; long ago if it was refused
        self._free_us = link.now_us  # when the RRC will have worked on all that was sent
        self._alarm: str | None = None
        self._costs: deque[tuple[int, int]] = deque()  # time and per cent, of the latest second

    @property
    def load(self) -> RrcLoad:
        """The load of the RRC that this channel causes."""
        self._forget_costs()
        load_pct = message.BASE_PCT + sum(pct for _, pct in self._costs) // message.PERIODS_A_SECOND
        line_us = _LINE_US + _REPLY_US * (not self.matcher.settings.stable)
        return RrcLoad(load_pct, message.PERIOD_PCT - load_pct, _SECOND_US // line_us)

    def send(self, command: Command) -> None:
        """Send a command without waiting."""
        self._wait_turn(command)
        self._put_unawaited(command)

    def request(self, command: Command, timeout_us: int) -> str:
        """Send a command, wait until the RRC has processed it, and return the text of the answer.

        Args:
            command: command to send.
            timeout_us: longest wait for the answer in us.
        """
        self._wait_turn(command)
        exchange = Exchange(command, stable=self.matcher.settings.stable)
        for line in exchange.lines:
            # The answers of all lines of an exchange are planned with its last one.
            self._put(line, exchange.replies if line is exchange.lines[-1] else 0)
        deadline_us = self._link.now_us + timeout_us
        while not exchange.done and self._link.now_us < deadline_us:
            self._listen(deadline_us, exchange)
        if exchange.refusal is not None:
            refused = RrcRefused(exchange.sent, exchange.refusal)
            self._raise_alarm(refused)
            raise refused
        self._raise_alarm()
        if not exchange.done:
            raise LinkTimeout(
                f"sent {exchange.sent!r}, waited {timeout_us / 1_000:g} ms,"
                f" {exchange.awaited} did not come"
            )
        return exchange.text

    def step(self, until_us: int) -> None:
        """Receive the next lines. Raise RrcStopped if the RRC has refused too many commands."""
        self._listen(until_us)
        self._raise_alarm()

    def resume(self) -> None:
        """Allow sending again after it was stopped by too many refusals."""
        self.matcher.refusals.clear()
        self._alarm = None

    def restart(self) -> None:
        """Forget the known state of the RRC and the pending commands."""
        self.matcher.clear()
        self._alarm = None

    def _listen(self, until_us: int, exchange: Exchange | None = None) -> None:
        """Receive the next lines, waiting no longer than `until_us`."""
        if exchange is None or not exchange.changes_protocol:
            if self._renewal_us <= self._link.now_us:
                self._put_unawaited(Watchdog(self.matcher.settings.watchdog_10ms))
            until_us = min(until_us, self._renewal_us)
        data = self._receive(until_us)
        now_us = self._link.now_us
        for reply in self._inbox.push(now_us, data):
            match reply:
                case Event():
                    if reply.kind in _FORGETTING:
                        self.matcher.initialized()
                case StatusA():
                    self._account(message.STATUS_PCT)
                case _:
                    self._deliver(reply, exchange)
        self.matcher.settle(now_us)

    @property
    def _renewal_us(self) -> int:
        """Time of the next renewal of the watchdog, or `NEVER` if the watchdog is off."""
        watchdog_10ms = self.matcher.settings.watchdog_10ms
        if not watchdog_10ms or self.matcher.refusals.stopped is not None:
            return NEVER
        due_us = self._renewed_us + max(message.PERIOD_US, watchdog_10ms * 10_000 // _RENEWALS)
        return max(due_us, self.matcher.unconfirmed.doubt_ends_us)  # VR2 is off meanwhile

    def _receive(self, until_us: int) -> bytes:
        """Read until no data are left, so that no ER is unread when commands settle."""
        data = self._link.receive(max(0, until_us - self._link.now_us))
        while more := self._link.receive(0) if data else b"":
            data += more
        return data

    def _wait_turn(self, command: Command) -> None:
        """Wait until the RRC has time, and until each OK belongs to only one command.

        `poweroff` never waits, and may always be sent.
        """
        # It must not wait for pace or doubt: it is the way to stop.
        if isinstance(command, PowerOff):
            return
        refusals, unconfirmed = self.matcher.refusals, self.matcher.unconfirmed
        if refusals.stopped is not None:
            text = f"{command.name.decode()} not sent after {refusals.limit} refusals in a row"
            raise RrcStopped(text, refusals.stopped)
        while self._link.now_us < (turn_us := max(self._free_us, unconfirmed.doubt_ends_us)):
            self.step(turn_us)

    def _put_unawaited(self, command: Command) -> None:
        stable = self.matcher.settings.stable
        self._put(command.encode(check=stable), int(not stable))
        self.matcher.sent(self._link.now_us, command)

    def _put(self, line: bytes, replies: int) -> None:
        _log.debug("sent %r", line)
        now_us = self._link.now_us
        self._link.send(line)
        self._account(message.LINE_FEED_PCT)
        self._free_us = max(now_us, self._free_us) + _LINE_US + _REPLY_US * replies
        self._renewed_us = now_us

    def _account(self, cost_pct: int) -> None:
        self._forget_costs()
        self._costs.append((self._link.now_us, cost_pct))

    def _forget_costs(self) -> None:
        since_us = self._link.now_us - _SECOND_US
        while self._costs and self._costs[0][0] <= since_us:
            self._costs.popleft()

    def _deliver(self, reply: Answer, exchange: Exchange | None) -> None:
        stopped_before = self.matcher.refusals.stopped
        overflow = reply == Refusal(RECEIVE_BUFFER_OVERFLOW)
        cost_pct = message.OVERFLOW_PCT if overflow else message.REPLY_PCT
        self._account(cost_pct)
        if isinstance(reply, Refusal) and (overflow or self.matcher.settings.stable):
            # nothing was planned for this answer
            self._free_us = max(self._link.now_us, self._free_us) + cost_pct * _PCT_US
        if not self.matcher.take(reply, exchange):
            self._report(reply)
        if isinstance(reply, Refusal):
            self._renewed_us = -NEVER  # a refused command renews nothing
            if stopped_before is None and self.matcher.refusals.stopped is not None:
                self._stop(reply.reason)

    def _report(self, reply: Answer) -> None:
        line = reply.encode().decode("latin-1").removesuffix("\n")
        if isinstance(reply, Ok):
            _log.debug("late reply %r", line)
        else:
            self._inbox.report(self._link.now_us, line)

    def _stop(self, reason: str) -> None:
        _log.warning("%d refusals in a row, the last is ER:%s", self.matcher.refusals.limit, reason)
        self._alarm = reason
        unwatched = not self.matcher.settings.watchdog_10ms
        if self._on_refusals is OnRefusals.POWER_OFF or unwatched:
            self._put_unawaited(PowerOff())

    def _raise_alarm(self, cause: Exception | None = None) -> None:
        """Raise RrcStopped, once, if there were too many refusals."""
        reason, self._alarm = self._alarm, None
        if reason is not None:
            raise RrcStopped(f"{self.matcher.refusals.limit} refusals in a row", reason) from cause
