"""Names of a running system, for the shell to complete; none where no system runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tickrig.emulators.rtc.at import VARIABLE, ask_system, default_path
from tickrig.host.cli.refused import Refused


def complete_component(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the name of a component."""
    return _begun(context, begun, lambda system: [each["name"] for each in system["components"]])


def complete_port(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the full name of a port."""
    return _begun(
        context,
        begun,
        lambda system: [port["name"] for each in system["components"] for port in each["ports"]],
    )


def complete_type(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Complete the name of a type of components."""
    return _begun(context, begun, lambda system: system["types"])


def _begun(context: click.Context, begun: str, names: Callable[[Any], list[str]]) -> list[str]:
    socket = context.params.get("at") or os.environ.get(VARIABLE) or default_path()
    try:
        known = names(ask_system(Path(socket), "describe"))
    except Refused:
        return []
    return [name for name in known if name.startswith(begun)]
