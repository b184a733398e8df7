"""One analogue input (CiA 401, 6400h to 6403h)."""

from __future__ import annotations

from math import floor
from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.analogue_channel import AnalogueChannel
from tickrig.device.canopen.ds401.converter import Converter
from tickrig.device.canopen.ds401.event_rule import EventRule
from tickrig.device.canopen.ds401.families import (
    ANALOGUE_INPUT,
    INTEGER_LIMITS,
    INTERRUPT_TRIGGER,
    REAL_LIMITS,
    find_number,
)
from tickrig.device.canopen.ds401.quantity import quantity, show
from tickrig.device.physical import InputSignal

DEFAULT_TRIGGER: Final = 7
"""Limits and delta (6421h)."""


class AnalogueInput:
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
        """Hear that the present value is on the bus."""
        for rule in self._rules:
            rule.sent()

    def update(self, physical: float, *, enabled: bool) -> bool:
        """Read the channel; say whether that is an event, as far as events are enabled."""
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
