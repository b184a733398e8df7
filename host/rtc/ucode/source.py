"""Where information about ucodes comes from, later than it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol


class SourceStatus(Enum):
    """How a request ended."""

    FOUND = "found"
    UNKNOWN = "unknown"  # there is nothing under this address
    FAILED = "failed"  # no answer, or one that is none


@dataclass(frozen=True, slots=True)
class Fetched:
    """The end of a request.

    Attributes:
        address: what was asked for.
        status: how it ended.
        text: what is there; why not, where it failed.
    """

    address: str
    status: SourceStatus
    text: str = ""


class Source(Protocol):
    """Gets texts by their addresses. Nothing waits: each request ends some time, in time-outs too.

    In real time it is HTTP in a thread of its own; in virtual time a table with a delay.
    """

    def request(self, address: str, now_us: int) -> None:
        """Ask for what is under an address."""

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Take the requests that have ended."""
        ...

    def close(self) -> None:
        """End; what is asked for then never comes."""


OpenSource = Callable[[str, tuple[str, ...]], Source]
"""Makes a source for who asks, with the hosts that addresses may name."""
