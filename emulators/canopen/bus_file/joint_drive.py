"""The motor, gear and switches behind a CiA 402 node of a bus.yml."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from math import pi
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary, DictionaryDescription
from tickrig.device.canopen.ds402 import Ds402, indices
from tickrig.device.canopen.ds402.automaton import Bounds
from tickrig.device.canopen.ds402.axis import FAR_DEG
from tickrig.device.canopen.ds402.settings import Parameters, Settings, read_settings
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import CanopenSlave, ServiceMaker
from tickrig.device.servo.parameters import (
    PRESETS,
    Encoders,
    ServoParameters,
    free_speed_rad_s,
    of_size,
    peak_torque_nm,
)
from tickrig.device.servo.servo import Servo
from tickrig.emulators.canopen.eds import PROFILE_AREA, fitting
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.eds.object_table import EntryDescription

_MOTOR: Final = "epos-wheel"
UNITS: Final = 1_000.0
"""Position units per radian or metre: the default of ros2_canopen."""
_SPARE_SPEED: Final = 1.5
"""Ratio of the no-load speed of a chosen motor to the speed of its joint."""
_LOW_SUPPLY: Final = 0.4
_HIGH_SUPPLY: Final = 1.5
_NEARLY: Final = 0.99
"""Share of the motor's speed below which a limit is reported."""
_FINEST: Final = 100_000
"""Largest denominator of the initial factor group of a drive."""

