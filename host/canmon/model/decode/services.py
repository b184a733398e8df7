"""Decoders for NMT, SYNC, TIME, EMCY, error control (CiA 301), LSS (CiA 305) and error frames."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.canopen import lss
from tickrig.wire.canopen.datatypes import TimeOfDay
from tickrig.wire.canopen.emcy import Emcy, ErrorRegister, describe
from tickrig.wire.canopen.nmt import ALL_NODES, NmtCommand, NmtState
from tickrig.wire.errors import WireError

# NMT, SYNC, TIME, EMCY, error control (CiA 301) and error frames (linux/can/error.h), decoded.

_CLASSES: Final = (
    "TX timeout",
    "lost arbitration",
    "controller",
    "protocol",
    "transceiver",
    "no acknowledge",
    "bus off",
    "bus error",
    "restarted",
)
_CONTROLLER: Final = (
    "RX overflow",
    "TX overflow",
    "RX warning",
    "TX warning",
    "RX passive",
    "TX passive",
    "active again",
)


def decode_error(frame: ErrorFrame) -> Decoded:
    """Decode the error frame of a controller.

    >>> decode_error(ErrorFrame.parse("20000004#0020000000006080")).text
    'controller: TX passive'
    """
    words = [text for bit, text in enumerate(_CLASSES) if frame.error_class >> bit & 1]
    states = [text for bit, text in enumerate(_CONTROLLER) if frame.data[1] >> bit & 1]
    text = ", ".join(words) or f"class {frame.error_class:X}h"
    word = text.replace(" ", "-")
    text += f": {', '.join(states)}" if states and "controller" in words else ""
    return Decoded("error", None, text, (Signal("class", frame.error_class, "", word),))


_TOGGLE: Final = 0x80
_TIME_ZERO: Final = datetime(1984, 1, 1, tzinfo=UTC)
_HIGHEST_NODE: Final = 127

_NMT_COMMANDS: Final = frozenset(NmtCommand)
_STATES: Final = {int(state): state.name.lower().replace("_", "-") for state in NmtState}


def decode_nmt(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a command of the NMT master.

    >>> decode_nmt(0, CanFrame.parse("000#0105")).text
    'start, node 5'
    """
    data = frame.data
    if len(data) != 2 or data[1] > _HIGHEST_NODE or data[0] not in _NMT_COMMANDS:
        return Decoded("nmt", None, f"no NMT command: {_dump(frame)}")
    command, node = NmtCommand(data[0]), data[1]
    whom = "all nodes" if node == ALL_NODES else f"node {node}"
    text = f"{_words(command.name)}, {whom}"
    word = _words(command.name).replace(" ", "-")
    return Decoded("nmt", node or None, text, (Signal("command", data[0], "", word),))


