"""The way through power-on and power-off: button, faults and time, but no commands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tickrig.device.physical import InputBank
from tickrig.device.rrc.config import FailTarget, RrcConfig
from tickrig.device.rrc.states import POWERED_ON, Move, RrcState
from tickrig.device.rrc.terminals import POWER_ON_FAULTS, RUNNING_FAULTS
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc.replies import RrcEvent


class Step(NamedTuple):
    """What a tick brings: an event to send, a move to make."""

    event: str | None = None
    move: Move | None = None


NOTHING: Final = Step()


@dataclass(slots=True)
class PowerSequence:
    """Watches power button, faults and time.

    Attributes:
        config: durations and names.
    """

    config: RrcConfig
    _button: int = field(default=0, init=False)
    _since: int | None = field(default=None, init=False)  # the present wait began
    _faults: dict[str, int] = field(default_factory=dict, init=False)  # present since

    def enter(self, state: RrcState, tick: int) -> None:
        """Begin the wait of a state; the power button begins that of the others."""
        timed = state in (RrcState.INITIALIZE, RrcState.POWER_OFF_BY_BUTTON)
        self._since = tick if timed else None
        self._faults.clear()

    def step(self, state: RrcState, tick: int, inputs: InputBank) -> Step:
        """Look at the physical side, once a tick; Initialize does not see the button yet."""
        if state is RrcState.INITIALIZE and self._since is not None:
            return self._waiting(state, tick - self._since, inputs)
        pressed = inputs["power_button"] > self._button
        self._button = inputs["power_button"]
        if state in POWERED_ON:
            return self._running(tick, inputs, pressed=pressed)
        if pressed and self._since is None:
            return self._begin(state, tick)
        if self._since is None:
            return NOTHING
        return self._waiting(state, tick - self._since, inputs)

    def due_tick(self, state: RrcState) -> int:
        """Return the next tick at which something happens without input."""
        holds = (since + self.config.fault_hold_ticks for since in self._faults.values())
        if self._since is None:
            return min(holds, default=NEVER)
        return self._since + self._wait_ticks(state)

    def _running(self, tick: int, inputs: InputBank, *, pressed: bool) -> Step:
        if pressed:
            return Step(RrcEvent.BY_BUTTON, Move.POWER_BUTTON)
        for name, event in RUNNING_FAULTS.items():
            if not inputs[name]:
                self._faults.pop(name, None)
            elif tick - self._faults.setdefault(name, tick) >= self.config.fault_hold_ticks:
                return Step(event, Move.FORCED)
        return NOTHING

    def _begin(self, state: RrcState, tick: int) -> Step:
        """Start what the power button starts: power-on, or the end of a forced stop."""
        self._since = tick
        return Step(self.config.power_on_event) if state is RrcState.WAIT_POWER_ON else NOTHING

    def _wait_ticks(self, state: RrcState) -> int:
        match state:
            case RrcState.INITIALIZE:
                return self.config.initialize_ticks
            case RrcState.WAIT_POWER_ON:
                return self.config.power_on_ticks
            case RrcState.POWER_OFF_BY_BUTTON:
                return self.config.button_off_ticks
            case _:
                return self.config.forced_off_ticks

    def _waiting(self, state: RrcState, waited: int, inputs: InputBank) -> Step:
        if waited < self._wait_ticks(state):
            return NOTHING
        match state:
            case RrcState.INITIALIZE:
                return Step(RrcEvent.INITIALIZED, Move.INITIALIZED)
            case RrcState.WAIT_POWER_ON:
                return self._power_on_result(waited, inputs)
            case _:
                return Step(RrcEvent.POWER_OFF_FINISHED, Move.TRAFFIC_ENDED)

    def _power_on_result(self, waited: int, inputs: InputBank) -> Step:
        if inputs["bus_unplugged"]:
            if waited < self.config.power_on_timeout_ticks:
                return NOTHING
            return self._power_on_failed(RrcEvent.POWER_ON_TIMEOUT)
        for name, event in POWER_ON_FAULTS.items():
            if inputs[name]:
                return self._power_on_failed(event)
        self._since = None
        return Step(RrcEvent.POWER_ON_SUCCESS, Move.POWER_ON_SUCCEEDED)

    def _power_on_failed(self, event: RrcEvent) -> Step:
        self._since = None
        again = self.config.power_on_fail_target is FailTarget.INITIALIZE
        return Step(event, Move.POWER_ON_FAILED if again else None)
