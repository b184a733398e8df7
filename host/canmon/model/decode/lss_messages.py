"""LSS messages, decoded (CiA 305)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.lss import (
    BIT_RATES,
    FASTSCAN_RESET,
    LSS_MASTER_COB_ID,
    MESSAGE_BYTES,
    STANDARD_TABLE,
    FastScan,
    LssCommand,
    LssError,
    number_of,
)

_COMMANDS: Final = frozenset(LssCommand)
_ANSWERED: Final = (
    LssCommand.CONFIGURE_NODE_ID,
    LssCommand.CONFIGURE_BIT_TIMING,
    LssCommand.STORE,
)
_ADDRESSES: Final = range(LssCommand.SWITCH_VENDOR, LssCommand.IDENTIFY_NON_CONFIGURED)
UNSET: Final = 0xFF
_PARTS: Final = ("vendor", "product", "revision", "serial")


def decode_lss(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a message of the LSS master or of a slave.

    >>> decode_lss(0, CanFrame.parse("7E5#1105000000000000")).text
    'master: configure node id 5'
    >>> decode_lss(0, CanFrame.parse("7E4#1100000000000000")).text
    'slave: configure node id done'
    """
    data = frame.data
    by_master = frame.can_id == LSS_MASTER_COB_ID
    who = "master" if by_master else "slave"
    if len(data) != MESSAGE_BYTES or data[0] not in _COMMANDS:
        return Decoded("lss", None, f"{who}: no LSS message: {data.hex(' ').upper()}")
    command = LssCommand(data[0])
    text = _master(command, data) if by_master else _slave(command, data)
    name = command.name.lower().replace("_", " ")
    word = Signal("command", data[0], "", name.replace(" ", "-"))
    signals = (word, Signal("number", number_of(data)))
    return Decoded("lss", None, f"{who}: {name} {text}".rstrip(), signals)


def _master(command: LssCommand, data: bytes) -> str:
    if command in _ADDRESSES:
        return f"{number_of(data):08X}h"
    write = _ARGUMENTS.get(command)
    return write(data) if write else ""


def _bit_timing(data: bytes) -> str:
    if data[1] == STANDARD_TABLE and data[2] in BIT_RATES:
        return f"{BIT_RATES[data[2]] // 1_000} kbit/s"
    return f"table {data[1]} index {data[2]}"


def _fastscan(data: bytes) -> str:
    scan = FastScan.parse(data)
    if scan.bit_check == FASTSCAN_RESET:
        return "reset"
    part = _PARTS[scan.sub] if scan.sub < len(_PARTS) else str(scan.sub)
    return f"{part} {scan.id_number:08X}h from bit {scan.bit_check}"


def _slave(command: LssCommand, data: bytes) -> str:
    if command in _ANSWERED:
        if data[1] == LssError.NONE:
            return "done"
        return f"refused, error {data[1]}" + (f", {data[2]}" if data[2] else "")
    if command is LssCommand.INQUIRE_NODE_ID:
        return str(data[1])
    inquiries = range(LssCommand.INQUIRE_VENDOR, LssCommand.INQUIRE_NODE_ID)
    return f"{number_of(data):08X}h" if command in inquiries else ""


_ARGUMENTS: Final[dict[LssCommand, Callable[[bytes], str]]] = {
    LssCommand.SWITCH_GLOBAL: lambda data: "configuration" if data[1] else "waiting",
    LssCommand.CONFIGURE_NODE_ID: lambda data: "none" if data[1] == UNSET else str(data[1]),
    LssCommand.CONFIGURE_BIT_TIMING: _bit_timing,
    LssCommand.ACTIVATE_BIT_TIMING: lambda data: f"after {data[1] | data[2] << 8} ms",
    LssCommand.FASTSCAN: _fastscan,
}
"""What the master says beside a command."""
