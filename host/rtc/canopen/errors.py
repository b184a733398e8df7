"""What RTC-CANopen raises where a person is to read it.

DefinitionError (ValueError)    a System Definition that cannot be used
ServerRefused (ValueError)      a command to the server that cannot be
"""

from __future__ import annotations


class DefinitionError(ValueError):
    """A System Definition that cannot be used.

    Attributes:
        line: where, counted from 1; 0 if it is nowhere in the text.
    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {message}" if line else message)
        self.line = line


class ServerRefused(ValueError):  # noqa: N818 - what the server did
    """A command to the server that cannot be."""
