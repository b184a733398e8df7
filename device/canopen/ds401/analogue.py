"""Analogue inputs and outputs (CiA 401): channels, converters, limits."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, floor, inf, isfinite, isnan
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.ds401 import families
from tickrig.device.physical import InputSignal, OutputSignal
from tickrig.device.twin import Immutable, Part

# Range, unit and steps of an analogue channel in the physical world.


@dataclass(frozen=True, slots=True)
class Converter(Immutable):
    """A linear converter between a physical quantity and the counts of an object.

    >>> adc = Converter("v", "V", low=0.0, high=5.0, high_raw=4095, shift=3)
    >>> adc.counts(1.25), adc.quantity(8192)
    (8192, 1.2503052503052503)

    Not emulated: offset and gain errors, noise, the conversion time.

    Attributes:
        suffix: end of the channel's name, such as `v` in `ai1_v`.
        unit: unit of the quantity, for display.
        low: smallest quantity.
        high: largest quantity.
        high_raw: number of converter steps at the quantity `high`.
        low_raw: number of converter steps at the quantity `low`.
        shift: number of bits by which the counts are left-shifted in the object (CiA 401).
        width: number of bits of the object that contains the counts.

    Raises:
        ValueError: the range is empty, or the object cannot hold the counts.
    """

    suffix: str
    unit: str
    low: float
    high: float
    high_raw: int
    low_raw: int = 0
    shift: int = 0
    width: int = 16

    def __post_init__(self) -> None:
        if not self.low < self.high or not self.low_raw < self.high_raw:
            raise ValueError(f"converter: {self.low}..{self.high} {self.unit} is no range")
        limit = 1 << self.width - 1
        if not -limit <= self.low_raw << self.shift <= self.high_raw << self.shift < limit:
            raise ValueError(f"converter: counts do not fit into {self.width} bit")

    @property
    def span(self) -> tuple[int, int, int]:
        """The counts of the object for `low` and for `high`, and of one step."""
        return self.low_raw << self.shift, self.high_raw << self.shift, 1 << self.shift

    def counts(self, quantity: float) -> int:
        """Return the counts for a quantity, limited to the range."""
        part = (min(max(quantity, self.low), self.high) - self.low) / (self.high - self.low)
        # Half up; the shift is that of CiA 401, which wants counts left-justified.
        return floor(self.low_raw + part * (self.high_raw - self.low_raw) + 0.5) << self.shift

    def quantity(self, counts: int) -> float:
        """Return the quantity for counts, limited to the range."""
        part = ((counts >> self.shift) - self.low_raw) / (self.high_raw - self.low_raw)
        return self.low + min(max(part, 0.0), 1.0) * (self.high - self.low)


# Common parts of analogue inputs and outputs.

_REAL32_MAX: Final = (2 - 2.0**-23) * 2.0**127


def _quantity(entry: Entry | None, default: float = 0) -> float:
    """Return the number in an object, or the default if the object or its number is missing."""
    value = default if entry is None else entry.value
    return value if isinstance(value, int | float) else default


def _factor(entry: Entry | None) -> float:
    """Return a scaling; 0 counts as 1, because many EDS files have a 0."""
    return _quantity(entry, 1) or 1


def _limited(value: float, limits: tuple[int, int]) -> int:
    """Return a value as an integer within limits; if it is not a number, the upper limit."""
    low, high = limits
    # Compiled, `min` of an int and a float is a float: 2**63 - 1 becomes 2**63.
    if not value < high:
        return high
    return int(value) if value > low else low


def _show(entry: Entry, value: float) -> None:
    """Put a number into an object, limited to the range of its data type."""
    if entry.data_type.is_integer:
        entry.value = _limited(value, entry.data_type.limits)
    else:
        entry.value = copysign(inf, value) if abs(value) > _REAL32_MAX else value


class _AnalogueChannel(Part):
    """A channel with its objects, its converter and its scaling.

    The widest integer object contains the counts; narrower objects contain their upper bits. A
    REAL32 object contains the physical quantity if the channel has a converter. Without a
    converter it contains the counts, or without counts the value that the outside world sets.
    Scaled value = value x scaling + offset.

    Args:
        prefix: prefix of the name: `ai` or `ao`.
        number: number of the channel, 1..254.
        converter: converter of the channel, or None for plain counts.

    Attributes:
        name: name of the physical input or output.
        integers: integer objects, sorted by width with the narrowest first.
        real: REAL32 object, or None if there is none.
        converter: converter of the channel, as given.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        objects: families.AnalogueObjects,
        prefix: str,
        number: int,
        converter: Converter | None,
    ) -> None:
        def find(index: int) -> Entry | None:
            return families.find_number(dictionary, index, number)

        self.name = f"{prefix}{number}" + (f"_{converter.suffix}" if converter else "")
        self.converter = converter
        self.integers = [entry for index in objects.integers if (entry := find(index)) is not None]
        self.real = find(objects.real)
        self._real_offset, self._real_scaling = (
            find(objects.real_offset),
            find(objects.real_scaling),
        )
        self._offset, self._scaling = find(objects.integer_offset), find(objects.integer_scaling)

    @property
    def unit(self) -> str:
        """Unit of the physical side."""
        return self.converter.unit if self.converter else ""

    @property
    def whole(self) -> bool:
        """Whether the physical quantity is a whole number."""
        return self.converter is None and bool(self.integers)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest physical quantity."""
        if self.converter is not None:
            return self.converter.low, self.converter.high
        return self.integers[-1].data_type.limits if self.integers else (-_REAL32_MAX, _REAL32_MAX)

    def scalings(self) -> list[Entry]:
        """Return offsets and scalings."""
        found = (self._offset, self._scaling, self._real_offset, self._real_scaling)
        return [entry for entry in found if entry is not None]

    def scaled(self, counts: float) -> float:
        """Scale an integer value."""
        return counts * _factor(self._scaling) + _quantity(self._offset)

    def real_scaled(self, value: float) -> float:
        """Scale a REAL32 value."""
        return value * _factor(self._real_scaling) + _quantity(self._real_offset)


# One analogue input, its event conditions, and the interrupt source objects (CiA 401, 6400h to
# 642Dh).


class _EventRule(Part):
    """The limits and deltas of one channel, as integers or as REAL32.

    Each bit of the interrupt trigger selection (6421h) enables a separate event:

    | bit | event                                                                  |
    |-----|------------------------------------------------------------------------|
    | 0   | the value was below the upper limit and no longer is                   |
    | 1   | the value was at or above the lower limit and is now below it          |
    | 2   | the value differs from the value sent last by more than the delta      |
    | 3   | the value is below the value sent last by more than the negative delta |
    | 4   | the value is above the value sent last by more than the positive delta |

    A limit causes an event when it is crossed, not for as long as it is exceeded. A missing limit
    object means no limit; a missing delta object means a delta of 0.

    Args:
        dictionary: the objects of the device.
        number: number of the channel.
        index: index of the upper limit. The other four objects follow it.
        entry: entry with the value to check.

    Attributes:
        there: whether the device has one of the five objects for the channel.
    """

    def __init__(self, dictionary: Dictionary, number: int, index: int, entry: Entry) -> None:
        objects = [families.find_number(dictionary, index + offset, number) for offset in range(5)]
        self._upper, self._lower, *self._deltas = objects
        self.settings = [found for found in objects if found is not None]
        self._entry = entry
        self._sent = self._seen = _quantity(entry)

    def begin(self) -> None:
        """Count the present value as sent."""
        self._sent = self._seen = _quantity(self._entry)

    def sent(self) -> None:
        """Record that the present value was sent."""
        self._sent = _quantity(self._entry)

    def judge(self, trigger: int) -> bool:
        """Return whether the value is an event."""
        now, before = _quantity(self._entry), self._seen
        self._seen = now
        change = now - self._sent
        delta, negative, positive = (_quantity(entry) for entry in self._deltas)
        events = (
            # The bits of 6421h: 0 upper limit, 1 lower limit, 2 delta, 3 negative, 4
            # positive delta.
            self._upper is not None and before < _quantity(self._upper) <= now,
            self._lower is not None and before >= _quantity(self._lower) > now,
            abs(change) > delta,
            -change > negative,
            change > positive,
        )
        return any(event and trigger >> bit & 1 for bit, event in enumerate(events))


_BANK_CHANNELS: Final = 32


class InterruptSource(Part):
    """The object 6422h, which shows the analogue inputs that have caused an interrupt.

    Each channel has one bit, with 32 channels in a sub-index. Reading a sub-index over the bus
    clears its bits.

    Attributes:
        entries: entries of the object.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._banks = dict(families.elements(dictionary, families.INTERRUPT_SOURCE))
        self.entries = list(self._banks.values())
        for entry in self.entries:
            entry.source = _read

    def note(self, number: int) -> None:
        """Set the bit of a channel, 1..254."""
        bank, bit = divmod(number - 1, _BANK_CHANNELS)
        entry = self._banks.get(bank + 1)
        if entry is not None and bit < 8 * entry.size:
            bits = int.from_bytes(entry.data, "little") | 1 << bit
            entry.assign(bits.to_bytes(entry.size, "little"))


