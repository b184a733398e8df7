"""Buses of python-can as a source."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import can
from can.util import load_config

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.can_log import channel_name, to_record
from tickrig.host.canmon.model.logs.mark import LogTally
from tickrig.host.canmon.sources.live_source import LiveSource, Reader
from tickrig.host.canmon.sources.socket_reader import SocketReader, let_fd
from tickrig.host.canmon.sources.source import INTERFACES, BusSpec
from tickrig.host.cli.can_options import UNNAMED, BusOptions, open_raw
from tickrig.host.cli.messages import BusUnavailable, Refused
from tickrig.host.links.can_link import BusReceiver, close_bus
from tickrig.host.links.link import LinkClosed

_BATCH: Final = 1_024
"""So that a bus that never falls silent cannot keep its reader."""

_DEFAULT: Final = "socketcan"
"""The interface where neither the command line nor a configuration names one."""

_UNREADABLE: Final = "frames that the driver could not read"

_STEPPED: Final = ("tickrig",)
"""Interfaces whose time passes while they are read."""


def open_bus(options: BusOptions) -> tuple[can.BusABC, str, str]:
    """Open a bus of the interface that the options, the configuration or the default name.

    Returns:
        The bus, its interface, and what its channel is called.

    Raises:
        Refused: options that python-can does not know.
        SourceFailed: the bus cannot be opened.
    """
    try:
        bus, interface, channel = open_raw(_with_interface(options))
    except BusUnavailable as error:
        raise SourceFailed(error.message) from None
    if interface == _DEFAULT:
        let_fd(bus)
    return bus, interface, channel_name(interface if channel is None else channel)


def _with_interface(options: BusOptions) -> BusOptions:
    if options.interface is None:
        try:
            load_config()
        except can.CanInterfaceNotImplementedError as error:
            if UNNAMED in str(error):
                return replace(options, interface=_DEFAULT)
    return options


class BusReader:
    """Any bus of python-can.

    Args:
        bus: an open bus; nobody else reads from it.
        interface: its interface.
        name: what it is called in what is heard.

    Attributes:
        reads: reads the bus, and counts what its driver could not read.
        lost: 0, for python-can does not tell.
        tally: what was no frame.
        stepped: its time passes while it is read.
    """

    def __init__(self, bus: can.BusABC, interface: str, name: str) -> None:
        self._bus, self.name, self.stepped = bus, name, interface in _STEPPED
        self.lost, self.tally = 0, LogTally()
        self.reads = BusReceiver(bus, name)

    def read(self, timeout_us: int, /) -> list[Record]:
        """Wait for a first frame; LinkClosed if the bus is gone."""
        records: list[Record] = []
        faults, wait_us = self.reads.faults, timeout_us
        try:
            while (message := self.reads.receive(wait_us / 1e6)) is not None:
                one = to_record(message, self.name, self.tally)
                records += (one,) if one else ()
                if len(records) >= _BATCH:
                    break
                wait_us = 0
        except LinkClosed:
            if not records:
                raise
        finally:
            if self.reads.faults != faults:
                self.tally.passed_over[_UNREADABLE] += self.reads.faults - faults
        return records

    def close(self) -> None:
        """Close the bus."""
        self.reads.closed = True
        close_bus(self._bus)


BusSource = LiveSource[Record]
"""One or more buses: all that comes are frames."""


def reader_of(bus: can.BusABC, interface: str, name: str) -> Reader[Record]:
    """Return what reads an open bus."""
    return SocketReader(bus, name) if interface == "socketcan" else BusReader(bus, interface, name)


class OpenBus:
    """A bus that a SOURCE word and options name; it can be opened again.

    Args:
        word: of the bus.
        options: what the command line says of it.

    Attributes:
        bus: as it was opened last.
        name: what it is called.

    Raises:
        Refused: options that python-can does not know.
        SourceFailed: it cannot be opened.
    """

    def __init__(self, word: BusSpec, options: BusOptions) -> None:
        self._options = merged(word, options)
        self.bus, self._interface, self.name = open_bus(self._options)

    @property
    def reader(self) -> Reader[Record]:
        """What reads it."""
        return reader_of(self.bus, self._interface, self.name)

    def open_again(self) -> Reader[Record]:
        """Open it once more; whoever used it has closed it."""
        self.bus, _, _ = open_bus(self._options)
        try:
            return self.reader
        except OSError:
            close_bus(self.bus)
            raise


def merged(word: BusSpec, options: BusOptions) -> BusOptions:
    """Return the options of a bus: what its word says goes before them.

    Beside -i the word is the channel, colons and all, unless it begins with that interface.

    Raises:
        Refused: the word and -c name two channels.
    """
    interface, channel = word.interface, word.channel
    if word.prefix and options.interface not in (None, interface):
        interface, channel = options.interface, f"{word.prefix}:{channel or ''}"
    if channel is not None and options.channel not in (None, channel):
        raise Refused(f"BUS {channel} and -c {options.channel} name two channels; give one")
    return replace(
        options,
        interface=interface or options.interface,
        channel=channel or options.channel,
        bitrate=word.bitrate or options.bitrate,
        bus_kwargs=(*_local(interface if word.interface else None), *options.bus_kwargs),
        fd=options.fd or word.data_bitrate is not None,
        data_bitrate=word.data_bitrate or options.data_bitrate,
    )


def _local(interface: str | None) -> tuple[str, ...]:
    """Return what keeps frames on this machine, unless the command line says otherwise."""
    return ("hop_limit=0",) if interface == INTERFACES["udp"] else ()
