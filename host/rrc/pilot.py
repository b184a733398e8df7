"""The state between a panel and a chair, so that screen and line do not wait for each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

from tickrig.host.links.link import DeviceRefused
from tickrig.host.rrc.chair import STEP_US, Chair, ChairStopped, DeadMan
from tickrig.host.rrc.channel import RrcLoad, RrcStopped
from tickrig.wire.rrc.commands import Limit
from tickrig.wire.rrc.replies import RrcEvent, StatusA

_KEPT_LINES: Final = 60


class Drives(StrEnum):
    """Who drives the chair, as chosen in the panel."""

    STOPPED = "stopped"
    HOST = "host"
    STICK = "stick"

    @property
    def text(self) -> str:
        """Text of the driver for the user."""
        return "stopped" if self is Drives.STOPPED else f"{self} drives"


class _PadStick(Protocol):
    """A stick with a dead-man button."""

    def poll(self, now_us: int, /) -> tuple[int, int]:
        """Return the translation and rotation to drive, in per cent.

        Both are 0 while no dead-man button of the game pad is held. The method raises
        ChairStopped if the game pad is gone.
        """
        ...


@dataclass(frozen=True, slots=True)
class PilotView:
    """Snapshot of the wheelchair and of the settings made in the panel, which the panel draws.

    Attributes:
        now_us: time of the snapshot in us.
        drives: driver of the chair: the host, the stick, or none.
        aim_pct: translation and rotation that the host drives while the dead-man key is held, in
            per cent.
        held: whether the dead-man key is held.
        speed_mode: chosen speed mode, 1 (slowest) to 5.
        most_pct: limit of translation and rotation while the stick drives, in per cent.
        status: latest status line, or None while the wheelchair (VR2) is off.
        load: load of the RRC that this program causes.
        lines: latest events and actions as `(time, mark, text)`. The mark is `<` for an event of
            the RRC, `>` for an action of the user, and `!` for a problem.
    """

    now_us: int
    drives: Drives = Drives.STOPPED
    aim_pct: tuple[int, int] = (0, 0)
    held: bool = False
    speed_mode: int = 1
    most_pct: int = 50
    status: StatusA | None = None
    load: RrcLoad | None = None
    lines: tuple[tuple[int, str, str], ...] = ()


class Pilot:
    """Drives a wheelchair in one thread, as another thread requests.

    The driving thread calls `step` repeatedly. The other thread, such as the thread of
    `ChairPanel`, calls the other methods and reads `view`.

    Args:
        chair: chair to drive.
        pad: game pad that replaces the keys for driving, or None.

    Attributes:
        view: present state of panel and chair.
    """

    def __init__(self, chair: Chair, pad: _PadStick | None = None) -> None:
        self._chair, self._pad = chair, pad
        self._client = chair.client
        self._dead_man = DeadMan()
        self._drives, self._aim_pct = Drives.STOPPED, (0, 0)
        self._speed_mode, self._most_pct = 1, 50
        self._acts: deque[Callable[[], None]] = deque()
        self._lines: deque[tuple[int, str, str]] = deque(maxlen=_KEPT_LINES)
        self._began_us = self._client.now_us
        chair.status()
        self.view = self._look()

    # Called by the screen.

    def press(self) -> None:
        """Press the dead-man key."""
        self._dead_man.press(self._client.now_us)

    def release(self) -> None:
        """Release the dead-man key, and set the values to drive to 0."""
        self._dead_man.release()
        self._aim_pct = 0, 0

    def aim(self, v_pct: int, w_pct: int) -> None:
        """Change the translation and rotation to drive by a number of per cent each."""
        v, w = self._aim_pct
        self._aim_pct = max(-100, min(100, v + v_pct)), max(-100, min(100, w + w_pct))

    def take(self, drives: Drives) -> None:
        """Choose who drives the chair: the host or the stick. `Drives.STOPPED` stops the chair."""
        self.release()
        self._acts.append(lambda: self._take(drives))

    def choose_speed(self, mode: int) -> None:
        """Choose the speed mode."""

        def act() -> None:
            self._client.speedmode(mode)
            self._speed_mode = mode
            self._note(">", f"speed mode {mode}")

        self._acts.append(act)

    def limit_stick(self, pct: int) -> None:
        """Change the limit of the stick by a number of per cent."""
        self._most_pct = max(0, min(100, self._most_pct + pct))
        if self._drives is Drives.STICK:
            self._acts.append(lambda: self._take(Drives.STICK))

    def beep(self) -> None:
        """Sound the buzzer for a moment."""
        self._acts.append(lambda: self._client.beep(200_000))

    def power_off(self) -> None:
        """Force the wheelchair (VR2) to stop."""
        self.release()
        self._acts.append(self._power_off)

    # Called by the thread of the line.

    def step(self) -> None:
        """Execute the requests of the panel, then drive or wait for 20 ms, and update `view`.

        Raises:
            LinkError: the line is gone, or the RRC does not answer.
        """
        try:
            while self._acts:
                self._acts.popleft()()
            if self._drives is Drives.HOST:
                self._chair.drive(*self._drive_pct())
            else:
                self._client.run_for(STEP_US)
            for arrival in self._chair.watch():
                self._note("<", f"EV:{arrival.value.name}")
        except ChairStopped as stop:
            self._stopped(stop)
        except RrcStopped as refused:
            self._note("!", str(refused))
            self._client.resume()
            self._drives = Drives.STOPPED
        except DeviceRefused as refused:
            self._note("!", str(refused))
        self.view = self._look()

    def _drive_pct(self) -> tuple[int, int]:
        now_us = self._client.now_us
        if self._pad is not None:
            aim_pct = self._pad.poll(now_us)
            if any(aim_pct):
                self._dead_man.press(now_us)
                self._aim_pct = aim_pct
            else:
                self.release()
        return self._aim_pct if self._dead_man.holds(now_us) else (0, 0)

    def _take(self, drives: Drives) -> None:
        if drives is Drives.HOST:
            self._chair.take_over(self._speed_mode)
        elif drives is Drives.STICK:
            limit = Limit(self._most_pct, self._most_pct)
            self._chair.drive_by_stick(limit, self._speed_mode)
        else:
            self._chair.stop()
        self._drives = drives
        self._note(">", drives.text)

    def _power_off(self) -> None:
        self._client.poweroff()
        self._note(">", "power off")

    def _stopped(self, stop: ChairStopped) -> None:
        self._drives = Drives.STOPPED
        self.release()
        if stop.kind is None:
            self._note("!", str(stop))
            self._chair.stop()
        else:
            self._note("<", f"EV:{stop.kind}")
        if stop.kind is RrcEvent.INITIALIZED:
            self._chair.set_guard()  # it has forgotten all
            self._speed_mode = 1

    def _note(self, mark: str, text: str) -> None:
        self._lines.append((self._client.now_us - self._began_us, mark, text))

    def _look(self) -> PilotView:
        now_us = self._client.now_us
        latest = self._chair.latest_status
        return PilotView(
            now_us - self._began_us,
            self._drives,
            self._aim_pct,
            self._dead_man.holds(now_us),
            self._speed_mode,
            self._most_pct,
            None if latest is None else latest.value,
            self._client.load,
            tuple(self._lines),
        )
