"""What `rrc-emu` runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.commands.serial_run import DeviceType, Options, SerialRun
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rrc.build import NAME, config_to_trace
from tickrig.emulators.serial.emulator import Emulator
from tickrig.wire.rrc.check import check_digit

EVENTS: Final = (b"EV:", b"ER:")


def _with_check(text: bytes) -> bytes:
    return text + check_digit(text) + b"\n"


def _is_event(line: WireLine) -> bool:
    return line.mark is Mark.FROM_DEVICE and line.data.startswith(EVENTS)


def _panel(emulator: Emulator) -> None:
    from tickrig.emulators.rrc.panel_run import run_panel  # noqa: PLC0415 - the extra [tui]

    run_panel(emulator)


KIND: Final = DeviceType(NAME, "RRC", {"check": _with_check}, _is_event, _panel)


def emulate(power_on_event: str, options: Mapping[str, Any]) -> int:
    """Run an RRC as the command line says, and return the exit status."""
    config = RrcConfig(power_on_event=power_on_event)
    return SerialRun(KIND, Rrc(config), config_to_trace(config), Options(**options)).run()
