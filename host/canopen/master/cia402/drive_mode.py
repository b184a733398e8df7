"""Modes of operation with their set-points and handshakes (CiA 402-2)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from tickrig.host.canopen.dialogue import Script
from tickrig.host.text.names import near
from tickrig.wire.canopen.drive import Controlword, Statusword

_START: Final = Controlword.START
"""Start bit of a mode: new set-point, start homing, or interpolate."""

_AT_ONCE: Final = Controlword.CHANGE_AT_ONCE


class ModeNumber(IntEnum):
    """Numbers of modes of operation (object 6060h)."""

    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10

    @classmethod
    def of(cls, mode: int | str) -> ModeNumber:
        """Find a mode by its number, or by its abbreviation such as `pp` (profile position).

        Raises:
            ValueError: there is no such mode.
        """
        if isinstance(mode, int) and mode in list(cls):
            return cls(mode)
        mode = str(mode)
        if mode not in _SHORT:
            raise ValueError(f"no mode {mode!r}; {near(mode, _SHORT)}")
        return _SHORT[mode]


_SHORT: Final[Mapping[str, ModeNumber]] = {
    "none": ModeNumber.NONE,
    "pp": ModeNumber.PROFILE_POSITION,
    "vl": ModeNumber.VELOCITY,
    "pv": ModeNumber.PROFILE_VELOCITY,
    "tq": ModeNumber.PROFILE_TORQUE,
    "hm": ModeNumber.HOMING,
    "ip": ModeNumber.INTERPOLATED_POSITION,
    "csp": ModeNumber.CYCLIC_POSITION,
    "csv": ModeNumber.CYCLIC_VELOCITY,
    "cst": ModeNumber.CYCLIC_TORQUE,
}


@dataclass(frozen=True, slots=True)
class DriveObject:
    """Object of the drive profile CiA 402, such as the target position, with its size and sign.

    Attributes:
        index: index of the object for the first axis of the device. For each further axis, the
            index is 800h higher.
        size: size of the value in bytes.
        sub: sub-index of the object.
        signed: whether the data type of the object is a signed INTEGER.
    """

    index: int
    size: int
    sub: int = 0
    signed: bool = True

    @property
    def lowest(self) -> int:
        """The smallest value."""
        return -(1 << 8 * self.size - 1) if self.signed else 0

    @property
    def highest(self) -> int:
        """The largest value."""
        return (1 << 8 * self.size - self.signed) - 1

    def value_of(self, bits: int) -> int:
        """Return the value of raw bits."""
        return bits - (1 << 8 * self.size) if bits > self.highest else bits

    def bits_of(self, value: int) -> int:
        """Return the raw bits of a value."""
        return value & (1 << 8 * self.size) - 1


_Write = Callable[[DriveObject, int], Script[None]]


class DriveMode:
    """Base class of the modes of operation: how a mode writes its target in each period.

    Attributes:
        controlword: bits of the controlword (6040h) that depend on the mode.
    """

    def __init__(self) -> None:
        self.controlword = 0

    def begin(self) -> None:
        """Clear the set-point, as after a selection of the mode."""

    def set_target(self, value: float) -> None:
        """Set the target, in units of the device, that is written to the drive in the next period.

        Raises:
            ValueError: this mode has no target.
        """
        raise ValueError("this mode has no target")

    def read(self, statusword: int) -> None:
        """Process the statusword of this period."""

    def write(self, write: _Write) -> Script[bool]:
        """Write the target to the drive. Return False if there is none, so that the drive halts."""
        yield from ()
        return False


class _TargetMode(DriveMode):
    """Mode that writes its target in each period.

    Args:
        target: object of the target.
        bits: bits of the controlword that are set while there is a target.
    """

    def __init__(self, target: DriveObject, bits: int = 0) -> None:
        super().__init__()
        self._object, self._bits = target, bits
        self._target: int | None = None

    def begin(self) -> None:
        """Clear the target."""
        self._target = None

    def set_target(self, value: float) -> None:
        """Set the target in units of the device. A value outside the object's range is limited.

        Raises:
            ValueError: the value is infinite or NaN.
        """
        if not math.isfinite(value):
            raise ValueError(f"{value} is not a target")
        self._target = max(self._object.lowest, min(int(value), self._object.highest))

    def write(self, write: _Write) -> Script[bool]:
        """Write the target, if there is one."""
        if self._target is None:
            self.controlword &= ~self._bits
            return False
        self.controlword |= self._bits
        yield from write(self._object, self._target)
        return True


class _ProfilePositionMode(_TargetMode):
    """Mode that writes each new target once, with the handshake of bits 4 and 12."""

    def begin(self) -> None:
        """Clear the current and the pending target."""
        super().begin()
        self._given: int | None = None
        self._acknowledged = False

    def read(self, statusword: int) -> None:
        """Check for the acknowledge."""
        self._acknowledged = bool(statusword & Statusword.MODE_12)

    def write(self, write: _Write) -> Script[bool]:
        """Write a new target, and set bit 4 of the controlword until the drive acknowledges it."""
        self.controlword |= _AT_ONCE
        if self._target is None:
            return False
        if self._acknowledged:
            self.controlword &= ~_START
        elif self._target != self._given:
            if self.controlword & _START:
                self.controlword &= ~_START
            else:
                yield from write(self._object, self._target)
                self.controlword |= _START
                self._given = self._target
        return True


class HomingMode(DriveMode):
    """Homing mode (CiA 402). Bit 4 of the controlword starts homing.

    Bits 10, 12 and 13 of the statusword report the progress.

    Attributes:
        runs: whether homing is requested.
        status: last values of bits 10, 12 and 13 of the statusword.
    """

    MASK: Final = Statusword.TARGET_REACHED | Statusword.MODE_12 | Statusword.MODE_13

    def begin(self) -> None:
        """Stop homing."""
        self.runs, self.status = False, 0

    def read(self, statusword: int) -> None:
        """Process the bits of homing in the statusword."""
        self.status = statusword & self.MASK

    def write(self, write: _Write) -> Script[bool]:
        """Set bit 4 while homing should run."""
        self.controlword = int(_START) if self.runs else 0
        yield from ()
        return self.runs


_POSITION: Final = DriveObject(0x607A, 4)
_SPEED: Final = DriveObject(0x60FF, 4)
_TORQUE: Final = DriveObject(0x6071, 2)
_FREQUENCY: Final = DriveObject(0x6042, 2)
_INTERPOLATED: Final = DriveObject(0x60C1, 4, sub=1)

TARGETS: Final = (_POSITION, _SPEED, _TORQUE, _FREQUENCY, _INTERPOLATED)
"""Objects of the set-points of all modes."""

MODES: Final[Mapping[ModeNumber, Callable[[], DriveMode]]] = {
    ModeNumber.PROFILE_POSITION: lambda: _ProfilePositionMode(_POSITION),
    ModeNumber.VELOCITY: lambda: _TargetMode(_FREQUENCY, 0x70),
    ModeNumber.PROFILE_VELOCITY: lambda: _TargetMode(_SPEED),
    ModeNumber.PROFILE_TORQUE: lambda: _TargetMode(_TORQUE),
    ModeNumber.HOMING: HomingMode,
    ModeNumber.INTERPOLATED_POSITION: lambda: _TargetMode(_INTERPOLATED, _START),
    ModeNumber.CYCLIC_POSITION: lambda: _TargetMode(_POSITION),
    ModeNumber.CYCLIC_VELOCITY: lambda: _TargetMode(_SPEED),
    ModeNumber.CYCLIC_TORQUE: lambda: _TargetMode(_TORQUE),
}

POSITIONS: Final = (
    ModeNumber.PROFILE_POSITION,
    ModeNumber.INTERPOLATED_POSITION,
    ModeNumber.CYCLIC_POSITION,
)
SPEEDS: Final = (ModeNumber.VELOCITY, ModeNumber.PROFILE_VELOCITY, ModeNumber.CYCLIC_VELOCITY)
"""Modes whose targets are scaled. Torques go to the device without scaling."""
