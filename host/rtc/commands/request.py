"""Requests to a running system: its control socket, names to complete, waiting for a state."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.control import request
from tickrig.host.cli.messages import Refused
from tickrig.host.cli.options import PATH, Decorator
from tickrig.host.control.requests import Object

SYSTEM: Final = "system"
VARIABLE: Final = "TICKRIG_RTC"
_POLL_S: Final = 0.01
ERROR: Final = "ERROR"


def default_path() -> Path:
    """Return the default path of the control socket through which commands reach a running system.

    It is `tickrig-rtc` in the run-time folder or the temporary folder of the user.
    """
    folder = os.environ.get("XDG_RUNTIME_DIR")
    if folder:
        return Path(folder, "tickrig-rtc")
    import tempfile  # noqa: PLC0415 - slow

    name = "tickrig-rtc"
    if sys.platform != "win32":
        name += f"-{os.getuid()}"
    return Path(tempfile.gettempdir(), name)


at: Final[Decorator] = click.option(
    "--at",
    type=PATH,
    envvar=VARIABLE,
    default=default_path,
    metavar="PATH",
    help=f"Control socket of the system; also from {VARIABLE}.",
)
"""Decorator that adds `--at`, which all verbs have."""


def request_system(socket: Path, do: str, /, **fields: object) -> Any:
    """Send a request to the control socket of a running system, and return the answer.

    Raise Refused if the system does not answer, or answers with an error.

    Args:
        socket: control socket of the system.
        do: name of the request, such as `describe`.
        fields: further fields of the request.
    """
    return request(socket, SYSTEM, do, **fields)


def components(socket: Path, *names: str) -> list[Any]:
    """Return the descriptions of components, or of all components if no name is given."""
    fields: Object = {"names": list(names)} if names else {}
    described: list[Any] = request_system(socket, "describe", **fields)["components"]
    return described


_Complete = Callable[[click.Context, click.Parameter, str], list[str]]


def _completer(names: Callable[[Any], list[str]]) -> _Complete:
    """Return a function that completes a word by names in the description of a running system."""

    def complete(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
        socket = context.params.get("at") or os.environ.get(VARIABLE) or default_path()
        try:
            known = names(request_system(Path(socket), "describe"))
        except Refused:
            return []
        return [name for name in known if name.startswith(begun)]

    return complete


complete_component: Final = _completer(lambda system: [one["name"] for one in system["components"]])
complete_port: Final = _completer(
    lambda system: [port["name"] for one in system["components"] for port in one["ports"]]
)
complete_type: Final = _completer(lambda system: system["types"])


def settle(socket: Path, name: str, wanted: str, wait_us: int) -> None:
    """Wait until a component of a running system has reached the wanted life-cycle state.

    Args:
        socket: control socket of the system.
        name: name of the component.
        wanted: name of the wanted life-cycle state, such as `ACTIVE`.
        wait_us: longest wait in us. 0 returns at once, without a check.

    Raises:
        Refused: the component or its system is gone.
        click.ClickException: the component moved to Error instead, or did not reach the state in
            time.
    """
    start_s = time.monotonic()
    while wait_us:
        (component,) = components(socket, name)
        if (state := component["state"]) == wanted:
            return
        waited_us = (time.monotonic() - start_s) * 1e6
        if waited_us > wait_us or (state == ERROR and waited_us > _periods_us(component)):
            raise click.ClickException(f"{name} is {state}, not {wanted}")
        time.sleep(_POLL_S)


def _periods_us(component: Any) -> float:
    """Return the longest time of a move, which is two periods and a moment for transport."""
    rate_hz: float = component["contexts"][0]["rate_hz"]
    return 2e6 / rate_hz + 100_000
