"""Errors of the communication with a node.

SdoFailed
 +-- SdoAborted                 the device or this host aborted a transfer
 +-- SdoTimeout (TimeoutError)  the device did not answer
 +-- SdoMisnamed                the device answered, and named another object
StateTimeout (TimeoutError)     a device did not report a state in time
WrongIdentity                   a device is not the one that its EDS describes
"""

from __future__ import annotations


class SdoFailed(Exception):  # noqa: N818 - what the transfer did
    """Base class of the errors that end an SDO transfer.

    Attributes:
        index: index of the object that was read or written.
        sub: sub-index of the object.
    """

    def __init__(self, message: str, index: int, sub: int) -> None:
        super().__init__(message)
        self.index, self.sub = index, sub


class SdoAborted(SdoFailed):
    """Raised if an SDO transfer is aborted, by the device or by the host.

    Attributes:
        code: SDO abort code. A code that CiA 301 does not define is a plain number.
    """

    def __init__(self, index: int, sub: int, code: int) -> None:
        name = getattr(code, "name", "unknown")
        super().__init__(f"{index:04X}h:{sub:02X} aborted: {code:08X}h {name}", index, sub)
        self.code = code


class SdoTimeout(SdoFailed, TimeoutError):  # noqa: N818 - a timeout, as the built-in calls it
    """Raised if the device does not answer an SDO request in time.

    Attributes:
        timeout_us: time that the host waited for the answer, in microseconds.
    """

    def __init__(self, index: int, sub: int, timeout_us: int = 0) -> None:
        super().__init__(f"{index:04X}h:{sub:02X} was not answered", index, sub)
        self.timeout_us = timeout_us


class SdoMisnamed(SdoFailed):
    """A transfer that the device answered with the name of another object."""

    def __init__(self, index: int, sub: int) -> None:
        message = f"{index:04X}h:{sub:02X} was answered with the name of another object"
        super().__init__(message, index, sub)


class StateTimeout(TimeoutError):  # noqa: N818 - a timeout, as the built-in calls it
    """A device that did not report a state in time."""


class WrongIdentity(Exception):  # noqa: N818 - what the device has
    """A device whose identity differs from the one that its EDS describes."""
