"""What a command line says of ROS 2."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_DOMAIN_VARIABLE: Final = "ROS_DOMAIN_ID"
_LAST_DOMAIN: Final = 232
"""Beyond it there is no port left (DDSI-RTPS, 9.6.2)."""


@dataclass(frozen=True, slots=True)
class Ros2Options:
    """How a system is joined with ROS 2.

    Attributes:
        domain: of DDS, 0..232.
        interface: of this machine, such as eth0; loopback if empty.
        table: which ports have topics; None for those of the command.
        topics: text of the table of the command; empty for a topic of each port.
    """

    domain: int = 0
    interface: str = ""
    table: Path | None = None
    topics: str = ""


def parse_options(
    domain: int | None, interface: str | None, table: Path | None, topics: str
) -> Ros2Options:
    """Return the options; the domain is that of ROS_DOMAIN_ID, or 0, where none is given.

    Raises:
        ValueError: the variable holds no domain.
    """
    if domain is None:
        text = os.environ.get(_DOMAIN_VARIABLE, "") or "0"
        if not re.fullmatch(r"\d{1,3}", text, re.ASCII) or int(text) > _LAST_DOMAIN:
            raise ValueError(f"{_DOMAIN_VARIABLE} {text!r} is no domain 0..{_LAST_DOMAIN}")
        domain = int(text)
    return Ros2Options(domain, interface or "", table, topics)
