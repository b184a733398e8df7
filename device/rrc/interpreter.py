"""From a received line to a command or a refusal (DECISION R11)."""

from __future__ import annotations

from tickrig.wire.errors import ChecksumError
from tickrig.wire.rrc.check import strip_check
from tickrig.wire.rrc.commands import BadParameters, Command, UnknownCommand, parse_command
from tickrig.wire.rrc.replies import COMMAND_CHECKSUM, COMMAND_UNKNOWN, Refusal


def read_line(line: bytes, *, check_wanted: bool) -> Command | Refusal | None:
    """Return what a line without LF asks for, its refusal, or None for an empty line."""
    message = line.removesuffix(b"\r")
    if not message:
        return None
    try:
        return parse_command(strip_check(message) if check_wanted else message)
    except ChecksumError:
        return Refusal(COMMAND_CHECKSUM)
    except UnknownCommand:
        return Refusal(COMMAND_UNKNOWN)
    except BadParameters as error:
        return Refusal(error.name.decode())
