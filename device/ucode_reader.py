"""An infra-red reader of ucodes on a serial line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, hypot, isfinite, radians, remainder, tau
from typing import ClassVar, Final

from tickrig.device.body import Pose
from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.twin import Copyable, Immutable
from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER
from tickrig.wire.lines import LineSplitter
from tickrig.wire.ucode import MAX_LEVEL, ROUNDS, LineType, UcodeLine, parse_ucode

# Parameters of a reader. The source names no product; these are choices.


@dataclass(frozen=True, slots=True, kw_only=True)
class ReaderParameters(Immutable):
    """Range and angle of reception of an infra-red reader for ucodes (128-bit identifiers).

    Attributes:
        range_m: range at which the reader receives a marker, 0.1..99 m.
        cone_deg: full angle of reception around the heading of the reader, 1..360 degrees.

    Raises:
        ValueError: a value is out of range.
    """

    range_m: float = 3.0
    cone_deg: int = 90

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range."""
        if not 0.1 <= self.range_m <= 99:
            raise ValueError(f"range_m {self.range_m} is not in 0.1..99 m")
        if not 1 <= self.cone_deg <= 360:
            raise ValueError(f"cone_deg {self.cone_deg} is not in 1..360 degrees")


# Infra-red markers in the environment, and their reception by a reader.


@dataclass(frozen=True, slots=True)
class Marker(Immutable):
    """An infra-red marker on a flat floor, which sends its ucode in all directions.

    Attributes:
        ucode: ucode of 128 bits, as 32 hex digits in capitals.
        x_m: position in x, in metres.
        y_m: position in y, in metres. The y axis points to the left if you look along the x axis.

    Raises:
        ValueError: the ucode or the position is invalid.
    """

    ucode: str
    x_m: float
    y_m: float

    def __post_init__(self) -> None:
        """Raise ValueError if ucode or position is invalid."""
        if not (isfinite(self.x_m) and isfinite(self.y_m)):
            raise ValueError(f"a marker has a place, got {self.x_m}, {self.y_m}")
        if parse_ucode(self.ucode) != self.ucode:
            raise FieldError(f"ucode {self.ucode!r} is not written in capitals")


@dataclass(frozen=True, slots=True)
class Reception(Immutable):
    """A ucode that a reader has received, with its signal level.

    Attributes:
        ucode: the received ucode.
        level: signal level, which is 100 % at the reader and falls to 1 % at the end of the range.
    """

    ucode: str
    level: int


def receive(
    markers: Sequence[Marker], pose: Pose, parameters: ReaderParameters, share: float = 1.0
) -> tuple[Reception, ...]:
    """Return what a reader receives from the markers around it, with the nearest marker first.

    Walls, reflections, and markers that disturb one another are not emulated. Therefore a reader
    also receives markers behind a wall.

    Args:
        markers: the sending markers.
        pose: position and heading of the reader.
        parameters: range and cone of the reader.
        share: share of the range that remains, for example behind a dirty window, 0..1.
    """
    range_m, half_rad = parameters.range_m * share, radians(parameters.cone_deg) / 2
    found = []
    for marker in markers:
        dx, dy = marker.x_m - pose.x_m, marker.y_m - pose.y_m
        away_m = hypot(dx, dy)
        off_rad = abs(remainder(atan2(dy, dx) - pose.heading_rad, tau)) if away_m else 0.0
        if away_m <= range_m and off_rad <= half_rad:
            level = max(1, round(MAX_LEVEL * (1 - away_m / parameters.range_m)))
            found.append((away_m, marker.ucode, Reception(marker.ucode, level)))
    return tuple(reception for _, _, reception in sorted(found, key=lambda item: item[:2]))


# Physical inputs and outputs of a reader: place, disturbances and faults.

_FAR_M: Final = 10_000
_MOST_MARKERS: Final = 1_000

