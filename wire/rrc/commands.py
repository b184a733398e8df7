r"""Commands from the host to the RRC (RRC manual, list of commands host to RRC).

>>> Output(v_pct=30, w_pct=-1).encode()
b'output1eff\n'
>>> Output(v_pct=30, w_pct=0).encode(check=True)
b'output1e007\n'
>>> parse_command(b"statusA1")
Status(on=1)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import ClassVar, Final

from tickrig.wire.errors import FieldError, FramingError
from tickrig.wire.rrc.message import all_digits, check_digit, read_hex, read_signed


class Parameter:
    """Describes one parameter of an RRC command: its number of hex digits and its allowed values.

    Attributes:
        width: number of hex digits, 1 or 2.
        low: smallest value. A value below 0 is written in two's complement.
        high: largest value.
        values: mapping from hex digits (as bytes) to the value of these digits. Only allowed values
            are in the mapping. The hex digits can be in upper, lower or mixed case.
    """

    __slots__ = ("high", "low", "values", "width")

    def __init__(self, width: int, low: int, high: int) -> None:
        self.width, self.low, self.high = width, low, high
        read = read_signed if low < 0 else read_hex
        numbers = {digits: read(digits) for digits in all_digits(width)}
        self.values = {d: value for d, value in numbers.items() if low <= value <= high}

    def read(self, digits: bytes) -> int:
        """Return the value of hex digits; raise FieldError for a bad digit or value."""
        value = self.values.get(digits)
        if value is None:
            return self.checked(read_signed(digits) if self.low < 0 else read_hex(digits))
        return value

    def write(self, value: int) -> bytes:
        """Return a value as hex digits in lower case, as in the samples of the manual."""
        return b"%0*x" % (self.width, value & 0xFF)

    def checked(self, value: int) -> int:
        """Return the value; raise FieldError if it is out of range."""
        if not self.low <= value <= self.high:
            raise FieldError(f"{value} is not in {self.low}..{self.high}")
        return value


_PERCENT: Final = Parameter(2, 0, 100)
_SIGNED_PERCENT: Final = Parameter(2, -100, 100)
_BYTE: Final = Parameter(2, 0, 255)
_ANGLE: Final = Parameter(2, 0, 90)
_NIBBLE: Final = Parameter(1, 0, 15)
_FLAG: Final = Parameter(1, 0, 1)
_SPEED_MODE: Final = Parameter(1, 1, 5)
_REVERSE_MODE: Final = Parameter(1, 0, 3)


class UnknownCommand(FramingError):  # noqa: N818 - the manual's word: CommandUnknown
    """No command has this name."""


class BadParameters(FieldError):  # noqa: N818 - what came
    """Error in a received line: the command is known, but its parameters are invalid.

    The number of digits is wrong, a digit is not hexadecimal, or a value is not allowed.

    Attributes:
        name: name of the command.
    """

    def __init__(self, name: bytes, reason: str) -> None:
        super().__init__(f"{name.decode()}: {reason}")
        self.name = name


@dataclass(frozen=True, slots=True)
class Command:
    """Base of all commands: a name, and parameters of fixed width."""

    name: ClassVar[bytes]
    literal: ClassVar[bytes] = b""  # what stands between the name and the parameters
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    size: ClassVar[int] = 0  # characters behind the name

    def __init_subclass__(cls) -> None:
        """Compute the length of the parameters."""
        widths: int = sum(p.width for p in cls.parameters)
        cls.size = len(cls.literal) + widths

    def __post_init__(self) -> None:
        """Raise BadParameters for the first value that does not fit."""
        values = self.values()
        if len(values) != len(self.parameters):
            raise BadParameters(self.name, f"{len(values)} values, not {len(self.parameters)}")
        try:
            for number, value in enumerate(values):
                self.parameters[number].checked(value)
        except FieldError as error:
            raise BadParameters(self.name, f"#{number + 1} {error}") from error

    def values(self) -> tuple[int, ...]:
        """Return the parameters #1, #2, ... in order."""
        names: tuple[str, ...] = self.__match_args__
        return tuple([getattr(self, name) for name in names])

    def encode(self, *, check: bool = False) -> bytes:
        """Return the line that sends this command, with its LF.

        Args:
            check: whether to add the checksum digit CHECK, which the mode `stablemode` requires.
        """
        digits = [p.write(v) for p, v in zip(self.parameters, self.values(), strict=True)]
        message = self.name + self.literal + b"".join(digits)
        return message + (check_digit(message) if check else b"") + b"\n"


