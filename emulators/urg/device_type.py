"""The URG as a device type: `urg-emu`, and its configuration in traces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial
from typing import Any, Final

from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, UrgParameters, Wall, World, room
from tickrig.emulators.commands.device_type import (
    ConfiguredDevice,
    DeviceType,
    by_miniterm,
    check_config,
)
from tickrig.emulators.fields import named
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.urg.fields import FIELDS, USB_BAUD
from tickrig.host.text.trace import Config, Mark

_USUAL_BAUD: Final = 115_200
"""Baud rate that a host sets, which has no meaning on USB."""

_BUFFER_BYTES: Final = 16_384
"""Size of the buffer, which has room for several whole scans."""

_OLD_SCIP: Final = "2.0"
"""The protocol at the start of traces that do not name a protocol."""


def _config_to_trace(parameters: UrgParameters, world: World) -> Config:
    """Return all parameters and the world."""
    return {
        "serial": parameters.serial,
        "noise": parameters.noise,
        "noise_seed": parameters.seed,
        "scip": parameters.scip,
        "baud": parameters.rs232_baud or USB_BAUD,
        "walls": _text(world.walls),
        "posts": _text(world.posts),
    }


def build_urg(config: Config) -> Urg:
    """Make an emulated range finder from its configuration.

    Raises:
        ValueError: a setting is unknown, or its value is invalid.
    """
    defaults = {**_config_to_trace(UrgParameters(), World()), "scip": _OLD_SCIP}
    check_config(config, defaults, "a sensor has no setting", typed=False)
    settings: dict[str, Any] = {**defaults, **config}
    baud = settings["baud"]
    noise, seed = settings["noise"], settings["noise_seed"]
    if type(seed) is not int or type(noise) not in (int, float):
        raise ValueError(f"noise {noise!r} and noise_seed {seed!r} are not two numbers")
    if type(baud) is not int:
        raise ValueError(f"baud {baud!r} is not a bit rate")
    walls = [_parse_wall(text) for text in str(settings["walls"]).split()]
    posts = [_parse_post(text) for text in str(settings["posts"]).split()]
    parameters = UrgParameters(
        serial=str(settings["serial"]),
        noise=noise,
        seed=seed,
        scip=str(settings["scip"]),
        rs232_baud=_rs232_baud(baud),
    )
    return Urg(parameters, World(tuple(walls), tuple(posts)))


def _rs232_baud(baud: int) -> int | None:
    return None if baud == USB_BAUD else baud


def _parse_wall(text: str) -> Wall:
    """Read `X1,Y1,X2,Y2`; raise ValueError if the text is not a wall.

    >>> _parse_wall("1,-1,1,1")
    Wall(x1_m=1.0, y1_m=-1.0, x2_m=1.0, y2_m=1.0)
    """
    return Wall(*_parse_numbers(text, 4, "a wall is X1,Y1,X2,Y2 in m"))


def _parse_post(text: str) -> Post:
    """Read `X,Y,RADIUS`; raise ValueError if the text is not a post."""
    return Post(*_parse_numbers(text, 3, "a post is X,Y,RADIUS in m"))


def _parse_numbers(text: str, count: int, form: str) -> tuple[float, ...]:
    """Read comma-separated numbers; raise ValueError with the form if the count is wrong."""
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise ValueError(f"{form}, got {text!r}")
    return numbers


def _text(things: Iterable[Wall | Post]) -> str:
    return " ".join(",".join(map(str, astuple(thing))) for thing in things)


def _configure(urg: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    scip = options["scip"]
    with named("--serial"):
        parameters = UrgParameters(
            serial=options["serial"],
            noise=options["noise"],
            seed=seed,
            scip=scip,
            rs232_baud=_rs232_baud(options["baud"]),
        )
    world = _world(options["size"], options["walls"], options["posts"])
    line = replace(urg.line, baud=options["baud"], uart=options["baud"] != USB_BAUD)
    urg = replace(urg, line=line, talk=partial(_talk, scip))
    return ConfiguredDevice(urg, Urg(parameters, world), _config_to_trace(parameters, world))


def _world(size: str | None, walls: Sequence[str], posts: Sequence[str]) -> World:
    around = World()
    if size is not None:
        with named("--room"):
            width_m, depth_m = _parse_numbers(size, 2, "a room is WIDTH,DEPTH in m")
            around = room(width_m, depth_m)
    with named("--wall"):
        more = tuple(_parse_wall(text) for text in walls)
    with named("--post"):
        return World(around.walls + more, tuple(_parse_post(text) for text in posts))


def _talk(scip: str, link: str, baud: int) -> str:
    switch = " The line SCIP2.0 switches it to SCIP 2.0." if scip == "1.1" else ""
    return switch + by_miniterm(link, _USUAL_BAUD if baud == USB_BAUD else baud)


URG: Final = DeviceType(
    name="urg",
    title="URG-04LX",
    build=build_urg,
    fields=FIELDS,
    configure=_configure,
    config_of=lambda urg: _config_to_trace(urg.parameters, urg.world),
    line=LineSettings(wire=partial(SerialLine, buffer_bytes=_BUFFER_BYTES)),
    is_event=lambda line: line.mark is Mark.TO_DEVICE,
)