INPUTS: Final = (
    InputSignal("x_m", "place of the reader", low=-_FAR_M, high=_FAR_M, unit="m", real=True),
    InputSignal(
        "y_m", "place of it, to the left of x", low=-_FAR_M, high=_FAR_M, unit="m", real=True
    ),
    InputSignal("heading_rad", "where it looks", low=-1e6, high=1e6, unit="rad", real=True),
    InputSignal("dark_marker", "the marker without supply, from 1; 0 if none", high=_MOST_MARKERS),
    InputSignal("dirty_window", "dust: half of the range is left", SignalType.FAULT),
    InputSignal("sunlight", "light that drowns all markers", SignalType.FAULT),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

_GROUPS: Final = {"pose": ("x_m", "y_m", "heading_rad")}

OUTPUTS: Final = (
    OutputSignal("listening", "1 while it listens"),
    OutputSignal("in_view", "markers in range now"),
    OutputSignal("received", "markers received in the latest round"),
    OutputSignal("rounds", "rounds since power-up"),
    OutputSignal("refused", "lines that are not commands, since power-up"),
)


_TICK_US: Final = 1_000
_BOOT_US: Final = 200_000
"""Time from power-up to the first line. Bytes that are received before are lost."""

_ROUND_US: Final = 100_000
MOST_RECEIVED: Final = 6
"""Largest number of markers in a round, whose lines fit into the round at 38400 bit/s."""

_VERSION: Final = 1
_DIRTY_SHARE: Final = 0.5


class UcodeReader(Copyable):
    """A reader of ucodes; a `Device[bytes]`.

    The reader receives in rounds of 100 ms. At the end of each round it sends a line for each
    received marker, with the nearest marker first and at most six lines. Then it sends a line that
    ends the round. The pose of the reader at the end of the round applies.

    The report (3.4.43.3 (4), Fig. 123) shows the reader but no protocol. The lines and all numbers
    are our choice.

    Not emulated: walls, markers that disturb one another, bits of the light.

    Args:
        parameters: parameters of the reader.
        markers: markers in the environment of the reader, at most 1000.

    Attributes:
        type_name: name of the device type, for traces.
        inputs: physical inputs; see `INPUTS`.
        markers: markers in the environment of the reader. Changes apply from the next round.
    """

    type_name: ClassVar[str] = "ucode-reader"

    def __init__(
        self, parameters: ReaderParameters | None = None, markers: tuple[Marker, ...] = ()
    ) -> None:
        self.parameters, self.markers = parameters or ReaderParameters(), markers
        self.inputs = QuantityBank(INPUTS, _GROUPS, self._input_set)
        self._lines = LineSplitter(64)
        self._on, self._restarted, self._switched = True, True, False
        self._power_up(0)

    @property
    def tick_us(self) -> int:
        """Resolution of the reader's time."""
        return _TICK_US

    @property
    def due_us(self) -> int:
        """The time of the next event without input."""
        return 0 if self._restarted or self._switched else self._due_us

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return _OUTPUTS

    @property
    def pose(self) -> Pose:
        """Pose of the reader."""
        return Pose(*(self.inputs[name] for name in _GROUPS["pose"]))

    @property
    def in_view(self) -> tuple[Reception, ...]:
        """The markers in range now."""
        if not self._on or self.inputs["sunlight"]:
            return ()
        dark = self.inputs["dark_marker"]
        senders = [marker for number, marker in enumerate(self.markers, 1) if number != dark]
        share = _DIRTY_SHARE if self.inputs["dirty_window"] else 1.0
        return receive(senders, self.pose, self.parameters, share)

    def reset(self) -> None:
        """Restore the state after power-up."""
        self._restarted = True

    def read(self, name: str, /) -> int | float:
        """Return the present value of a physical output.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return _READ[name](self)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Run one tick of the reader: receive bytes from the host, answer, and report ucodes.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: bytes that have arrived since the latest tick.

        Returns:
            The bytes that the reader sends in this tick.
        """
        if self.inputs.changed:
            self._inputs_changed()
        if self._restarted:
            self._power_up(now_us)
        if not self._on:
            return b""
        sent = b""
        if self._booting:
            if now_us < self._due_us:
                return b""
            sent = self._begin(now_us)
        elif self._due_us <= now_us:
            sent = self._end_round()
        for line in self._lines.push(rx.replace(b"\r", b"\n")):
            sent += self._obey(now_us, line) if line else b""
        return sent

    def _input_set(self) -> None:
        self._switched = bool(self.inputs["power_cut"]) == self._on

    def _inputs_changed(self) -> None:
        self.inputs.changed = self._switched = False
        on = not self.inputs["power_cut"]
        if on != self._on:
            self._on, self._restarted = on, True

    def _power_up(self, now_us: int) -> None:
        self._restarted, self._booting, self._listening = False, True, False
        self._due_us = now_us + _BOOT_US if self._on else NEVER
        self._round = self._rounds = self._refused = self._received = 0
        self._lines.clear()

    def _begin(self, now_us: int) -> bytes:
        """Send the identification after booting, and start to receive."""
        self._booting = False
        self._listen(now_us)
        return self._identification()

    def _listen(self, now_us: int) -> None:
        self._listening, self._due_us = True, now_us + _ROUND_US

    def _identification(self) -> bytes:
        reader = self.parameters
        fields = (_VERSION, round(reader.range_m * 1_000), reader.cone_deg, int(self._listening))
        return UcodeLine(LineType.READER, fields).encode()

    def _end_round(self) -> bytes:
        number, self._round = self._round, (self._round + 1) % ROUNDS
        self._due_us += _ROUND_US
        self._rounds += 1
        received = self.in_view[:MOST_RECEIVED]
        self._received = len(received)
        if self.inputs["sunlight"]:
            return UcodeLine(LineType.LIGHT, (number,)).encode()
        lines = [UcodeLine(LineType.UCODE, (number, each.ucode, each.level)) for each in received]
        lines.append(UcodeLine(LineType.ROUND, (number, len(received))))
        return b"".join(line.encode() for line in lines)

    def _obey(self, now_us: int, line: bytes) -> bytes:
        match line:
            case b"ID":
                return self._identification()
            case b"ON" if not self._listening:
                self._listen(now_us)
            case b"ON":
                pass
            case b"OFF":
                self._listening, self._due_us, self._received = False, NEVER, 0
            case _:
                self._refused += 1
                return UcodeLine(LineType.REFUSED, ()).encode()
        return self._identification()


_OUTPUTS: Final = {output.name: output for output in OUTPUTS}

_READ: Final[Mapping[str, Callable[[UcodeReader], int]]] = {
    "listening": lambda reader: int(reader._listening),
    "in_view": lambda reader: len(reader.in_view),
    "received": lambda reader: reader._received,
    "rounds": lambda reader: reader._rounds,
    "refused": lambda reader: reader._refused,
}
