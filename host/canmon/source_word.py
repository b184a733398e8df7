"""What a SOURCE word names.

>>> parse_source("slcan:/dev/ttyACM0@500k")
BusWord(interface='slcan', channel='/dev/ttyACM0', bitrate=500000, chosen=None)
>>> parse_source("can0,123:7FF").chosen.passes(0x123)
True
>>> parse_source("-") is None
True
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.candump_filter import CandumpFilter
from tickrig.host.monitor.logs.log_format import COMPRESSED, SUFFIXES, LogFormatError, log_format

INTERFACES: Final = {"udp": "udp_multicast", "sim": "tickrig"}
"""Short names of python-can's interfaces."""

UDP_GROUP: Final = "239.74.163.2"
"""The IPv4 group of python-can's udp_multicast."""

_BUS: Final = re.compile(
    r"(?:(?P<interface>[A-Za-z]\w*):)?(?P<channel>[^@]*)(?:@(?P<bitrate>[0-9]{1,9}[kM]?))?"
)
_FACTORS: Final = {"k": 1_000, "M": 1_000_000}


@dataclass(frozen=True, slots=True)
class FileWord:
    """A log file, and which frames of it are wanted."""

    path: Path
    chosen: CandumpFilter | None = None


@dataclass(frozen=True, slots=True)
class BusWord:
    """A bus, and which frames of it are wanted; what is None the options say."""

    interface: str | None = None
    channel: str | None = None
    bitrate: int | None = None
    chosen: CandumpFilter | None = None


def parse_source(word: str) -> FileWord | BusWord | None:
    """Read a SOURCE word; None is standard input.

    Raises:
        Refused: it is none.
    """
    if word == "-":
        return None
    if Path(word).is_file():
        return _file(word, "")
    name, _, filters = word.partition(",")
    path = Path(name)
    if path.is_file() or path.suffix.lower() in (*SUFFIXES, COMPRESSED):
        return _file(name, filters)
    if name and path.is_dir():
        raise Refused(f"SOURCE {name!r} is a folder")
    return _bus(name, filters)


def _file(name: str, filters: str) -> FileWord:
    try:
        log_format(Path(name))
    except LogFormatError as error:
        raise Refused(str(error)) from None
    return FileWord(Path(name), _chosen(filters))


def _bus(name: str, filters: str) -> BusWord:
    match = _BUS.fullmatch(name)
    if match is None or not name:
        raise Refused(f"SOURCE {name!r} is not a bus as can0 or slcan:/dev/ttyACM0@500k, nor a log")
    interface, channel, bitrate = match.group("interface", "channel", "bitrate")
    if name in INTERFACES:
        interface, channel = name, ""
    if interface == "udp":
        channel = channel or UDP_GROUP
    return BusWord(
        INTERFACES.get(interface, interface),
        channel or None,
        _bit_s(bitrate) if bitrate else None,
        _chosen(filters),
    )


def _bit_s(text: str) -> int:
    factor = _FACTORS.get(text[-1], 1)
    return int(text.rstrip("kM")) * factor


def _chosen(filters: str) -> CandumpFilter | None:
    try:
        return CandumpFilter.parse(filters) if filters else None
    except ValueError as error:
        raise Refused(str(error)) from None
