"""SCIP 1.1, with the texts and settings that both protocols share."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from tickrig.device.twin import Immutable
from tickrig.device.urg.world import BIT_RATE, LAST_STEP, View
from tickrig.wire import scip as status
from tickrig.wire.scip import ERROR, FARTHEST_MM, SCIP1_OK, SWITCH, encode_distances, encode_reply

# Identification of a URG-04LX (URG network, status information).

BY_DEFAULT: Final = "<-Default setting by user"

CONDITION: Final[Mapping[str, str]] = {
    "": "Sensor works well.",
    status.LASER_TROUBLE: "Laser trouble.",
    status.MOTOR_TROUBLE: "Motor trouble.",
}
"""Texts by status. The texts of faults are our choice."""


def _first_version(serial: str) -> Mapping[str, str]:
    """Return the answer to V in SCIP 1.1 (from HokuyoAIST, and a recording in regilo)."""
    return {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00,07/01/18(20-4095[mm],240[deg],44-725[step],600[rpm])",
        "PROT": "00003,(SCIP 1.0)",
        "SERI": serial,
    }


def version(serial: str) -> Mapping[str, str]:
    """Return the answer to VV."""
    return {
        "VEND": "Hokuyo Automatic Co.,Ltd.",
        "PROD": "SOKUIKI Sensor URG-04LX",
        "FIRM": "3.1.00(18/Jan./2007)",
        "PROT": "SCIP 2.0",
        "SERI": serial,
    }


# Settings of SS and HS (SCIP 2.0, sensor commands).

_BIT_RATES: Final = (19_200, 38_400, 57_600, 115_200, 250_000, 500_000, 750_000)


@dataclass(slots=True)
class Settings:
    """Bit rate and sensitivity of a URG sensor, as the host has set them.

    Attributes:
        rate: bit rate of RS-232C in bit/s. On USB the sensor only reports this rate.
        sensitive: whether the sensor measures in the sensitive mode. The sensor only reports it,
            because it has no effect on the emulation.
        first_rate: bit rate after power-up.
    """

    rate: int = BIT_RATE
    sensitive: bool = False
    first_rate: int = BIT_RATE

    @property
    def mode(self) -> str:
        """Measuring mode, as reported by II."""
        return f"Measuring by {'Sensitive' if self.sensitive else 'Normal'} Mode"

    @property
    def rate_text(self) -> str:
        """The bit rate, as reported by II."""
        return f"{self.rate}[bps]{BY_DEFAULT if self.rate == self.first_rate else ''}"

    def set_rate(self, text: str) -> str:
        """Set the bit rate; return the status."""
        if not text.isdecimal():
            return "01"
        rate = int(text)
        if rate not in _BIT_RATES:
            return "02"
        if rate == self.rate:
            return "03"
        self.rate = rate
        return status.OK

    def set_sensitivity(self, text: str) -> str:
        """Set the sensitivity; return the status."""
        if text not in ("0", "1"):
            return "01"
        sensitive = text == "1"
        if sensitive == self.sensitive:
            return "02"
        self.sensitive = sensitive
        return status.OK


# The sensor's side of SCIP 1.1: the commands of a URG-04LX until it is switched.

_RATE_KEPT: Final = "03"


class Sensor(Protocol):
    """The sensor that the commands act on, which is the server of SCIP 2.0."""

    @property
    def serial(self) -> str:
        """The serial number."""
        ...

    @property
    def settings(self) -> Settings:
        """The bit rate."""
        ...

    def light(self, now_us: int) -> bool:
        """Switch the laser on unless there is a fault; return whether it is on."""
        ...

    def stop(self) -> None:
        """Switch the laser off."""

    def switch(self) -> None:
        """Switch to SCIP 2.0."""

    def measure(self, capture: Capture) -> bytes | None:
        """Return the answer to a G command with the latest scan.

        Returns:
            The answer. The result is b"" if the sensor will send the answer after the next scan, or
            None if the sensor refuses the command.
        """
        ...


@dataclass(frozen=True, slots=True)
class Capture(Immutable):
    """A G command of SCIP 1.1, which requests one scan and waits for it.

    Attributes:
        line: the command as received.
        first: first step (direction of a beam) to send.
        last: last step to send.
        cluster: number of steps that are combined into one distance in the answer.
    """

    line: bytes
    first: int
    last: int
    cluster: int

    def answer(self, view: View) -> bytes:
        """Return a scan in the requested form."""
        # Two characters carry 4095 at most (SCIP 1.1); larger distances read as 4095.
        numbers = view.distances(self.first, self.last, self.cluster)
        lines = encode_distances([min(number, FARTHEST_MM) for number in numbers])
        return encode_reply(self.line, SCIP1_OK, lines)

    def refuse(self, code: str) -> bytes:
        """Return the answer to a command that gets no scan."""
        return encode_reply(self.line, ERROR)


def obey(sensor: Sensor, now_us: int, line: bytes) -> bytes:
    """Return the immediate answer to a line."""
    for form, work in _COMMANDS.items():
        if match := form.fullmatch(line):
            return work(sensor, now_us, match)
    return encode_reply(line, ERROR)


def _version(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    lines = (f"{key}:{text}".encode() for key, text in _first_version(sensor.serial).items())
    return encode_reply(match[0], SCIP1_OK, lines)


def _laser(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    if match[1] == b"0":
        sensor.stop()
        return encode_reply(match[0], SCIP1_OK)
    return encode_reply(match[0], SCIP1_OK if sensor.light(now_us) else ERROR)


def _rate(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    code = sensor.settings.set_rate(match[1].decode())
    # Setting the rate that is already set is no error in SCIP 1.1: its only statuses are 0 and E.
    return encode_reply(match[0], SCIP1_OK if code in (status.OK, _RATE_KEPT) else ERROR)


def _get(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    first, last, cluster = map(int, match.groups())
    answer = None
    if first <= last <= LAST_STEP:
        answer = sensor.measure(Capture(match[0], first, last, cluster))
    return encode_reply(match[0], ERROR) if answer is None else answer


def _switch(sensor: Sensor, now_us: int, match: re.Match[bytes]) -> bytes:
    sensor.switch()
    return encode_reply(match[0], SCIP1_OK)


_COMMANDS: Final[Mapping[re.Pattern[bytes], Callable[[Sensor, int, re.Match[bytes]], bytes]]] = {
    re.compile(rb"V"): _version,
    re.compile(rb"L([01])"): _laser,
    re.compile(rb"G(\d{3})(\d{3})(\d\d)"): _get,
    re.compile(rb"S(\d{6})\d{7}"): _rate,
    re.compile(re.escape(SWITCH)): _switch,
}
