"""A chair with an RRC, which is protected, driven by a dead-man key, and stopped at the end."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Final

from tickrig.host.links.link import Closing, DeviceRefused, Link, LinkClosed, LinkError, LinkTimeout
from tickrig.host.rrc.channel import RrcRefused, RrcStopped
from tickrig.host.rrc.client import RrcClient
from tickrig.host.rrc.inbox import Arrival
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rrc.commands import Limit
from tickrig.wire.rrc.replies import Event, Ok, RrcEvent, StatusA

# Theory of operation
# ===================
#
# A person sits in the chair, so each way in which a program can end or fail has an answer here.
#
# - Before anything else the device must answer as an RRC (`RrcClient.start`: `device`, which no
#   other device answers with OK:device). What came instead is quoted: it shows what is connected.
# - Then the guard is set: the watchdog first, because it also covers what follows, then
#   stablemode. Only then a verb may move something.
# - While the host drives, `drive` sends the values again each 100 ms, listens for 20 ms and
#   judges what came (`watch`): an event that VR2 stopped, status lines that stop coming,
#   status lines whose output is not what was commanded (CHECK does not detect exchanged
#   characters, so the manual's own check is not enough). Each ends the drive.
# - `DeadMan` is what lets values other than 0 through. A terminal reports no key-up, so a press
#   holds for 1 s; a longer press repeats sooner than that. Whoever presses may run in another
#   thread than `step` (the panel): if that thread hangs, no press comes, and the chair stops.
# - The end of a `with` block leaves the RRC as it was found: motors stopped, status lines off,
#   stablemode as before, and last the watchdog off. A watchdog that stays on would stop VR2 by
#   force as soon as the program is gone, although nothing moves. A status line must show the
#   stop; if none does, `poweroff` follows.
# - If the line is gone, nothing can be sent: the watchdog stops VR2. The same happens if the
#   program is killed or the machine fails. So without a watchdog there is no such end.
#
# Signals do not raise exceptions inside of a call of the client, which would leave it in an
# unknown state in the middle of the stop: the commands set a flag (`verbs.Ended`), and the
# loops look at it.

DEAD_MAN_US: Final = 1_000_000
"""Time for which a press of the dead-man key is valid."""

STEP_US: Final = 20_000
_RESEND_US: Final = 100_000
_SILENT_US: Final = 300_000
"""Time without a status line after which the RRC counts as silent. Status lines come each 10 ms."""

_ASK_US: Final = 1_000_000
"""Time without a status line after which the RRC is queried. VR2 may be off, and then none come."""

_TAKEN_US: Final = 200_000
"""Time after which a status line shows the effect of a command."""

_STOP_TRIES: Final = 3
_MEET_TRIES: Final = 3
"""Number of queries to an RRC that has answered once, because a busy machine delivers late."""

_KEPT_BYTES: Final = 4_096
_SHOWN_BYTES: Final = 40
_OK: Final = Ok("device").encode()

_OFF: Final = "VR2 is off: press its power button, then call this again"
_STOPS: Final = frozenset(
    {kind for kind in RrcEvent if kind.startswith("PowerOff")} | {RrcEvent.INITIALIZED}
)


class ChairStopped(Exception):  # noqa: N818 - what happened
    """The wheelchair (VR2) is switched off, or it stopped while the program was driving it.

    The program drives the wheelchair through a device, the RRC.

    Attributes:
        kind: event with which the RRC reported the stop, or None if there was no event.
    """

    def __init__(self, message: str, kind: RrcEvent | None = None) -> None:
        super().__init__(message)
        self.kind = kind


class NotAnRrc(LinkError):  # noqa: N818 - what is there
    """The device on the serial line answers, but not as an RRC."""


@dataclass(frozen=True, slots=True)
class Guard:
    """Safety settings that `Chair` makes in the RRC before a program may drive the wheelchair.

    Attributes:
        watchdog_us: time without a command, in us, after which the RRC stops the wheelchair. 0
            switches this watchdog off.
        stable: whether the RRC's stablemode is switched on. In stablemode each line has a checksum.
    """

    watchdog_us: int = 500_000
    stable: bool = True


class DeadMan:
    """A dead-man key. A press is valid for 1 s, so the driver must press the key repeatedly."""

    def __init__(self) -> None:
        self._until_us: int | None = None

    def press(self, now_us: int) -> None:
        """Record a press."""
        self._until_us = now_us + DEAD_MAN_US

    def release(self) -> None:
        """Release the key at once."""
        self._until_us = None

    def holds(self, now_us: int) -> bool:
        """Whether the latest press is still valid."""
        until_us = self._until_us
        return until_us is not None and now_us < until_us


class _OpeningLink:
    """A `Link[bytes]` that stores the first received bytes.

    Attributes:
        received: bytes that were received first.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link, self.received = link, b""

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send bytes."""
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        """Return received bytes."""
        data = self._link.receive(timeout_us)
        if len(self.received) < _KEPT_BYTES:
            self.received += data
        return data

    def close(self) -> None:
        """Close the line."""
        self._link.close()


class Chair(Closing):
    """A wheelchair that a program drives through an RRC (the Robotic Relay Communicator) safely.

    The constructor checks that the device is an RRC and makes the safety settings of `guard`. The
    end of a `with` block stops the motors and restores the earlier settings of the RRC.

    Args:
        link: open serial line to the RRC. The chair closes the line at the end.
        guard: watchdog and stablemode settings that protect the person in the chair.

    Attributes:
        client: client that communicates with the RRC.
        guard: watchdog and stablemode settings that protect the person in the chair.
        moved: whether the motors may run because of this program.

    Raises:
        NotAnRrc: another device answers.
        LinkTimeout: no device answers.
        LinkClosed: the serial line is closed or its port has disappeared.
    """

    def __init__(self, link: Link[bytes], guard: Guard) -> None:
        opening = _OpeningLink(link)
        self.client, self.guard, self.moved = RrcClient(opening), guard, False
        self._link = link
        self._sent: tuple[int, int] | None = None  # what the host drives, None if it does not
        self._changed_us = self._resend_us = 0
        self._status_since_us: int | None = None
        self._asked_us = self.client.now_us
        try:
            self._meet(opening)
            self._found_stable = self.client.stable
            self.set_guard()
        except BaseException:
            self.client.close()
            raise

    def set_guard(self) -> None:
        """Set the RRC's watchdog and stablemode, at the start and after EV:Initialized."""
        if self.guard.watchdog_us:
            self.client.watchdog(self.guard.watchdog_us)
        if self.guard.stable:
            self.client.stablemode()
        if self._status_since_us is not None:
            self._status_since_us = self.client.now_us
            self.client.status()

    def _meet(self, opening: _OpeningLink) -> None:
        """Contact the RRC and check its answer. A line with an echo does not answer OK:device."""
        failure: Exception | None = None
        for _ in range(_MEET_TRIES):
            try:
                self.client.start()
            except (LinkTimeout, DeviceRefused) as error:
                failure = error
            else:
                failure = None
            if failure is None or _OK not in opening.received:
                break
        if failure is None and (self.client.stable or _OK in opening.received):
            return
        if _OK in opening.received:
            raise LinkTimeout(f"an RRC answered once, then not in time: {failure}") from failure
        if opening.received:
            raise NotAnRrc(f"no RRC: {opening.received[:_SHOWN_BYTES]!r} came") from failure
        raise LinkTimeout("no answer: is an RRC connected, and has it power?") from failure

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the motors, restore the initial settings of the RRC, and close the line."""
        try:
            if not isinstance(error, LinkClosed):
                self._leave()
        except (LinkError, DeviceRefused):
            if error is None:
                raise
        finally:
            self.client.close()

    def close(self) -> None:
        """Close the line without stopping the motors first.

        The RRC's watchdog then stops the wheelchair.
        """
        self.client.close()

    def leave_driving(self) -> None:
        """Do not stop the wheelchair at the end of the program.

        The user can then continue to drive it with its stick. The RRC's watchdog is off.
        """
        self.moved = False

    def _leave(self) -> None:
        self.stop()
        client = self.client
        if self._status_since_us is not None:
            client.status(on=False)
        if client.stable and not self._found_stable:
            client.stablemode(on=False)
        if client.watchdog_us:
            client.watchdog(0)

    def status(self) -> StatusA | None:
        """Return the next status line of the wheelchair, or None if the wheelchair is off.

        The first call switches the stream of status lines on.
        """
        if self._status_since_us is None:
            self._status_since_us = self.client.now_us
            self.client.status()
        until_us = self.client.now_us + _SILENT_US
        while (latest := self.latest_status) is None and self.client.now_us < until_us:
            self.client.run_for(STEP_US)
        return None if latest is None else latest.value

    def require_on(self) -> StatusA:
        """Return a status line of the wheelchair.

        Raise ChairStopped if the wheelchair (VR2) is off.
        """
        status = self.status()
        if status is None:
            raise ChairStopped(_OFF)
        list(self.client.events(0))  # what happened before is over
        return status

    def take_over(self, speed_mode: int = 1) -> None:
        """Let this program drive the wheelchair instead of the stick.

        The first command is a standstill.

        Args:
            speed_mode: speed mode of the wheelchair, 1 (slowest) to 5.

        Raises:
            ChairStopped: the wheelchair (VR2) is off.
        """
        self.require_on()
        self.moved = True
        self.client.drive_by_host(0, 0)
        self._note(0, 0)
        if speed_mode != 1:
            self.client.speedmode(speed_mode)

    def drive(self, v_pct: int, w_pct: int) -> None:
        """Drive the wheelchair for 20 ms. Call this method in a loop after `take_over`.

        Args:
            v_pct: translation in -100..100 %, forward positive.
            w_pct: rotation in -100..100 %, right positive.

        Raises:
            ChairStopped: the wheelchair (VR2) was stopped, or its motors do not follow the command.
            LinkTimeout: the RRC no longer sends status lines.
        """
        try:
            if (v_pct, w_pct) != self._sent or self.client.now_us >= self._resend_us:
                self.client.drive_by_host(v_pct, w_pct)
                self._note(v_pct, w_pct)
            self.client.run_for(STEP_US)
        except DeviceRefused:
            self.watch()  # an event is the better reason
            raise
        self.watch()

    def drive_by_stick(self, limit: Limit, speed_mode: int = 1) -> None:
        """Let the wheelchair's stick drive.

        Args:
            limit: limits of the translation and the rotation that the stick commands.
            speed_mode: speed mode of the RRC, from 1 (slowest) to 5.
        """
        self.require_on()
        self.moved = True
        self._sent = None
        self.client.drive_by_stick(*limit.values())
        if speed_mode != 1:
            self.client.speedmode(speed_mode)

    def watch(self) -> list[Arrival[Event]]:
        """Check the lines received since the last call, and stop driving if they report a problem.

        Returns:
            The events that are no reason to stop, oldest first.

        Raises:
            ChairStopped: the wheelchair (VR2) was stopped, or its motors do not follow the command.
            LinkTimeout: the RRC no longer sends status lines, or it does not answer.
        """
        self.ask_if_silent()
        events = []
        for arrival in self.client.events(0):  # those behind one that raises stay untaken
            events.append(arrival)
            if (kind := arrival.value.kind) in _STOPS:
                self.moved, self._sent = False, None
                if self._status_since_us is not None:
                    self._status_since_us = self.client.now_us  # they come again with VR2
                raise ChairStopped(f"VR2 was stopped: EV:{arrival.value.name}", kind)
        now_us, latest = self.client.now_us, self.latest_status
        if latest is not None and now_us - latest.at_us > _SILENT_US:
            raise LinkTimeout(
                f"no status line for {_SILENT_US // 1_000} ms: is the RRC still there?"
            )
        if latest is not None and self._sent is not None:
            out_pct = latest.value.out_v_pct, latest.value.out_w_pct
            if out_pct != self._sent and latest.at_us - self._changed_us > _TAKEN_US:
                self._power_off()
                said = "commanded {} {}, the RRC drives {} {}: VR2 switched off"
                raise ChairStopped(said.format(*self._sent, *out_pct))
        return events

    def ask_if_silent(self) -> None:
        """If no status line came for a second, check by a query that the RRC still answers.

        A missing status line alone is no error, because the RRC sends none while the wheelchair
        (VR2) is off.

        Raises:
            LinkTimeout: the RRC does not answer.
        """
        latest, now_us = self.latest_status, self.client.now_us
        heard_us = 0 if latest is None else latest.at_us
        if now_us - max(heard_us, self._asked_us) < _ASK_US:
            return
        for tries_left in reversed(range(_MEET_TRIES)):
            try:
                self.client.device()
                break
            except LinkTimeout as error:
                if not tries_left:
                    raise LinkTimeout("no answer: is the RRC still there?") from error
        self._asked_us = self.client.now_us

    def stay_silent(self, kind: RrcEvent, most_us: int) -> int | None:
        """Simulate a program that hangs: send nothing until an event arrives, then resume sending.

        The test procedure uses this to check that the RRC's watchdog stops the wheelchair.

        Args:
            kind: kind of the expected event.
            most_us: longest wait for the event in us.

        Returns:
            The time until the event in us, or None if the event did not arrive in time.
        """
        lines, began_us = LineSplitter(), self.client.now_us
        wanted = Event(kind).encode().removesuffix(b"\n")
        while (waited_us := self.client.now_us - began_us) < most_us:
            if wanted in lines.push(self._link.receive(most_us - waited_us)):
                waited_us = self.client.now_us - began_us
                self.moved, self._sent, self._status_since_us = False, None, self.client.now_us
                self.client.start()
                return waited_us
        self.client.start()
        return None

    def stop(self) -> None:
        """Stop the motors, and wait for a status line that confirms the stop.

        If no status line confirms the stop, this method switches the wheelchair (VR2) off.
        """
        if not self.moved:
            return
        for _ in range(_STOP_TRIES):
            try:
                if self._sent is None:  # the stick drives
                    self.client.drive_by_host(0, 0)
                self.client.output(0, 0, confirm=True)
            except RrcRefused as error:
                if error.code in ("output", "limit"):  # VR2 is off
                    self.moved = False
                    return
            except RrcStopped:
                break
            except LinkTimeout:
                continue
            self._note(0, 0)
            if self._stands():
                self.moved = False
                return
        self._power_off()

    def _stands(self) -> bool:
        """Wait for a status line whose output is 0.

        With stablemode, the RRC does not reply to a lost line, so only a status line confirms the
        stop.
        """
        since_us = self.client.now_us
        while self.client.now_us < since_us + _TAKEN_US:
            self.client.run_for(STEP_US)
            latest = self.latest_status
            if latest is None or latest.at_us < since_us:
                continue
            if not (latest.value.out_v_pct or latest.value.out_w_pct):
                return True
        return False

    def _power_off(self) -> None:
        with suppress(RrcRefused):  # it is off
            self.client.poweroff()
        self.moved = False

    def _note(self, v_pct: int, w_pct: int) -> None:
        now_us = self.client.now_us
        if self._sent != (v_pct, w_pct):
            self._sent, self._changed_us = (v_pct, w_pct), now_us
        self._resend_us = now_us + _RESEND_US

    @property
    def latest_status(self) -> Arrival[StatusA] | None:
        """The newest status line, or None if the wheelchair (VR2) has been off since."""
        latest, since_us = self.client.latest_status, self._status_since_us
        return latest if latest and since_us is not None and latest.at_us >= since_us else None
