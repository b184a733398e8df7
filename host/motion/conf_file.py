"""Configuration files of OpenRTM components: `conf.default.lengthOfAxle: 0.464`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from tickrig.host.rtc.errors import RtcRefused

_LINE: Final = re.compile(r"conf\.([^.\s:=]+)\.([^\s:=]+)\s*[:=]\s*(.*)")


def read_conf(path: Path) -> dict[str, dict[str, str]]:
    """Return the values of each configuration set; other lines are OpenRTM's own.

    Raises:
        OSError: the file cannot be read.
        RtcRefused: a line with `conf.` that is no such line; it says which.
    """
    sets: dict[str, dict[str, str]] = {}
    for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
        text = line.partition("#")[0].strip()
        if not text.startswith("conf."):
            continue
        if (match := _LINE.fullmatch(text)) is None:
            raise RtcRefused(f"{path}:{number}: {text!r} is not conf.SET.NAME: VALUE")
        sets.setdefault(match[1], {})[match[2]] = match[3]
    return sets
