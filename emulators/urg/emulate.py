"""What `urg-emu` runs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import World, room
from tickrig.emulators.commands.serial_run import DeviceType, Options, SerialRun, by_miniterm
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.urg.build import (
    NAME,
    config_to_trace,
    parse_numbers,
    parse_post,
    parse_wall,
)
from tickrig.emulators.urg.cli import USB_BAUD
from tickrig.host.cli.refused import refused_at

USUAL_BAUD: Final = 115_200
"""What a host sets, which means nothing on USB."""

BUFFER_BYTES: Final = 16_384
"""Room for several whole scans at once."""


def emulate(serial: str, noise: float, scip: str, baud: int, options: dict[str, Any]) -> int:
    """Run a range finder as the command line says, and return the exit status."""
    with refused_at("--serial"):
        parameters = UrgParameters(serial=serial, noise=noise, seed=options["seed"], scip=scip)
    world = _world(options.pop("size"), options.pop("walls"), options.pop("posts"))
    line = LineSettings(baud, wire=partial(SerialLine, buffer_bytes=BUFFER_BYTES))
    kind = DeviceType(NAME, "URG-04LX", is_event=_is_event, line=line, talk=partial(_talk, scip))
    config = config_to_trace(parameters, world)
    return SerialRun(kind, Urg(parameters, world), config, Options(**options)).run()


def _world(size: str | None, walls: Sequence[str], posts: Sequence[str]) -> World:
    around = World()
    if size is not None:
        with refused_at("--room"):
            width_m, depth_m = parse_numbers(size, 2, "a room is WIDTH,DEPTH in m")
            around = room(width_m, depth_m)
    with refused_at("--wall"):
        more = tuple(parse_wall(text) for text in walls)
    with refused_at("--post"):
        return World(around.walls + more, tuple(parse_post(text) for text in posts))


def _talk(scip: str, link: str, baud: int) -> str:
    switch = " The line SCIP2.0 switches it to SCIP 2.0." if scip == "1.1" else ""
    return switch + by_miniterm(link, USUAL_BAUD if baud == USB_BAUD else baud)


def _is_event(line: WireLine) -> bool:
    return line.mark is Mark.TO_DEVICE
