"""Buses of python-can as a source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import can

from tickrig.host.canmon.sources.bus_reader import BusReader, open_bus
from tickrig.host.canmon.sources.live_source import LiveSource, Reader
from tickrig.host.canmon.sources.socket_reader import SocketReader
from tickrig.host.canmon.sources.source_word import INTERFACES, BusWord
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.monitor.frames.heard import Heard

BusSource = LiveSource[Heard]
"""One or more buses: all that comes are frames."""


def open_buses(words: Sequence[BusWord], options: BusOptions) -> BusSource:
    """Open the buses that are named, or none.

    Raises:
        Refused: options that python-can does not know.
        SourceFailed: a bus that cannot be opened.
    """
    readers: list[Reader[Heard]] = []
    try:
        for word in words:
            readers.append(reader_of(*open_bus(merged(word, options))))
    except BaseException:
        for reader in readers:
            reader.close()
        raise
    return BusSource(readers, [word.chosen for word in words])


def reader_of(bus: can.BusABC, interface: str, name: str) -> Reader[Heard]:
    """Return what reads an open bus."""
    return SocketReader(bus, name) if interface == "socketcan" else BusReader(bus, interface, name)


def merged(word: BusWord, options: BusOptions) -> BusOptions:
    """Return the options of a bus: what its word says goes before them."""
    return replace(
        options,
        interface=word.interface or options.interface,
        channel=word.channel or options.channel,
        bitrate=word.bitrate or options.bitrate,
        bus_kwargs=(*local(word.interface), *options.bus_kwargs),
    )


def local(interface: str | None) -> tuple[str, ...]:
    """Return what keeps frames on this machine, unless the command line says otherwise."""
    return ("hop_limit=0",) if interface == INTERFACES["udp"] else ()
