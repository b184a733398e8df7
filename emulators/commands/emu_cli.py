"""The command `tickrig emu` for all device types, built-in or of other packages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.commands import run_options
from tickrig.host.cli.extensions import ExtensionError
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import LazyGroup
from tickrig.host.text.names import near

if TYPE_CHECKING:
    from tickrig.device.physical import InputSignal
    from tickrig.emulators.commands.device_type import DeviceType

_OURS: Final = {
    "rrc": ("tickrig.emulators.rrc.cli:main", "Emulate an RRC, as rrc-emu."),
    "rtc-lite": ("tickrig.emulators.rtc_lite.cli:main", "Emulate a PIC, as rtc-lite-emu."),
    "rh3-base": ("tickrig.emulators.rh3.cli:main", "Emulate the base of RH3, as rh3-emu."),
    "urg": ("tickrig.emulators.urg.cli:main", "Emulate a range finder, as urg-emu."),
    "ucode-reader": (
        "tickrig.emulators.tkernel.reader.cli:main",
        "Emulate an infra-red reader of ucodes, as ucode-reader-emu.",
    ),
    "canopen-slave": (
        "tickrig.emulators.canopen.cli:main",
        "Emulate CANopen slaves, as canopen-slave-emu.",
    ),
}
"""Built-in devices, with their own command lines."""

_HELP: Final = """\
The emulator runs in real time until Ctrl-C. With --scenario but without --link, --serve and
--control, the scenario runs in virtual time: as fast as possible, with the same transcript each
time, and with exit status 1 if an expectation was missed. With one of these three options, the
scenario runs in real time."""


class _DeviceGroup(LazyGroup):
    """Built-in command lines, and a generated command line for each other device type."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, built-in names first; report each device type that cannot be loaded."""
        self.commands.update(
            (name, device_command(each))
            for name, each in run_options.device_types().load_foreign(say).items()
        )
        return list(self.commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command line of a device."""
        if cmd_name in self.commands:
            return self.commands[cmd_name]
        types = run_options.device_types()
        if cmd_name not in (names := types.names()):
            hint = near(cmd_name, dict.fromkeys([*_OURS, *names]))
            raise Refused(f"no device {cmd_name!r}; {hint}")
        try:
            return device_command(types.load(cmd_name))
        except ExtensionError as error:
            raise Refused(str(error)) from None


def device_command(device_type: DeviceType) -> click.Command:
    """Return the click command `tickrig emu NAME` of a device type.

    It has the options of the type and the options of all devices on a serial line.
    """
    declared = {option.name: option for option in device_type.options}

    @run_options.device_options(field for field in device_type.fields if field.name not in declared)
    @run_options.line_options(", ".join(device_type.line.faults), lambda: _inputs(device_type))
    @click.pass_context
    def run(context: click.Context, /, **options: Any) -> None:
        context.exit(run_options.run_named(device_type.name, options))

    first = device_type.text or f"Emulate {device_type.title}."
    example = f"\b\ntickrig emu {device_type.name} --link /tmp/{device_type.name}"
    command = click.command(device_type.name, help=f"{first}\n\n{_HELP}\n\n{example}")(run)
    command.params[:0] = declared.values()
    if device_type.panel:
        run_options.panel_option(command)
    return command


def _inputs(device_type: DeviceType) -> Iterable[InputSignal]:
    return device_type.build({}).inputs.table.values()


@click.group(cls=_DeviceGroup, commands=_OURS)
def emu() -> None:
    """Emulate a built-in device or a device of an installed package.

    \b
    tickrig emu rrc --link /tmp/rrc
    tickrig emu canopen-slave --model f-palette --node-id 5 -i socketcan -c vcan0
    """  # noqa: D301 - click wants the backspace
