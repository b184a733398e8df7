"""What console commands are, and options of which command lines are made."""

from __future__ import annotations

import os
from collections.abc import Callable
from math import isnan
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._version import __version__
from tickrig.host.cli.start import standard_streams

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


class NodeId(click.IntRange):
    """A node-ID 1..127, as `5`."""

    def __init__(self) -> None:
        super().__init__(1, 127)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Read a node-ID."""
        if isinstance(value, str) and not value.strip().lstrip("+-").isdecimal():
            self.fail(f"{value!r} is no node-ID 1..127.", param, ctx)
        return int(super().convert(value, param, ctx))


NODE_ID: Final = NodeId()


def version_option() -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `--version`, in the form that all commands have."""
    return click.version_option(__version__, message="%(prog)s (tickrig) %(version)s")


def time_option(option: str, name: str, **attributes: Any) -> Decorator:
    """Return the option of a time, as `10s`; in microseconds, None where it is not given."""

    def parsed(context: click.Context, parameter: click.Parameter, text: str | None) -> int | None:
        from tickrig.host.cli.refused import Refused  # noqa: PLC0415 - a TAB needs none
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
