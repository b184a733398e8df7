"""Lines from the RRC to the host (RRC manual, list of commands RRC to host).

>>> status = parse_reply(b"SA:64003200A1000F")
>>> status.in_v_pct, status.out_v_pct, status.gauge
(100, 50, 10)
>>> parse_reply(b"EV:PowerOnTrigger").kind
<RrcEvent.POWER_ON: 'PowerOn'>
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from tickrig.wire.errors import FieldError, FramingError
from tickrig.wire.rrc.message import check_digit, read_hex, read_signed, strip_check

COMMAND_CHECKSUM: Final = "CommandChecksum"
COMMAND_UNKNOWN: Final = "CommandUnknown"
RECEIVE_BUFFER_OVERFLOW: Final = "ReceiveBufferOverflow"


class RrcEvent(StrEnum):
    """The 16 events of the manual."""

    INITIALIZED = "Initialized"
    POWER_ON = "PowerOn"
    POWER_ON_SUCCESS = "PowerOnSuccess"
    POWER_ON_ERROR1 = "PowerOnError1"
    POWER_ON_ERROR2 = "PowerOnError2"
    POWER_ON_TIMEOUT = "PowerOnTimeout"
    BY_BUTTON = "PowerOffWaitByButton"
    BY_COMMUNICATION_ERROR = "PowerOffWaitByCommunicationError"
    BY_JOYSTICK_MODULE_ERROR = "PowerOffWaitByJoystickModuleError"
    BY_POWER_MODULE_ERROR = "PowerOffWaitByPowerModuleError"
    BY_SYSTEM_ERROR = "PowerOffWaitBySystemError"
    BY_HOST = "PowerOffWaitByHost"
    BY_WATCHDOG = "PowerOffWaitByWatchdog"
    BY_OVER_TIME = "PowerOffWaitByOverTime"
    BY_NO_COMMUNICATION = "PowerOffWaitByNoCommunication"
    POWER_OFF_FINISHED = "PowerOffFinished"


POWER_ON_TRIGGER: Final = "PowerOnTrigger"
"""Event that devices in the field send for `PowerOn` (DECISION R7)."""


@dataclass(frozen=True, slots=True)
class Ok:
    """Reply `OK:name`: the command was executed."""

    name: str

    def encode(self) -> bytes:
        """Write the line with its LF."""
        return b"OK:%b\n" % self.name.encode("latin-1")


@dataclass(frozen=True, slots=True)
class Refusal:
    """Reply `ER:reason` of an RRC wheelchair controller: a command was refused.

    The reason is the name of the refused command, or one of the constants `COMMAND_CHECKSUM`,
    `COMMAND_UNKNOWN` and `RECEIVE_BUFFER_OVERFLOW` of this module.
    """

    reason: str

    def encode(self) -> bytes:
        """Write the line with its LF."""
        return b"ER:%b\n" % self.reason.encode("latin-1")


@dataclass(frozen=True, slots=True)
class Event:
    """Line `EV:name` of an RRC wheelchair controller: a state has changed.

    It is the state of the RRC or of the wheelchair (VR2). Newer firmware may send names that the
    manual does not list.
    """

    name: str

    @property
    def kind(self) -> RrcEvent | None:
        """The event of the manual, or None if the manual does not list it."""
        if self.name == POWER_ON_TRIGGER:
            return RrcEvent.POWER_ON
        try:
            return RrcEvent(self.name)
        except ValueError:
            return None

    def encode(self) -> bytes:
        """Write the line with its LF."""
        return b"EV:%b\n" % self.name.encode("latin-1")


@dataclass(frozen=True, slots=True)
class StatusA:
    """Status line `SA:` with the state of RRC and VR2, once a period of 10 ms.

    Attributes:
        in_v_pct: field #1, translation of the stick, -100..100 %.
        in_w_pct: field #2, rotation of the stick, -100..100 %.
        out_v_pct: field #3, translation sent to the power module.
        out_w_pct: field #4, rotation sent to the power module.
        gauge: field #5, voltage gauge, 1..10.
        speed_mode: field #6, speed mode, 1..5.
        speed_up_count: field #7, counter of the speed-up button, 0..15, which is odd while the
            button is pressed.
        speed_down_count: field #8, counter of the speed-down button, 0..15, which is odd while the
            button is pressed.
        alarm_count: field #9, counter of the alarm button, 0..15, which is odd while the button is
            pressed.
    """

    in_v_pct: int
    in_w_pct: int
    out_v_pct: int
    out_w_pct: int
    gauge: int
    speed_mode: int
    speed_up_count: int
    speed_down_count: int
    alarm_count: int

    @staticmethod
    def line(
        stick_pct: tuple[int, int],
        out_pct: tuple[int, int],
        gauge: int,
        speed_mode: int,
        counts: tuple[int, int, int],
    ) -> bytes:
        r"""Return the status line (SA) of an RRC wheelchair controller with the given values.

        It ends with the checksum digit CHECK and LF.

        Args:
            stick_pct: fields #1 and #2 of the line, translation and rotation of the stick.
            out_pct: fields #3 and #4, translation and rotation for the motors.
            gauge: field #5, level of the battery gauge.
            speed_mode: field #6, speed mode.
            counts: fields #7, #8 and #9, counters of the buttons.

        >>> StatusA.line((100, 0), (50, 0), 10, 1, (0, 0, 0))
        b'SA:64003200A1000F\n'
        """
        # SA:64003200A1000F: numbers in two's complement with two digits (FF = -1, 9C = -100), then
        # five nibbles and CHECK. SA has its CHECK in every mode; EV, OK and ER have no CHECK.
        percentages = (stick_pct[0] & 0xFF) << 24 | (stick_pct[1] & 0xFF) << 16
        percentages |= (out_pct[0] & 0xFF) << 8 | out_pct[1] & 0xFF
        nibbles = gauge << 16 | speed_mode << 12 | counts[0] << 8 | counts[1] << 4 | counts[2]
        message = b"SA:%013X" % (percentages << 20 | nibbles)  # one number is formatted, not nine
        return message + check_digit(message) + b"\n"

    def encode(self) -> bytes:
        """Write the line with CHECK and LF."""
        return StatusA.line(
            (self.in_v_pct, self.in_w_pct),
            (self.out_v_pct, self.out_w_pct),
            self.gauge,
            self.speed_mode,
            (self.speed_up_count, self.speed_down_count, self.alarm_count),
        )


@dataclass(frozen=True, slots=True)
class Text:
    """Any other line of an RRC wheelchair controller: the answer to `device`, `version` or `date`.

    A line of newer firmware that is unknown here is also a `Text`.
    """

    text: str

    def encode(self) -> bytes:
        """Write the line with its LF."""
        return self.text.encode("latin-1") + b"\n"


Reply = Ok | Refusal | Event | StatusA | Text

_BY_PREFIX: Final[dict[bytes, type[Ok] | type[Refusal] | type[Event]]] = {
    b"OK:": Ok,
    b"ER:": Refusal,
    b"EV:": Event,
}


def parse_reply(line: bytes) -> Reply:
    """Parse a line that an RRC wheelchair controller has sent, without its LF.

    Raises:
        FramingError: an SA line has a wrong length.
        ChecksumError: the CHECK of an SA line does not match.
        FieldError: an SA line has a bad digit or a value out of range.
    """
    prefix = line[:3]
    if prefix == b"SA:":
        return _parse_status(line)
    kind = _BY_PREFIX.get(prefix)
    return Text(line.decode("latin-1")) if kind is None else kind(line[3:].decode("latin-1"))


def _parse_status(line: bytes) -> StatusA:
    # "SA:", 8 digits of percentages, 5 nibbles, CHECK.
    if len(line) != 17:
        raise FramingError(f"{line!r} has {len(line)} characters, an SA line has 17")
    message = strip_check(line)
    v_in, w_in, v_out, w_out = (read_signed(message[at : at + 2]) for at in (3, 5, 7, 9))
    gauge, mode, up, down, alarm = (read_hex(message[at : at + 1]) for at in range(11, 16))
    sound = max(map(abs, (v_in, w_in, v_out, w_out))) <= 100 and 1 <= gauge <= 10 and 1 <= mode <= 5
    if not sound:
        raise FieldError(f"{line!r}: a percentage, the gauge or the speed mode is out of range")
    return StatusA(v_in, w_in, v_out, w_out, gauge, mode, up, down, alarm)
