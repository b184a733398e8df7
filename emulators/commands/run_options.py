"""Common options of the command lines of all emulators, and the run of a device."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.fields import DeviceField
from tickrig.host.cli.options import (
    PATH,
    Choice,
    Decorator,
    HarmlessCommand,
    NumberRange,
    add_options,
    version_option,
)
from tickrig.host.cli.start import load, loading

if TYPE_CHECKING:
    from tickrig.device.physical import InputSignal
    from tickrig.emulators.commands.device_type import DeviceType
    from tickrig.host.cli.extensions import ExtensionGroup


_Faults = Callable[[click.Context], Iterable[str]]
"""Function that returns the faults of a device with the options given before."""


def device_options(fields: Iterable[DeviceField]) -> Decorator:
    """Return a decorator that adds an option for each field of a device."""
    return add_options(*map(_field_option, fields))


def _field_option(field: DeviceField) -> Decorator:
    given: dict[str, Any] = {"help": field.help}
    ranged = field.low is not None or field.high is not None
    if field.kind is bool:
        return click.option(f"--{field.word}", field.name, is_flag=True, **given)
    if field.choices:
        given["type"] = Choice(field.choices)
    elif ranged:
        range_type: Any = click.IntRange if field.kind is int else NumberRange
        given["type"] = range_type(field.low, field.high)
    else:
        given["type"] = field.kind
    if field.unit:
        given["metavar"] = field.unit
    if field.default is not None:
        given["default"] = field.default
    if field.proposals:
        given["shell_complete"] = lambda context, option, begun: [
            each for each in field.proposals if each.startswith(begun)
        ]
    return click.option(f"--{field.word}", field.name, multiple=field.many, **given)


def run_options(wire_faults: str, device_faults: _Faults) -> Decorator:
    """Return a decorator that adds the options of all emulators to a click command.

    These options are the fields of `run.RunOptions`, and `--version`.

    Args:
        wire_faults: names of wire faults, separated by commas.
        device_faults: function that returns the names of device faults, for shell completion.
    """

    def complete(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
        names = [*wire_faults.split(", "), *device_faults(context)]
        return [name for name in names if name.startswith(begun)]

    return add_options(
        click.option("--scenario", type=PATH, help="Play a scenario file; - reads standard input."),
        click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'."),
        click.option(
            "--fault",
            "faults",
            multiple=True,
            metavar="NAME[=ARGUMENT][@FROM[-TO]]",
            shell_complete=complete,
            help=f"Inject a fault of the wire ({wire_faults}) or of the device; may be repeated.",
        ),
        click.option("--seed", type=int, default=0, help="Seed of the random wire faults. [0]"),
        click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line."),
        version_option(),
    )


SERIAL_FAULTS: Final = (
    "flip, drop, dup, cut, delay, jitter, split, swap, garbage, repeat, truncate, break, framing,"
    " parity"
)
"""The names in `BYTE_FAULTS`, which is slow to load."""


panel_option: Final[Decorator] = click.option(
    "--panel", is_flag=True, help="Show an operator panel in this terminal."
)


def line_options(wire_faults: str, inputs: str | Callable[[], Iterable[InputSignal]]) -> Decorator:
    """Return a decorator that adds the options of all devices on a serial line to a click command.

    These options are `--link`, `--serve`, `--trace` and the options that `run_options` adds.

    Args:
        wire_faults: names of wire faults, separated by commas.
        inputs: physical inputs of the device, for shell completion: a function that returns the
            inputs, or a text `MODULE:NAME` with the module and the variable that contain the
            inputs.
    """

    def device_faults(context: click.Context) -> list[str]:
        table = load(inputs) if isinstance(inputs, str) else inputs()
        return [item.name for item in table if item.type.value == "fault"]

    return add_options(
        click.option("--link", type=PATH, help="Make a symbolic link to the terminal."),
        click.option(
            "--serve",
            multiple=True,
            metavar="URL",
            shell_complete=_complete_serve,
            help="Serve the line at rfc2217://[HOST:]PORT or socket://[HOST:]PORT;"
            " may be repeated.",
        ),
        click.option("--trace", type=PATH, help="Record the run in a file, for 'tickrig replay'."),
        run_options(wire_faults, device_faults),
    )


def _complete_serve(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
    return [url for url in ("rfc2217://", "socket://") if url.startswith(begun)]


def run_named(name: str, options: Mapping[str, Any]) -> int:
    """Run an emulated device of a given type, and return the exit status for the command line.

    Args:
        name: name of a device type in `device_type.DEVICES`.
        options: options of the device, and options of `line_options`.

    Raises:
        Refused: the device cannot be run with these options.
    """
    with loading():
        run_device = load("tickrig.emulators.commands.serial_run:run_device")
    status: int = run_device(device_types().load(name), options)
    return status


def serial_command(
    name: str,
    fields: Iterable[DeviceField],
    inputs: str,
    wire_faults: str = SERIAL_FAULTS,
    *,
    panel: bool = False,
) -> Callable[[Callable[[], None]], click.Command]:
    """Return a decorator that makes the click command of an emulated device on a serial line.

    The decorated function is never called, so it needs only a docstring. This docstring becomes the
    help text of the command.

    Args:
        name: name of a device type in `device_type.DEVICES`.
        fields: fields of the device, which become options.
        inputs: text `MODULE:NAME` with the module and the variable that contain the physical
            inputs.
        wire_faults: names of wire faults, separated by commas.
        panel: whether the device has an operator panel.
    """

    def decorate(described: Callable[[], None]) -> click.Command:
        @click.command(cls=HarmlessCommand)
        @device_options(fields)
        @add_options(*[panel_option] * panel)
        @line_options(wire_faults, inputs)
        @click.pass_context
        @wraps(described)
        def command(context: click.Context, /, **options: Any) -> None:
            context.exit(run_named(name, options))

        return command

    return decorate


def device_types() -> ExtensionGroup[DeviceType]:
    """Return the device types, `device_type.DEVICES`; not needed for help and completion."""
    with loading():
        found: ExtensionGroup[DeviceType] = load("tickrig.emulators.commands.device_type:DEVICES")
    return found


# The option --type: a device type by name.


def type_option(text: str) -> Decorator:
    """Return a decorator that adds the option `--type NAME` to a click command.

    The shell completes the names of the device types.

    Args:
        text: help text of the option.
    """
    return click.option("--type", "type_name", default="", shell_complete=_complete, help=text)


def _complete(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
    return [name for name in device_types().names() if name.startswith(begun)]
