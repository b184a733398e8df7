"""The interface of every emulated device."""

from __future__ import annotations

from typing import Protocol, TypeVar

from tickrig.wire.uart import UartSetting

W = TypeVar("W")  # one tick's traffic: bytes on a line, tuple[CanFrame, ...] on CAN


class Device(Protocol[W]):
    """A Mealy machine: traffic in, traffic out, one step per tick."""

    @property
    def tick_us(self) -> int:
        """The control period in microseconds; ticks are at multiples of the period."""
        ...

    @property
    def due_us(self) -> int:
        """The earliest time at which the device does anything without new input, in microseconds.

        A rig in virtual time skips the ticks up to this time. Therefore a tick before this time
        must have no visible effect if there is no traffic. If the time is in the past, the device
        acts in the next tick. `NEVER` means that the device does nothing without input.

        The time may become earlier in `tick` and `reset`. Between steps it may become earlier by
        other changes, such as a new input or a write to the dictionary. Therefore a rig reads it
        again at each call that advances the time. Within a step, one device affects another only
        through the wire.
        """
        ...

    def reset(self) -> None:
        """Power-on reset: erase all state except the configuration and the physical inputs."""

    def tick(self, now_us: int, rx: W, /) -> W:
        """Advance the device by one tick.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: traffic that has arrived since the last tick, in the order of the wire.

        Returns:
            The traffic that the device sends in this tick, in the order of the wire. The device
            answers bad input as the real device does, and never raises.
        """
        ...


class UartDevice(Device[bytes], Protocol):
    """A device that can change the setting of its serial line at run time."""

    @property
    def uart(self) -> UartSetting | None:
        """Setting of the device's UART after the latest tick or `reset`, or None without a UART.

        If a tick changes the setting, the traffic that this tick returns is still sent with the old
        setting. The new setting applies to sending and receiving after the last stop bit of this
        traffic.
        """
        ...
