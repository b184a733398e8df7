"""Digital and analogue inputs of a generic I/O module (CiA 401)."""

from __future__ import annotations

from enum import IntFlag
from typing import Final

from tickrig.device.canopen.application import number_of
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.entry import Entry
from tickrig.device.core import NEVER

READ_INPUT_8: Final = 0x6000
POLARITY_INPUT_8: Final = 0x6002
FILTER_INPUT_8: Final = 0x6003
INTERRUPT_ANY_8: Final = 0x6006
INTERRUPT_LOW_TO_HIGH_8: Final = 0x6007
INTERRUPT_HIGH_TO_LOW_8: Final = 0x6008
READ_ANALOGUE_INPUT_16: Final = 0x6401
INTERRUPT_TRIGGER: Final = 0x6421
UPPER_LIMIT: Final = 0x6424
LOWER_LIMIT: Final = 0x6425
DELTA: Final = 0x6426
NEGATIVE_DELTA: Final = 0x6427
POSITIVE_DELTA: Final = 0x6428

FILTER_US: Final = 10_000
"""How long a filtered line must be stable; the profile leaves it to the device."""


class DigitalInput:
    """Eight lines: filter, polarity, then the three interrupt masks.

    Attributes:
        entry: what the bus reads.
        level: the physical lines.
        due_us: when the filter lets the lines through.
    """

    def __init__(self, dictionary: Dictionary, number: int, entry: Entry) -> None:
        find = dictionary.find
        self.entry, self.level, self.due_us = entry, 0, NEVER
        self._polarity, self._filter = find(POLARITY_INPUT_8, number), find(FILTER_INPUT_8, number)
        self._any = find(INTERRUPT_ANY_8, number)
        self._rising = find(INTERRUPT_LOW_TO_HIGH_8, number)
        self._falling = find(INTERRUPT_HIGH_TO_LOW_8, number)
        self._raw = self._passed = 0

    def settings(self) -> list[Entry]:
        """Return the objects that change what is read."""
        return [entry for entry in (self._polarity, self._filter) if entry is not None]

    def update(self, now_us: int) -> bool:
        """Read the lines; say whether that is an interrupt."""
        self._pass(now_us)
        before = self.entry.number
        value = self._passed ^ number_of(self._polarity, 0)
        self.entry.assign(bytes([value]))
        rising, falling = value & ~before, before & ~value
        return bool(
            (rising | falling) & number_of(self._any, 0xFF)
            | rising & number_of(self._rising, 0)
            | falling & number_of(self._falling, 0)
        )

    def _pass(self, now_us: int) -> None:
        """Let unfiltered lines through at once, filtered ones when they have been stable."""
        if self.level != self._raw:
            self._raw, self.due_us = self.level, now_us + FILTER_US
        held = number_of(self._filter, 0) if now_us < self.due_us else 0
        self._passed = self._passed & held | self._raw & ~held
        if not held:
            self.due_us = NEVER


class Trigger(IntFlag):
    """Interrupt trigger selection (6421h)."""

    UPPER_LIMIT = 1
    LOWER_LIMIT = 2
    DELTA = 4
    NEGATIVE_DELTA = 8
    POSITIVE_DELTA = 16


LIMITS: Final = Trigger.UPPER_LIMIT | Trigger.LOWER_LIMIT
DELTAS: Final = Trigger.DELTA | Trigger.NEGATIVE_DELTA | Trigger.POSITIVE_DELTA


class AnalogueInput:
    """One channel of 16 bit.

    A change is an interrupt if the value is at or above the upper limit or below
    the lower one, as far as the trigger asks for limits, and if it is farther from
    the value of the last interrupt than a delta, as far as it asks for deltas.
    Limits are taken as right-aligned: in the unit of the channel.

    Attributes:
        entry: what the bus reads.
        level: the physical value, -32768..32767.
    """

    def __init__(self, dictionary: Dictionary, number: int, entry: Entry) -> None:
        find = dictionary.find
        self.entry, self.level = entry, 0
        self._trigger = find(INTERRUPT_TRIGGER, number)
        self._upper, self._lower = find(UPPER_LIMIT, number), find(LOWER_LIMIT, number)
        self._delta = find(DELTA, number)
        self._negative = find(NEGATIVE_DELTA, number)
        self._positive = find(POSITIVE_DELTA, number)
        self._told = 0

    def begin(self) -> None:
        """Take the present value as told: a TPDO has just been sent."""
        self._told = self.entry.number

    def update(self) -> bool:
        """Read the channel; say whether that is an interrupt."""
        if self.level == self.entry.number:
            return False
        self.entry.value = self.level
        trigger = Trigger(number_of(self._trigger, 7) & (LIMITS | DELTAS))
        interrupt = bool(trigger) and self._limits(trigger) and self._deltas(trigger)
        if interrupt:
            self._told = self.level
        return interrupt

    def _limits(self, trigger: Trigger) -> bool:
        above = Trigger.UPPER_LIMIT in trigger and self.level >= number_of(self._upper, 0)
        below = Trigger.LOWER_LIMIT in trigger and self.level < number_of(self._lower, 0)
        return above or below or not trigger & LIMITS

    def _deltas(self, trigger: Trigger) -> bool:
        change = self.level - self._told
        met = Trigger.DELTA in trigger and abs(change) > number_of(self._delta, 0)
        met |= Trigger.NEGATIVE_DELTA in trigger and -change > number_of(self._negative, 0)
        met |= Trigger.POSITIVE_DELTA in trigger and change > number_of(self._positive, 0)
        return met or not trigger & DELTAS
