"""Ask over a control socket on behalf of a command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from tickrig.host.cli.refused import Refused
from tickrig.host.control.client import ControlClient

if TYPE_CHECKING:
    from pathlib import Path

_NOBODY: Final = (FileNotFoundError, ConnectionRefusedError)


def request(socket: Path | str, whom: str, do: str, /, **fields: object) -> Any:
    """Make one request and return its answer.

    Args:
        socket: the control socket.
        whom: what is expected there, for people: `emulator`, `system`.
        do: the verb of the request.
        fields: of the request.

    Raises:
        Refused: nobody answers, or with an error.
    """
    with refused_by(socket, whom), ControlClient(socket) as client:
        return client.request(do, **fields)


@contextmanager
def refused_by(socket: Path | str, whom: str) -> Iterator[None]:
    """Raise Refused in place of what a `ControlClient` raises; arguments as those of `request`."""
    try:
        yield
    except TimeoutError:
        raise Refused(f"socket {socket}: the {whom} does not answer") from None
    except OSError as error:
        hint = f", is the {whom} running?" if isinstance(error, _NOBODY) else ""
        raise Refused(f"socket {socket}: {error.strerror or error}{hint}") from None
    except ValueError as error:
        raise Refused(str(error)) from None
