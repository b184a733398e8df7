"""The board of a node: its supply, its boot, and the system that runs on it while it is up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from enum import IntEnum
from typing import Final, Protocol

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.emulators.tkernel.node_manager import REFUSED, NodeLimits, NodeManager
from tickrig.wire.instant import NEVER

INPUTS: Final = (
    InputSignal("reset", "the reset button", SignalType.BUTTON),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
)

_OUTPUTS: Final = (
    OutputSignal("state", "0 without supply, 1 while it boots, 2 while it runs"),
    OutputSignal("boots", "how often it was up"),
    OutputSignal("components", "components on it"),
    *(OutputSignal(f"refused_{what}", f"{what} that are beyond its limits") for what in REFUSED),
)


class _BoardState(IntEnum):
    """What a board does."""

    OFF = 0
    BOOTING = 1
    RUNNING = 2


class _SolderedLines(Protocol):
    """What is soldered to a board and is let go without a word when its supply goes."""

    def cut(self) -> None:
        """Close all that was opened since the latest time."""


_StartSystem = Callable[[NodeManager, ExitStack], None]
"""Makes the system of a board that has booted; what it enters is left when the supply goes."""


class Board:
    """A board that boots, runs its system, and loses it with its supply; an item of a `Schedule`.

    A power cut is no shutdown: no component is deactivated, no device told, and all caches are
    gone. A new boot makes everything anew. The reset button does the same.

    Args:
        limits: of the node.
        start: makes its system.
        lines: are cut with the supply.

    Attributes:
        inputs: what is done to it.
        manager: its system while it runs, else None.
        boots: how often it was up.
    """

    def __init__(self, limits: NodeLimits, start: _StartSystem, lines: _SolderedLines) -> None:
        self.limits, self._start, self._lines = limits, start, lines
        self.inputs = InputBank(INPUTS, on_change=self._input_set)
        self.manager: NodeManager | None = None
        self.boots, self._changed, self._up_us = 0, True, NEVER
        self._state, self._stack = _BoardState.OFF, ExitStack()
        self._refused = dict.fromkeys(REFUSED, 0)

    @property
    def tick_us(self) -> int:
        """How finely it keeps time."""
        return self.limits.tick_us

    @property
    def due_us(self) -> int:
        """When it has something to do."""
        if self._changed:
            return 0
        return self._up_us if self.manager is None else self.manager.due_us

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """What `read` knows."""
        return {output.name: output for output in _OUTPUTS}

    def read(self, name: str, /) -> int:
        """Look at an output; KeyError if there is none of that name."""
        manager = self.manager
        if name.startswith("refused_"):
            what = name.removeprefix("refused_")
            return self._refused[what] + (manager.refused[what] if manager else 0)
        components = len(manager.components) if manager else 0
        return {"state": self._state, "boots": self.boots, "components": components}[name]

    def tick(self, now_us: int, /) -> None:
        """Go on: lose or get the supply, boot, run what is due."""
        if self._changed:
            self._inputs_changed(now_us)
        if self._state is _BoardState.BOOTING and now_us >= self._up_us:
            self._begin(now_us)
        if self.manager is not None:
            self.manager.tick(now_us)

    def close(self) -> None:
        """End in order: each component is deactivated."""
        for component in self.manager.components if self.manager else ():
            for context in tuple(component.contexts):
                context.close()
        self._lose()

    def _input_set(self) -> None:
        self._changed = True

    def _inputs_changed(self, now_us: int) -> None:
        self._changed = False
        # Holding the reset button is being without supply; letting it go begins the boot.
        off = bool(self.inputs["power_cut"] or self.inputs["reset"])
        if off and self._state is not _BoardState.OFF:
            self._lose()
        elif not off and self._state is _BoardState.OFF:
            self._state, self._up_us = _BoardState.BOOTING, now_us + self.limits.boot_us

    def _begin(self, now_us: int) -> None:
        self.manager = manager = NodeManager(self.limits)
        manager.now_us, self._up_us = now_us, NEVER
        self._start(manager, self._stack)
        self._state = _BoardState.RUNNING
        self.boots += 1

    def _lose(self) -> None:
        """Be without supply: nothing of the system is left."""
        for what in REFUSED:
            self._refused[what] += self.manager.refused[what] if self.manager else 0
        self._state, self.manager, self._up_us = _BoardState.OFF, None, NEVER
        # Lines before the stack: a power cut says nothing to anybody, and closing doors in
        # order would.
        self._lines.cut()
        self._stack.close()
