"""The hands at what has inputs and outputs and no wire, and its control socket."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final

from tickrig.device.physical import SignalType
from tickrig.emulators.bench.fault_spec import FaultSpec, parse_fault_spec
from tickrig.emulators.bench.operator import PRESS_US, Operator
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.host.control.requests import Object, RequestDispatcher, short, text_of, whole
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting

_MAX_PRESS_US: Final = 10**12


class NoWire:
    """A wire that has no faults."""

    fault_types: Mapping[str, object] = MappingProxyType({})
    armed: tuple[str, ...] = ()

    def check(self, name: str, rate: float | None) -> None:
        """Allow everything: nothing is asked."""

    def arm(self, name: str, rate: float | None = None) -> None:
        """Do nothing."""

    def clear(self, name: str) -> None:
        """Do nothing."""


class Operated(RequestDispatcher):
    """A thing, and what is done to it, now or at a later time; answers requests about it.

    Its verbs are those of an emulator (docs: control) but `lines`.

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
        self._name, self._thing, self._stop, self._more = name, thing, stop, status
        self._events, self.now_us = EventQueue(), 0
        self.operator = Operator(thing.inputs, thing.tick_us, self._events, NoWire())  # type: ignore[arg-type] # it has no fault
        super().__init__(
            {
                "describe": (self._describe, ()),
                "get": (self._get, ("names",)),
                "set": (self._set, ("name", "value")),
                "press": (self._press, ("name", "duration_us")),
                "fault": (self._fault, ("spec",)),
                "clear": (self._clear, ("name",)),
                "status": (self._status, ("since",)),
                "stop": (self._stopped, ()),
            }
        )

    @property
    def due_us(self) -> int:
        """When something is to be done next; `NEVER` if nothing is."""
        return self._events.due_us

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

    def _describe(self, request: Object) -> Object:
        inputs, outputs = self._thing.inputs, self._thing.outputs
        return {
            "device": self._name,
            "tick_us": self._thing.tick_us,
            "inputs": [
                {
                    **{"name": item.name, "text": item.text, "kind": item.type.value},
                    **{"low": item.low, "high": item.high, "unit": item.unit},
                }
                for item in inputs.table.values()
            ],
            "groups": {name: list(members) for name, members in inputs.groups.items()},
            "outputs": [
                {"name": item.name, "text": item.text, "unit": item.unit}
                for item in outputs.values()
            ],
            "wire_faults": [],
        }

    def _get(self, request: Object) -> Object:
        known = [*self._thing.inputs.table, *self._thing.outputs]
        names = request.get("names", known)
        if not isinstance(names, list):
            raise ValueError(f"names is a list of names, not {short(names)}")
        if unknown := [name for name in names if name not in known]:
            raise ValueError(
                f"no input or output {short(unknown[0])}; {near(str(unknown[0]), known)}"
            )
        return {"values": {name: read_signal(self._thing, name) for name in names}}

    def _set(self, request: Object) -> Object:
        name, value = text_of(request, "name"), request.get("value")
        self.operator.set(name, *map(_setting, value if isinstance(value, list) else [value]))
        return {}

    def _press(self, request: Object) -> Object:
        duration_us = whole(request.get("duration_us", PRESS_US), "duration_us", 1, _MAX_PRESS_US)
        self.operator.press(self.now_us, text_of(request, "name"), duration_us)
        return {}

    def _fault(self, request: Object) -> Object:
        spec = parse_fault_spec(text_of(request, "spec"), self.operator.check_clear)
        self.operator.fault(self.now_us, spec)
        return {}

    def _clear(self, request: Object) -> Object:
        self.operator.clear(text_of(request, "name"))
        return {}

    def _status(self, request: Object) -> Object:
        faults = [
            name for name in self._thing.inputs.names(SignalType.FAULT) if self._thing.inputs[name]
        ]
        return {"now_us": self.now_us, "faults": faults, **self._more()}

    def _stopped(self, request: Object) -> Object:
        self._stop()
        return {}


def _setting(value: object) -> Setting:
    if not isinstance(value, int | float | str):
        raise ValueError(f"a value is a number or a text, not {short(value)}")
    return value
