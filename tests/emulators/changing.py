"""A device that changes its serial line when it is told to, as URG, GNSS and servos do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.device.twin import Copyable
from tickrig.wire.instant import NEVER
from tickrig.wire.lines import LineSplitter
from tickrig.wire.uart import Parity, UartSetting

INPUTS = (InputSignal("no_power", "its supply is cut", SignalType.FAULT),)


class Changing(Copyable):
    """Repeats each line; `=9600 8E1` is answered with `OK`, and is its setting from then on."""

    tick_us = 1_000
    outputs: Mapping[str, OutputSignal] = {}

    def __init__(self, baud: int = 100_000) -> None:
        self._first = self.uart = UartSetting(baud)
        self.inputs = InputBank(INPUTS)
        self._splitter = LineSplitter()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else NEVER

    def reset(self) -> None:
        self.uart = self._first
        self._splitter = LineSplitter()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        if self.inputs["no_power"]:
            self.reset()
            return b""
        return b"".join(self._answer(line) for line in self._splitter.push(rx))

    def _answer(self, line: bytes) -> bytes:
        if not line.startswith(b"="):
            return line + b"\n"
        baud, frame = line[1:].decode().split()
        parity = cast(Parity, frame[1])
        self.uart = UartSetting(int(baud), int(frame[0]), parity, int(frame[2]))
        return b"OK\n"

    def read(self, name: str, /) -> int:
        raise KeyError(name)
