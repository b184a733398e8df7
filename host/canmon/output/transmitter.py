"""A bus that a verb sends on, and hears where it wants to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

import can

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.sources.bus_source import BusReader, BusSource, merged, open_bus, reader_of
from tickrig.host.canmon.sources.source import BusSpec, parse_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.links.can_link import BusReceiver, close_bus, reason_of, to_message
from tickrig.host.links.link import LinkClosed
from tickrig.wire.can import CanFrame, FdFrame

_FD_WITHOUT_ASKING: Final = ("socketcan", "tickrig", "udp_multicast", "virtual")
"""Interfaces that take CAN FD however they were opened, or say themselves that they do not."""

_SEND_TIMEOUT_S: Final = 1
"""How long a full queue of the driver may stay full."""


class Transmitter:
    """An open bus.

    Args:
        word: SOURCE word of a bus; None where the options name it.
        options: what the command line says of it.
        receives: read what comes in; else nothing is kept of it.

    Attributes:
        name: what the bus is called.

    Raises:
        Refused: the word names no bus.
        SourceFailed: the bus cannot be opened.
    """

    def __init__(self, word: str | None, options: BusOptions, *, receives: bool = False) -> None:
        bus_word = BusSpec() if word is None else parse_source(word)
        if not isinstance(bus_word, BusSpec):
            raise Refused(f"{word!r} is no bus; frames are sent on can0 or slcan:/dev/ttyACM0@500k")
        whole = merged(bus_word, options)
        self._bus, interface, self.name = open_bus(whole)
        self._takes_fd = whole.fd or interface in _FD_WITHOUT_ASKING
        self._source: BusSource | None = None
        self._reads: BusReceiver | None = None
        if receives:
            reader = reader_of(self._bus, interface, self.name)
            self._source = BusSource([reader], [bus_word.chosen])
            self._reads = reader.reads if isinstance(reader, BusReader) else None

    def send(self, frame: CanFrame | FdFrame) -> None:
        """Send a frame; SourceFailed if the bus is gone, takes none for 1 s or no CAN FD."""
        if isinstance(frame, FdFrame) and not self._takes_fd:
            raise SourceFailed(f"cannot send {frame} on {self.name}: CAN FD wants --fd")
        send_on(self._bus, self.name, frame)

    def poll(self, timeout_us: int) -> list[Record]:
        """Wait for a first frame, then return all that are there.

        Raises:
            SourceFailed: the bus is gone.
        """
        assert self._source is not None, "it was opened to hear"
        records = self._source.poll(timeout_us)
        if not records and self._source.failed:
            raise SourceFailed(self._source.failed)
        return records

    def check_reads(self) -> None:
        """Raise SourceFailed if the last 100 reads of the bus have failed: nothing can be heard."""
        try:
            if self._reads is not None:
                self._reads.check()
        except LinkClosed as error:
            raise SourceFailed(str(error)) from None

    def close(self) -> None:
        """Close the bus."""
        if self._source is None:
            close_bus(self._bus)
        else:
            self._source.close()


def send_on(bus: can.BusABC, name: str, frame: CanFrame | FdFrame) -> None:
    """Send a frame on a bus that is called so; SourceFailed if it is gone or takes none for 1 s."""
    try:
        bus.send(to_message(frame), _SEND_TIMEOUT_S)
    except Exception as error:  # drivers raise what they like
        raise SourceFailed(f"cannot send on {name}: {reason_of(error)}") from error


@contextmanager
def transmitters(
    words: Sequence[str | None], options: BusOptions, *, receives: bool = False
) -> Iterator[list[Transmitter]]:
    """Open buses, and close them behind the block."""
    opened: list[Transmitter] = []
    try:
        for word in words:
            opened.append(Transmitter(word, options, receives=receives))
        yield opened
    finally:
        for one in opened:
            one.close()
