"""A client for host programs: one method per command, with events and status lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Final, Self, TypeVar

from tickrig.host.links.link import Closing, Link, LinkTimeout
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc.channel import Channel, RrcLoad, RrcRefused
from tickrig.host.rrc.inbox import Arrival, Inbox
from tickrig.host.rrc.reply_matcher import OnRefusals
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.commands import Command
from tickrig.wire.rrc.replies import COMMAND_CHECKSUM, Event, RrcEvent, StatusA

TIMEOUT_US: Final = 200_000
_SETTLE_US: Final = 100_000
"""Wait time after the dummy command at the start (RRC manual, notes)."""

_UNIT_US: Final = 10_000
"""Unit of times on the wire, which are multiples of 10 ms."""

_SLOWEST: Final = 1

_T = TypeVar("_T")


class RrcClient(Closing):
    """A synchronous client of a Robotic Relay Communicator, without a background thread.

    Time passes only in the calls of this client. While a watchdog is set, each call renews the
    watchdog in time. A program that hangs does not renew the watchdog, and the watchdog stops VR2.

    After `max_refusals` ER lines in a row for one command, the client raises RrcStopped. The client
    then sends only `poweroff`, until the RRC is initialized again or `resume` is called.

    Values out of range raise `BadParameters` (a ValueError) before the command is sent. Every
    method that sends a command raises the same errors as `command`.

    The client keeps a tenth of the RRC's time free. Therefore a call may wait 6.25 ms for each line
    sent before, and 3.75 ms for each answer. `load` returns the resulting load of the RRC.

    The client does not check that the RRC received the values as they were sent. CHECK does not
    detect exchanged characters. If this matters, compare the values with `statuses`.

    Args:
        link: open line, which the client closes.
        timeout_us: time to wait for the answer to a command in us.
        max_refusals: number of refusals in a row after which the client stops, 1 or more.
        on_refusals: reaction to too many refusals.
        on_unknown: function that is called with each line that the manual does not list.

    Attributes:
        unknown: latest lines that the manual does not list.

    Raises:
        ValueError: `max_refusals` is below 1.
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
        self.unknown: deque[Arrival[str]] = self._inbox.unknown
        self._channel = Channel(link, self._inbox, max_refusals, on_refusals)
        self._settings = self._channel.matcher.settings

    @classmethod
    def open(cls, url: str) -> Self:
        """Open the serial port of an RRC and start the communication.

        Args:
            url: device path or pyserial URL, as for `SerialLink`.

        Returns:
            A started client. Close the client, or use it in a `with` block.

        Raises:
            LinkClosed: the port cannot be opened.
            LinkTimeout: no RRC answers.
        """
        client = cls(SerialLink(url))
        try:
            client.start()
        except BaseException:
            client.close()
            raise
        return client

    def start(self) -> None:
        """Start the communication with the RRC in the way that its manual advises.

        The client sends a dummy command, waits, and empties the receive buffer. It also finds out
        whether an earlier program left stablemode on. Lines that arrived before the start are
        dropped, including events.

        Raises:
            LinkTimeout: no RRC answers.
        """
        # The LF ends what an earlier program has left half sent; what comes of that, and of
        # the dummy command, is dropped below.
        self._link.send(b"\n" + cmd.DeviceName().encode())
        settled_us = self._link.now_us + _SETTLE_US
        while self._link.now_us < settled_us:
            self._link.receive(settled_us - self._link.now_us)
        self._inbox.clear()
        self._channel.restart()
        try:
            self.command(cmd.DeviceName())
        except RrcRefused as error:
            if error.code != COMMAND_CHECKSUM:
                raise
            # It was sent without CHECK and is refused for that: stablemode is still on. In
            # both modes `device` is answered (R12).
            self._settings.stable = True
            self.command(cmd.DeviceName())

    def close(self) -> None:
        """Close the link. If a watchdog is set, the RRC then stops the wheelchair."""
        self._link.close()

    @property
    def now_us(self) -> int:
        """Time on the link's clock, which is used for all time stamps."""
        return self._link.now_us

    @property
    def stable(self) -> bool:
        """Whether stablemode is on, as far as the client knows."""
        return self._settings.stable

    @property
    def watchdog_us(self) -> int:
        """Time-out in us of the watchdog that the client renews, or 0 if the watchdog is off."""
        return self._settings.watchdog_10ms * 10_000

    @property
    def stopped(self) -> bool:
        """Whether the client stopped sending after too many refusals."""
        return self._channel.matcher.refusals.stopped is not None

    @property
    def latest_status(self) -> Arrival[StatusA] | None:
        """The newest status line that the client has received, or None if there was none.

        The line may be old, so compare its `at_us` with `now_us` before use.
        """
        return self._inbox.latest_status

    @property
    def load(self) -> RrcLoad:
        """Load that this client causes in the RRC, and the maximum rate at which it sends lines."""
        return self._channel.load

    def resume(self) -> None:
        """Resume sending after RrcStopped.

        The count of refusals restarts at zero.
        """
        self._channel.resume()

    def command(self, command: Command, *, confirm: bool | None = None) -> str:
        """Send any command and, by default, wait until the RRC has processed it.

        Args:
            command: command to send.
            confirm: whether to wait for the confirmation. False sends the command without waiting,
                for example in a fast stream of commands. If the RRC refuses such a command later,
                the client counts the refusal. By default, the client waits, except for `output`
                with stablemode on. It always waits for `stablemode`.

        Returns:
            The answer to `device`, `version` or `date`. The answer is empty for other commands.

        Raises:
            RrcRefused: the RRC refused the command (ER).
            LinkTimeout: the RRC did not answer.
            RrcStopped: the RRC refused too many commands in a row.
            LinkClosed: the line is gone.
        """
        if confirm is None:
            confirm = not (self.stable and isinstance(command, cmd.Output))
        if confirm or isinstance(command, cmd.StableMode):
            return self._channel.request(command, self._timeout_us)
        self._channel.send(command)
        return ""

    def run_for(self, duration_us: int) -> None:
        """Wait like `time.sleep`, but receive lines and renew the watchdog during the wait.

        Args:
            duration_us: time to wait in us. 0 only reads the lines that have already arrived.

        Raises:
            LinkClosed: the line is gone.
        """
        until_us = self._link.now_us + duration_us
        self._channel.step(until_us)
        while self._link.now_us < until_us:
            self._channel.step(until_us)

    def events(self, timeout_us: int) -> Iterator[Arrival[Event]]:
        """Yield the events that the RRC sent and that were not read yet, oldest first.

        Args:
            timeout_us: longest wait for each event in us. The iteration ends when no event arrives
                in time.

        Yields:
            An event with the time at which it arrived.
        """
        return self._drain(self._inbox.events, timeout_us)

    def statuses(self, timeout_us: int) -> Iterator[Arrival[StatusA]]:
        """Yield the status lines that the RRC sent and that were not read yet, oldest first.

        Args:
            timeout_us: longest wait for each status line in us. The iteration ends when none
                arrives in time.

        Yields:
            A status line with the time at which it arrived.
        """
        return self._drain(self._inbox.statuses, timeout_us)

    def wait_for(self, kind: RrcEvent, timeout_us: int) -> Arrival[Event]:
        """Wait for an event of a given kind, and return the first such event.

        An event that arrived before the call and was not read yet also counts. Events that are
        older than the returned event are dropped.

        Args:
            kind: kind of the expected event.
            timeout_us: longest wait in us.

        Returns:
            The event with the time at which it arrived.

        Raises:
            LinkTimeout: no such event arrived. The other events can still be read.
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

    def limit(
        self,
        v_pct: int,
        w_pct: int,
        sum_pct: int = 255,
        product_pct: int = 255,
        radius_pct: int = 255,
    ) -> None:
        """Let the stick drive the wheelchair, within limits (command `limit`).

        In the limits, v is the translation and w is the rotation that the stick requests.

        Args:
            v_pct: largest translation, 0..100 %.
            w_pct: largest rotation, 0..100 %.
            sum_pct: largest `|v| + |w|`, 0..255 %.
            product_pct: largest `|v| * |w| / 100`, 0..255 %.
            radius_pct: largest root of v² + w², 0..255 %.

        Raises:
            RrcRefused: the wheelchair (VR2) is off.
        """
        self.command(cmd.Limit(v_pct, w_pct, sum_pct, product_pct, radius_pct))

    def output(self, v_pct: int, w_pct: int, *, confirm: bool | None = None) -> None:
        """Drive the wheelchair with a translation and a rotation (command `output`).

        Args:
            v_pct: translation in -100..100 %, forward positive.
            w_pct: rotation in -100..100 %, right positive.
            confirm: whether to wait for the confirmation. The default depends on stablemode: if it
                is off, the client waits; if it is on, the client does not wait.
        """
        self.command(cmd.Output(v_pct, w_pct), confirm=confirm)

    def device(self) -> str:
        """Return the device name that the RRC reports."""
        return self.command(cmd.DeviceName())

    def version(self) -> str:
        """Return the version that the RRC reports."""
        return self.command(cmd.Version())

    def date(self) -> str:
        """Return the date and time of compilation that the RRC reports."""
        return self.command(cmd.Date())

    def speedmode(self, mode: int, *, locked: bool = False) -> None:
        """Choose the speed mode of the wheelchair.

        Args:
            mode: speed mode, 1 (slowest) to 5.
            locked: whether to lock the buttons of the stick that change the speed mode.
        """
        self.command(cmd.SpeedMode(mode, int(locked)))

    def joystick(self, shape: cmd.Joystick) -> None:
        """Set how the wheelchair responds to movements of its stick (command `joystick`).

        Args:
            shape: parameters #1 to #10 of the command, such as the exponents of translation and
                rotation.
        """
        self.command(shape)

    def watchdog(self, time_us: int) -> None:
        """Set the time without a command after which the RRC stops the wheelchair (watchdog).

        From then on, each call of the client renews the watchdog. The wheelchair therefore stops if
        the program hangs.

        Args:
            time_us: time in 0..2_550_000 us, a multiple of 10_000 us. 0 switches the watchdog off.

        Raises:
            ValueError: the time is out of range.
        """
        self.command(cmd.Watchdog(_units(time_us)))

    def stablemode(self, *, on: bool = True) -> None:
        """Switch the stablemode of the RRC on or off. Stablemode protects lines by a checksum.

        With stablemode, the client appends the checksum (CHECK) to each line, and the RRC does not
        confirm commands with OK lines.

        Args:
            on: whether to switch stablemode on.
        """
        self.command(cmd.StableMode(int(on)))

    def status(self, *, on: bool = True) -> None:
        """Switch the stream of status lines on or off.

        The RRC sends a status line each 10 ms while the wheelchair (VR2) is on.

        Args:
            on: whether to switch the stream on.
        """
        self.command(cmd.Status(int(on)))

    def poweroff(self) -> None:
        """Force the wheelchair (VR2) to stop. It must then be switched on by its power button."""
        self.command(cmd.PowerOff())

    def beep(self, *times_us: int) -> None:
        """Sound the buzzer of the wheelchair in a pattern.

        Args:
            times_us: up to ten durations in us. The buzzer is on for the first duration, off for
                the second one, and so on. Each duration is in 0..2_550_000 and a multiple of
                10_000.

        Raises:
            ValueError: a duration is out of range.
        """
        times = tuple(_units(time_us) for time_us in times_us)
        self.command(cmd.Beep(times + (0,) * (10 - len(times))))

    def drive_by_host(self, v_pct: int, w_pct: int) -> None:
        """Let this program drive. If the stick was driving, select the slowest speed mode first.

        The RRC manual advises the slowest speed mode whenever the driver changes. The slowest speed
        mode stays selected. If you want another speed mode, select it after this call.

        This method sends the command `output`. If the stick was driving, or if it is unknown who
        was driving, the method waits until the RRC has confirmed this command.

        Args:
            v_pct: translation in -100..100 %, forward positive.
            w_pct: rotation in -100..100 %, right positive.
        """
        changes = self._slow_down_before(cmd.Output)
        self.output(v_pct, w_pct, confirm=changes or None)

    def drive_by_stick(
        self,
        v_pct: int,
        w_pct: int,
        sum_pct: int = 255,
        product_pct: int = 255,
        radius_pct: int = 255,
    ) -> None:
        """Let the stick drive. If this program was driving, select the slowest speed mode first.

        The arguments are the same as those of `limit`: v_pct, w_pct, sum_pct, product_pct,
        radius_pct.
        """
        self._slow_down_before(cmd.Limit)
        self.limit(v_pct, w_pct, sum_pct, product_pct, radius_pct)

    def _drain(self, queue: deque[Arrival[_T]], timeout_us: int) -> Iterator[Arrival[_T]]:
        until_us = self._link.now_us + timeout_us
        self._channel.step(self._link.now_us)
        while queue or self._link.now_us < until_us:
            if queue:
                yield queue.popleft()
                until_us = self._link.now_us + timeout_us
            else:
                self._channel.step(until_us)

    def _slow_down_before(self, drive: type[cmd.Limit | cmd.Output]) -> bool:
        """Send speed mode 1 unless this drive is active. Return whether it was sent."""
        settings = self._settings
        changes = settings.drive is not drive
        if changes:
            self.command(cmd.SpeedMode(_SLOWEST, settings.locked))
        return changes


def _units(time_us: int) -> int:
    if time_us % _UNIT_US:
        raise ValueError(f"{time_us} us is not a multiple of {_UNIT_US} us")
    return time_us // _UNIT_US
