"""The CAN bus outside, on which a rig's nodes are heard."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Final, NamedTuple

from tickrig.emulators.can.outside.bus_port import CanBusPort
from tickrig.emulators.can.outside.without_echo import CountingPort, WithoutEcho
from tickrig.host.cli.can_options import BusOptions, open_raw

ECHOING: Final = ("udp_multicast",)
"""Interfaces that give back what they sent, whatever is asked of them."""


class OpenBus(NamedTuple):
    """A bus outside.

    Attributes:
        port: the bus.
        name: what people call it.
        channel: what logs call it.
    """

    port: CountingPort
    name: str
    channel: str


def open_bus(options: BusOptions, stack: ExitStack) -> OpenBus:
    """Open the bus that options, environment or configuration files of python-can name.

    Raises:
        Refused: none is named, or it cannot be opened.
    """
    instead = "give --scenario FILE, which runs in virtual time"
    bus, interface, channel = open_raw(options, instead)
    stack.callback(bus.shutdown)
    name = interface if channel is None else f"{interface} {channel}"
    port = CanBusPort(bus)
    label = "_".join(str(channel).split()) if channel not in (None, "") else interface
    return OpenBus(WithoutEcho(port) if interface in ECHOING else port, name, label)
