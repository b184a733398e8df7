"""A command that runs until somebody stops it: by a signal, or over its control socket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Protocol

from tickrig.host.cli.refused import refuse_path
from tickrig.host.cli.start import give_up_terminals, taking_signals

if TYPE_CHECKING:
    from tickrig.host.control.requests import RequestDispatcher
    from tickrig.host.control.server import ControlServer


class Waiting(Protocol):
    """What waits, and may serve somebody meanwhile: a `ServingClock`, the loop of a server.

    Attributes:
        serve: called with the time in microseconds that it may take.
    """

    serve: Callable[[int], None] | None


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C, SIGTERM and a closed terminal call `stop` instead of ending the process."""

    def received(number: int, frame: FrameType | None) -> None:
        stop()
        give_up_terminals()

    with taking_signals(received):
        yield


@contextmanager
def serving_control(
    path: Path, dispatcher: RequestDispatcher, clock: Waiting
) -> Iterator[ControlServer]:
    """Serve a control socket whenever the clock waits; the server is given to whoever has more.

    Args:
        path: of the socket.
        dispatcher: answers the requests.
        clock: what the run waits by; it serves the socket meanwhile.

    Raises:
        Refused: no socket can be made there.
    """
    from tickrig.host.control.server import ControlServer  # noqa: PLC0415 - a TAB needs none

    try:
        server = ControlServer(path, dispatcher)
    except OSError as error:
        refuse_path("control", error)
    clock.serve = server.serve
    try:
        yield server
    finally:
        server.close()
