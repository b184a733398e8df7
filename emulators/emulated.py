"""A device that can be ticked, touched and looked at."""

from __future__ import annotations

from typing import Protocol

from tickrig.device.core import Device, W
from tickrig.device.physical import Physical


class Emulated(Device[W], Physical, Protocol[W]):
    """What an emulator needs of a device: its wire side and its physical side."""
