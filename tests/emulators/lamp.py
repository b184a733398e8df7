"""A small device: echoes while its lamp is on, and says when it is switched."""

from __future__ import annotations

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.wire.instant import NEVER

OUTPUTS = {
    "state": OutputSignal("state", "Lit or Dark"),
    "count": OutputSignal("count", "bytes heard", "B"),
}


class Lamp:
    tick_us = 1_000

    def __init__(self, greeting: bytes = b"hi\n") -> None:
        self.inputs = InputBank(
            (
                InputSignal("lamp", "lamp", initial=1),
                InputSignal("key", "key", SignalType.BUTTON),
                InputSignal("x_mm", "x", low=-10, high=10, unit="mm"),
                InputSignal("y_mm", "y", low=-10, high=10, unit="mm"),
                InputSignal("dead", "broken", SignalType.FAULT),
            ),
            {"place": ("x_mm", "y_mm")},
        )
        self.outputs = OUTPUTS
        self.greeting = greeting
        self.reset()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed or not self._greeted else NEVER

    def reset(self) -> None:
        self._greeted, self._key, self._count = False, 0, 0

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        if self.inputs["dead"]:
            return b""
        out = b"" if self._greeted else self.greeting
        if self.inputs["key"] > self._key:
            out += b"click\n"
        self._greeted, self._key = True, self.inputs["key"]
        self._count += len(rx)
        return out + (rx if self.inputs["lamp"] else b"")

    def read(self, name: str, /) -> int | str:
        return {"state": "Lit" if self.inputs["lamp"] else "Dark", "count": self._count}[name]
