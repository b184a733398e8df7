"""The buses on which our slave meets foreign masters."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can

SLOWDOWN = int(os.environ.get("WITH_VCAN_SLOWDOWN", "1"))
"""How many times slower than a machine this guest of tools/with-vcan is."""

VCAN = "vcan0"
GROUP = "ff11::7469:636b"  # of interface-local scope: what is sent never leaves this machine
PORT = 20_000 + os.getpid() % 20_000  # so that two runs beside each other do not meet

NO_SOCKETCAN = (
    f"no SocketCAN with {VCAN} here; 'tools/with-vcan pytest tests/interop' runs it in a kernel"
    " that has it"
)


def patience(seconds: float) -> float:
    """Return how long something may take here that takes so long at most on a machine."""
    return seconds * SLOWDOWN


@dataclass(frozen=True)
class Bus:
    """A bus that a process can name to another.

    Attributes:
        interface: python-can's name.
        channel: its channel.
        options: further keyword arguments.
    """

    interface: str
    channel: str
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def arguments(self) -> list[str]:
        """As options of canopen-slave-emu and of python-can's tools."""
        words = ["-i", self.interface, "-c", self.channel]
        for name, value in self.options:
            words += ["--bus-kwargs", f"{name}={value}"]
        return words

    @property
    def keywords(self) -> dict[str, Any]:
        """As keyword arguments of `can.Bus`."""
        return {"interface": self.interface, "channel": self.channel, **dict(self.options)}

    def why_not(self) -> str:
        """Say why it cannot be used here, empty if it can."""
        return _why_no_socketcan() if self.interface == "socketcan" else _why_no_multicast()


SOCKETCAN = Bus("socketcan", VCAN)
MULTICAST = Bus("udp_multicast", GROUP, (("port", PORT),))


def _why_no_socketcan() -> str:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (AttributeError, OSError):
        return NO_SOCKETCAN
    return "" if Path("/sys/class/net", VCAN).exists() else NO_SOCKETCAN


def _why_no_multicast() -> str:
    """Send a frame to ourselves."""
    try:
        with can.Bus(**MULTICAST.keywords) as bus:
            bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
            if bus.recv(1) is not None:
                return ""
    except (can.CanError, OSError) as error:
        return f"no UDP multicast here: {error}"
    return "no UDP multicast here: what is sent to the group does not come back"