def _read(entry: Entry) -> bytes:
    data = entry.data
    entry.assign(bytes(entry.size))
    return data


class AnalogueInput(Part):
    """One analogue input channel: converts and scales its value, and detects its events.

    Several integer objects can contain the value of a channel, such as an object of 8 bits and one
    of 16 bits. Integer limits and deltas apply to the number in the widest of these objects. REAL32
    limits and deltas apply to the number in the object 6403h. If the device has no objects for
    limits and deltas, each change of the value is an event.

    Attributes:
        number: number of the channel, 1..254.
        channel: objects and scaling of the channel.
        entries: entries that contain the value of the channel.
    """

    def __init__(self, dictionary: Dictionary, number: int, converter: Converter | None) -> None:
        self.number = number
        self.channel = _AnalogueChannel(
            dictionary, families.ANALOGUE_INPUT, "ai", number, converter
        )
        real = [self.channel.real] if self.channel.real is not None else []
        self.entries = [*self.channel.integers, *real]
        self._trigger = families.find_number(dictionary, families.INTERRUPT_TRIGGER, number)
        whole = _EventRule(
            dictionary, number, families.INTEGER_LIMITS, ([*real, *self.channel.integers])[-1]
        )
        fraction = _EventRule(dictionary, number, families.REAL_LIMITS, self.entries[-1])
        self._rules = [rule for rule in (whole, fraction) if rule.settings] or [whole]
        self._judged: tuple[float, bool] | None = None
        for entry in self.objects():
            entry.watch(self._judge_anew)

    @property
    def name(self) -> str:
        """Name of the physical input."""
        return self.channel.name

    @property
    def input(self) -> InputSignal:
        """The physical input."""
        (low, high), whole = self.channel.bounds, self.channel.whole
        converter = self.channel.converter
        text = f"analogue input {self.number}"
        start = min(max(0, low), high)
        return InputSignal(
            self.channel.name,
            text,
            low=low,
            high=high,
            unit=self.channel.unit,
            initial=start,
            real=not whole,
            counts=converter.span if converter else (),
        )

    def objects(self) -> list[Entry]:
        """Return the objects that influence the value or the event conditions."""
        trigger = [self._trigger] if self._trigger is not None else []
        judged = [entry for rule in self._rules for entry in rule.settings]
        return [*self.channel.scalings(), *trigger, *judged]

    def begin(self, physical: float) -> None:
        """Count the present value as sent."""
        self._judged = None
        self._convert(physical)
        for rule in self._rules:
            rule.begin()

    def sent(self) -> None:
        """Record that the present value was sent."""
        for rule in self._rules:
            rule.sent()

    def update(self, physical: float, *, enabled: bool) -> bool:
        """Read the channel; return whether the change is an event and events are enabled."""
        if self._judged == (physical, enabled):
            return False
        self._judged = physical, enabled
        self._convert(physical)
        trigger = int(_quantity(self._trigger, families.DEFAULT_TRIGGER))
        events = [rule.judge(trigger) for rule in self._rules]
        event = enabled and any(events)
        if event:
            self.sent()
        return event

    def _judge_anew(self, entry: Entry) -> None:
        self._judged = None

    def _convert(self, physical: float) -> None:
        channel, converter, value = self.channel, self.channel.converter, physical
        if channel.integers:
            bits = channel.integers[-1].data_type.bits
            counts = int(physical)
            if converter is not None:
                counts = _justified(converter.counts(physical), converter.width, bits)
            _show(channel.integers[-1], channel.scaled(counts))
            for entry in channel.integers[:-1]:
                widest = int(_quantity(channel.integers[-1]))
                _show(entry, _justified(widest, bits, entry.data_type.bits))
        if channel.real is not None:
            if converter is not None:
                value = converter.quantity(converter.counts(physical))
            _show(channel.real, channel.real_scaled(value))


