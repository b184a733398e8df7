"""The letters of RTC-Lite: commands, status, states, execution contexts, link faults.

The paper (Suzuki et al., RTComponent-Lite-0.4.0, RSJ 2007) defines that a command has two bytes,
but not their values. If RTno has a letter for a command, this module uses it (DECISION L9).
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Final


class LiteCommand(Enum):
    """Commands: Cmnd0 selects the RTC object, and Cmnd1 its operation. A reply repeats both."""

    INITIALIZE = b"CI"
    PROFILE = b"CZ"
    STATE = b"CX"
    PING = b"CY"
    FINALIZE = b"CF"
    ACTIVATE = b"AA"
    DEACTIVATE = b"AD"
    EXECUTE = b"AE"
    ABORT = b"AB"
    ERROR = b"AC"
    RESET = b"AR"
    STARTUP = b"AS"
    SHUTDOWN = b"AH"
    CONTEXT = b"BB"
    RATE = b"BW"
    IN_PROFILE = b"PP"
    WRITE = b"PS"
    OUT_PROFILE = b"QQ"
    DATA = b"QV"
    POLL = b"QG"
    CHECKSUM_FAULT = b"FH"
    TIMEOUT_FAULT = b"FK"
    UNKNOWN_FAULT = b"FU"


class LiteLinkFault(IntEnum):
    """Faults that a receiver reports for bytes that are not a request (DECISION L7)."""

    TIMEOUT = 1
    CHECKSUM = 3
    UNKNOWN = 65


FAULT_COMMANDS: Final = {
    LiteLinkFault.TIMEOUT: LiteCommand.TIMEOUT_FAULT,
    LiteLinkFault.CHECKSUM: LiteCommand.CHECKSUM_FAULT,
    LiteLinkFault.UNKNOWN: LiteCommand.UNKNOWN_FAULT,
}
"""Commands of the frames that report faults, by fault."""


class LiteStatus(IntEnum):
    """First byte of a reply."""

    OK = ord("@")
    ERROR = ord("x")  # a callback returned an error
    WRONG_STATE = ord("H")  # precondition not met
    NO_IN_PORT = ord("F")
    NO_OUT_PORT = ord("D")
    EMPTY = ord("I")  # the out-port holds no new data
    UNSUPPORTED = ord("!")


class LiteState(IntEnum):
    """Life-cycle state of the component on the device."""

    CREATED = ord("C")
    INACTIVE = ord("I")
    ACTIVE = ord("A")
    ERROR = ord("E")
    NONE = ord("N")  # finalized


class LiteContextType(IntEnum):
    """Kind of execution context."""

    PROXY = 0x21  # the proxy's execution context, one AE a period
    TIMER = 0x22  # a timer of the device
