"""A CAN adapter on a serial port: a pty, where python-can's slcan opens it."""

from __future__ import annotations

import os
import tty
from typing import Any

import can

OPTIONS: dict[str, Any] = {"sleep_after_open": 0, "timeout": 0.01, "bitrate": 500_000}


class Adapter:
    """An adapter that is plugged in; whoever opens it gets what is sent.

    Attributes:
        name: of its port.
    """

    def __init__(self) -> None:
        self._adapter, self._port = os.openpty()
        tty.setraw(self._port)
        self.name = os.ttyname(self._port)

    def open(self) -> can.BusABC:
        return can.Bus(interface="slcan", channel=self.name, **OPTIONS)

    def send(self, text: bytes) -> None:
        os.write(self._adapter, text)

    def unplug(self) -> None:
        os.close(self._port)
        os.close(self._adapter)
