"""What a host says about a link or a device.

LinkError
 +-- LinkTimeout (TimeoutError)      no answer in time
 +-- LinkClosed (ConnectionError)    the line is gone: cable out, emulator ended
DeviceRefused                        the device answered, and said no
"""

from __future__ import annotations

from typing import Final

TRACEBACK: Final = "Traceback (most recent call last)"
"""Some drivers put one into the text of what they raise."""


def first_line(error: BaseException) -> str:
    r"""Return the text of an error in a line, without a traceback; its type if there is none.

    >>> first_line(ValueError("bad frame\nTraceback (most recent call last):\n  File x"))
    'bad frame'
    >>> first_line(OSError())
    'OSError'
    """
    text = " ".join(str(error).partition(TRACEBACK)[0].split())
    return text or type(error).__name__


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