def decode_sync(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a SYNC with its counter, if there is one."""
    if not frame.data:
        return Decoded("sync")
    counter = Signal("counter", frame.data[0])
    return Decoded("sync", None, str(counter), (counter,))


def decode_time(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a TIME stamp.

    >>> decode_time(0, CanFrame.parse("100#B0A429043143")).text
    '2031-02-04 19:23:58.000'
    """
    try:
        time = TimeOfDay.parse(frame.data)
    except WireError as error:
        return Decoded("time", None, str(error))
    moment = _TIME_ZERO + timedelta(days=time.days, milliseconds=time.ms)
    text = moment.strftime("%Y-%m-%d %H:%M:%S.") + f"{time.ms % 1_000:03d}"
    return Decoded("time", None, text, (Signal("days", time.days), Signal("ms", time.ms)))


@lru_cache(maxsize=256)  # the same EMCY comes again and again: a board takes it in half the time
def decode_emcy(node: int, frame: CanFrame) -> Decoded:
    """Decode an EMCY.

    >>> decode_emcy(5, CanFrame.parse("085#3081110700000000")).text
    '8130h life guard error or heartbeat error, register GENERIC|COMMUNICATION, 07 00 00 00 00'
    """
    try:
        emcy = Emcy.parse(frame.data)
    except WireError as error:
        return Decoded("emcy", node, str(error))
    register = ErrorRegister(emcy.register).name or "none"
    text = f"{emcy.code:04X}h {describe(emcy.code)}, register {register}"
    text += f", {emcy.text.hex(' ').upper()}" if any(emcy.text) else ""
    signals = (
        Signal("code", emcy.code, "", f"{emcy.code:04X}h"),
        Signal("register", emcy.register),
    )
    return Decoded("emcy", node, text, signals)


def decode_error_control(node: int, frame: CanFrame, *, guarded: bool) -> Decoded:
    """Return the meaning of an error control frame: boot-up, heartbeat or node guarding.

    Args:
        node: node-ID of the node that sent the frame. For a guarding request, it is the node-ID of
            the guarded node.
        frame: frame to decode.
        guarded: whether the frame is the answer to a guarding request.
    """
    if frame.remote:
        return Decoded("guard", node, "guarding request", asks=True)
    if len(frame.data) != 1:
        return Decoded("heartbeat", node, f"no NMT state: {_dump(frame)}")
    byte = frame.data[0]
    if byte == NmtState.INITIALISING and not guarded:
        return Decoded("boot-up", node, "boot-up", (Signal("state", 0),))
    state = byte & ~_TOGGLE
    kind = "guard" if guarded or byte & _TOGGLE else "heartbeat"
    toggle = f", toggle {byte >> 7}" if kind == "guard" else ""
    signal = Signal("state", state, "", nmt_state_name(state))
    return Decoded(kind, node, f"{nmt_state_name(state)}{toggle}", (signal,))


def nmt_state_name(state: int) -> str:
    """Return the name of an NMT state, or the hexadecimal number if no state has this number.

    Args:
        state: number of the NMT state, as in a heartbeat.

    >>> nmt_state_name(0x7F), nmt_state_name(0x11)
    ('pre-operational', '11h')
    """
    return _STATES.get(state) or f"{state:02X}h"


def _words(name: str) -> str:
    return name.lower().replace("_", " ").replace("pre operational", "pre-operational")


def _dump(frame: CanFrame) -> str:
    return frame.data.hex(" ").upper() or "no data"


# LSS messages, decoded (CiA 305).

_LSS_COMMANDS: Final = frozenset(lss.LssCommand)
_ANSWERED: Final = (
    lss.LssCommand.CONFIGURE_NODE_ID,
    lss.LssCommand.CONFIGURE_BIT_TIMING,
    lss.LssCommand.STORE,
)
_ADDRESSES: Final = range(lss.LssCommand.SWITCH_VENDOR, lss.LssCommand.IDENTIFY_NON_CONFIGURED)
_UNSET: Final = 0xFF
_PARTS: Final = ("vendor", "product", "revision", "serial")


def decode_lss(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a message of the LSS master or of a slave.

    >>> decode_lss(0, CanFrame.parse("7E5#1105000000000000")).text
    'master: configure node id 5'
    >>> decode_lss(0, CanFrame.parse("7E4#1100000000000000")).text
    'slave: configure node id done'
    """
    data = frame.data
    by_master = frame.can_id == lss.LSS_MASTER_COB_ID
    who = "master" if by_master else "slave"
    if len(data) != lss.MESSAGE_BYTES or data[0] not in _LSS_COMMANDS:
        return Decoded("lss", None, f"{who}: no LSS message: {data.hex(' ').upper()}")
    command = lss.LssCommand(data[0])
    text = _master(command, data) if by_master else _slave(command, data)
    name = command.name.lower().replace("_", " ")
    word = Signal("command", data[0], "", name.replace(" ", "-"))
    signals = (word, Signal("number", lss.number_of(data)))
    return Decoded("lss", None, f"{who}: {name} {text}".rstrip(), signals)


def _master(command: lss.LssCommand, data: bytes) -> str:
    if command in _ADDRESSES:
        return f"{lss.number_of(data):08X}h"
    write = _ARGUMENTS.get(command)
    return write(data) if write else ""


def _bit_timing(data: bytes) -> str:
    if data[1] == lss.STANDARD_TABLE and data[2] in lss.BIT_RATES:
        return f"{lss.BIT_RATES[data[2]] // 1_000} kbit/s"
    return f"table {data[1]} index {data[2]}"


def _fastscan(data: bytes) -> str:
    scan = lss.FastScan.parse(data)
    if scan.bit_check == lss.FASTSCAN_RESET:
        return "reset"
    part = _PARTS[scan.sub] if scan.sub < len(_PARTS) else str(scan.sub)
    return f"{part} {scan.id_number:08X}h from bit {scan.bit_check}"


def _slave(command: lss.LssCommand, data: bytes) -> str:
    if command in _ANSWERED:
        if data[1] == lss.LssError.NONE:
            return "done"
        return f"refused, error {data[1]}" + (f", {data[2]}" if data[2] else "")
    if command is lss.LssCommand.INQUIRE_NODE_ID:
        return str(data[1])
    inquiries = range(lss.LssCommand.INQUIRE_VENDOR, lss.LssCommand.INQUIRE_NODE_ID)
    return f"{lss.number_of(data):08X}h" if command in inquiries else ""


_ARGUMENTS: Final[dict[lss.LssCommand, Callable[[bytes], str]]] = {
    lss.LssCommand.SWITCH_GLOBAL: lambda data: "configuration" if data[1] else "waiting",
    lss.LssCommand.CONFIGURE_NODE_ID: lambda data: "none" if data[1] == _UNSET else str(data[1]),
    lss.LssCommand.CONFIGURE_BIT_TIMING: _bit_timing,
    lss.LssCommand.ACTIVATE_BIT_TIMING: lambda data: f"after {data[1] | data[2] << 8} ms",
    lss.LssCommand.FASTSCAN: _fastscan,
}
"""Parameters of the LSS master's commands."""
