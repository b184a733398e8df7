"""Ask over a control socket on behalf of a command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from tickrig.emulators.control.client import ControlClient
from tickrig.emulators.control.requests import Object
from tickrig.host.cli.refused import Refused

if TYPE_CHECKING:
    from pathlib import Path

EMULATOR: Final = "emulator"

_NOBODY: Final = (FileNotFoundError, ConnectionRefusedError)


def ask(socket: Path | str, do: str, /, **fields: object) -> Object:
    """Ask an emulator and return its answer; Refused if it gives none, or an error."""
    with refused_by(socket, EMULATOR), ControlClient(socket) as client:
        return client.ask(do, **fields)


@contextmanager
def refused_by(socket: Path | str, whom: str) -> Iterator[None]:
    """Raise Refused in place of what a `ControlClient` raises.

    Args:
        socket: the control socket.
        whom: what is expected there, for people.
    """
    try:
        yield
    except TimeoutError:
        raise Refused(f"socket {socket}: the {whom} does not answer") from None
    except OSError as error:
        hint = f", is the {whom} running?" if isinstance(error, _NOBODY) else ""
        raise Refused(f"socket {socket}: {error.strerror or error}{hint}") from None
    except ValueError as error:
        raise Refused(str(error)) from None
