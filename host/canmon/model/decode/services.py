"""NMT, SYNC, TIME, EMCY, error control (CiA 301) and error frames (linux/can/error.h), decoded."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.canopen.emcy import Emcy, ErrorRegister, describe
from tickrig.wire.canopen.nmt import ALL_NODES, NmtCommand, NmtState
from tickrig.wire.canopen.time_of_day import TimeOfDay
from tickrig.wire.errors import WireError

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
    """Decode what a controller says.

    >>> decode_error(ErrorFrame.parse("20000004#0020000000006080")).text
    'controller: TX passive'
    """
    words = [text for bit, text in enumerate(_CLASSES) if frame.error_class >> bit & 1]
    states = [text for bit, text in enumerate(_CONTROLLER) if frame.data[1] >> bit & 1]
    text = ", ".join(words) or f"class {frame.error_class:X}h"
    word = text.replace(" ", "-")
    text += f": {', '.join(states)}" if states and "controller" in words else ""
    return Decoded("error", None, text, (Signal("class", frame.error_class, "", word),))


TOGGLE: Final = 0x80
TIME_ZERO: Final = datetime(1984, 1, 1, tzinfo=UTC)
HIGHEST_NODE: Final = 127

_COMMANDS: Final = frozenset(NmtCommand)
_STATES: Final = {int(state): state.name.lower().replace("_", "-") for state in NmtState}


def decode_nmt(at_us: int, frame: CanFrame) -> Decoded:
    """Decode a command of the NMT master.

    >>> decode_nmt(0, CanFrame.parse("000#0105")).text
    'start, node 5'
    """
    data = frame.data
    if len(data) != 2 or data[1] > HIGHEST_NODE or data[0] not in _COMMANDS:
        return Decoded("nmt", None, f"no NMT command: {_dump(frame)}")
    command, node = NmtCommand(data[0]), data[1]
    whom = "all nodes" if node == ALL_NODES else f"node {node}"
    text = f"{_words(command.name)}, {whom}"
    word = _words(command.name).replace(" ", "-")
    return Decoded("nmt", node or None, text, (Signal("command", data[0], "", word),))


def decode_sync(at_us: int, frame: CanFrame) -> Decoded:
    """Decode SYNC, with its counter where it has one."""
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
    moment = TIME_ZERO + timedelta(days=time.days, milliseconds=time.ms)
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
    """Decode boot-up, heartbeat or guarding.

    Args:
        node: whose it is.
        frame: the frame.
        guarded: this answers a guarding request.
    """
    if frame.remote:
        return Decoded("guard", node, "guarding request", asks=True)
    if len(frame.data) != 1:
        return Decoded("heartbeat", node, f"no NMT state: {_dump(frame)}")
    byte = frame.data[0]
    if byte == NmtState.INITIALISING and not guarded:
        return Decoded("boot-up", node, "boot-up", (Signal("state", 0),))
    state = byte & ~TOGGLE
    kind = "guard" if guarded or byte & TOGGLE else "heartbeat"
    toggle = f", toggle {byte >> 7}" if kind == "guard" else ""
    signal = Signal("state", state, "", nmt_state_name(state))
    return Decoded(kind, node, f"{nmt_state_name(state)}{toggle}", (signal,))


def nmt_state_name(state: int) -> str:
    """Return the name of an NMT state; its number if it has none.

    >>> nmt_state_name(0x7F), nmt_state_name(0x11)
    ('pre-operational', '11h')
    """
    return _STATES.get(state) or f"{state:02X}h"


def _words(name: str) -> str:
    return name.lower().replace("_", " ").replace("pre operational", "pre-operational")


def _dump(frame: CanFrame) -> str:
    return frame.data.hex(" ").upper() or "no data"
