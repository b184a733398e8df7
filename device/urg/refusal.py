"""Why a command is refused (SCIP 2.0, sensor commands and response to invalid commands)."""

from __future__ import annotations

from tickrig.device.urg.parameters import LAST_STEP
from tickrig.wire.sensors.scip import status
from tickrig.wire.sensors.scip.command import LETTERS, MOST_STRING, SIZES, Command

NOT_A_NUMBER = ("01", "02", "03", "06", "07")
"""Starting step, end step, cluster count, scan interval, number of scans."""


def refusal(command: Command, *, adjusting: bool) -> str:
    """Return the status for what is no command, or not now; empty if nothing is wrong."""
    if command.symbol not in SIZES:
        return status.UNKNOWN
    if len(command.string) > MOST_STRING + 1:
        return status.STRING_TOO_LONG
    if not LETTERS.issuperset(command.string[1:]):
        return status.STRING_LETTERS
    wanted: int = sum(SIZES[command.symbol])
    if len(command.parameters) != wanted:
        return status.TOO_SHORT if len(command.parameters) < wanted else status.TOO_LONG
    if adjusting and command.symbol not in ("TM", "RS"):
        return status.UNKNOWN  # by which the vendor's urg_library knows the mode
    return ""


def flaw(command: Command) -> str:
    """Return the status that refuses MD, MS, GD or GS for its parameters, empty if none does."""
    for text, code in zip(command.fields, NOT_A_NUMBER, strict=False):
        if not text.isdecimal():
            return code
    first, last = (int(text) for text in command.fields[:2])
    if max(first, last) > LAST_STEP:
        return "04"
    return "05" if last < first else ""
