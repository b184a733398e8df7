"""What `rh3-emu` runs."""

from __future__ import annotations

from typing import Any, Final

from tickrig.device.rh3.base import Rh3Base
from tickrig.emulators.commands.serial_run import DeviceType, Options, SerialRun
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rh3.base_options import NAMES, read_parameters
from tickrig.emulators.rh3.build import NAME, config_to_trace
from tickrig.emulators.rh3.frame_log import frame_splitter
from tickrig.emulators.rh3.verbs import verbs
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.rs485_line import Rs485Line

CYCLE: Final = b"01 17 "
"""What -v leaves out: the traffic of each period."""


def emulate(baud: int, options: dict[str, Any]) -> int:
    """Run a base as the command line says, and return the exit status."""
    settings = {name: options.pop(name) for name in ("address", *NAMES)}
    parameters = read_parameters({**settings, "seed": options["seed"]})
    kind = DeviceType(
        NAME,
        "RH3 base",
        is_event=_is_event,
        senders=verbs(parameters.address),
        line=LineSettings(baud, splitter=frame_splitter, wire=Rs485Line),
        talk=lambda link, baud: (
            f" Any Modbus RTU master can open this path, as address {parameters.address}."
            f" To address 1:\n  rh3 goto 1 0 0 --device {link} --baud {baud}"
        ),
    )
    run = SerialRun(kind, Rh3Base(parameters), config_to_trace(parameters), Options(**options))
    return run.run()


def _is_event(line: WireLine) -> bool:
    return not line.data.startswith(CYCLE)
