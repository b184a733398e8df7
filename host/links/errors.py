"""What a host says about a link or a device.

LinkError
 +-- LinkTimeout (TimeoutError)      no answer in time
 +-- LinkClosed (ConnectionError)    the line is gone: cable out, emulator ended
DeviceRefused                        the device answered, and said no
"""

from __future__ import annotations


class LinkError(Exception):
    """The link to a device failed."""


class LinkTimeout(LinkError, TimeoutError):  # noqa: N818 - a timeout, as the built-in calls it
    """The device did not answer in time."""


class LinkClosed(LinkError, ConnectionError):  # noqa: N818 - a state of the link
    """The line is gone: cable out, port closed, emulator ended."""


class DeviceRefused(Exception):  # noqa: N818 - what the device did
    """The device answered, and refused.

    Args:
        message: what people read.
        code: what the device gave as its reason.

    Attributes:
        code: what the device gave as its reason, in its own notation.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code
