"""What is done to a thing that has inputs and outputs and no wire."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from tickrig.emulators.bench.operator import AssemblyFaults, FaultSpec, Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue


class Operated:
    """A thing without a wire, and what is done to it, now or at a later time.

    `EmulatorControl` answers requests about it.

    Args:
        name: of the thing.
        thing: has inputs and outputs.
        stop: called when somebody asks for the end.
        status: gives more for the request `status`.

    Attributes:
        operator: does what is asked for.
        now_us: the present, as `tick` was told.
    """

    def __init__(
        self,
        name: str,
        thing: HasSignals,
        stop: Callable[[], None] = lambda: None,
        status: Callable[[], Mapping[str, object]] = dict,
    ) -> None:
        self.name, self.device, self.stop, self._more = name, thing, stop, status
        self._events, self.now_us, self.wire = EventQueue(), 0, AssemblyFaults({})
        self.operator = Operator(thing.inputs, thing.tick_us, self._events, self.wire)

    @property
    def due_us(self) -> int:
        """When something is to be done next; `NEVER` if nothing is."""
        return self._events.due_us

    @property
    def effective_us(self) -> int:
        """When what is done now takes effect."""
        return self.now_us

    def tick(self, now_us: int, /) -> None:
        """Do what is due."""
        self.now_us = now_us
        self._events.run(now_us)

    def plan(self, faults: Iterable[FaultSpec]) -> None:
        """Let faults come at their times.

        Raises:
            ValueError: one cannot be.
        """
        for spec in faults:
            self.operator.fault(self.now_us, spec)

    def status(self) -> Mapping[str, object]:
        """Return how it is going."""
        faults = list(self.operator.active_faults)
        return {"now_us": self.now_us, "faults": faults, **self._more()}
