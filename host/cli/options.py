"""Base class of console commands, and common options."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import wraps
from math import isnan
from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from tickrig._version import __version__
from tickrig.host.cli.start import load, loading, standard_streams

if TYPE_CHECKING:
    from pathlib import Path


class HarmlessCommand(click.Command):
    """A console command. Terminals do not interpret control characters in its output."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run the command."""
        with standard_streams():
            return super().main(*args, **extra)


class _PathType(click.Path):
    """A path, like `click.Path(path_type=Path)`, which imports pathlib only if a path is given."""

    def convert(
        self,
        value: str | os.PathLike[str],
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> Path:
        """Read a path."""
        from pathlib import Path  # noqa: PLC0415 - slow

        return Path(str(super().convert(value, param, ctx)))


PATH: Final = _PathType()
VERSION: Final = __version__

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def add_options(*options: Decorator) -> Decorator:
    """Return a decorator that adds options in this order."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def refuse_idle(why: str, *names: str) -> None:
    """Refuse the current command if the user gave an option that has no effect.

    Args:
        why: reason why the options have no effect, such as `--jsonl has its own times`.
        names: parameter names of the options that have no effect.
    """
    from tickrig.host.cli.messages import Refused  # noqa: PLC0415 - a TAB needs none

    context = click.get_current_context()
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name or "")
        if parameter.name in names and source is ParameterSource.COMMANDLINE:
            raise Refused(f"{max(parameter.opts, key=len)} does nothing here: {why}")


class Choice(click.Choice):  # type: ignore[type-arg] # click 8.1 has no type there
    """Option type for one of several words. For an unknown word, the error suggests the nearest."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read a word."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            from tickrig.host.text.names import closest  # noqa: PLC0415 - only for mistakes

            meant = closest(str(value), map(str, self.choices))
            hint = "".join(f" Did you mean {word!r}?" for word in meant)
            raise click.BadParameter(f"{error.message}{hint}", ctx, param) from None


class NumberRange(click.FloatRange):
    """A number in a range. NaN is refused."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Read a number."""
        number: float = super().convert(value, param, ctx)
        if isnan(number):
            self.fail(f"{value} is no number.", param, ctx)
        return number


class _NodeId(click.IntRange):
    """A node-ID in 1..127, such as `5`."""

    def __init__(self) -> None:
        super().__init__(1, 127)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Read a node-ID."""
        if isinstance(value, str) and not value.strip().lstrip("+-").isdecimal():
            self.fail(f"{value!r} is no node-ID 1..127.", param, ctx)
        return int(super().convert(value, param, ctx))


NODE_ID: Final = _NodeId()


def version_option() -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `--version` in the form that all commands have."""
    return click.version_option(__version__, message="%(prog)s (tickrig) %(version)s")


def time_option(option: str, name: str, **attributes: Any) -> Decorator:
    """Return the decorator of an option for a time such as `10s`.

    The command gets the time in microseconds, or None if the option is not given.
    """

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
"""Option of commands that rebuild devices from a trace."""


# Commands that are imported on demand, so that each starts fast: a group finds its
# commands by their paths, and a command with heavy imports finds its work by its path.


def works_in(path: str) -> Decorator:
    """Return a decorator for a command whose code is imported only when the command runs.

    The decorated function declares the command: it has the parameters of the command and an empty
    body. Another function with the same parameters does the work. The module of this other function
    is imported only when the command runs, because help and completion do not need the module.

    Args:
        path: location of the function that does the work, in the form `MODULE:NAME`. The function
            returns the exit status, or None for 0.
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
    """Entry of a command list that stands for a command whose module is not imported yet.

    Args:
        name: name of the command.
        path: location of the command, in the form `MODULE:NAME`.
        short_help: first sentence of the command's help, which the list shows.
    """

    def __init__(self, name: str, path: str, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self.path = path


class LazyGroup(HarmlessCommand, click.Group):
    """Click group that imports the module of a subcommand only when the subcommand is needed.

    Args:
        commands: mapping from the name of each subcommand to its location (`MODULE:NAME`) and its
            short help. The help of the group lists the subcommands in the order of the mapping.
        attributes: further arguments of `click.Group`.
    """

    def __init__(self, commands: Mapping[str, tuple[str, str]], **attributes: Any) -> None:
        awaited: dict[str, click.Command] = {
            name: LazyCommand(name, *each) for name, each in commands.items()
        }
        super().__init__(commands=awaited, **attributes)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the subcommands, in the order of the mapping `commands`."""
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Import the requested command."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, load(command.path) if isinstance(command, LazyCommand) else command, rest
