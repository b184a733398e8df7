"""Where a running system is asked."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.control import ask
from tickrig.host.cli.options import PATH, Decorator
from tickrig.host.control.requests import Object

SYSTEM: Final = "system"
VARIABLE: Final = "TICKRIG_RTC"


def default_path() -> Path:
    """Return where a system is if nobody says: `tickrig-rtc`, in a folder of this user."""
    folder = os.environ.get("XDG_RUNTIME_DIR")
    if folder:
        return Path(folder, "tickrig-rtc")
    import tempfile  # noqa: PLC0415 - slow

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
    return ask(socket, SYSTEM, do, **fields)


def components(socket: Path, *names: str) -> list[Any]:
    """Return the descriptions of components, of all if none is named."""
    fields: Object = {"names": list(names)} if names else {}
    described: list[Any] = ask_system(socket, "describe", **fields)["components"]
    return described
