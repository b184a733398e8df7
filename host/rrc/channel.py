"""The line to one RRC: its pace, the watchdog's renewal, the stop after refusals."""

from __future__ import annotations

from typing import Final

from tickrig.host.links.errors import LinkTimeout
from tickrig.host.links.link import Link
from tickrig.host.rrc.errors import RrcRefused, RrcStopped
from tickrig.host.rrc.exchange import Exchange
from tickrig.host.rrc.inbox import Answer, Inbox
from tickrig.host.rrc.keep_alive import KeepAlive
from tickrig.host.rrc.ledger import Ledger
from tickrig.host.rrc.mirror import WIPING
from tickrig.host.rrc.refusals import OnRefusals, Refusals
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc.commands import Command, PowerOff, Watchdog
from tickrig.wire.rrc.replies import Event, Ok, Refusal

LINE_US: Final = 5_000
"""The RRC's time for a line in either direction: about two in 10 ms (RRC manual, notes)."""

_log = log_of(__name__)


class Channel:
    """Sends commands at the RRC's pace and gives every line that comes its owner.

    The watchdog is renewed by sending `watchdog` again with the same value: the
    one command that changes nothing, and with stablemode it has no answer. That
    happens only while the program waits in the client: one that hangs lets the
    watchdog trip.

    Attributes:
        ledger: what is known of the RRC and of the commands sent to it.
    """

    def __init__(
        self, link: Link[bytes], inbox: Inbox, refusals: Refusals, on_refusals: OnRefusals
    ) -> None:
        self.ledger = Ledger(refusals)
        self._link, self._inbox, self._on_refusals = link, inbox, on_refusals
        self._keep_alive = KeepAlive()
        self._free_us = link.now_us  # when the RRC will have worked on all that was sent
        self._alarm: str | None = None

    def send(self, command: Command) -> None:
        """Send a command that nobody waits for."""
        self._wait_turn(command)
        self._put_unawaited(command)

    def converse(self, command: Command, timeout_us: int) -> str:
        """Send a command, wait until the RRC has worked on it, return the answer's text."""
        self._wait_turn(command)
        exchange = Exchange(command, stable=self.ledger.mirror.stable)
        for line in exchange.lines:
            self._put(line, answered=line is exchange.lines[-1])
        deadline_us = self._link.now_us + timeout_us
        while not exchange.done and self._link.now_us < deadline_us:
            self.listen(deadline_us, exchange)
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
        """Listen once; RrcStopped if that brought one refusal too many."""
        self.listen(until_us)
        self._raise_alarm()

    def listen(self, until_us: int, exchange: Exchange | None = None) -> None:
        """Take what comes next, but wait no longer than `until_us`."""
        if exchange is None or not exchange.changes_talk:
            self._renew_in_time()
            until_us = min(until_us, self._renewal_us)
        data = self._receive(until_us)
        now_us = self._link.now_us
        for reply in self._inbox.push(now_us, data):
            if isinstance(reply, Event):
                self._note_event(reply)
            else:
                self._deliver(reply, exchange)
        self.ledger.settle(now_us)

    def resume(self) -> None:
        """Lift the stop after too many refusals."""
        self.ledger.refusals.clear()
        self._alarm = None

    def restart(self) -> None:
        """Forget all that was known of the RRC and the commands."""
        self.ledger.clear()
        self._alarm = None

    @property
    def _renewal_us(self) -> int:
        if self.ledger.refusals.stopped is not None:
            return NEVER
        due_us = self._keep_alive.due_us(self.ledger.mirror.watchdog_10ms)
        return max(due_us, self.ledger.doubt_ends_us)  # VR2 is off meanwhile

    def _renew_in_time(self) -> None:
        if self._renewal_us <= self._link.now_us:
            self._put_unawaited(Watchdog(self.ledger.mirror.watchdog_10ms))

    def _receive(self, until_us: int) -> bytes:
        """Read until the line is dry, so that no ER is still unread when commands settle."""
        data = self._link.receive(max(0, until_us - self._link.now_us))
        while more := self._link.receive(0) if data else b"":
            data += more
        return data

    def _wait_turn(self, command: Command) -> None:
        """Wait until the RRC has time and each OK has one owner.

        `poweroff` never waits, and always may be sent.
        """
        if isinstance(command, PowerOff):
            return
        stopped = self.ledger.refusals.stopped
        if stopped is not None:
            name, limit = command.name.decode(), self.ledger.refusals.limit
            raise RrcStopped(f"{name} not sent after {limit} refusals in a row", stopped)
        while self._link.now_us < (turn_us := max(self._free_us, self.ledger.doubt_ends_us)):
            self.step(turn_us)

    def _put_unawaited(self, command: Command) -> None:
        stable = self.ledger.mirror.stable
        self._put(command.encode(check=stable), answered=not stable)
        self.ledger.sent(self._link.now_us, command)

    def _put(self, line: bytes, *, answered: bool) -> None:
        _log.debug("sent %r", line)
        now_us = self._link.now_us
        self._link.send(line)
        self._free_us = max(now_us, self._free_us) + LINE_US * (1 + answered)
        self._keep_alive.note_sent(now_us)

    def _note_event(self, event: Event) -> None:
        if event.kind in WIPING:
            self.ledger.wiped()

    def _deliver(self, reply: Answer, exchange: Exchange | None) -> None:
        stopped_before = self.ledger.refusals.stopped
        if not self.ledger.take(reply, exchange):
            self._report(reply)
        if isinstance(reply, Refusal):
            self._keep_alive.note_refused()
            if stopped_before is None and self.ledger.refusals.stopped is not None:
                self._stop(reply.reason)

    def _report(self, reply: Answer) -> None:
        line = reply.encode().decode("latin-1").removesuffix("\n")
        if isinstance(reply, Ok):
            _log.debug("late reply %r", line)
        else:
            self._inbox.report(self._link.now_us, line)

    def _stop(self, reason: str) -> None:
        _log.warning("%d refusals in a row, the last is ER:%s", self.ledger.refusals.limit, reason)
        self._alarm = reason
        unwatched = not self.ledger.mirror.watchdog_10ms
        if self._on_refusals is OnRefusals.POWER_OFF or unwatched:
            self._put_unawaited(PowerOff())

    def _raise_alarm(self, cause: Exception | None = None) -> None:
        """Raise RrcStopped, once, if there were too many refusals."""
        reason, self._alarm = self._alarm, None
        if reason is not None:
            raise RrcStopped(f"{self.ledger.refusals.limit} refusals in a row", reason) from cause