@dataclass(frozen=True, slots=True)
class Limit(Command):
    """Command `limit` of an RRC wheelchair controller: drive by the stick, but with limits.

    The limits apply to the translation v and the rotation w.

    Attributes:
        v_pct: parameter #1, translation input limit, 0..100 %.
        w_pct: parameter #2, rotation input limit, 0..100 %.
        sum_pct: parameter #3, limit of |v| + |w|, 0..255 %.
        product_pct: parameter #4, limit of |v| * |w| / 100, 0..255 %.
        radius_pct: parameter #5, limit of the root of v² + w², 0..255 %.
    """

    name = b"limit"
    parameters = (_PERCENT, _PERCENT, _BYTE, _BYTE, _BYTE)

    v_pct: int
    w_pct: int
    sum_pct: int = 255
    product_pct: int = 255
    radius_pct: int = 255


@dataclass(frozen=True, slots=True)
class Output(Command):
    """Drive by the host: translation (forward) and rotation (right), -100..100 %."""

    name = b"output"
    parameters = (_SIGNED_PERCENT, _SIGNED_PERCENT)

    v_pct: int
    w_pct: int


@dataclass(frozen=True, slots=True)
class DeviceName(Command):
    """Request the device name."""

    name = b"device"


@dataclass(frozen=True, slots=True)
class Version(Command):
    """Request the version."""

    name = b"version"


@dataclass(frozen=True, slots=True)
class Date(Command):
    """Request the date and time of compilation."""

    name = b"date"


@dataclass(frozen=True, slots=True)
class SpeedMode(Command):
    """Command `speedmode` of an RRC wheelchair controller: choose the speed mode, 1 (slowest) to 5.

    `locked` = 1 locks the speed buttons of the wheelchair.
    """

    name = b"speedmode"
    parameters = (_SPEED_MODE, _FLAG)

    mode: int
    locked: int = 0


@dataclass(frozen=True, slots=True)
class Joystick(Command):
    """Shape the stick. The defaults are those of the emulator (DECISION R15).

    Attributes:
        v_low_pct: parameter #1, translation that counts as 0, which is below `v_high_pct`.
        w_low_pct: parameter #2, rotation that counts as 0, which is below `w_high_pct`.
        v_high_pct: parameter #3, translation that counts as 100.
        w_high_pct: parameter #4, rotation that counts as 100.
        v_exponent: parameter #5, exponent of translation, 0..15: output = input ^ (1 + 0.1 * #5).
        w_exponent: parameter #6, exponent of rotation, 0..15.
        reverse_mode: parameter #7, reverse mode: 0 plain, 1 no backing, 2 gear change, 3 gear
            change reversed.
        neutral_pct: parameter #8, neutral radius, 0..100 %. If #7 is 0 or 1, any byte is allowed
            (DECISION R14).
        switch_deg: parameter #9, threshold between backward and forward gear, 0..90 from straight
            back. If #7 is 0 or 1, any byte is allowed.
        fade_deg: parameter #10, angle at which the backward gear starts to fade, 0..90 from
            straight back. If #7 is 0 or 1, any byte is allowed.
    """

    name = b"joystick"
    parameters = (*[_PERCENT] * 4, _NIBBLE, _NIBBLE, _REVERSE_MODE, _BYTE, _BYTE, _BYTE)
    gear_parameters: ClassVar[tuple[Parameter, ...]] = (
        _PERCENT,
        _ANGLE,
        _ANGLE,
    )  # of a gear change

    v_low_pct: int = 0
    w_low_pct: int = 0
    v_high_pct: int = 100
    w_high_pct: int = 100
    v_exponent: int = 0
    w_exponent: int = 0
    reverse_mode: int = 0
    neutral_pct: int = 5
    switch_deg: int = 30
    fade_deg: int = 45

    def __post_init__(self) -> None:
        """Refuse a reversed dead zone, and #8 to #10 that no gear change can use."""
        Command.__post_init__(self)
        try:
            for number, parameter in enumerate(self.gear_parameters, 8):
                if self.reverse_mode > 1:
                    parameter.checked(self.values()[number - 1])
        except FieldError as error:
            raise BadParameters(self.name, f"#{number} {error}") from error
        if self.v_low_pct >= self.v_high_pct or self.w_low_pct >= self.w_high_pct:
            raise BadParameters(self.name, "lower dead zone is not below the upper one")

    def after(self, former: Joystick) -> Joystick:
        """Return the joystick settings that apply after this command.

        If one of the parameters #8 to #10 (`neutral_pct`, `switch_deg` and `fade_deg`) is out of
        range, this parameter keeps its former value (DECISION R14).

        Args:
            former: settings before the command.

        >>> Joystick(neutral_pct=255, switch_deg=20).after(Joystick(neutral_pct=7)).values()[7:]
        (7, 20, 45)
        """
        taken = [
            new if new <= parameter.high else old
            for parameter, new, old in zip(
                self.gear_parameters, self.values()[7:], former.values()[7:], strict=True
            )
        ]
        return Joystick(*self.values()[:7], *taken)


