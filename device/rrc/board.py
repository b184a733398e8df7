"""The board of an RRC: its power stage, load, buzzer and terminals."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.device.rrc.settings import POWERED_ON, FailTarget, Move, RrcConfig, RrcState
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import message
from tickrig.wire.rrc.replies import RrcEvent

# Physical inputs and outputs of the RRC and of the VR2 around it.

_BUTTON: Final = SignalType.BUTTON
_FAULT: Final = SignalType.FAULT

INPUTS: Final = (
    InputSignal("rrc_power", "supply of the RRC, from the VR2 battery or USB", initial=1),
    InputSignal("power_button", "power button of the controller", _BUTTON),
    InputSignal("alarm_button", "alarm button of the controller", _BUTTON),
    InputSignal("speed_up_button", "speed mode up, on the controller", _BUTTON),
    InputSignal("speed_down_button", "speed mode down, on the controller", _BUTTON),
    InputSignal("stick_v_pct", "stick, forward is positive", low=-100, high=100, unit="%"),
    InputSignal("stick_w_pct", "stick, right is positive", low=-100, high=100, unit="%"),
    InputSignal("gauge", "voltage gauge of the battery", low=1, high=10, initial=10),
    InputSignal(
        "extra_load_pct", "work of the RRC beside its own, per period", high=1_000, unit="%"
    ),
    InputSignal("bus_noise", "noise on the VR2 bus", _FAULT),
    InputSignal("joystick_fault", "the joystick module says nonsense", _FAULT),
    InputSignal("power_module_fault", "the power module says nonsense", _FAULT),
    InputSignal("vr2_fault", "VR2 has an error of its own, as a motor without its cable", _FAULT),
    InputSignal("bus_unplugged", "a connector of the VR2 bus is out", _FAULT),
)

_RUNNING_FAULTS: Final = {
    "bus_noise": RrcEvent.BY_COMMUNICATION_ERROR,
    "joystick_fault": RrcEvent.BY_JOYSTICK_MODULE_ERROR,
    "power_module_fault": RrcEvent.BY_POWER_MODULE_ERROR,
    "vr2_fault": RrcEvent.BY_SYSTEM_ERROR,
    "bus_unplugged": RrcEvent.BY_NO_COMMUNICATION,
}
"""Event names by fault, for faults that have lasted (condition 8, DECISION R25)."""

_POWER_ON_FAULTS: Final = {
    "bus_noise": RrcEvent.POWER_ON_ERROR1,
    "joystick_fault": RrcEvent.POWER_ON_ERROR1,
    "power_module_fault": RrcEvent.POWER_ON_ERROR2,
    "vr2_fault": RrcEvent.POWER_ON_ERROR2,
}
"""Effect of each fault on a power-on. The manual lists two causes, but does not assign them to
faults."""

OUTPUTS: Final = {
    output.name: output
    for output in (
        OutputSignal("state", "state of the RRC"),
        OutputSignal("vr2_power", "1 while VR2 runs"),
        OutputSignal("error_led", "1 while the controller's LED blinks an error"),
        OutputSignal(
            "stick_drives", "1 while the stick drives, 0 while it waits or the host drives"
        ),
        OutputSignal("out_v_pct", "translation to the power module", "%"),
        OutputSignal("out_w_pct", "rotation to the power module", "%"),
        OutputSignal("speed_mode", "speed mode of VR2, 1 to 5"),
        OutputSignal("gear", "imitated gear: N, F or R"),
        OutputSignal("buzzer", "1 while the RRC's buzzer sounds"),
        OutputSignal("load_pct", "work of the RRC, mean of 100 ms; 0 while VR2 is off", "%"),
        OutputSignal("margin_pct", "100 minus load_pct; below 0 the RRC falls behind", "%"),
        OutputSignal("backlog_pct", "work that the RRC is behind, of a period; 300 stops VR2", "%"),
        OutputSignal("pace_lines_s", "lines a second that a host may send, at 90 % load", "1/s"),
        OutputSignal("speed_mm_s", "true speed of the vehicle, forward is positive", "mm/s"),
        OutputSignal("turn_mrad_s", "true turning speed, right is positive", "mrad/s"),
        OutputSignal("distance_mm", "way of the vehicle, backing counts negative", "mm"),
        OutputSignal("heading_mrad", "how far the vehicle has turned to the right", "mrad"),
        OutputSignal("battery_permille", "how full the battery of the vehicle is", "0.1 %"),
    )
}


def new_inputs() -> InputBank:
    """Return the physical inputs of an RRC at the start.

    The supply is on, the battery is full, and the stick and all buttons are at rest.
    """
    return InputBank(INPUTS, groups={"stick": ("stick_v_pct", "stick_w_pct")})


# The work load of the RRC, and its overload (DECISION R27).

_SHOWN_PERIODS: Final = 10
"""Number of periods in the mean `load_pct`."""


@dataclass(slots=True)
class LoadAccount:
    """Account of the work of an RRC, a wheelchair controller: it shows when the RRC cannot keep up.

    Work that does not fit into a period of 10 ms is left over for the next one. Each received line
    feed costs work, whatever happens to its line, and so do bytes that an overflow discards. Two
    commands and a status line take exactly one period, so the backlog stays constant. Two OK lines
    in addition exceed the period by 30 %, and the RRC stops the wheelchair (VR2) in the tenth such
    tick.

    Attributes:
        backlog_pct: work that is left over, in per cent of a period.
        extra_pct: work that a physical input adds, in per cent of a period.
        settled: whether a period without traffic leaves this account unchanged.
    """

    backlog_pct: int = 0
    extra_pct: int = 0
    settled: bool = True
    _costs_pct: tuple[int, ...] = (0,) * _SHOWN_PERIODS  # of the latest periods

    @property
    def load_pct(self) -> int:
        """Mean work of the latest 100 ms; the part above 100 becomes backlog."""
        costs_pct: int = sum(self._costs_pct)
        return costs_pct // _SHOWN_PERIODS

    @property
    def too_far_behind(self) -> bool:
        """Whether the backlog is so large that the RRC stops VR2."""
        return self.backlog_pct >= message.TOO_FAR_BEHIND_PCT

    def spend(
        self, line_feeds: int, overflows: int, replies: int, *, status: bool, extra_pct: int
    ) -> None:
        """Update the backlog of work for one period in which the wheelchair (VR2) runs.

        The emulated RRC needs time for its work, and the backlog is the work that it has not
        finished. The work of this period is added to the backlog, and the work that the RRC can do
        in a period is subtracted.

        Args:
            line_feeds: number of received line feeds.
            overflows: number of overflows of the receive buffer. After an overflow, each block of
                256 discarded bytes counts as one more overflow.
            replies: number of lines sent, except overflow errors and the status line.
            status: whether a status line was sent.
            extra_pct: work that a physical input adds, in per cent of a period.
        """
        self.extra_pct = extra_pct
        idle_pct = message.BASE_PCT + extra_pct + (message.STATUS_PCT if status else 0)
        cost_pct = idle_pct + message.LINE_FEED_PCT * line_feeds + message.OVERFLOW_PCT * overflows
        cost_pct += message.REPLY_PCT * replies
        self.backlog_pct = max(0, self.backlog_pct + cost_pct - message.PERIOD_PCT)
        # The account is settled after ten idle periods in a row. Until then `load_pct`, a mean of
        # the last ten periods, still changes without traffic, so each tick must run.
        self._costs_pct = (*self._costs_pct[1:], cost_pct)
        idle = cost_pct == idle_pct and not self.backlog_pct
        self.settled = idle and self._costs_pct.count(idle_pct) == _SHOWN_PERIODS


# The RRC's buzzer: patterns of the host, and the automatic alarm below them.

_ALARM_TICKS: Final = 50
"""Duration of each sound and each pause of the automatic alarm (DECISION R18)."""


@dataclass(slots=True)
class Buzzer:
    """The buzzer of the RRC, which plays patterns of the host and the automatic alarm.

    Attributes:
        sounding: whether the buzzer sounded in the latest tick.
        changes_at: number of the next tick at which `sounding` may change without input.
    """

    sounding: bool = False
    changes_at: int | None = None
    _phases: deque[tuple[int, bool]] = field(default_factory=deque, init=False)  # (end, on)

    def play(self, tick: int, times: tuple[int, ...]) -> None:
        """Start a pattern of the host in the next tick. It replaces the present pattern.

        If all times are zero, the buzzer is silent (DECISION R24).

        Args:
            tick: number of the present tick.
            times: times in ticks, alternately on and off. A zero time skips its phase.
        """
        self._phases.clear()
        # A pattern begins in the tick after its command (R24). The first phase is silent and ends
        # in that tick.
        end = tick + 1
        self._phases.append((end, False))
        for number, ticks in enumerate(times):
            end += ticks
            if ticks:
                self._phases.append((end, number % 2 == 0))

    def silence(self) -> None:
        """Drop the host's pattern."""
        self._phases.clear()

    def tick(self, tick: int, alarm_since: int | None) -> None:
        """Compute whether the buzzer sounds in this tick.

        Args:
            tick: number of the tick.
            alarm_since: tick at which the automatic alarm started, or None without an alarm.
        """
        while self._phases and tick >= self._phases[0][0]:
            self._phases.popleft()
        # A pattern of the host has priority over the automatic alarm, also during the silent phases
        # of the pattern (R18).
        if self._phases:
            self.changes_at, self.sounding = self._phases[0]
        elif alarm_since is not None:
            periods, rest = divmod(tick - alarm_since, _ALARM_TICKS)
            self.sounding, self.changes_at = periods % 2 == 0, tick - rest + _ALARM_TICKS
        else:
            self.sounding, self.changes_at = False, None


