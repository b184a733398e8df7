"""CAN FD frames in lines of ASC and TRC logs."""

from __future__ import annotations

from typing import Final

import can
from can.util import channel2int, len2dlc

ASC_FLAGS: Final = 0x1000
"""A CAN FD frame; the bits above it say BRS and ESI."""
ASC_REMOTE: Final = 0x10

TRC_TYPES: Final = {
    (False, False): "FD",
    (True, False): "FB",
    (False, True): "BI",
    (True, True): "FE",
}
"""Types of CAN FD frames by BRS and ESI."""


def fd_asc_event(message: can.Message, channel: int, ident: str, direction: str) -> str:
    """Write what stands behind the time; durations, bit timings and CRC, never told, are 0."""
    brs, esi = int(message.bitrate_switch), int(message.error_state_indicator)
    flags = ASC_FLAGS * (1 + 2 * brs + 4 * esi)
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return (
        f"CANFD {channel:>3} {direction:<4} {ident:>8}  {'':>32} {brs} {esi}"
        f" {len2dlc(message.dlc):x} {message.dlc:>2}{data} {0:>8} {0:>4} {flags:8X} 0 0 0 0 0"
    )


def told_by_flags(message: can.Message, line: str) -> None:
    """Make a classic frame of a message where the flags of its line `CANFD` say that it is one.

    Vector's tools and `log2asc -f` write classic frames so, too; python-can does not look.
    """
    _, _, _, _, _, *words = line.split()
    places = words[0 if words[0].isdigit() else 1 :]  # a symbolic name may stand before them
    place = 4 + int(places[3]) + 2  # behind BRS, ESI, DLC, length, data, duration and bits
    flags = int(places[place], 16) if place < len(places) else ASC_FLAGS
    if flags & ASC_FLAGS or message.is_error_frame:
        return
    message.is_fd, message.is_remote_frame = False, bool(flags & ASC_REMOTE)
    if not (message.is_remote_frame or message.data):
        message.dlc = 0


def fd_trc_line(message: can.Message, number: int, begin_s: float) -> str:
    """Write the line of a frame, which python-can reads but does not write."""
    kind = TRC_TYPES[message.bitrate_switch, message.error_state_indicator]
    offset_ms = (message.timestamp - begin_s) * 1000
    ident = f"{message.arbitration_id:0{7 if message.is_extended_id else 4}X}"
    direction, channel = "Rx" if message.is_rx else "Tx", (channel2int(message.channel) or 0) + 1
    return (
        f"{number:>7} {offset_ms:13.3f} {kind} {channel:>2} {ident:>8} {direction} -  "
        f"{len2dlc(message.dlc):<4} {message.data.hex(' ').upper()}\n"
    )