@dataclass(frozen=True, slots=True)
class Watchdog(Command):
    """Command `watchdog` of an RRC: stop the wheelchair if no correct command arrives for a time.

    The time is 0..255 x 10 ms. 0 switches the watchdog off.
    """

    name = b"watchdog"
    parameters = (_BYTE,)

    time_10ms: int


@dataclass(frozen=True, slots=True)
class StableMode(Command):
    """Switch stablemode: each line needs CHECK, and there are no OK lines."""

    name = b"stablemode"
    parameters = (_FLAG,)

    on: int


@dataclass(frozen=True, slots=True)
class Status(Command):
    """Command `status` of an RRC wheelchair controller: switch the periodic status lines on or off.

    Type A (SA lines) is the only type of status line in version 1.0.
    """

    name = b"status"
    literal = b"A"
    parameters = (_FLAG,)

    on: int


@dataclass(frozen=True, slots=True)
class PowerOff(Command):
    """Force VR2 to stop."""

    name = b"poweroff"


@dataclass(frozen=True, slots=True)
class Beep(Command):
    """Command `beep` of an RRC wheelchair controller: sound the buzzer in a given pattern.

    The pattern has five pairs of on and off times, 0..255 x 10 ms each.
    """

    name = b"beep"
    parameters = (_BYTE,) * 10

    times_10ms: tuple[int, ...]

    def values(self) -> tuple[int, ...]:
        """Return the ten times."""
        return self.times_10ms


COMMANDS: Final[dict[bytes, type[Command]]] = {
    kind.name: kind
    for kind in (
        *(Limit, Output, DeviceName, Version, Date, SpeedMode),
        *(Joystick, Watchdog, StableMode, Status, PowerOff, Beep),
    )
}

_NAME: Final = re.compile(b"|".join(COMMANDS))  # no name is a prefix of another


def parse_command(message: bytes) -> Command:
    """Parse a command line for an RRC wheelchair controller.

    Args:
        message: line without its line end and without its checksum digit CHECK.

    Raises:
        UnknownCommand: the name is unknown. Names are lower case.
        BadParameters: the number of digits is wrong, a digit is bad, or a value is out of range.
    """
    # First the name is checked, then the count of characters, then digits, then ranges (R11). So
    # `limit 6464ffffff` is ER:limit and `Limit6464ffffff` is ER:CommandUnknown.
    match = _NAME.match(message)
    if match is None:
        raise UnknownCommand(f"{message!r} is not one of {', '.join(n.decode() for n in COMMANDS)}")
    name = match[0]
    size, fields = _PLACES.get(name, _NOWHERE)
    if size == len(message):
        command = _read_fields(COMMANDS[name], fields, message)
        if command is not None:
            return command
    kind = COMMANDS[name]
    values = _read_parameters(kind, message[len(name) :])
    return Beep(values) if kind is Beep else kind(*values)


# The short way of a line without a fault: its values are those of a table, so no check is repeated.

_Field = tuple[str, int, int, dict[bytes, int]]


def _fields_of(kind: type[Command]) -> tuple[_Field, ...]:
    """Return name, begin, end and values of each parameter of a kind."""
    names: tuple[str, ...] = kind.__match_args__
    fields, at = list[_Field](), len(kind.name)
    for name, parameter in zip(names, kind.parameters, strict=True):
        fields.append((name, at, at + parameter.width, parameter.values))
        at += parameter.width
    return tuple(fields)


_PLACES: Final = {
    kind.name: (len(kind.name) + kind.size, _fields_of(kind))
    for kind in COMMANDS.values()
    if kind not in (Beep, Joystick, Status)  # they have more than independent numbers
}
"""The length of the line and its parameters, by name."""

_NOWHERE: Final[tuple[int, tuple[_Field, ...]]] = (0, ())
_new, _set = object.__new__, object.__setattr__


def _read_fields(kind: type[Command], fields: tuple[_Field, ...], message: bytes) -> Command | None:
    """Return a command of this kind, or None if a parameter is not in its table."""
    command = _new(kind)
    for name, begin, end, values in fields:
        value = values.get(message[begin:end])
        if value is None:
            return None
        _set(command, name, value)
    return command


def _read_parameters(kind: type[Command], text: bytes) -> tuple[int, ...]:
    """Split the text after the name into parameters; raise BadParameters if it does not fit."""
    at = len(kind.literal)
    size = kind.size
    if len(text) != size or not text.startswith(kind.literal):
        raise BadParameters(kind.name, f"{text!r} is not {size} characters of its grammar")
    values: list[int] = []
    try:
        for parameter in kind.parameters:
            values.append(parameter.read(text[at : at + parameter.width]))
            at += parameter.width
    except FieldError as error:
        raise BadParameters(kind.name, f"#{len(values) + 1} {error}") from error
    return tuple(values)
