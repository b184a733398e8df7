"""Lines of an RRC's serial port, decoded into the trace of the buses."""

from __future__ import annotations

from dataclasses import fields
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.frames.record import LineRecord
from tickrig.wire.errors import WireError
from tickrig.wire.rrc.check import strip_check
from tickrig.wire.rrc.commands import Command, parse_command
from tickrig.wire.rrc.replies import Event, Ok, Refusal, StatusA, Text, parse_reply
from tickrig.wire.serial.lines import LineSplitter

KIND: Final = "rrc"


class RrcLines:
    """Decodes both directions of a line to an RRC; chunking makes no difference.

    Args:
        channel: name of the line.
    """

    def __init__(self, channel: str) -> None:
        self._channel = channel
        self._splitters = {True: LineSplitter(), False: LineSplitter()}

    def take(self, at_us: int, data: bytes, *, to_device: bool) -> list[LineRecord]:
        """Take bytes of one direction; return the lines that are whole now."""
        decode = decode_command if to_device else decode_reply
        return [
            LineRecord(at_us, self._channel, to_device, line, decode(line))
            for line in self._splitters[to_device].push(data)
        ]


def decode_command(line: bytes) -> Decoded:
    """Decode a line to the RRC, with CHECK at its end or without.

    >>> decode_command(b"output1eff").text, decode_command(b"output1e007").text
    ('output v_pct=30 w_pct=-1', 'output v_pct=30 w_pct=0')
    """
    try:
        return _command(parse_command(line))
    except WireError as error:
        try:
            return _command(parse_command(strip_check(line)))
        except WireError:
            return Decoded(KIND, None, str(error))


def decode_reply(line: bytes) -> Decoded:
    """Decode a line from the RRC.

    >>> decode_reply(b"EV:PowerOn").text, decode_reply(b"OK:beep").text
    ('event PowerOn', 'OK beep')
    """
    try:
        reply = parse_reply(line)
    except WireError as error:
        return Decoded(KIND, None, str(error))
    match reply:
        case StatusA():
            signals = _signals(reply)
            return Decoded(KIND, None, "status " + " ".join(map(str, signals)), signals)
        case Ok(name=text):
            return Decoded(KIND, None, f"OK {text}", (Signal("ok", text),))
        case Refusal(reason=text):
            return Decoded(KIND, None, f"refused {text}", (Signal("refused", text),))
        case Event(name=text):
            return Decoded(KIND, None, f"event {text}", (Signal("event", text),))
        case Text(text=text):
            return Decoded(KIND, None, text)


def _command(command: Command) -> Decoded:
    signals = _signals(command)
    text = " ".join([command.name.decode(), *map(str, signals)])
    return Decoded(KIND, None, text, (Signal("command", command.name.decode()), *signals))


def _signals(message: Command | StatusA) -> tuple[Signal, ...]:
    """Return the fields of a message; a row of numbers is one text."""
    values = ((field.name, getattr(message, field.name)) for field in fields(message))
    return tuple(
        Signal(name, value if isinstance(value, int) else " ".join(map(str, value)))
        for name, value in values
    )
