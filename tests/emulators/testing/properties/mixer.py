"""A mixer with timers of half a minute and half a second, and mixers with one mistake each."""

from __future__ import annotations

from itertools import count
from typing import Any

from tickrig import NEVER, Copyable, InputBank, InputSignal, LineSplitter, OutputSignal, SignalType

STOP_US, TRIP_US = 30_000_000, 500_000
INPUTS = (
    InputSignal("jam", "a spoon in the bowl", SignalType.FAULT),
    InputSignal("no_power", "its supply is cut", SignalType.FAULT),
)


class Mixer(Copyable):
    """Takes `ON`, `OFF`, `?`; stops after 30 s by itself, and 0.5 s after a jam with an error."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs = InputBank(INPUTS)
        self.outputs = {"state": OutputSignal("state", "Idle, Mixing or Error")}
        self.reset()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else min(self.stop_us, self.trip_us)

    def reset(self) -> None:
        self.splitter, self.state = LineSplitter(64), "Idle"
        self.stop_us = self.trip_us = NEVER

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        if self.inputs["no_power"]:
            self.reset()
            return b""
        if now_us >= self.trip_us:
            self.stop("Error")
        if now_us >= self.stop_us:
            self.stop("Idle")
        answers = [self.answer(line, now_us) for line in self.lines(rx)]
        if self.state != "Mixing" or not self.inputs["jam"]:
            self.trip_us = NEVER
        elif self.trip_us == NEVER:
            self.trip_us = now_us + TRIP_US
        return b"".join(answer + b"\n" for answer in answers)

    def lines(self, rx: bytes) -> list[bytes]:
        return self.splitter.push(rx)

    def stop(self, state: str) -> None:
        self.state, self.stop_us, self.trip_us = state, NEVER, NEVER

    def answer(self, line: bytes, now_us: int) -> bytes:
        if line == b"?":
            return self.state.encode()
        if line == b"ON":
            self.state, self.stop_us = "Mixing", now_us + STOP_US
            return b"OK"
        if line == b"OFF":
            self.stop("Idle")
            return b"OK"
        return b"ERR"

    def read(self, name: str, /) -> int | float | str:
        return {"state": self.state}[name]


class ForgetsStop(Mixer):
    """Its timer of 30 s is not in `due_us`."""

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else self.trip_us


class ForgetsTrip(Mixer):
    """Its timer of 0.5 s is not in `due_us`."""

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else self.stop_us


class Unseen(ForgetsStop):
    """That it has stopped is seen in an answer alone, and only in the one after."""

    def __init__(self) -> None:
        super().__init__()
        self.outputs = {}

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        answers = [self.answer(line, now_us) for line in self.lines(rx)]
        if now_us >= self.stop_us:
            self.stop("Idle")
        return b"".join(answer + b"\n" for answer in answers)


class HalfLines(Mixer):
    """Keeps no half line."""

    def lines(self, rx: bytes) -> list[bytes]:
        return [line for line in rx.split(b"\n") if line]


class KeepsError(Mixer):
    """A reset leaves its error."""

    def reset(self) -> None:
        state = getattr(self, "state", "Idle")
        super().reset()
        self.state = state if state == "Error" else "Idle"


class KeepsFault(Mixer):
    """A reset leaves that its supply was cut while it was mixing."""

    cut = False

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.cut = self.cut or bool(self.inputs["no_power"] and self.state == "Mixing")
        return super().tick(now_us, rx)

    def read(self, name: str, /) -> int | float | str:
        return "Error" if self.cut else super().read(name)


CLOCK = count()


class Clocked(Mixer):
    """Tells something of the machine."""

    def answer(self, line: bytes, now_us: int) -> bytes:
        return b"%d" % next(CLOCK)


class Sharing(Mixer):
    """All of them have one list."""

    heard: list[bytes] = []  # noqa: RUF012 - the mistake

    def answer(self, line: bytes, now_us: int) -> bytes:
        self.heard.append(line)
        return b"%d" % len(self.heard)


class LeavesChanged(Mixer):
    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        sent = super().tick(now_us, rx)
        self.inputs.changed = True
        return sent


class TicksNone(Mixer):
    def tick(self, now_us: int, rx: bytes, /) -> Any:
        return super().tick(now_us, rx) or None


class TicksText(Mixer):
    def tick(self, now_us: int, rx: bytes, /) -> Any:
        return super().tick(now_us, rx).decode()


class ReadsNone(Mixer):
    def read(self, name: str, /) -> Any:
        return None


class NoPeriod(Mixer):
    tick_us = 0


class RealPeriod(Mixer):
    tick_us: Any = 1_000.0


class DueNone(Mixer):
    due_us: Any = None


class DueReal(Mixer):
    due_us: Any = property(lambda self: Mixer.due_us.fget(self) / 1)  # type: ignore[attr-defined] # of a property


class NoInputs:
    tick_us, due_us = 1_000, NEVER

    def reset(self) -> None:
        return

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return rx


class NoOutputs(NoInputs):
    def __init__(self) -> None:
        self.inputs = InputBank()


class NoReset:
    tick_us, due_us = 1_000, NEVER


class Late(Mixer):
    """Answers a tenth of a second later."""

    def reset(self) -> None:
        super().reset()
        self.later, self.later_us = b"", NEVER

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else min(self.stop_us, self.trip_us, self.later_us)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        sent = b""
        if now_us >= self.later_us:
            sent, self.later, self.later_us = self.later, b"", NEVER
        if answer := super().tick(now_us, rx):
            self.later += answer
            self.later_us = min(self.later_us, now_us + 100_000)
        return sent
