"""Moves inputs of an emulated device by names of its signals (docs/reference/bench/control.md)."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Collection
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.bus.step_failed import Disturbed, NotAllowed
from tickrig.host.control.client import ControlRefused
from tickrig.host.text.page_text import one_line
from tickrig.host.text.values import Setting, parse_setting
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.errors import FieldError

HEX = "hex:"
"""Begins the bytes of an octet string or a domain."""

LINES: Final = 8
"""`di1` is lines 1 to 8, `di2` those that follow."""
CHANNEL: Final = re.compile(r"(di|do|ai)([1-9][0-9]{0,2})")
INPUTS: Final = {"6000": "di", "6401": "ai"}
"""Objects of CiA 401 that show what is at the inputs."""


class Span(NamedTuple):
    """A linear converter: from `low` to `high` its object holds `first` to `last` by `step`."""

    low: float
    high: float
    first: int
    last: int
    step: int


class SignalStimulus(ABC):
    """Takes the words of a check, and sets, reads and switches by name."""

    def __call__(self, *words: str) -> str:
        """Do it, and return what was read.

        Raises:
            NotAllowed: the device has nothing of the kind.
            Disturbed: it has, and it could not be done.
        """
        try:
            return self._act(*words)
        except (ControlRefused, KeyError) as error:
            known = any(signal_name(word) in self.names() for word in words[1:2])
            kind = Disturbed if known else NotAllowed
            raise kind(f"{' '.join(words)}: {one_line(str(error))}") from None
        except (OSError, ValueError, FieldError) as error:
            text = getattr(error, "strerror", None) or str(error) or type(error).__name__
            raise Disturbed(f"{' '.join(words)}: {one_line(text)}") from None

    def _act(self, *words: str) -> str:
        match words:
            case ("input", name, value):
                self._input(name, value)
            case ("output", name):
                return self._output(name)
            case ("emergency", code, *_):
                self._set_emergency(int(code, 16))
            case ("emergency-clear", *_):
                self._set_emergency(0)
            case ("power", ("on" | "off") as state):
                self.switch(on=state == "on")
            case _:
                raise NotAllowed(f"{' '.join(words)}: the device has nothing of the kind")
        return ""

    def _input(self, name: str, value: str) -> None:
        """Set an input; of a CiA 401 module eight lines or counts, as an object of it too."""
        module = "di1" in self.names() or self._channels("ai1")
        index, _, sub = name.partition(":")
        if module and index in INPUTS:
            data = int.from_bytes(bytes.fromhex(value), "little", signed=INPUTS[index] == "ai")
            name = f"{INPUTS[index]}{int(sub, 16)}"
            value = f"{data:02X}" if INPUTS[index] == "di" else f"{data}"
        channel = CHANNEL.fullmatch(name) if module else None
        if channel and channel[1] == "di":
            self._set_lines(int(channel[2]), int(value, 16))
        elif channel and name not in self.names() and (others := self._channels(name)):
            self.set(others[0], self._quantity(others[0], int(value)))
        else:
            signal = signal_name(name)
            self.set(signal, _value(value, self.unit(signal)))

    def _quantity(self, name: str, counts: int) -> float:
        """Return what a converter turns into these counts."""
        span = self.span(name)
        if span is None:
            raise ValueError(f"{name} takes {self.unit(name)}, and its counts are not known here")
        if counts not in range(span.first, span.last + 1, span.step):
            raise NotAllowed(f"the converter of {name} has no step of {counts} counts")
        part = (counts - span.first) / (span.last - span.first)
        return span.low + part * (span.high - span.low)

    def _channels(self, name: str) -> list[str]:
        """Return an analogue input that has a unit: `ai1_v` is `ai1`."""
        return [each for each in self.names() if each.startswith(f"{name}_")]

    def _set_lines(self, number: int, levels: int) -> None:
        """Set eight lines; those that there are not can only be low."""
        for bit in range(LINES):
            line, level = f"di{LINES * (number - 1) + bit + 1}", levels >> bit & 1
            if line in self.names():
                self.set(line, level)
            elif level:
                raise NotAllowed(f"the device has no input {line}")

    def _output(self, name: str) -> str:
        channel = CHANNEL.fullmatch(name)
        if channel and channel[1] == "do" and "do" in self.names():
            levels = self.get("do")
            return f"{int(levels) >> LINES * (int(channel[2]) - 1) & 0xFF:02X}"
        signal = signal_name(name)
        return _hex(self.get(signal), self.unit(signal))

    def _set_emergency(self, code: int) -> None:
        """Let an error come or go: there is one at a time."""
        if code and self.get("emergency"):
            raise NotAllowed("a second error at once: the device takes one by hand")
        self.set("emergency", code)

    @abstractmethod
    def set(self, name: str, value: Setting) -> None:
        """Set an input; ValueError if it cannot be."""

    @abstractmethod
    def get(self, name: str) -> Setting:
        """Return the value of a signal; ValueError if there is none."""

    @abstractmethod
    def names(self) -> Collection[str]:
        """Return the names of all its signals."""

    @abstractmethod
    def unit(self, name: str) -> str:
        """Return the unit of a signal, of an object its data type; empty if it has none."""

    @abstractmethod
    def span(self, name: str) -> Span | None:
        """Return what the converter of an input tells, None where that is not known."""

    @abstractmethod
    def switch(self, *, on: bool) -> None:
        """Switch its supply."""


def signal_name(name: str) -> str:
    """Return what an emulator calls an object of a check.

    >>> signal_name("6000:01"), signal_name("2000:00"), signal_name("stick")
    ('0x6000:1', '0x2000', 'stick')
    """
    index, colon, sub = name.partition(":")
    if not colon:
        return name
    return f"0x{index}:{int(sub, 16)}" if int(sub, 16) else f"0x{index}"


def _value(text: str, unit: str) -> Setting:
    """Read the bytes of an object as its type, what is none as a number."""
    if unit not in DataType.__members__:
        return parse_setting(text)
    value = DataType[unit].decode(bytes.fromhex(text))
    return f"{HEX}{value.hex()}" if isinstance(value, bytes) else value


def _hex(value: Setting, unit: str) -> str:
    """Write the value of an object as it goes over the bus."""
    if unit not in DataType.__members__:
        return str(value)
    if isinstance(value, str) and value.startswith(HEX):
        return value.removeprefix(HEX).upper()
    return DataType[unit].encode(value).hex().upper()
