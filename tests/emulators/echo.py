"""A device so small that only the rig is tested: it repeats what it hears, and ticks."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickrig.wire.instant import NEVER


@dataclass
class Echo:
    """Sends back in the next tick what came in this one, and a dot every `period_us`."""

    tick_us: int = 10_000
    period_us: int = NEVER
    ticks: list[int] = field(default_factory=list)
    heard: bytes = b""
    _held: bytes = b""
    _dot_us: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._dot_us = self.period_us

    @property
    def due_us(self) -> int:
        return 0 if self._held else self._dot_us

    def reset(self) -> None:
        self._held = b""

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.ticks.append(now_us)
        self.heard += rx
        sent, self._held = self._held, rx
        if now_us >= self._dot_us:
            self._dot_us += self.period_us
            sent += b"."
        return sent
