"""A device by the name of its type and the options of its command line, given as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Final

import click

from tickrig.emulators.commands.device_type import DEVICES, ConfiguredDevice
from tickrig.emulators.commands.emu_cli import OURS, device_command
from tickrig.emulators.commands.serial_run import Options
from tickrig.host.cli.messages import Refused
from tickrig.host.cli.start import load
from tickrig.host.text.names import near

_SHARED: Final = frozenset({*(item.name for item in fields(Options)), "fault", "version", "help"})
"""Options that say how a device is run, and nothing of the device."""


def configure(name: str, config: Mapping[str, object], seed: int = 0) -> ConfiguredDevice:
    """Make a device of its type and of its options.

    Args:
        name: of the device type.
        config: options without their dashes, as `node` or `timer`; a list for one that may be
            repeated. What is left out is as on the command line.
        seed: of all chance in it.

    Raises:
        ExtensionError: there is no such type, or it cannot be loaded.
        ValueError: no such option, or not with this value; the text begins with the option.

    >>> configure("rtc-lite", {"node": "lite-a"}).config["node"]
    'lite-a'
    """
    device_type, options = DEVICES.load(name), _options_of(name)
    words = [word for key, value in config.items() for word in _words(name, options, key, value)]
    command = click.Command(name, params=list(options.values()), add_help_option=False)
    try:
        with command.make_context(name, words) as context:
            values = dict(context.params)
        return device_type.of_options(values, seed)
    except click.ClickException as error:
        raise ValueError(error.format_message()) from None
    except Refused as refused:
        raise ValueError(str(refused)) from None


def option_names(name: str) -> tuple[str, ...]:
    """Return the options of a device type without their dashes; ExtensionError if there is none."""
    return tuple(_options_of(name))


def _options_of(name: str) -> dict[str, click.Option]:
    """Return the options of a device alone, by their names on the command line."""
    command = load(OURS[name][0]) if name in OURS else device_command(DEVICES.load(name))
    options = [option for option in command.params if isinstance(option, click.Option)]
    named = {option.opts[0].removeprefix("--"): option for option in options}
    return {
        word: option
        for word, option in named.items()
        if option.name not in _SHARED and word not in _SHARED
    }


def _words(name: str, options: Mapping[str, click.Option], key: str, value: object) -> list[str]:
    """Return an option as a command line has it."""
    option = options.get(key.replace("_", "-"))
    if option is None:
        raise ValueError(f"{key}: {name} has no such option; {near(key, options)}")
    if option.is_flag:
        if not isinstance(value, bool):
            raise ValueError(f"{key}: {value!r} is not true or false")
        return [option.opts[0]] if value else []
    values = value if isinstance(value, list) else [value]
    if isinstance(value, list) and not option.multiple:
        raise ValueError(f"{key}: it is given once, not as a list")
    for each in values:
        if not isinstance(each, int | float | str) or isinstance(each, bool):
            raise ValueError(f"{key}: {each!r} is not a number or a text")
    return [f"{option.opts[0]}={each}" for each in values]
