"""Why a gateway does not do what it is asked (CiA 309-3, internal error codes)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class ErrorCode(IntEnum):
    """Internal error code."""

    NOT_SUPPORTED = 100
    SYNTAX = 101
    INTERNAL_STATE = 102
    TIME_OUT = 103
    NO_DEFAULT_NET = 104
    NO_DEFAULT_NODE = 105
    UNSUPPORTED_NET = 106
    UNSUPPORTED_NODE = 107
    LOST_CONNECTION = 201
    LSS_MANUFACTURER = 501
    LSS_NODE_ID = 502
    LSS_BIT_RATE = 503
    LSS_STORE = 504


TEXTS: Final = {
    ErrorCode.NOT_SUPPORTED: "request not supported",
    ErrorCode.SYNTAX: "syntax error",
    ErrorCode.INTERNAL_STATE: "not possible now",
    ErrorCode.TIME_OUT: "no answer in time",
    ErrorCode.NO_DEFAULT_NET: "no default net is set",
    ErrorCode.NO_DEFAULT_NODE: "no default node is set",
    ErrorCode.UNSUPPORTED_NET: "there is no such net",
    ErrorCode.UNSUPPORTED_NODE: "there can be no such node",
    ErrorCode.LOST_CONNECTION: "the bus is gone",
    ErrorCode.LSS_MANUFACTURER: "LSS: an error of the maker of the slave",
    ErrorCode.LSS_NODE_ID: "LSS: the slave does not take this node-ID",
    ErrorCode.LSS_BIT_RATE: "LSS: the slave does not take this bit rate",
    ErrorCode.LSS_STORE: "LSS: the slave cannot store",
}


class GatewayError(Exception):
    """A command that is not carried out.

    Args:
        code: why.
        text: the same for people; that of the code if empty.
    """

    def __init__(self, code: ErrorCode, text: str = "") -> None:
        super().__init__(text or TEXTS[code])
        self.code = code
