"""How many nodes answer to one node-ID, by the answers to what they are asked."""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import Final

from tickrig.wire.canopen.sdo.sdo_command import SPECIFIER, ClientCommand, ServerCommand

LEAST: Final = 3
"""So many objects that were asked for say something."""
ANSWERS: Final = (ServerCommand.UPLOAD, ServerCommand.ABORT)
MULTIPLEXER: Final = slice(1, 4)
"""Of an SDO frame."""


class Presence(Enum):
    """How many nodes there are."""

    NONE = 0
    ONE = 1
    TWO = 2


class Answers:
    """Counts uploads that begin, and answers to them, by object."""

    def __init__(self) -> None:
        self._uploads, self._answered = Counter[bytes](), Counter[bytes]()
        self._silent = True

    def count_request(self, data: bytes) -> None:
        """Count a request."""
        if data and data[0] & SPECIFIER == ClientCommand.UPLOAD:
            self._uploads[data[MULTIPLEXER]] += 1

    def count_response(self, data: bytes) -> None:
        """Count a response."""
        self._silent = False
        if data and data[0] & SPECIFIER in ANSWERS:
            self._answered[data[MULTIPLEXER]] += 1

    @property
    def presence(self) -> Presence:
        """How many nodes have answered: two, if most objects were told twice each time."""
        if self._silent:
            return Presence.NONE
        twice = sum(self._answered[at] == 2 * times for at, times in self._uploads.items())
        many = len(self._uploads) >= LEAST and 2 * twice > len(self._uploads)
        return Presence.TWO if many else Presence.ONE
