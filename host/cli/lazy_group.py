"""Groups of commands that are imported when they are asked for, so that each starts fast."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from tickrig.host.cli.options import HarmlessCommand
from tickrig.host.cli.start import load


class LazyCommand(click.Command):
    """Stands in lists for a command that is not imported yet.

    Args:
        name: as it is asked for.
        path: where it is, as `MODULE:NAME`.
        short_help: how its help begins.
    """

    def __init__(self, name: str, path: str, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self.path = path


class LazyGroup(HarmlessCommand, click.Group):
    """A group whose commands live in modules of their own.

    Args:
        commands: path and short help of each by its name, in the order of the list.
        attributes: those of any group.
    """

    def __init__(self, commands: Mapping[str, tuple[str, str]], **attributes: Any) -> None:
        awaited: dict[str, click.Command] = {
            name: LazyCommand(name, *each) for name, each in commands.items()
        }
        super().__init__(commands=awaited, **attributes)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order in which people meet them."""
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Import the command that was asked for."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, load(command.path) if isinstance(command, LazyCommand) else command, rest
