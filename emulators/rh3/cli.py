"""The command `rh3-emu`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.commands.run_options import line_options, run_named
from tickrig.host.cli.messages import Refused
from tickrig.host.cli.options import Decorator, HarmlessCommand, add_options
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from tickrig.device.rh3.parameters import BaseParameters


# What a base on a command line is like: options for `BaseParameters`.

_OPTIONS: Final[Mapping[str, str]] = {
    "radius_left_m": "Effective radius of the left wheel.  [0.0995]",
    "radius_right_m": "Effective radius of the right wheel.  [0.0995]",
    "tread_m": "Effective distance between the wheels.  [0.464]",
    "friction": "Coefficient between wheels and ground; without it they never slip.",
    "response_s": "Time constant of the speed loop.  [0.05]",
    "delay_ms": "From a command to its effect.  [0]",
    "noise": "Spread of a wheel's way over the ground, as a share of it.  [0]",
}
NAMES: Final = tuple(_OPTIONS)


def _option(name: str, text: str) -> Decorator:
    kind, metavar = (int, "MS") if name == "delay_ms" else (float, "NUMBER")
    return click.option(f"--{name.replace('_', '-')}", type=kind, metavar=metavar, help=text)


base_options: Final = add_options(*(_option(*row) for row in _OPTIONS.items()))
"""Add the parameters in `NAMES` as options."""


def parameters_of(settings: Mapping[str, Any]) -> BaseParameters:
    """Return parameters; ValueError for a value of another type or out of range."""
    with loading():
        from tickrig.device.rh3.parameters import BaseParameters  # noqa: PLC0415 - slow

    defaults = asdict(BaseParameters())
    for name, value in settings.items():
        wanted = (int,) if type(defaults[name]) is int else (int, float)
        if not (type(value) in wanted or (name == "friction" and value is None)):
            kind = "a whole number" if wanted == (int,) else "a number"
            raise ValueError(f"{name} is {value!r}, expected is {kind}")
    return BaseParameters(**settings)


def read_parameters(options: Mapping[str, Any]) -> BaseParameters:
    """Return a base of options, those left out as they are; Refused for one that cannot be."""
    try:
        return parameters_of({name: v for name, v in options.items() if v is not None})
    except ValueError as error:
        raise Refused(_by_option(str(error))) from None


def _by_option(message: str) -> str:
    """Name the option, where a message begins with the parameter."""
    name, blank, rest = message.partition(" ")
    return f"--{name.replace('_', '-')}{blank}{rest}" if name in (*NAMES, "address") else message


@click.command(cls=HarmlessCommand)
@click.option(
    "--baud",
    type=click.IntRange(1_200, 4_000_000),
    default=115_200,
    help="Bit rate of the line, 8N1.  [115200]",
)
@click.option("--address", type=int, metavar="1..247", help="Modbus address.  [1]")
@base_options
@line_options("flip, drop, dup, cut", "tickrig.device.rh3.driver:INPUTS")
@click.pass_context
def main(context: click.Context, /, **options: Any) -> None:
    """Emulate the base of Reference Hardware 3, a Modbus RTU slave, on a pseudo-terminal.

    It runs in real time until Ctrl-C. A scenario alone runs in virtual time:
    as fast as it goes, with the same transcript each time, exit status 1 if
    something expected did not come. Together with --link, --serve or
    --control it is played in real time.

    \b
    rh3-emu --link /tmp/rh3 --control /tmp/rh3.ctl
    tickrig ctl /tmp/rh3.ctl get x_m
    tickrig ctl /tmp/rh3.ctl press emergency_stop
    rh3-emu --link /tmp/rh3 --tread-m 0.45 --noise 0.02 --seed 7 --fault drop=0.01
    echo '0 read status' | rh3-emu --scenario -

    \b
    Completion of options in the shell:
    eval "$(_RH3_EMU_COMPLETE=bash_source rh3-emu)"
    """  # noqa: D301 - click wants the backspace
    context.exit(run_named("rh3-base", options))
