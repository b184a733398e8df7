"""A session with an RRC: start, time, events and status."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Final, Self, TypeVar

from tickrig.host.links.errors import LinkTimeout
from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc.channel import Channel
from tickrig.host.rrc.errors import RrcRefused
from tickrig.host.rrc.inbox import Arrival, Inbox
from tickrig.host.rrc.refusals import OnRefusals, Refusals
from tickrig.wire.rrc.commands import Command, DeviceName, Output, StableMode
from tickrig.wire.rrc.replies import COMMAND_CHECKSUM, Event, EventKind, StatusA

TIMEOUT_US: Final = 200_000
SETTLE_US: Final = 100_000
"""Wait behind the dummy command at the start (RRC manual, notes)."""

T = TypeVar("T")


class Session:
    """Everything about talking to an RRC but the commands themselves.

    Time passes only in these calls. While a watchdog is set, each of them renews
    it in time; a program that hangs does not, and the watchdog stops VR2.

    After `max_refusals` ER lines in a row for one command the session raises
    RrcStopped and sends nothing more but `poweroff`, until the RRC is
    initialized again or `resume` is called.

    Args:
        link: the line, open; the session closes it.
        timeout_us: how long to wait for the answer to a command.
        max_refusals: how many refusals in a row are too many, 1 or more.
        on_refusals: what to do then.
        on_unknown: called with each line that the manual does not list.

    Attributes:
        unknown: the latest of these lines.
    """

    def __init__(
        self,
        link: Link[bytes],
        *,
        timeout_us: int = TIMEOUT_US,
        max_refusals: int = 3,
        on_refusals: OnRefusals = OnRefusals.POWER_OFF,
        on_unknown: Callable[[Arrival[str]], None] | None = None,
    ) -> None:
        self._link, self._timeout_us = link, timeout_us
        self._inbox = Inbox(on_unknown)
        self.unknown = self._inbox.unknown
        self._channel = Channel(link, self._inbox, Refusals(max_refusals), on_refusals)
        self._ledger = self._channel.ledger

    @classmethod
    def open(cls, url: str) -> Self:
        """Open a device path or pyserial URL and start; see `SerialLink` and `start`."""
        session = cls(SerialLink(url))
        try:
            session.start()
        except BaseException:
            session.close()
            raise
        return session

    def start(self) -> None:
        """Begin to talk, as the manual's notes advise: dummy command, wait, empty the buffer.

        After that it is known whether an earlier program left stablemode on.
        What was received before is dropped, events too.

        Raises:
            LinkTimeout: no RRC answers.
        """
        self._link.send(b"\n" + DeviceName().encode())
        settled_us = self._link.now_us + SETTLE_US
        while self._link.now_us < settled_us:
            self._link.receive(settled_us - self._link.now_us)
        self._inbox.clear()
        self._channel.restart()
        try:
            self.command(DeviceName())
        except RrcRefused as error:
            if error.code != COMMAND_CHECKSUM:
                raise
            self._ledger.mirror.stable = True
            self.command(DeviceName())

    def close(self) -> None:
        """Close the link; a watchdog that is set will stop VR2."""
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def now_us(self) -> int:
        """Time on the link's clock, the one of all time stamps."""
        return self._link.now_us

    @property
    def stable(self) -> bool:
        """Whether stablemode is on, as far as the client knows."""
        return self._ledger.mirror.stable

    @property
    def watchdog_us(self) -> int:
        """The time of the watchdog that the client renews, 0 if none is set."""
        return self._ledger.mirror.watchdog_10ms * 10_000

    @property
    def stopped(self) -> bool:
        """Whether the client stopped sending, after too many refusals."""
        return self._ledger.refusals.stopped is not None

    @property
    def latest_status(self) -> Arrival[StatusA] | None:
        """The newest status line received in any call; look at its age."""
        return self._inbox.latest_status

    def resume(self) -> None:
        """Send again after RrcStopped."""
        self._channel.resume()

    def command(self, command: Command, *, confirm: bool | None = None) -> str:
        """Send any command and wait until the RRC has worked on it.

        Args:
            command: what to send.
            confirm: False to send it only, for a stream; ERs that come later
                count. Left out, all is confirmed but `output` with stablemode on;
                `stablemode` is confirmed in any case.

        Returns:
            The answer of `device`, `version` or `date`, empty for the others.

        Raises:
            RrcRefused: the RRC answered ER.
            LinkTimeout: it did not answer.
            RrcStopped: there were too many refusals.
            LinkClosed: the line is gone.
        """
        if confirm is None:
            confirm = not (self.stable and isinstance(command, Output))
        if confirm or isinstance(command, StableMode):
            return self._channel.converse(command, self._timeout_us)
        self._channel.send(command)
        return ""

    def run_for(self, duration_us: int) -> None:
        """Let time pass, and take in what comes; 0 only takes in what is there."""
        until_us = self._link.now_us + duration_us
        self._channel.step(until_us)
        while self._link.now_us < until_us:
            self._channel.step(until_us)

    def events(self, timeout_us: int) -> Iterator[Arrival[Event]]:
        """Give events, the oldest untaken one first; end when none came for `timeout_us`."""
        return self._drain(self._inbox.events, timeout_us)

    def statuses(self, timeout_us: int) -> Iterator[Arrival[StatusA]]:
        """Give status lines, the oldest untaken one first; end when none came for `timeout_us`."""
        return self._drain(self._inbox.statuses, timeout_us)

    def wait_for(self, kind: EventKind, timeout_us: int) -> Arrival[Event]:
        """Take events up to the first of this kind; one that came before the call counts.

        Raises:
            LinkTimeout: it did not come; the other events stay untaken.
        """
        events = self._inbox.events
        until_us = self._link.now_us + timeout_us
        self._channel.step(self._link.now_us)
        while not any(arrival.value.kind is kind for arrival in events):
            if self._link.now_us >= until_us:
                others = ", ".join(arrival.value.name for arrival in events) or "no event"
                waited = f"waited {timeout_us / 1_000:g} ms for EV:{kind}"
                raise LinkTimeout(f"{waited}; {others} came")
            self._channel.step(until_us)
        while (arrival := events.popleft()).value.kind is not kind:
            continue
        return arrival

    def _drain(self, queue: deque[Arrival[T]], timeout_us: int) -> Iterator[Arrival[T]]:
        until_us = self._link.now_us + timeout_us
        self._channel.step(self._link.now_us)
        while queue or self._link.now_us < until_us:
            if queue:
                yield queue.popleft()
                until_us = self._link.now_us + timeout_us
            else:
                self._channel.step(until_us)
