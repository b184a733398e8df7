"""Scripts: what is said to a node, written in the order in which it is said.

A script is a generator. It yields steps, is given what came of each, and returns
its result; what goes wrong is raised in it. It waits for nothing: a `Dialogue`
goes on with it when there is an answer, or when a time has passed.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.canopen.sdo.sdo import Response

SDO_TIMEOUT_US: Final = 500_000


@dataclass(frozen=True, slots=True)
class Ask:
    """Send an SDO request; gives the response, raises SdoTimeout without one."""

    request: bytes
    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class Tell:
    """Send an SDO frame that has no answer."""

    request: bytes


@dataclass(frozen=True, slots=True)
class Command:
    """Send an NMT command."""

    command: NmtCommand


@dataclass(frozen=True, slots=True)
class Await:
    """Wait until a heartbeat or boot-up says a state; raises StateTimeout."""

    state: NmtState
    timeout_us: int


@dataclass(frozen=True, slots=True)
class Pause:
    """Let time pass."""

    duration_us: int


Step = Ask | Tell | Command | Await | Pause

T = TypeVar("T")

Script = Generator[Step, Any, T]
"""A script that returns a T; it is sent the `Response` of an `Ask`, else None."""

Answer = Response | None
