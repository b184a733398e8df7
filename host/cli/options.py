"""What console commands are, and options of which command lines are made."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import wraps
from math import isnan
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._version import __version__
from tickrig.host.cli.start import load, loading, standard_streams

if TYPE_CHECKING:
    from pathlib import Path


class HarmlessCommand(click.Command):
    """A console command: nothing that it prints is obeyed by a terminal."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run it."""
        with standard_streams():
            return super().main(*args, **extra)


class PathType(click.Path):
    """A path, as `click.Path(path_type=Path)`: pathlib is imported when there is one."""

    def convert(
        self,
        value: str | os.PathLike[str],
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Path:
        """Read a path."""
        from pathlib import Path  # noqa: PLC0415 - slow

        return Path(str(super().convert(value, param, ctx)))


PATH: Final = PathType()
VERSION: Final = __version__

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def add_options(*options: Decorator) -> Decorator:
    """Return a decorator that adds options in this order."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


class NumberRange(click.FloatRange):
    """Numbers of a range; NaN, which compares with nothing, is none of them."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read a number."""
        number: float = super().convert(value, param, ctx)
        if isnan(number):
            self.fail(f"{value} is no number.", param, ctx)
        return number


class _NodeId(click.IntRange):
    """A node-ID 1..127, as `5`."""

    def __init__(self) -> None:
        super().__init__(1, 127)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Read a node-ID."""
        if isinstance(value, str) and not value.strip().lstrip("+-").isdecimal():
            self.fail(f"{value!r} is no node-ID 1..127.", param, ctx)
        return int(super().convert(value, param, ctx))


NODE_ID: Final = _NodeId()


def version_option() -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `--version`, in the form that all commands have."""
    return click.version_option(__version__, message="%(prog)s (tickrig) %(version)s")


def time_option(option: str, name: str, **attributes: Any) -> Decorator:
    """Return the option of a time, as `10s`; in microseconds, None where it is not given."""

    def parsed(context: click.Context, parameter: click.Parameter, text: str | None) -> int | None:
        from tickrig.host.cli.messages import Refused  # noqa: PLC0415 - a TAB needs none
        from tickrig.host.text.values import parse_time_with_unit_us  # noqa: PLC0415

        try:
            return None if text is None else parse_time_with_unit_us(text)
        except ValueError as error:
            raise Refused(f"{option} {error}") from None

    return click.option(option, name, metavar="TIME", callback=parsed, **attributes)


run_code_option: Final[Decorator] = click.option(
    "--run-code", is_flag=True, help="Run the Python files that the trace names (FILE.py:Class)."
)
"""Of commands that make devices again of a trace."""


# Commands that are imported when they are asked for, so that each starts fast: a group finds its
# commands by their paths, and a command with heavy imports finds its work by its path.


def works_in(path: str) -> Decorator:
    """Return a decorator: the function says what a command takes, and `path` does its work.

    Help and completion need the options alone, so the module of the work is imported when the
    command runs. The decorated function has the signature of the work and an empty body.

    Args:
        path: of the function that does the work, as `MODULE:NAME`. What it returns is the exit
            status; None is 0.
    """

    def decorate(described: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(described)
        def command(**options: Any) -> None:
            with loading():
                work = load(path)
            if status := work(**options):
                click.get_current_context().exit(status)

        vars(command)["work"] = path  # for those who look whether options and work agree
        return command

    return decorate


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
