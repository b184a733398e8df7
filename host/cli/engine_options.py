"""Options that join a system with those of other middleware, the same for all commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.cli.options import PATH, Decorator, add_options
from tickrig.host.cli.refused import Refused

if TYPE_CHECKING:
    from tickrig.host.cli.openrtm_options import OpenRtmOptions
    from tickrig.host.cli.ros2_options import Ros2Options

openrtm_options: Final[Decorator] = add_options(
    click.option(
        "--openrtm",
        metavar="HOST[:PORT]",
        help="Components as those of OpenRTM, in its name server there (extra tickrig[openrtm]).",
    ),
    click.option(
        "--openrtm-address",
        metavar="HOST[:PORT]",
        help="Where its peers reach them, else 127.0.0.1. CORBA has no access control.",
    ),
    click.option(
        "--openrtm-names", metavar="FORMAT", help="As naming.formats, else %h.host_cxt/%n.rtc."
    ),
)

ros2_options: Final[Decorator] = add_options(
    click.option("--ros2", is_flag=True, help="Ports as topics of ROS 2 (extra tickrig[ros2])."),
    click.option(
        "--ros2-table", type=PATH, metavar="FILE", help="TOML: which ports, topics and types."
    ),
    click.option(
        "--ros2-domain",
        type=click.IntRange(0, 232),
        metavar="ID",
        help="Of DDS, else that of ROS_DOMAIN_ID, else 0.",
    ),
    click.option(
        "--ros2-interface", metavar="NAME", help="Else loopback. DDS has no access control here."
    ),
)


@dataclass(frozen=True, slots=True)
class EngineOptions:
    """Which engines a command line asks for.

    Attributes:
        openrtm: OpenRTM, or None.
        ros2: ROS 2, or None.
    """

    openrtm: OpenRtmOptions | None = None
    ros2: Ros2Options | None = None

    def __bool__(self) -> bool:
        """Return whether it asks for any."""
        return self.openrtm is not None or self.ros2 is not None


def take_engines(options: dict[str, Any], topics: str = "") -> EngineOptions:
    """Take the options of engines out of those of a command.

    Args:
        options: of the command line, by name.
        topics: table of topics that holds where none is given; all ports have one if empty.

    Raises:
        Refused: options of an engine that is not asked for, or that cannot be.
    """
    return EngineOptions(_take_openrtm(options), _take_ros2(options, topics))


def _take_openrtm(options: dict[str, Any]) -> OpenRtmOptions | None:
    server = options.pop("openrtm")
    address, names = (options.pop(f"openrtm_{name}") or "" for name in ("address", "names"))
    if server is None:
        for option, word in (("address", address), ("names", names)):
            if word:
                raise Refused(f"--openrtm-{option} is for --openrtm")
        return None
    from tickrig.host.cli.openrtm_options import parse_options  # noqa: PLC0415 - a TAB needs none

    try:
        return parse_options(server, address, names)
    except ValueError as error:
        raise Refused(str(error)) from None


def _take_ros2(options: dict[str, Any], topics: str) -> Ros2Options | None:
    wanted = options.pop("ros2", False)
    given = {name: options.pop(f"ros2_{name}", None) for name in ("domain", "interface", "table")}
    if not wanted:
        for name, word in given.items():
            if word is not None:
                raise Refused(f"--ros2-{name} is for --ros2")
        return None
    from tickrig.host.cli.ros2_options import parse_options  # noqa: PLC0415 - a TAB needs none

    try:
        return parse_options(**given, topics=topics)
    except ValueError as error:
        raise Refused(str(error)) from None
