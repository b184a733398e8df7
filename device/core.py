"""The contract every emulated device keeps."""

from __future__ import annotations

from typing import Protocol, TypeVar

from tickrig.wire.uart import UartSetting

W = TypeVar("W")  # one tick's traffic: bytes on a line, tuple[CanFrame, ...] on CAN


class Device(Protocol[W]):
    """A Mealy machine on a tick: traffic in, traffic out, one step a tick."""

    @property
    def tick_us(self) -> int:
        """The control period in microseconds; ticks fall on its multiples."""
        ...

    @property
    def due_us(self) -> int:
        """The earliest time at which anything would happen without input.

        A rig in virtual time jumps to it. It may be in the past (the next tick
        then does the work) or `NEVER`. A tick before it, without traffic, must
        change nothing that anybody could ever see.

        It may become earlier in `tick` and `reset`, and by what is done to the
        device between steps: inputs, a write to its dictionary. A rig looks
        again whenever it is asked to go on; what one device does to another
        within a step is heard of only through the wire.
        """
        ...

    def reset(self) -> None:
        """Power-on reset: forget all but the configuration and the physical inputs."""

    def tick(self, now_us: int, rx: W, /) -> W:
        """Advance by one tick.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: what arrived since the last tick, in wire order.

        Returns:
            What the device sends in this tick, in wire order. Bad input is
            answered as the real device answers it; it never raises.
        """
        ...


class UartDevice(Device[bytes], Protocol):
    """A device that changes the setting of its serial line while it runs."""

    @property
    def uart(self) -> UartSetting | None:
        """The setting of its UART, as the latest tick or `reset` left it; None without a UART.

        What a tick returns is still sent with the setting before that tick. The new one counts
        when the last stop bit has passed; from then on the device also receives with it.
        """
        ...