_Defaults = Mapping[tuple[int, int], int]
"""Values by (index, sub-index)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointDrive:
    """The drive of a joint; values that are not given are None.

    Attributes:
        motor: name of the motor in `servo.presets.PRESETS`.
        gear_ratio: number of turns of the motor per turn of the shaft.
        gear_efficiency: share of the power of an external torque that the gear transmits.
        friction_nm: dry friction at the shaft.
        inertia_kg_m2: permanent inertia on the shaft, to which the loops are tuned.
        supply_v: supply voltage of the power stage.
        encoder_counts: number of quadrature counts per turn of the motor.
        max_torque: largest torque of the shaft for one second, in Nm, or in N for a carriage.
        max_velocity: largest velocity of the shaft, in rad/s, or in m/s for a carriage.
        lower, upper: positions of the limit switches, in rad, or in m for a carriage.
        home: range in which the home switch is pressed, in rad, or in m for a carriage.
        travel_m: travel of a carriage per turn of the shaft, or None if the joint turns.
        units: number of position units per radian or metre.
    """

    motor: str = _MOTOR
    gear_ratio: float | None = None
    gear_efficiency: float | None = None
    friction_nm: float | None = None
    inertia_kg_m2: float | None = None
    supply_v: float | None = None
    encoder_counts: int | None = None
    max_torque: float | None = None
    max_velocity: float | None = None
    lower: float | None = None
    upper: float | None = None
    home: tuple[float, float] | None = None
    travel_m: float | None = None
    units: float = UNITS

    @property
    def per_turn(self) -> float:
        """A turn of the shaft in rad or m."""
        return 2 * pi if self.travel_m is None else self.travel_m

    @property
    def servo(self) -> ServoParameters:
        """Parameters of the motor, the power stage and the gear of this joint's drive.

        The parameters come from the chosen preset, and are scaled to the torque and the speed of
        the joint.
        """
        servo = self._with_supply(PRESETS[self.motor])
        turn = self.per_turn / (2 * pi)
        ratio = self.gear_ratio
        if ratio is None and self.max_velocity:
            ratio = _ratio_for(servo, self.max_velocity / turn)
        if ratio is not None:
            servo = replace(servo, gear=replace(servo.gear, ratio=ratio))
        if self.gear_efficiency is not None:
            servo = replace(servo, gear=replace(servo.gear, efficiency=self.gear_efficiency))
        if self.max_torque:
            needed_nm = self.max_torque * turn / servo.gear.efficiency
            servo = of_size(servo, needed_nm / peak_torque_nm(servo))
        return self._with_load(servo)

    @property
    def start(self) -> dict[str, float]:
        """Physical inputs of the drive whose values differ from the usual values."""
        degrees = 360 / self.per_turn
        found = {"supply_v": self.servo.stage.supply_v}
        if self.lower is not None:
            found["negative_limit_at"] = self.lower * degrees
        if self.upper is not None:
            found["positive_limit_at"] = self.upper * degrees
        if self.home is not None:
            found["home_from"], found["home_to"] = (place * degrees for place in self.home)
        for name in found.keys() - {"supply_v"}:  # where no shaft ever is, a switch is nowhere
            found[name] = max(-FAR_DEG, min(found[name], FAR_DEG))
        return found

    @property
    def unit(self) -> str:
        """The unit of positions."""
        return "rad" if self.travel_m is None else "m"

    def about(self, dictionary: Dictionary) -> str:
        """Return a readable description of the drive with the objects of a dictionary."""
        servo, unit = self.servo, self.unit
        turn = self.per_turn / (2 * pi)
        torque = peak_torque_nm(servo) * servo.gear.efficiency / turn
        speed, limit = free_speed_rad_s(servo) * turn, self._settings(dictionary).max_velocity
        limit /= self._counts_per_unit
        words = [f"CiA 402, {self.motor}", f"gear {servo.gear.ratio:.4g}:1"]
        words.append(f"{torque:.3g} {'Nm' if unit == 'rad' else 'N'}")
        slower = limit < speed * _NEARLY
        words.append(f"{limit:.3g} {unit}/s of {speed:.3g}" if slower else f"{speed:.3g} {unit}/s")
        return ", ".join([*words, f"{self.units_of(dictionary):.6g} units a {unit}"])

    def units_of(self, dictionary: Dictionary) -> float:
        """Return the position units per radian or metre of the objects of a dictionary."""
        per_position = self._settings(dictionary).units.per_position
        return self._counts_per_unit / abs(per_position)

    @property
    def _counts_per_unit(self) -> float:
        """Counts of the encoder per radian or metre."""
        servo = self.servo
        return servo.encoders.counts_per_turn * servo.gear.ratio / self.per_turn

    def _settings(self, dictionary: Dictionary) -> Settings:
        parameters = Parameters(dictionary, self.defaults())
        return read_settings(parameters, self.servo.encoders.counts_per_turn)

    def defaults(self) -> _Defaults:
        """Return the defaults of objects that have no value in the EDS."""
        servo = self.servo
        speed = free_speed_rad_s(servo) / (2 * pi) * self.per_turn * self.units
        gear = Fraction(servo.gear.ratio).limit_denominator(_FINEST)
        feed = Fraction(self.per_turn * self.units).limit_denominator(_FINEST)
        rpm = free_speed_rad_s(servo) * servo.gear.ratio * 60 / (2 * pi)
        if self.max_velocity:
            rpm = self.max_velocity / self.per_turn * servo.gear.ratio * 60
        continuous_ma = max(1, round(servo.stage.continuous_a * 1_000))
        rated_nm = servo.stage.continuous_a * servo.motor.torque_constant_nm_a
        return {
            **indices.DEFAULTS,
            (indices.ENCODER_RESOLUTION, 1): servo.encoders.counts_per_turn,
            (indices.GEAR_RATIO, 1): gear.numerator,
            (indices.GEAR_RATIO, 2): gear.denominator,
            (indices.FEED_CONSTANT, 1): feed.numerator,
            (indices.FEED_CONSTANT, 2): feed.denominator,
            (indices.MAX_MOTOR_SPEED, 0): max(1, round(rpm)),
            (indices.RATED_CURRENT, 0): continuous_ma,
            (indices.RATED_TORQUE, 0): max(1, round(rated_nm * 1_000)),
            (indices.MAX_CURRENT, 0): round(servo.stage.peak_a * 1e6 / continuous_ma),
            (indices.PROFILE_VELOCITY, 0): _units(speed / 4),
            (indices.PROFILE_ACCELERATION, 0): _units(speed),
            (indices.PROFILE_DECELERATION, 0): _units(speed),
            (indices.QUICK_STOP_DECELERATION, 0): _units(4 * speed),
            (indices.HOMING_SPEEDS, 1): _units(speed / 20),
            (indices.HOMING_SPEEDS, 2): _units(speed / 200),
            (indices.HOMING_ACCELERATION, 0): _units(speed),
        }

    def application(self) -> ServiceMaker:
        """Return the factory of the drive, for `make_slave`."""
        supply_mv = self.servo.stage.supply_v * 1_000
        bounds = Bounds(supply_mv=(round(supply_mv * _LOW_SUPPLY), round(supply_mv * _HIGH_SUPPLY)))
        return partial(_make_drive, self.servo, self.defaults(), bounds)

    def _with_supply(self, servo: ServoParameters) -> ServoParameters:
        if self.supply_v is None:
            return servo
        low_v = self.supply_v * _LOW_SUPPLY
        return replace(
            servo, stage=replace(servo.stage, supply_v=self.supply_v, supply_min_v=low_v)
        )

    def _with_load(self, servo: ServoParameters) -> ServoParameters:
        """Return the servo with the given parameters."""
        gear, counts = servo.gear, self.encoder_counts
        if self.friction_nm is not None:
            gear = replace(gear, coulomb_nm=self.friction_nm)
        if self.inertia_kg_m2 is not None:
            gear = replace(gear, inertia_kg_m2=self.inertia_kg_m2)
        encoders = Encoders(counts) if counts else servo.encoders
        return replace(servo, gear=gear, encoders=encoders)


def _make_drive(
    servo: ServoParameters, defaults: _Defaults, bounds: Bounds, node: CanopenSlave, slot: int
) -> Ds402:
    drive = Ds402(node, slot, Servo(servo), defaults)
    drive.supervision.bounds = bounds
    return drive


def _ratio_for(servo: ServoParameters, speed_rad_s: float) -> float:
    """Return the gear ratio with which a motor reaches the speed of a joint."""
    return free_speed_rad_s(servo) * servo.gear.ratio / (_SPARE_SPEED * speed_rad_s)


def _units(value: float) -> int:
    return max(1, min(round(value), (1 << 32) - 2))


# The objects of a drive: those of its EDS with values, and those that its modes need.

NAMES: Final = {
    1: "pp",
    3: "pv",
    4: "tq",
    6: "hm",
    7: "ip",
    8: "csp",
    9: "csv",
    10: "cst",
}
"""Abbreviations of the modes of operation (CiA 402), by number in 6060h."""


_PROFILE: Final = (indices.PROFILE_ACCELERATION, indices.PROFILE_DECELERATION)
_ALWAYS: Final = (
    *(indices.CONTROLWORD, indices.STATUSWORD, indices.MODES_OF_OPERATION),
    *(indices.MODES_OF_OPERATION_DISPLAY, indices.POSITION_ACTUAL, indices.VELOCITY_ACTUAL),
    indices.SUPPORTED_MODES,
)
_FACTORS: Final = (indices.ENCODER_RESOLUTION, indices.GEAR_RATIO, indices.FEED_CONSTANT)
UNITS_OF_POSITION: Final = (*_FACTORS, indices.SI_UNIT_POSITION)
"""Objects that define the position units."""
_MODES: Final = indices.SUPPORTED_MODES
_TORQUE: Final = (indices.TARGET_TORQUE, indices.TORQUE_ACTUAL)
_NEEDED: Final = {
    1: (indices.TARGET_POSITION, indices.PROFILE_VELOCITY, *_PROFILE),
    3: (indices.TARGET_VELOCITY, *_PROFILE),
    4: (*_TORQUE, indices.TORQUE_SLOPE),
    6: (
        *(indices.HOME_OFFSET, indices.HOMING_METHOD, indices.HOMING_SPEEDS),
        indices.HOMING_ACCELERATION,
    ),
    7: (
        *(indices.INTERPOLATION_SUBMODE, indices.INTERPOLATION_DATA),
        indices.INTERPOLATION_PERIOD,
    ),
    8: (indices.TARGET_POSITION, indices.INTERPOLATION_PERIOD),
    9: (indices.TARGET_VELOCITY, indices.INTERPOLATION_PERIOD),
    10: _TORQUE,
}
"""Objects without which a master cannot use a mode, by number of the mode."""


_NEVER_ZERO: Final = frozenset(
    {
        *(indices.FOLLOWING_ERROR_WINDOW, indices.MAX_TORQUE, indices.MAX_CURRENT),
        *(indices.RATED_CURRENT, indices.RATED_TORQUE, indices.MAX_PROFILE_VELOCITY),
        *(indices.MAX_MOTOR_SPEED, indices.PROFILE_VELOCITY, indices.PROFILE_ACCELERATION),
        *(indices.PROFILE_DECELERATION, indices.QUICK_STOP_DECELERATION, indices.TORQUE_SLOPE),
        *(indices.HOMING_SPEEDS, indices.HOMING_ACCELERATION, indices.MAX_ACCELERATION),
        *(indices.MAX_DECELERATION, indices.POSITIVE_TORQUE_LIMIT, indices.NEGATIVE_TORQUE_LIMIT),
    }
)
"""Objects for which 0 means no motion. A 0 in a file therefore counts as no value."""


def complete(
    dictionary: Dictionary, modes: Collection[int], added: Collection[int], defaults: _Defaults
) -> Dictionary:
    """Return the dictionary of a drive, completed so that the drive can be emulated.

    Args:
        dictionary: the dictionary of the drive's EDS.
        modes: modes of operation of the drive.
        added: indices of objects that are not in the EDS. The result contains these objects.
        defaults: values of objects of the profile. An object gets its value from here if it has no
            value in the EDS, or if it is not in the EDS.
    """
    given, own = dictionary.description, epos.dictionary().description
    entries = [
        _with_default(each, defaults) if each.index in PROFILE_AREA else each for each in given
    ]
    entries += [_with_default(each, defaults, anew=True) for each in _of(own, added)]
    listed = [_listing(each, modes) if each.index == _MODES else each for each in entries]
    if tuple(listed) == given.entries:
        return dictionary
    return Dictionary(listed, {**given.objects, **{index: own.objects[index] for index in added}})


def with_values(dictionary: Dictionary, values: Mapping[tuple[int, int], Value]) -> Dictionary:
    """Return a dictionary in which existing entries have other power-on values."""
    rows: dict[int, EntryDescription] = {}
    for at, value in values.items():
        entry = dictionary.find(*at)
        if entry is None:
            continue
        row = entry.description.with_default(value)
        if row.default != entry.description.default or not entry.description.has_default:
            rows[row.key] = row
    if not rows:
        return dictionary
    given = dictionary.description
    return Dictionary([rows.get(each.key, each) for each in given], given.objects)


def with_factors(dictionary: Dictionary, defaults: _Defaults) -> Dictionary:
    """Return a dictionary whose position units come from defaults, not from its EDS."""
    values = {at: value for at, value in defaults.items() if at[0] in _FACTORS}
    found = {
        at: fitting(entry.description, value)
        for at, value in {**values, (indices.SI_UNIT_POSITION, 0): 0}.items()
        if (entry := dictionary.find(*at)) is not None and entry.description.data_type.is_integer
    }
    return with_values(dictionary, found)


def missing(dictionary: Dictionary, modes: Iterable[int]) -> list[int]:
    """Return the objects that some modes need and a dictionary lacks, sorted."""
    wanted = {*_ALWAYS, *(index for mode in modes for index in _NEEDED[mode])}
    return sorted(index for index in wanted if index not in dictionary.objects)


def _of(own: DictionaryDescription, wanted: Collection[int]) -> Iterator[EntryDescription]:
    return (each for each in own if each.index in wanted)


def _with_default(
    entry: EntryDescription, defaults: _Defaults, *, anew: bool = False
) -> EntryDescription:
    """Return an entry with the default of a drive if it has no value; see `_NEVER_ZERO`.

    The default is limited to the type and the limits of the object in the EDS.
    """
    value = defaults.get((entry.index, entry.sub))
    open_zero = entry.index in _NEVER_ZERO and not any(entry.default)
    own = entry.has_default and not (anew or open_zero)  # `in_profile` has filled the others
    if own or value is None or entry.index not in PROFILE_AREA or not entry.data_type.is_integer:
        return entry
    return entry.with_default(fitting(entry, value))


def _listing(entry: EntryDescription, modes: Collection[int]) -> EntryDescription:
    """Return 6502h with the bits of the modes, and its other bits unchanged."""
    known = sum(1 << number - 1 for number in NAMES)
    more = int.from_bytes(entry.default, "little") & ~known
    listed = entry.with_default(more | sum(1 << number - 1 for number in modes))
    return entry if entry.has_default and listed.default == entry.default else listed
