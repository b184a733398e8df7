"""A kettle on a serial line of 9600 baud: `heat`, `stop` and `temp?`; it tells when it boils."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tickrig import (
    NEVER,
    Copyable,
    DeviceField,
    DeviceType,
    InputBank,
    InputSignal,
    LineSettings,
    LineSplitter,
    OutputSignal,
    SignalType,
)

ROOM_C: Final = 20
BOILING_C: Final = 100
INPUTS: Final = (
    InputSignal("lid_open", "the lid is open: it stops heating", SignalType.BUTTON),
    InputSignal("water_ml", "water in it", high=1_500, unit="ml", initial=1_000),
    InputSignal("sensor_broken", "the wire of the thermometer is cut", SignalType.FAULT),
)
OUTPUTS: Final = {
    "state": OutputSignal("state", "Cold, Heating or Boiling"),
    "temperature_c": OutputSignal("temperature_c", "of the water", "degC"),
}


class Kettle(Copyable):
    """Heats by a degree each `1_000_000 * water_ml / (power_w * 240)` us.

    Not emulated: that it cools.

    Args:
        power_w: of its heater, 100 to 3000.

    Raises:
        ValueError: it has no such heater.
    """

    tick_us = 1_000

    def __init__(self, power_w: int = 2_000) -> None:
        if not 100 <= power_w <= 3_000:
            raise ValueError(f"power-w {power_w} is not in 100..3000")
        self._power_w = power_w
        self.inputs, self.outputs = InputBank(INPUTS), OUTPUTS
        self.reset()

    def reset(self) -> None:
        """Be plugged in, with cold water."""
        self.temperature_c, self._degree_us = ROOM_C, NEVER
        self._splitter = LineSplitter()

    @property
    def due_us(self) -> int:
        """When it is a degree warmer, or at once if somebody did something to it."""
        return 0 if self.inputs.changed else self._degree_us

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Hear lines, and be a degree warmer if it is time."""
        self.inputs.changed = False
        said = [self._answer(now_us, line) for line in self._splitter.push(rx)]
        if self.inputs["lid_open"]:
            self._degree_us = NEVER
        while now_us >= self._degree_us:
            self.temperature_c += 1
            self._degree_us += self._step_us
            if self.temperature_c >= BOILING_C:
                self._degree_us = NEVER
                said.append("boils")
        return "".join(f"{line}\n" for line in said).encode()

    def _answer(self, now_us: int, line: bytes) -> str:
        match line:
            case b"heat" if self.inputs["lid_open"] or not self.inputs["water_ml"]:
                return "no"
            case b"heat":
                self._degree_us = min(self._degree_us, now_us + self._step_us)
                return "ok"
            case b"stop":
                self._degree_us = NEVER
                return "ok"
            case b"temp?":
                return "?" if self.inputs["sensor_broken"] else f"{self.temperature_c}"
        return "what?"

    @property
    def _step_us(self) -> int:
        return max(1, 4_186_000 * self.inputs["water_ml"] // self._power_w)

    def read(self, name: str, /) -> int | str:
        """Return an output."""
        if name == "temperature_c":
            return self.temperature_c
        hot = "Boiling" if self.temperature_c >= BOILING_C else "Cold"
        return {"state": hot if self._degree_us == NEVER else "Heating"}[name]


def _build(config: Mapping[str, Any]) -> Kettle:
    return Kettle(**config)


def _ask(text: bytes) -> bytes:
    return text + b"?\n"


DEVICE: Final = DeviceType(
    name="kettle",
    title="Kettle",
    text="Emulate a kettle on a pseudo-terminal.",
    build=_build,
    fields=(DeviceField(name="power_w", kind=int, default=2_000, help="Of its heater.  [2000]"),),
    line=LineSettings(baud=9_600),
    encoders={"ask": _ask},
    is_event=lambda line: line.data == b"boils",
)
