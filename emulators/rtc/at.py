"""Where a running system is asked, and the names that it knows."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.ask import refused_by
from tickrig.emulators.control_client import ControlClient
from tickrig.emulators.requests import Object
from tickrig.host.cli.duration import parse_time_us
from tickrig.host.cli.options import PATH, Decorator
from tickrig.host.cli.refused import Refused

SYSTEM: Final = "system"
VARIABLE: Final = "TICKRIG_RTC"


def default_path() -> Path:
    """Return where a system is if nobody says: `tickrig-rtc`, in a folder of this user."""
    folder = os.environ.get("XDG_RUNTIME_DIR")
    if folder:
        return Path(folder, "tickrig-rtc")
    return Path(tempfile.gettempdir(), f"tickrig-rtc-{os.getuid()}")


at: Final[Decorator] = click.option(
    "--at",
    type=PATH,
    envvar=VARIABLE,
    default=default_path,
    metavar="PATH",
    help=f"Control socket of the system; also from {VARIABLE}.",
)
"""Add `--at`, which all verbs have."""


def ask_system(socket: Path, do: str, /, **fields: object) -> Any:
    """Ask a running system and return its answer; Refused if it gives none, or an error."""
    with refused_by(socket, SYSTEM), ControlClient(socket) as client:
        return client.ask(do, **fields)


def time_us(word: str) -> int:
    """Read a time of the command line; Refused if it is none."""
    try:
        return parse_time_us(word)
    except ValueError as error:
        raise Refused(str(error)) from None


def components(socket: Path, *names: str) -> list[Any]:
    """Return the descriptions of components, of all if none is named."""
    fields: Object = {"names": list(names)} if names else {}
    described: list[Any] = ask_system(socket, "describe", **fields)["components"]
    return described


def complete_component(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the name of a component."""
    return _begun(context, begun, lambda component: [component["name"]])


def complete_port(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the full name of a port."""
    return _begun(context, begun, lambda component: [port["name"] for port in component["ports"]])


def _begun(context: click.Context, begun: str, names: Callable[[Any], list[str]]) -> list[str]:
    return [name for name in _names(context, names) if name.startswith(begun)]


def _names(context: click.Context, names: Callable[[Any], list[str]]) -> Iterator[str]:
    socket = context.params.get("at") or os.environ.get(VARIABLE) or default_path()
    try:
        described = components(Path(socket))
    except Refused:
        return
    for component in described:
        yield from names(component)