# The power sequence: button, faults and time, but no commands.


class Step(NamedTuple):
    """Result of a tick: an event to send, or a transition to make."""

    event: str | None = None
    move: Move | None = None


_NOTHING: Final = Step()


@dataclass(slots=True)
class PowerSequence:
    """Watches power button, faults and time.

    Attributes:
        config: configuration with durations and names.
    """

    config: RrcConfig
    _button: int = field(default=0, init=False)
    _since: int | None = field(default=None, init=False)  # the present wait began
    _faults: dict[str, int] = field(default_factory=dict, init=False)  # present since

    def enter(self, state: RrcState, tick: int) -> None:
        """Start the wait of a state; in other states the power button starts it."""
        timed = state in (RrcState.INITIALIZE, RrcState.POWER_OFF_BY_BUTTON)
        self._since = tick if timed else None
        self._faults.clear()

    def step(self, state: RrcState, tick: int, inputs: InputBank) -> Step:
        """Check once a tick whether a button, a fault or the time changes the state of the RRC.

        In the state Initialize the power button has no effect yet.
        """
        if state is RrcState.INITIALIZE and self._since is not None:
            return self._waiting(state, tick - self._since, inputs)
        # An edge counts, not a level: a button that is held from one state into the next acts once.
        # Edges are not followed in Initialize, so a press in Initialize counts in the first tick of
        # the state after it.
        pressed = inputs["power_button"] > self._button
        self._button = inputs["power_button"]
        if state in POWERED_ON:
            return self._running(tick, inputs, pressed=pressed)
        if pressed and self._since is None:
            return self._begin(state, tick)
        if self._since is None:
            return _NOTHING
        return self._waiting(state, tick - self._since, inputs)

    @property
    def waiting(self) -> bool:
        """Whether a fault is present that has not lasted long enough to be detected."""
        return bool(self._faults)

    def due_tick(self, state: RrcState) -> int:
        """Return the next tick at which something happens without input."""
        holds = (since + self.config.fault_hold_ticks for since in self._faults.values())
        if self._since is None:
            # No wait is running. Either the RRC waits for the button, or VR2 runs and a fault may
            # be about to be detected.
            return min(holds, default=NEVER)
        return self._since + self._wait_ticks(state)

    def _running(self, tick: int, inputs: InputBank, *, pressed: bool) -> Step:
        if pressed:
            return Step(RrcEvent.BY_BUTTON, Move.POWER_BUTTON)
        # In the order of the table: if two faults are detected in one tick, the first of them is
        # the cause. `>=` counts from the tick in which the fault was first seen: 10 ticks are
        # 100 ms (R25, corrected).
        for name, event in _RUNNING_FAULTS.items():
            if not inputs[name]:
                self._faults.pop(name, None)
            elif tick - self._faults.setdefault(name, tick) >= self.config.fault_hold_ticks:
                return Step(event, Move.FORCED)
        return _NOTHING

    def _begin(self, state: RrcState, tick: int) -> Step:
        """Start power-on, or the end of a forced stop, after the power button."""
        self._since = tick
        return Step(self.config.power_on_event) if state is RrcState.WAIT_POWER_ON else _NOTHING

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
            return _NOTHING
        match state:
            case RrcState.INITIALIZE:
                return Step(RrcEvent.INITIALIZED, Move.INITIALIZED)
            case RrcState.WAIT_POWER_ON:
                return self._power_on_result(waited, inputs)
            case _:
                return Step(RrcEvent.POWER_OFF_FINISHED, Move.TRAFFIC_ENDED)

    def _power_on_result(self, waited: int, inputs: InputBank) -> Step:
        # Without an answer of VR2 the test cannot end. It continues until the time-out, or until
        # the connector is plugged in again.
        if inputs["bus_unplugged"]:
            if waited < self.config.power_on_timeout_ticks:
                return _NOTHING
            return self._power_on_failed(RrcEvent.POWER_ON_TIMEOUT)
        for name, event in _POWER_ON_FAULTS.items():
            if inputs[name]:
                return self._power_on_failed(event)
        self._since = None
        return Step(RrcEvent.POWER_ON_SUCCESS, Move.POWER_ON_SUCCEEDED)

    def _power_on_failed(self, event: RrcEvent) -> Step:
        self._since = None
        # Without a move, state and settings stay (R3). With a move, `_move` passes through
        # Initialize and wipes the settings.
        again = self.config.power_on_fail_target is FailTarget.INITIALIZE
        return Step(event, Move.POWER_ON_FAILED if again else None)
