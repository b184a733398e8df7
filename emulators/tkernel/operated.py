"""Operation of an object with inputs and outputs but without a wire."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from tickrig.emulators.bench.operator import AssemblyFaults, FaultSpec, Operator
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue


class Operated:
    """An emulated object that has no wire. An operator sets its inputs, at once or at a later time.

    `EmulatorControl` answers requests about the object.

    Args:
        name: name of the object.
        thing: object with its inputs and outputs.
        stop: function that is called when a request ends the run.
        status: function that returns additional data for the request `status`.

    Attributes:
        operator: operator that executes the actions.
        now_us: time of the latest `tick`, in microseconds.
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
        """The time of the next action, or `NEVER` if there is none."""
        return self._events.due_us

    @property
    def effective_us(self) -> int:
        """The time at which an action takes effect."""
        return self.now_us

    def tick(self, now_us: int, /) -> None:
        """Run due actions."""
        self.now_us = now_us
        self._events.run(now_us)

    def plan(self, faults: Iterable[FaultSpec]) -> None:
        """Schedule faults.

        Raises:
            ValueError: a fault is invalid.
        """
        for spec in faults:
            self.operator.fault(self.now_us, spec)

    def status(self) -> Mapping[str, object]:
        """Return the status of the object."""
        faults = list(self.operator.active_faults)
        return {"now_us": self.now_us, "faults": faults, **self._more()}
