"""Codes and states of OMG RTC 1.0 with the numbers of its IDL, and the error with such a code."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

MAX_RATE_HZ: Final = 1_000_000
MIN_RATE_HZ: Final = 1e-6
"""Minimum rate of execution contexts and of periodic connectors.

The minimum for connectors is one period in eleven days.
"""


class ReturnCode(IntEnum):
    """Result of an operation or a callback of a component (OMG RTC, ReturnCode_t).

    Attributes:
        RTC_OK: the operation succeeded.
        RTC_ERROR: the operation failed.
        BAD_PARAMETER: an argument is invalid.
        UNSUPPORTED: the operation is not supported.
        OUT_OF_RESOURCES: memory or another resource is exhausted.
        PRECONDITION_NOT_MET: the operation is not allowed in the present state.
    """

    RTC_OK = 0
    RTC_ERROR = 1
    BAD_PARAMETER = 2
    UNSUPPORTED = 3
    OUT_OF_RESOURCES = 4
    PRECONDITION_NOT_MET = 5


class LifeCycleState(IntEnum):
    """State of a component in an execution context (OMG RTC, LifeCycleState)."""

    CREATED = 0
    INACTIVE = 1
    ACTIVE = 2
    ERROR = 3


class ExecutionKind(IntEnum):
    """Kind of an execution context (OMG RTC, ExecutionKind)."""

    PERIODIC = 0
    EVENT_DRIVEN = 1
    OTHER = 2


class RtcRefused(ValueError):  # noqa: N818 - what the model did
    """An operation on components, ports or connectors was refused because it is not possible.

    Attributes:
        code: OMG RTC return code that describes the reason.
    """

    def __init__(self, message: str, code: ReturnCode = ReturnCode.BAD_PARAMETER) -> None:
        super().__init__(message)
        self.code = code


class PortStatus(IntEnum):
    """Result of a read or write of a data port (OpenRTM-aist 1.x, DataPortStatus).

    The enumeration has only the codes that can occur here. PORT_ERROR, BUFFER_EMPTY and
    CONNECTION_LOST occur only at ports that are connected with ports in other processes.
    """

    PORT_OK = 0
    PORT_ERROR = 1
    BUFFER_FULL = 3
    BUFFER_EMPTY = 4
    BUFFER_TIMEOUT = 5
    INVALID_ARGS = 10
    CONNECTION_LOST = 12
