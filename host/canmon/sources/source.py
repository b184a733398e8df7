"""Where frames come from, under one face, and what a SOURCE word names.

What a SOURCE word names.

>>> parse_source("slcan:/dev/ttyACM0@500k")
BusSpec(interface='slcan', channel='/dev/ttyACM0', bitrate=500000, chosen=None, data_bitrate=None)
>>> parse_source("can0,123:7FF").chosen.passes(0x123)
True
>>> parse_source("serial:/dev/ttyUSB0@57600,rtc-lite").protocol
'rtc-lite'
>>> parse_source("-") is None
True
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from tickrig.host.canmon.model.frames import CandumpFilter, Record
from tickrig.host.canmon.model.logs.log_file import COMPRESSED, SUFFIXES, LogFormatError, log_format
from tickrig.host.cli.messages import Refused, refusing

if TYPE_CHECKING:
    from tickrig.host.canmon.model.logs.mark import LogTally, Mark


# Where frames come from: buses, log files or standard input, under one face.

Taken_co = TypeVar("Taken_co", covariant=True)


class AnySource(Generic[Taken_co]):
    """Frames, or lines of a serial port, as they come in.

    Attributes:
        live: it goes on by itself; False where all of it is there already.
        failed: why it ended before its time; empty if it did not.
        marks: what happened behind the frames that `poll` returned last.
        recorded: a recorder wrote these marks, and has said them.
    """

    live = recorded = False
    failed = ""
    marks: Sequence[Mark] = ()
    _ended = False

    @property
    def ended(self) -> bool:
        """Whether no more will come."""
        return self._ended

    @property
    def away(self) -> Sequence[str]:
        """Buses that went away and are not back."""
        return ()

    @property
    def gaps(self) -> int:
        """How often a bus went away and was to be opened again."""
        return 0

    def reopen(self) -> None:
        """Open buses again that go away; what has an end is left alone."""

    def tallies(self) -> Iterable[tuple[str, LogTally]]:
        """Return what was no frame, by the name of each bus or file."""
        return ()

    @property
    def lost(self) -> int:
        """Frames that were there and did not get here, as far as anybody told."""
        return sum(tally.lost for _, tally in self.tallies())

    @property
    def unread(self) -> int:
        """Lines and frames that got here and could not be taken, as noise and CAN FD."""
        return sum(tally.unread for _, tally in self.tallies())

    def poll(self, timeout_us: int, /) -> Sequence[Taken_co]:
        """Wait for a first frame, then return all that are there; none if none came."""
        return []

    def messages(self) -> list[str]:
        """Say what was no frame or got lost, one line each."""
        return [text for name, tally in self.tallies() for text in tally.messages(name)]

    def losses(self) -> list[str]:
        """Say what of it got lost or could not be taken: not what is no frame by its nature."""
        return [text for name, tally in self.tallies() for text in tally.losses(name)]

    def errors(self) -> list[str]:
        """Say what of it tells of errors on the bus beside error frames."""
        return [text for name, tally in self.tallies() for text in tally.errors(name)]

    @property
    def without_errors(self) -> str:
        """Why no error frame can come, whatever happens; empty if some can."""
        told = [tally.without_errors for _, tally in self.tallies()]
        return told[0] if told and all(told) else ""

    def close(self) -> None:
        """Give back what it holds; closing twice is no error."""
        self._ended = True


Source = AnySource[Record]


INTERFACES: Final = {"udp": "udp_multicast", "sim": "tickrig"}
"""Short names of python-can's interfaces."""

_PROTOCOLS: Final = ("rrc", "rtc-lite", "rtc-lite-xor8")
"""What is spoken on serial lines."""

_UDP_GROUP: Final = "239.74.163.2"
"""The IPv4 group of python-can's udp_multicast."""

_BUS: Final = re.compile(
    r"(?:(?P<interface>[A-Za-z]\w*):)?(?P<channel>[^@]*)"
    r"(?:@(?P<bitrate>[0-9]{1,9}[kM]?)(?:/(?P<fast>[0-9]{1,9}[kM]?))?)?"
)
_LINE: Final = re.compile(
    r"serial:(?P<port>.+?)(?:@(?P<baud>[0-9]{1,9}[kM]?))?"
    rf",(?P<protocol>{'|'.join(_PROTOCOLS)})(?P<host>,host)?"
)
_FACTORS: Final = {"k": 1_000, "M": 1_000_000}


@dataclass(frozen=True, slots=True)
class FileSpec:
    """A log file, and which frames of it are wanted."""

    path: Path
    chosen: CandumpFilter | None = None


@dataclass(frozen=True, slots=True)
class BusSpec:
    """A bus, and which frames of it are wanted; what is None the options say.

    One with a data bit rate is one of CAN FD.

    Attributes:
        prefix: what stood before the first colon: part of the channel where -i names the interface.
    """

    interface: str | None = None
    channel: str | None = None
    bitrate: int | None = None
    chosen: CandumpFilter | None = None
    data_bitrate: int | None = None
    prefix: str = field(default="", repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class LineSpec:
    """A serial port, and the protocol of its line.

    Attributes:
        port: a device or pyserial URL.
        baud: bit/s, None for what is usual with the protocol.
        protocol: one of `_PROTOCOLS`.
        from_host: what comes in is what the host sends.
    """

    port: str
    baud: int | None
    protocol: str
    from_host: bool = False


def parse_source(word: str) -> FileSpec | BusSpec | LineSpec | None:
    """Read a SOURCE word; None is standard input.

    Raises:
        Refused: it is none.
    """
    if word == "-":
        return None
    if line := _LINE.fullmatch(word):
        baud = _bit_s(line["baud"]) if line["baud"] else None
        return LineSpec(line["port"], baud, line["protocol"], bool(line["host"]))
    if Path(word).is_file():
        return _file(word, "")
    name, _, filters = word.partition(",")
    path = Path(name)
    if path.is_file() or path.suffix.lower() in (*SUFFIXES, COMPRESSED):
        return _file(name, filters)
    if name and path.is_dir():
        raise Refused(f"SOURCE {name!r} is a folder")
    return _bus(name, filters)


def _file(name: str, filters: str) -> FileSpec:
    with refusing("", LogFormatError):
        log_format(Path(name))
    return FileSpec(Path(name), _chosen(filters))


def _bus(name: str, filters: str) -> BusSpec:
    match = _BUS.fullmatch(name)
    if match is None or not name:
        raise Refused(f"SOURCE {name!r} is not a bus as can0 or slcan:/dev/ttyACM0@500k, nor a log")
    interface, channel, bitrate, fast = match.group("interface", "channel", "bitrate", "fast")
    prefix = interface or ""
    if name in INTERFACES:
        interface, channel = name, ""
    if interface == "udp":
        channel = channel or _UDP_GROUP
    return BusSpec(
        INTERFACES.get(interface, interface),
        channel or None,
        _bit_s(bitrate) if bitrate else None,
        _chosen(filters),
        _bit_s(fast) if fast else None,
        prefix,
    )


def _bit_s(text: str) -> int:
    factor = _FACTORS.get(text[-1], 1)
    return int(text.rstrip("kM")) * factor


def _chosen(filters: str) -> CandumpFilter | None:
    with refusing():
        return CandumpFilter.parse(filters) if filters else None
