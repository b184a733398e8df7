"""What the component model raises where a person is to read it.

RtcRefused (ValueError)    an operation that cannot be: no such port, other data type, ...
"""

from __future__ import annotations

from tickrig.host.rtc.execution.states import ReturnCode


class RtcRefused(ValueError):  # noqa: N818 - what the model did
    """An operation on components, ports or connectors that cannot be.

    Attributes:
        code: what OMG RTC returns for it.
    """

    def __init__(self, message: str, code: ReturnCode = ReturnCode.BAD_PARAMETER) -> None:
        super().__init__(message)
        self.code = code
