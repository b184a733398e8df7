"""Two small devices, and signals that drive them; what they saw is kept."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from tickrig.device.physical import InputSignal, OutputSignal, QuantityBank, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.signals.driver import SignalDriver
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.emulators.testing.signals.spec_reader import read_signal_spec
from tickrig.wire.instant import NEVER

INPUTS = (
    InputSignal("volt", "a voltage", low=-100, high=100, unit="V", real=True),
    InputSignal("count", "a whole number", low=-50, high=50),
    InputSignal("key", "a button", SignalType.BUTTON),
    InputSignal("label", "a text", SignalType.TEXT),
)
OUTPUTS = {
    "mean": OutputSignal("mean", "mean of the voltage at this tick and before"),
    "state": OutputSignal("state", "a text"),
}


class LabelBank(QuantityBank):
    """Inputs, one of which takes a text."""

    label = ""

    def check(self, name: str, value: float | str) -> Any:
        return str(value) if name == "label" else super().check(name, value)

    def set(self, name: str, value: float | str) -> None:
        if name == "label":
            self.label, self.changed = str(value), True
        else:
            super().set(name, value)

    def __getitem__(self, name: str) -> Any:
        return self.label if name == "label" else super().__getitem__(name)


class Meter(Copyable):
    """Notes its inputs whenever they are others, and answers with their mean."""

    def __init__(self, tick_us: int) -> None:
        self.tick_us, self.inputs, self.outputs = tick_us, LabelBank(INPUTS), OUTPUTS
        self.seen: list[tuple[object, ...]] = []
        self.mean = 0.0

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else NEVER

    def reset(self) -> None:
        self.mean = 0.0

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        if self.inputs.changed:
            self.inputs.changed = False
            self.mean = (self.mean + self.inputs["volt"]) / 2
            self.seen.append((now_us, *(self.inputs[item.name] for item in INPUTS)))
        return b""

    def read(self, name: str, /) -> float | str:
        values: dict[str, float | str] = {"mean": self.mean, "state": "on"}
        return values[name]


Signals = dict[str, SignalSpec]


def signals_of(tables: dict[str, Any], folder: Path | None = None) -> Signals:
    """Read signals, by name; there must be no mistake."""
    specs = {}
    for name, value in tables.items():
        found = read_signal_spec(value, (name,), folder)
        assert isinstance(found, SignalSpec), found
        specs[name] = found
    return specs


class SignalBench:
    """A rig of a device `a` of 10 ms and a device `b` of 4 ms."""

    def __init__(self, signals: Signals, seed: int = 0, *, dense: bool = False) -> None:
        self.a, self.b = Meter(10_000), Meter(4_000)
        self.driver = SignalDriver(signals, {"a": self.a, "b": self.b}, seed)
        stations = [Station(device, SerialLine().a) for device in (self.a, self.b)]
        self.rig = Rig(*stations, couplings=[self.driver], dense=dense)

    @classmethod
    def of(cls, toml: str, **options: Any) -> SignalBench:
        return cls(signals_of(tomllib.loads(toml)), **options)

    @property
    def seen(self) -> list[tuple[object, ...]]:
        return [*self.a.seen, *self.b.seen]