def _justified(counts: int, from_bits: int, to_bits: int) -> int:
    """Return left-justified counts in another width."""
    # A power of two is exact in floating point, for either direction; floor keeps the sign.
    return floor(counts * 2.0 ** (to_bits - from_bits))


# One analogue output (CiA 401, 6410h to 6413h).


class AnalogueOutput(Part):
    """One analogue output channel: drives its level from the objects that the bus writes.

    Several objects can contain the value of a channel. The object that changed last sets the level,
    and the other objects keep their values. After an error of the device, the channel can output
    its error value instead. An integer error value (6444h) has the scale of the object that changed
    last, and is limited to the range of this object. A NaN or infinity leaves the level unchanged.

    Attributes:
        number: number of the channel, 1..254.
        channel: objects and scaling of the channel.
        level: physical value of the output.
        failed: whether the channel outputs its error value instead of the written value.
    """

    def __init__(self, dictionary: Dictionary, number: int, converter: Converter | None) -> None:
        self.number, self.level, self.failed = number, 0.0, False
        self.channel = _AnalogueChannel(
            dictionary, families.ANALOGUE_OUTPUT, "ao", number, converter
        )
        real = [self.channel.real] if self.channel.real is not None else []
        self._written = [*real, *self.channel.integers]
        self._latest = self._written[-1]
        self._mode = families.find_number(dictionary, families.ANALOGUE_ERROR_MODE, number)
        self._error = families.find_number(dictionary, families.INTEGER_ERROR_VALUE, number)
        self._real_error = families.find_number(dictionary, families.REAL_ERROR_VALUE, number)
        for entry in self._written:
            entry.watch(self._write)

    @property
    def output(self) -> OutputSignal:
        """The physical output."""
        return OutputSignal(self.channel.name, f"analogue output {self.number}", self.channel.unit)

    def objects(self) -> list[Entry]:
        """Return the objects that influence the output."""
        found = (self._mode, self._error, self._real_error)
        settings = [entry for entry in found if entry is not None]
        return [*self._written, *self.channel.scalings(), *settings]

    def power_on(self) -> None:
        """Start at 0, limited to the range of the converter."""
        converter = self.channel.converter
        self.level = converter.quantity(converter.counts(0.0)) if converter is not None else 0.0

    def update(self) -> None:
        """Update the output."""
        error = self.failed and _quantity(self._mode, 1) != 0
        put = self._real if self._latest is self.channel.real else self._whole
        level = put(error=error)
        if isfinite(level):
            self.level = level

    def _whole(self, *, error: bool) -> float:
        entry, converter = self._latest, self.channel.converter
        low, high = entry.data_type.limits
        value = _quantity(self._error) if error else entry.number
        counts = _limited(self.channel.scaled(max(low, min(high, value))), (low, high))
        if converter is None:
            return counts
        return converter.quantity(counts * 2**converter.width >> entry.data_type.bits)

    def _real(self, *, error: bool) -> float:
        value = _quantity(self._real_error) if error else _quantity(self._latest)
        level, (low, high) = self.channel.real_scaled(value), self.channel.bounds
        if self.channel.converter is None or isnan(level):
            return level
        return max(low, min(high, level))

    def _write(self, entry: Entry) -> None:
        self._latest, self.failed = entry, False
