"""The board of a node with its supply, its boot, and the system that runs on the board."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from enum import IntEnum
from typing import Final, Protocol

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.emulators.tkernel.node_manager import NodeLimits, NodeManager
from tickrig.wire.instant import NEVER

_INPUTS: Final = (
    InputSignal("reset", "the reset button", SignalType.BUTTON),
    InputSignal("power_cut", "the supply is off, and everything is lost", SignalType.FAULT),
)

_REFUSED: Final = ("connectors", "interfaces", "messages", "periods")

_OUTPUTS: Final = (
    OutputSignal("state", "0 without supply, 1 while it boots, 2 while it runs"),
    OutputSignal("boots", "number of boots"),
    OutputSignal("components", "components on it"),
    *(OutputSignal(f"refused_{what}", f"{what} beyond its limits") for what in _REFUSED),
)


class _BoardState(IntEnum):
    """State of a board."""

    OFF = 0
    BOOTING = 1
    RUNNING = 2


class _SolderedLines(Protocol):
    """Hardware on a board that is disconnected without notice when the supply fails."""

    def cut(self) -> None:
        """Close everything opened since the last call."""


_StartSystem = Callable[[NodeManager, ExitStack], None]
"""Function that makes the system of a booted board; its contexts exit when the supply fails."""


class Board:
    """An emulated board: it boots and runs RT components, until a power cut or a reset ends them.

    A power cut is not a shutdown: no component is deactivated, no device is notified, and all
    caches are lost. The next boot makes all components again. The reset button has the same effect.
    A board is an item of a `Schedule`.

    Args:
        limits: limits of the board.
        start: function that makes the RT components of the board.
        lines: lines to devices, which are cut together with the supply.

    Attributes:
        inputs: inputs of the board: the reset button and the power cut.
        manager: manager of the RT components while they run, or None.
        boots: number of boots.
    """

    def __init__(self, limits: NodeLimits, start: _StartSystem, lines: _SolderedLines) -> None:
        self.limits, self._start, self._lines = limits, start, lines
        self.inputs = InputBank(_INPUTS, on_change=self._input_set)
        self.manager: NodeManager | None = None
        self.boots, self._changed, self._up_us = 0, True, NEVER
        self._state, self._stack = _BoardState.OFF, ExitStack()
        self._refused = dict.fromkeys(_REFUSED, 0)

    @property
    def tick_us(self) -> int:
        """Resolution of the board's time."""
        return self.limits.tick_us

    @property
    def due_us(self) -> int:
        """The time of the board's next event."""
        if self._changed:
            return 0
        return self._up_us if self.manager is None else self.manager.due_us

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return {output.name: output for output in _OUTPUTS}

    def read(self, name: str, /) -> int:
        """Return the present value of an output; raise KeyError if the name is unknown."""
        manager = self.manager
        if name.startswith("refused_"):
            what = name.removeprefix("refused_")
            return self._refused[what] + (manager.refused[what] if manager else 0)
        components = len(manager.components) if manager else 0
        return {"state": self._state, "boots": self.boots, "components": components}[name]

    def tick(self, now_us: int, /) -> None:
        """Advance the board: lose or get the supply, boot, run due events."""
        if self._changed:
            self._inputs_changed(now_us)
        if self._state is _BoardState.BOOTING and now_us >= self._up_us:
            self._begin(now_us)
        if self.manager is not None:
            self.manager.tick(now_us)

    def close(self) -> None:
        """Shut down, and deactivate each component."""
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
        """Switch the supply off, so that the system is lost."""
        for what in _REFUSED:
            self._refused[what] += self.manager.refused[what] if self.manager else 0
        self._state, self.manager, self._up_us = _BoardState.OFF, None, NEVER
        # Lines before the stack: a power cut says nothing to anybody, and closing doors in
        # order would.
        self._lines.cut()
        self._stack.close()
