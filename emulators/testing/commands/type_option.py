"""The option --type: a device type by name."""

from __future__ import annotations

import click

from tickrig.host.cli.options import Decorator


def type_option(text: str) -> Decorator:
    """Return a decorator that adds `--type NAME`, which the shell completes.

    Args:
        text: its help.
    """
    return click.option("--type", "type_name", default="", shell_complete=_complete, help=text)


def _complete(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
    from tickrig.emulators.commands.device_type import DEVICES  # noqa: PLC0415 - slow

    return [name for name in DEVICES.names() if name.startswith(begun)]
