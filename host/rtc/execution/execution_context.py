"""A periodic execution context: when its components run, and in which order."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tickrig.host.rtc.execution.execution_contexts import ExecutionContexts
from tickrig.host.rtc.execution.participant import Callback, Participant
from tickrig.host.rtc.states import ExecutionKind, LifeCycleState, ReturnCode
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.rtc.component import RtComponent

MoveListener = Callable[["RtComponent", LifeCycleState, ReturnCode], object]

SECOND_US: Final = 1_000_000
MAX_RATE_HZ: Final = 1_000_000
MIN_RATE_HZ: Final = 1e-6
"""One period in eleven days."""


class ExecutionContext:
    """Runs components period by period: three passes over all of them, in the order of adding.

    - pre: moves that were asked for (activate, deactivate, reset, abort);
    - do: on_execute in Active, on_error in Error;
    - post: on_state_update in Active.

    Requests are checked when they are made, and take effect in the next
    period: nothing waits. Periods fall on the multiples of `period_us`.
    It is PERIODIC; EVENT_DRIVEN and OTHER are not emulated.

    Args:
        rate_hz: periods a second, 1 uHz to 1 MHz; a period is a whole number of microseconds.

    Attributes:
        due_us: when the next period begins; `NEVER` while it is stopped.
        rate_hz: periods a second.
        period_us: one period.
        running: between start and stop.
        allows_period: asked for each new period in us, where not all are possible.
        on_move: called with a component, its state and what the callback of the move returned,
            after each move that it made or, after on_reset, could not make; Created if it left.

    Raises:
        ValueError: a rate that is not in the range.
    """

    kind: Final = ExecutionKind.PERIODIC

    def __init__(self, rate_hz: float = 1_000.0) -> None:
        if not _possible(rate_hz):
            raise ValueError(f"rate {rate_hz} Hz is not in {MIN_RATE_HZ}..{MAX_RATE_HZ} Hz")
        self._ticked_us, self.due_us, self.running = 0, NEVER, False
        self._others = ExecutionContexts()
        self.rate_hz, self.period_us = rate_hz, _period_us(rate_hz)
        self._participants: tuple[Participant, ...] = ()
        self._by_id: dict[int, Participant] = {}
        self.allows_period: Callable[[int], bool] | None = None
        self.on_move: list[MoveListener] = []

    @property
    def now_us(self) -> int:
        """The time of the latest tick; what callbacks take as the present."""
        ticked_us, quiet_us = self._ticked_us, self._others.quiet_us
        return ticked_us if ticked_us > quiet_us else quiet_us  # noqa: FURB136 - twice as fast

    @property
    def components(self) -> tuple[RtComponent, ...]:
        """The participants, in the order in which they run."""
        return tuple(participant.component for participant in self._participants)

    def tick(self, now_us: int) -> None:
        """Go on, and run a period if one is due.

        Args:
            now_us: the present.
        """
        self._ticked_us = now_us
        if now_us < self.due_us:
            return
        self._plan()
        participants = self._participants
        for step in _PASSES:
            for participant in participants:
                if self.running:
                    step(participant)

    def start(self) -> ReturnCode:
        """Start it, with on_startup of every participant.

        Returns:
            PRECONDITION_NOT_MET if it runs or a participant is not alive.
        """
        if self.running or not all(component.alive for component in self.components):
            return ReturnCode.PRECONDITION_NOT_MET
        self.running = True
        self._plan()
        self._notify(lambda component: component.on_startup)
        return ReturnCode.RTC_OK

    def stop(self) -> ReturnCode:
        """Stop it, with on_shutdown of every participant; their states stay as they are.

        Returns:
            PRECONDITION_NOT_MET unless it runs.
        """
        if not self.running:
            return ReturnCode.PRECONDITION_NOT_MET
        self.running, self.due_us = False, NEVER
        self._others.replan()
        self._notify(lambda component: component.on_shutdown)
        return ReturnCode.RTC_OK

    def join(self, others: ExecutionContexts) -> None:
        """Go on with others from now on; a `Manager` sees to it.

        Args:
            others: are told when it is due at another time.
        """
        self._ticked_us, self._others = self.now_us, others

    def close(self) -> None:
        """Deactivate all participants at once, stop, and let them go."""
        for participant in self._participants:
            participant.leave()
        self.stop()
        for participant in self._participants:
            self._release(participant)

    def set_rate(self, rate_hz: float) -> ReturnCode:
        """Change the rate, with on_rate_changed of every participant.

        Args:
            rate_hz: periods a second.

        Returns:
            BAD_PARAMETER unless 1 uHz <= rate <= 1 MHz, and its period is allowed.
        """
        if not _possible(rate_hz):
            return ReturnCode.BAD_PARAMETER
        if self.allows_period is not None and not self.allows_period(_period_us(rate_hz)):
            return ReturnCode.BAD_PARAMETER
        self.rate_hz, self.period_us = rate_hz, _period_us(rate_hz)
        if self.running:
            self._plan()
        self._notify(lambda component: component.on_rate_changed)
        return ReturnCode.RTC_OK

    def add_component(self, component: RtComponent) -> ReturnCode:
        """Let a component take part, Inactive, after all that do.

        Args:
            component: which.

        Returns:
            PRECONDITION_NOT_MET if it takes part already.
        """
        if self._find(component) is not None:
            return ReturnCode.PRECONDITION_NOT_MET
        participant = self._by_id[id(component)] = Participant(component, self)
        self._participants += (participant,)
        component.contexts.append(self)
        return ReturnCode.RTC_OK

    def remove_component(self, component: RtComponent) -> ReturnCode:
        """Let a component take part no more.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part, PRECONDITION_NOT_MET while it is Active.
        """
        participant = self._find(component)
        if participant is None:
            return ReturnCode.BAD_PARAMETER
        if participant.state is LifeCycleState.ACTIVE:
            return ReturnCode.PRECONDITION_NOT_MET
        self._release(participant)
        return ReturnCode.RTC_OK

    def release_component(self, component: RtComponent) -> ReturnCode:
        """Let a component take part no more, with on_deactivated at once if it is Active.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part.
        """
        participant = self._find(component)
        if participant is None:
            return ReturnCode.BAD_PARAMETER
        self._release(participant)
        return ReturnCode.RTC_OK

    def activate_component(self, component: RtComponent) -> ReturnCode:
        """Ask for Inactive to Active.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part or is not alive, PRECONDITION_NOT_MET
            unless it is Inactive.
        """
        return self._request(component, LifeCycleState.INACTIVE, LifeCycleState.ACTIVE)

    def deactivate_component(self, component: RtComponent) -> ReturnCode:
        """Ask for Active to Inactive.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part or is not alive, PRECONDITION_NOT_MET
            unless it is Active and not on its way to Error.
        """
        return self._request(component, LifeCycleState.ACTIVE, LifeCycleState.INACTIVE)

    def reset_component(self, component: RtComponent) -> ReturnCode:
        """Ask for Error to Inactive.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part or is not alive, PRECONDITION_NOT_MET
            unless it is in Error.
        """
        return self._request(component, LifeCycleState.ERROR, LifeCycleState.INACTIVE)

    def abort_component(self, component: RtComponent) -> ReturnCode:
        """Ask for Error, from Inactive or Active; for a proxy whose device went there.

        Not in OMG RTC, where only a callback that fails leads to Error.

        Args:
            component: which.

        Returns:
            BAD_PARAMETER if it does not take part or is not alive, PRECONDITION_NOT_MET
            if it is in Error.
        """
        participant = self._find(component)
        if participant is None or not component.alive:
            return ReturnCode.BAD_PARAMETER
        if participant.state is LifeCycleState.ERROR:
            return ReturnCode.PRECONDITION_NOT_MET
        participant.abort()
        return ReturnCode.RTC_OK

    def state_of(self, component: RtComponent) -> LifeCycleState:
        """Return the state of a component here; Created if it is not alive or takes no part."""
        participant = self._find(component)
        if participant is None or not component.alive:
            return LifeCycleState.CREATED
        return participant.state

    def _request(
        self, component: RtComponent, source: LifeCycleState, wanted: LifeCycleState
    ) -> ReturnCode:
        participant = self._find(component)
        if participant is None or not component.alive:
            return ReturnCode.BAD_PARAMETER
        return participant.request(source, wanted)

    def _release(self, participant: Participant) -> None:
        participant.leave()
        self._participants = tuple(p for p in self._participants if p is not participant)
        del self._by_id[id(participant.component)]
        participant.component.contexts.remove(self)

    def _find(self, component: RtComponent) -> Participant | None:
        return self._by_id.get(id(component))

    def _plan(self) -> None:
        """Plan the next period."""
        now_us = self.now_us
        self.due_us = now_us - now_us % self.period_us + self.period_us
        self._others.replan()

    def _notify(self, callback: Callable[[RtComponent], Callback]) -> None:
        for participant in self._participants:
            participant.notify(callback(participant.component))


_PASSES: Final = (Participant.pre, Participant.do, Participant.post)


def _possible(rate_hz: float) -> bool:
    return MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ


def _period_us(rate_hz: float) -> int:
    return round(SECOND_US / rate_hz)
