"""Requests of commands over a control socket."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, Protocol

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.start import give_up_terminals, taking_signals
from tickrig.host.control.client import ControlClient

if TYPE_CHECKING:
    from pathlib import Path
    from types import FrameType

    from tickrig.host.control.requests import RequestDispatcher
    from tickrig.host.control.server import ControlServer


_NOBODY: Final = (FileNotFoundError, ConnectionRefusedError)


def request(socket: Path | str, whom: str, do: str, /, **fields: object) -> Any:
    """Send a request to a running emulator or system at its control socket, and return the answer.

    Args:
        socket: path of the control socket.
        whom: name of the server in error messages, `emulator` or `system`.
        do: verb of the request.
        fields: further fields of the request.

    Raises:
        Refused: the server does not answer, or refuses the request.
    """
    with refused_by(socket, whom), ControlClient(socket) as client:
        return client.request(do, **fields)


@contextmanager
def refused_by(socket: Path | str, whom: str) -> Iterator[None]:
    """Turn errors of a `ControlClient` into Refused. The arguments are those of `request`."""
    try:
        yield
    except TimeoutError:
        raise Refused(f"socket {socket}: the {whom} does not answer") from None
    except OSError as error:
        hint = f", is the {whom} running?" if isinstance(error, _NOBODY) else ""
        raise Refused(f"socket {socket}: {error.strerror or error}{hint}") from None
    except ValueError as error:
        raise Refused(str(error)) from None


# A command that runs until it is stopped, by a signal or over its control socket.


class _Waiting(Protocol):
    """An object that serves requests while it waits, such as a `ServingClock` or a server loop.

    Attributes:
        serve: function that is called with the time in microseconds that it may take.
    """

    serve: Callable[[int], None] | None


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Make Ctrl-C, SIGTERM and a closed terminal call `stop` instead of ending the process."""

    def received(number: int, frame: FrameType | None) -> None:
        stop()
        give_up_terminals()

    with taking_signals(received):
        yield


@contextmanager
def serving_control(
    path: Path, dispatcher: RequestDispatcher, clock: _Waiting
) -> Iterator[ControlServer]:
    """Context manager that creates a control socket and yields its server.

    Whenever the clock waits, it calls the server, which answers the requests that have arrived.

    Args:
        path: path of the socket to create.
        dispatcher: dispatcher that executes and answers the requests.
        clock: clock of the run, which serves the socket while it waits.

    Raises:
        Refused: the socket cannot be created.
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
