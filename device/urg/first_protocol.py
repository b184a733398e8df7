"""The sensor's side of SCIP 1.1: what a URG-04LX understands until it is switched."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from tickrig.device.twin import Immutable
from tickrig.device.urg.parameters import LAST_STEP
from tickrig.device.urg.settings import Settings
from tickrig.device.urg.texts import first_version
from tickrig.device.urg.view import View
from tickrig.wire.sensors.scip import status
from tickrig.wire.sensors.scip.scip1 import (
    ERROR,
    FARTHEST_MM,
    OK,
    SWITCH,
    encode_distances,
    encode_reply,
)

_RATE_KEPT: Final = "03"


class Sensor(Protocol):
    """What the commands act on: the server of SCIP 2.0."""

    @property
    def serial(self) -> str:
        """The serial number."""
        ...

    @property
    def settings(self) -> Settings:
        """The bit rate."""
        ...

    def light(self, now_us: int) -> bool:
        """Switch the laser on, unless there is trouble; return whether it is on."""
        ...

    def stop(self) -> None:
        """Switch the laser off."""

    def switch(self) -> None:
        """Go on in SCIP 2.0."""

    def measure(self, capture: Capture) -> bytes | None:
        """Answer with the latest scan, later with the first one; None if there will be none."""
        ...


@dataclass(frozen=True, slots=True)
class Capture(Immutable):
    """A G that waits for a scan.

    Attributes:
        line: the command as it came.
        first: step.
        last: step.
        cluster: steps for each number.
    """

    line: bytes
    first: int
    last: int
    cluster: int

    def answer(self, view: View) -> bytes:
        """Return a scan as it was asked for."""
        numbers = view.distances(self.first, self.last, self.cluster)
        lines = encode_distances([min(number, FARTHEST_MM) for number in numbers])
        return encode_reply(self.line, OK, lines)

    def refuse(self, code: str) -> bytes:
        """Return that there will be no scan."""
        return encode_reply(self.line, ERROR)


def obey(sensor: Sensor, now_us: int, line: bytes) -> bytes:
    """Return what is answered to a line at once."""
    for form, work in _COMMANDS.items():
        if match := form.fullmatch(line):
            return work(sensor, now_us, match)
    return encode_reply(line, ERROR)


def _version(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    lines = (f"{key}:{text}".encode() for key, text in first_version(sensor.serial).items())
    return encode_reply(match[0], OK, lines)


def _laser(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    if match[1] == b"0":
        sensor.stop()
        return encode_reply(match[0], OK)
    return encode_reply(match[0], OK if sensor.light(now_us) else ERROR)


def _rate(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    code = sensor.settings.set_rate(match[1].decode())
    return encode_reply(match[0], OK if code in (status.OK, _RATE_KEPT) else ERROR)


def _get(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    first, last, cluster = map(int, match.groups())
    answer = None
    if first <= last <= LAST_STEP:
        answer = sensor.measure(Capture(match[0], first, last, cluster))
    return encode_reply(match[0], ERROR) if answer is None else answer


def _switch(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    sensor.switch()
    return encode_reply(match[0], OK)


_COMMANDS: Final[Mapping[re.Pattern[bytes], Callable[[Sensor, int, re.Match[bytes]], bytes]]] = {
    re.compile(rb"V"): _version,
    re.compile(rb"L([01])"): _laser,
    re.compile(rb"G(\d{3})(\d{3})(\d\d)"): _get,
    re.compile(rb"S(\d{6})\d{7}"): _rate,
    re.compile(re.escape(SWITCH)): _switch,
}
