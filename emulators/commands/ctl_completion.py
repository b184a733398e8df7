"""Names of a running emulator, for the shell to complete; none where no emulator runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import click

from tickrig.host.control.client import ControlClient

PATIENCE_S: Final = 1.0

Complete = Callable[[click.Context, click.Parameter, str], list[str]]
Names = Callable[[Any], Iterator[str]]
"""Gives names of what an emulator says to `describe`."""


def buttons(told: Any) -> Iterator[str]:
    """Give what can be pressed."""
    return (each["name"] for each in told.get("inputs", ()) if each["kind"] == "button")


def faults(told: Any) -> Iterator[str]:
    """Give faults of the wire, then of the device."""
    yield from (each["name"] for each in told.get("wire_faults", ()))
    yield from (each["name"] for each in told.get("inputs", ()) if each["kind"] == "fault")


def settable(told: Any) -> Iterator[str]:
    """Give groups and inputs."""
    yield from told.get("groups", ())
    yield from (each["name"] for each in told.get("inputs", ()))


def seen(told: Any) -> Iterator[str]:
    """Give inputs and outputs."""
    yield from (each["name"] for each in [*told.get("inputs", ()), *told.get("outputs", ())])


def complete(names: Names) -> Complete:
    """Return what completes a word to one of these names."""

    def completed(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
        assert context.parent is not None
        try:
            with ControlClient(context.parent.params["socket"], PATIENCE_S) as client:
                told = client.ask("describe")
        except (OSError, ValueError):  # nobody is there, or somebody else
            return []
        return [name for name in names(told) if name.startswith(begun)]

    return completed
