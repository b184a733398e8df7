"""What verbs that take SOURCE words share."""

from __future__ import annotations

from collections.abc import Callable
from inspect import cleandoc
from typing import Any, Final

import click

from tickrig.host.cli.can_options import BusCommand, bus_options, fd_options
from tickrig.host.cli.options import Decorator, add_options

SOURCE_HELP = """\b
SOURCE   can0                      a bus of SocketCAN, or of the interface that -i or ~/.canrc names
         can0,123:7FF,400~700,#FF  candump's filters: these, not these, error frames
         slcan:/dev/ttyACM0@500k   interface:channel@bitrate; can0@500k/2M is CAN FD; udp
         serial:/dev/ttyUSB0,rrc   a port (dump, top, tui): PORT[@BAUD],rrc or ,rtc-lite
         run.log run.blf run.asc.gz  logs: candump, jsonl, asc, blf, trc, csv, mf4, pcapng, trace
         -                         standard input: what candump or canmon dump prints"""
"""For the help text of a verb that takes SOURCE words."""

strict_option: Final[Decorator] = click.option(
    "--strict", is_flag=True, help="Exit status 4 if frames were lost or bad."
)

reopen_option: Final[Decorator] = click.option(
    "--reopen", is_flag=True, help="Wait for a bus that goes away until it is back."
)


def source_command(*options: Decorator) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a verb with SOURCE words, `--strict`, and those of a bus.

    Args:
        options: what else the verb has, in the order of its help.
    """
    source = click.argument("source", nargs=-1)
    add = add_options(source, *options, strict_option, bus_options, fd_options)

    def decorate(function: Callable[..., Any]) -> click.Command:
        return explained(click.command(cls=BusCommand)(add(function)))

    return decorate


def explained(command: click.Command) -> click.Command:
    """Put what a SOURCE may be in the place of `{source}` in a command's help."""
    command.help = cleandoc(command.help or "").replace("{source}", SOURCE_HELP)
    return command
