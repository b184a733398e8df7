"""Several ports on one serial line."""

from __future__ import annotations

from collections.abc import Sequence

from tickrig.device.twin import NonCopyable
from tickrig.emulators.serial.emulator import Outside
from tickrig.wire.instant import NEVER


class SerialHub(NonCopyable):
    """Ports on one line: each hears all that the device sends, and each may send.

    What several hosts send at the same time arrives mixed, in pieces of a port's poll; none of
    them hears the others.

    Args:
        ports: the ports, a pty and network ports.
    """

    why_not_copied = "its ports belong to this machine"

    def __init__(self, ports: Sequence[Outside]) -> None:
        self._ports = tuple(ports)

    @property
    def due_us(self) -> int:
        """Unknown to anybody but the hosts."""
        return NEVER

    @property
    def lost(self) -> int:
        """Bytes that a port dropped because its host did not read."""
        return sum(port.lost for port in self._ports)

    @property
    def host_setting(self) -> str:
        """What hosts have set that is not the device's, as `9600 8N1`."""
        return ", ".join(port.host_setting for port in self._ports if port.host_setting)

    def poll(self, now_us: int, /) -> bytes:
        """Take what the hosts sent."""
        return b"".join([port.poll(now_us) for port in self._ports])

    def attend(self, now_us: int, /) -> None:
        """Let hosts come and go, and give them what is kept for them."""
        for port in self._ports:
            port.attend(now_us)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send to every host."""
        for port in self._ports:
            port.send(now_us, traffic)
