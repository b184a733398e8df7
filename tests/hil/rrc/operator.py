"""The operator: hands and eyes at a VR2 wheelchair, emulated or real."""

from __future__ import annotations

from typing import Final, Protocol

PRESS_US: Final = 30_000
"""How long a button is pressed: several periods of the RRC."""


class Operator(Protocol):
    """Whoever presses buttons, moves the stick and looks at the motors.

    Attributes:
        said_no: a human saw what should not be; that counts however late the machine was.
    """

    said_no: bool

    def press(self, button: str) -> None:
        """Press a button and let it go: `power_button`, `speed_up_button`, ..."""

    def hold_stick(self, v_pct: int, w_pct: int) -> None:
        """Move the stick (forward and right are positive) and hold it there."""

    def cut_power(self) -> None:
        """Take the RRC's power away for a moment; skips the test if that cannot be done."""

    def make_fault(self, name: str, value: int = 1) -> None:
        """Make a physical fault; skips the test if that cannot be done."""

    def switch_off(self) -> None:
        """Bring VR2 off, whatever state it is in."""

    def sees_motion(self, v_pct: int, w_pct: int) -> bool:
        """Whether the motors run like this, 0 and 0 for not at all."""
        ...

    def sees_error(self) -> bool:
        """Whether the controller's LED blinks an error."""
        ...

    def hears_tones(self, times_us: tuple[int, ...]) -> bool:
        """Whether the buzzer now sounds like this: on, off, on, ... times."""
        ...
