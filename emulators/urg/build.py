"""Build a sensor from the configuration that a trace carries, and the other way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple
from typing import Any, Final

from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, Wall, World
from tickrig.emulators.record.trace import Config

NAME: Final = "urg"

SETTINGS: Final = ("serial", "noise", "noise_seed", "scip", "walls", "posts")
OLD_SCIP: Final = "2.0"
"""The protocol at the start of traces that name none."""

DEFAULTS: Final = UrgParameters()


def config_to_trace(parameters: UrgParameters, world: World) -> Config:
    """Return all parameters and the world."""
    return {
        "serial": parameters.serial,
        "noise": parameters.noise,
        "noise_seed": parameters.seed,
        "scip": parameters.scip,
        "walls": _text(world.walls),
        "posts": _text(world.posts),
    }


def build_urg(config: Config) -> Urg:
    """Build a sensor.

    Raises:
        ValueError: a setting that a sensor does not have, or a value that it cannot have.
    """
    settings: dict[str, Any] = {key: value for key, value in config.items() if key != "seed"}
    for name in settings:
        if name not in SETTINGS:
            raise ValueError(f"a sensor has no setting {name!r}; known: {', '.join(SETTINGS)}")
    noise, seed = settings.get("noise", DEFAULTS.noise), settings.get("noise_seed", 0)
    if type(seed) is not int or type(noise) not in (int, float):
        raise ValueError(f"noise {noise!r} and noise_seed {seed!r} are not two numbers")
    serial = str(settings.get("serial", DEFAULTS.serial))
    walls = [parse_wall(text) for text in str(settings.get("walls", "")).split()]
    posts = [parse_post(text) for text in str(settings.get("posts", "")).split()]
    scip = str(settings.get("scip", OLD_SCIP))
    parameters = UrgParameters(serial=serial, noise=noise, seed=seed, scip=scip)
    return Urg(parameters, World(tuple(walls), tuple(posts)))


def parse_wall(text: str) -> Wall:
    """Read `X1,Y1,X2,Y2`; ValueError if it is no wall.

    >>> parse_wall("1,-1,1,1")
    Wall(x1_m=1.0, y1_m=-1.0, x2_m=1.0, y2_m=1.0)
    """
    return Wall(*parse_numbers(text, 4, "a wall is X1,Y1,X2,Y2 in m"))


def parse_post(text: str) -> Post:
    """Read `X,Y,RADIUS`; ValueError if it is no post."""
    return Post(*parse_numbers(text, 3, "a post is X,Y,RADIUS in m"))


def parse_numbers(text: str, count: int, form: str) -> tuple[float, ...]:
    """Read numbers between commas; ValueError with the form if they are not so many."""
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise ValueError(f"{form}, got {text!r}")
    return numbers


def _text(things: Iterable[Wall | Post]) -> str:
    return " ".join(",".join(map(str, astuple(thing))) for thing in things)
