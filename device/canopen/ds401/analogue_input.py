"""One analogue input, what of it is an event, and which were one (CiA 401, 6400h to 642Dh)."""

from __future__ import annotations

from math import floor
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.analogue_channel import AnalogueChannel, quantity, show
from tickrig.device.canopen.ds401.converter import Converter
from tickrig.device.canopen.ds401.families import (
    ANALOGUE_INPUT,
    DEFAULT_TRIGGER,
    INTEGER_LIMITS,
    INTERRUPT_SOURCE,
    INTERRUPT_TRIGGER,
    REAL_LIMITS,
    elements,
    find_number,
)
from tickrig.device.physical import InputSignal
from tickrig.device.twin import Part


class EventRule(Part):
    """The limits and deltas of one channel, as integers or as REAL32.

    Each bit of the interrupt trigger selection (6421h) is an event of its own:

    | bit | event                                               |
    |-----|-----------------------------------------------------|
    | 0   | the value was below the upper limit and is no more  |
    | 1   | the value was at the lower limit or above and is below |
    | 2   | it differs from what was sent last by more than the delta |
    | 3   | it is below what was sent last by more than the negative delta |
    | 4   | it is above what was sent last by more than the positive delta |

    A limit is an event when it is crossed, not as long as it is exceeded. A limit
    that the device has no object for is none, a delta is 0.

    Args:
        dictionary: the objects of the device.
        number: of the channel.
        index: of the upper limit; the other four follow.
        entry: the value that is judged.

    Attributes:
        there: whether the device has one of the five objects for the channel.
    """

    def __init__(self, dictionary: Dictionary, number: int, index: int, entry: Entry) -> None:
        objects = [find_number(dictionary, index + offset, number) for offset in range(5)]
        self._upper, self._lower, *self._deltas = objects
        self.settings = [found for found in objects if found is not None]
        self._entry = entry
        self._sent = self._seen = quantity(entry)

    def begin(self) -> None:
        """Take the value as sent."""
        self._sent = self._seen = quantity(self._entry)

    def sent(self) -> None:
        """Note that the value is on the bus."""
        self._sent = quantity(self._entry)

    def judge(self, trigger: int) -> bool:
        """Return whether the value is an event."""
        now, before = quantity(self._entry), self._seen
        self._seen = now
        change = now - self._sent
        delta, negative, positive = (quantity(entry) for entry in self._deltas)
        events = (
            self._upper is not None and before < quantity(self._upper) <= now,
            self._lower is not None and before >= quantity(self._lower) > now,
            abs(change) > delta,
            -change > negative,
            change > positive,
        )
        return any(event and trigger >> bit & 1 for bit, event in enumerate(events))


BANK_CHANNELS: Final = 32


class InterruptSource(Part):
    """Banks of 32 channels; reading a bank over the bus clears it.

    Attributes:
        entries: the banks.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._banks = dict(elements(dictionary, INTERRUPT_SOURCE))
        self.entries = list(self._banks.values())
        for entry in self.entries:
            entry.source = _read

    def note(self, number: int) -> None:
        """Set the bit of a channel, 1..254."""
        bank, bit = divmod(number - 1, BANK_CHANNELS)
        entry = self._banks.get(bank + 1)
        if entry is not None and bit < 8 * entry.size:
            bits = int.from_bytes(entry.data, "little") | 1 << bit
            entry.assign(bits.to_bytes(entry.size, "little"))


def _read(entry: Entry) -> bytes:
    data = entry.data
    entry.assign(bytes(entry.size))
    return data


class AnalogueInput(Part):
    """Converts, scales and judges one channel.

    Integer limits and deltas are right-aligned: in the unit of the widest integer
    object. Those of REAL32 are in the unit of 6403h. Without any of them each
    change is an event.

    Attributes:
        number: 1..254.
        channel: its objects.
        entries: those that show its value.
    """

    def __init__(self, dictionary: Dictionary, number: int, converter: Converter | None) -> None:
        self.number = number
        self.channel = AnalogueChannel(dictionary, ANALOGUE_INPUT, "ai", number, converter)
        real = [self.channel.real] if self.channel.real is not None else []
        self.entries = [*self.channel.integers, *real]
        self._trigger = find_number(dictionary, INTERRUPT_TRIGGER, number)
        whole = EventRule(dictionary, number, INTEGER_LIMITS, ([*real, *self.channel.integers])[-1])
        fraction = EventRule(dictionary, number, REAL_LIMITS, self.entries[-1])
        self._rules = [rule for rule in (whole, fraction) if rule.settings] or [whole]
        self._judged: tuple[float, bool] | None = None
        for entry in self.objects():
            entry.watch(self._judge_anew)

    @property
    def name(self) -> str:
        """What the physical input is called."""
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
        """Return the objects that change what is read or what is an event."""
        trigger = [self._trigger] if self._trigger is not None else []
        judged = [entry for rule in self._rules for entry in rule.settings]
        return [*self.channel.scalings(), *trigger, *judged]

    def begin(self, physical: float) -> None:
        """Take the present value as sent."""
        self._judged = None
        self._convert(physical)
        for rule in self._rules:
            rule.begin()

    def sent(self) -> None:
        """Note that the present value is on the bus."""
        for rule in self._rules:
            rule.sent()

    def update(self, physical: float, *, enabled: bool) -> bool:
        """Read the channel. Returns: whether that is an event, as far as events are enabled."""
        if self._judged == (physical, enabled):
            return False
        self._judged = physical, enabled
        self._convert(physical)
        trigger = int(quantity(self._trigger, DEFAULT_TRIGGER))
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
            show(channel.integers[-1], channel.scaled(counts))
            for entry in channel.integers[:-1]:
                widest = int(quantity(channel.integers[-1]))
                show(entry, _justified(widest, bits, entry.data_type.bits))
        if channel.real is not None:
            if converter is not None:
                value = converter.quantity(converter.counts(physical))
            show(channel.real, channel.real_scaled(value))


def _justified(counts: int, from_bits: int, to_bits: int) -> int:
    """Return left-justified counts in another width."""
    return floor(counts * 2.0 ** (to_bits - from_bits))
