"""The RRC as a host program sees it: one method a command."""

from __future__ import annotations

from typing import Final

from tickrig.host.rrc.session import Session
from tickrig.wire.rrc import commands as cmd

UNIT_US: Final = 10_000
"""Times on the wire are multiples of 10 ms."""

SLOWEST: Final = 1


class RrcClient(Session):
    """A synchronous RRC client; nothing runs in the background.

    Values out of range raise `BadParameters` (a ValueError) before anything is
    sent. All methods raise what `command` raises.

    Not checked: that the RRC received the values as they were sent. CHECK does
    not see exchanged characters; compare with `statuses` where it matters.
    """

    def limit(
        self,
        v_pct: int,
        w_pct: int,
        sum_pct: int = 255,
        product_pct: int = 255,
        radius_pct: int = 255,
    ) -> None:
        """Let the stick drive, within limits; see `commands.Limit`."""
        self.command(cmd.Limit(v_pct, w_pct, sum_pct, product_pct, radius_pct))

    def output(self, v_pct: int, w_pct: int, *, confirm: bool | None = None) -> None:
        """Drive: translation (forward) and rotation (right), -100..100 %.

        Args:
            v_pct: translation.
            w_pct: rotation.
            confirm: whether to wait until the RRC has it. Left out, it is waited
                for without stablemode, and streamed with it.
        """
        self.command(cmd.Output(v_pct, w_pct), confirm=confirm)

    def device(self) -> str:
        """Return the device name."""
        return self.command(cmd.DeviceName())

    def version(self) -> str:
        """Return the version."""
        return self.command(cmd.Version())

    def date(self) -> str:
        """Return the date and time of compilation."""
        return self.command(cmd.Date())

    def speedmode(self, mode: int, *, locked: bool = False) -> None:
        """Choose the speed mode, 1 (slowest) to 5, and whether its buttons are locked."""
        self.command(cmd.SpeedMode(mode, int(locked)))

    def joystick(self, shape: cmd.Joystick) -> None:
        """Shape the stick; the ten parameters are named in `commands.Joystick`."""
        self.command(shape)

    def watchdog(self, time_us: int) -> None:
        """Stop VR2 after this time without a command, 0..2_550_000 us; 0 is off.

        From then on the client renews it in each of its calls.
        """
        self.command(cmd.Watchdog(_units(time_us)))

    def stablemode(self, *, on: bool = True) -> None:
        """Want CHECK on each line, which the client appends, and no OK lines."""
        self.command(cmd.StableMode(int(on)))

    def status(self, *, on: bool = True) -> None:
        """Switch the stream of status lines, one each 10 ms while VR2 is on."""
        self.command(cmd.Status(int(on)))

    def poweroff(self) -> None:
        """Stop VR2 by force; it must then be switched off by its button."""
        self.command(cmd.PowerOff())

    def beep(self, *times_us: int) -> None:
        """Sound the buzzer: on, off, on, ... up to ten times of 0..2_550_000 us."""
        times = tuple(_units(time_us) for time_us in times_us)
        self.command(cmd.Beep(times + (0,) * (10 - len(times))))

    def drive_by_host(self, v_pct: int, w_pct: int) -> None:
        """Send `output`, and before it the slowest speed mode if the stick drove until now.

        The manual advises it for every change between limit and output. The
        first output is confirmed. Choose the speed mode again afterwards.
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
        """Send `limit`, and before it the slowest speed mode if the host drove until now."""
        self._slow_down_before(cmd.Limit)
        self.limit(v_pct, w_pct, sum_pct, product_pct, radius_pct)

    def _slow_down_before(self, drive: type[cmd.Limit | cmd.Output]) -> bool:
        """Send speed mode 1 unless this drive is on; return whether that was sent."""
        mirror = self._ledger.mirror
        changes = mirror.drive is not drive
        if changes:
            self.command(cmd.SpeedMode(SLOWEST, mirror.locked))
        return changes


def _units(time_us: int) -> int:
    if time_us % UNIT_US:
        raise ValueError(f"{time_us} us is not a multiple of {UNIT_US} us")
    return time_us // UNIT_US
