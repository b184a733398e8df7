"""Faults of a wire: what happens to traffic on its way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic

from tickrig.device.chance import Chance, check_rate, threshold_of
from tickrig.device.core import W
from tickrig.device.twin import Copyable, Immutable, Listeners
from tickrig.emulators.rig.port import Port
from tickrig.host.text.trace import Mark

Fault = Callable[[int, W], W]
"""What a fault makes of the traffic that passes at a time in us; it is state, so no closure."""


class HoldingFault(ABC, Generic[W]):
    """A fault that holds traffic back, and lets it go later."""

    @property
    @abstractmethod
    def due_us(self) -> int:
        """When `release` has something to give; `NEVER` if nothing is held."""

    @abstractmethod
    def __call__(self, now_us: int, traffic: W, /) -> W:
        """Take traffic in; return what passes at once."""

    @abstractmethod
    def release(self, now_us: int) -> W | None:
        """Return what was held until now, None if nothing was."""

    def pair(self, other: HoldingFault[W]) -> None:
        """Share with the fault of the other direction what both directions have in common."""


@dataclass(frozen=True, slots=True)
class FaultType(Immutable, Generic[W]):
    """A fault that can be armed by name.

    Attributes:
        text: what it does, for people.
        make: builds the fault from its chance and the threshold of its rate.
        rated: whether it wants a rate.
    """

    text: str
    make: Callable[[Chance, int], Fault[W]]
    rated: bool = True


class FaultyPort(Copyable, Generic[W]):
    """A port whose traffic suffers the faults that are armed, in the order of arming.

    Each direction has a chance of its own, drawn only for traffic that is
    there: what happens one way, and ticks without traffic, change nothing.

    Args:
        port: the port behind it.
        fault_types: the faults that can be armed, by name.
        seed: seed of all chance in it.

    Attributes:
        seed: seed of all chance in it; a new one counts for faults that are armed from then on.
        drawn: whether a fault by chance was ever armed.
        listeners: called with the time, the direction, what was sent and what faults left of
            it, where that differs. Nobody listens to a twin.
    """

    def __init__(
        self, port: Port[W], fault_types: Mapping[str, FaultType[W]], seed: int = 0
    ) -> None:
        self._port, self.seed, self.drawn = port, seed, False
        self.fault_types = fault_types
        self._to_device: dict[str, Fault[W]] = {}
        self._from_device: dict[str, Fault[W]] = {}
        self.listeners: Listeners[Callable[[int, Mark, W, W], None]] = Listeners()

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the faults that are armed."""
        return tuple(self._to_device)

    def check(self, name: str, rate: float | None) -> None:
        """Raise ValueError unless the fault can be armed like this."""
        check_rate(name, rate, rated=self.fault_types[name].rated)

    def arm(self, name: str, rate: float | None = None) -> None:
        """Let a fault begin; one of the same name is replaced.

        Raises:
            KeyError: no fault has this name.
            ValueError: a rate is missing, out of range or too much.
        """
        self.check(name, rate)
        threshold, make = threshold_of(rate or 0), self.fault_types[name].make
        self.drawn |= rate is not None
        there = make(Chance(self.seed, f"{name} >"), threshold)
        back = make(Chance(self.seed, f"{name} <"), threshold)
        if isinstance(there, HoldingFault) and isinstance(back, HoldingFault):
            there.pair(back)
        self._to_device[name], self._from_device[name] = there, back

    def clear(self, name: str) -> None:
        """Let a fault end; what it holds is lost. Clearing one that is not armed is no error."""
        self._to_device.pop(name, None)
        self._from_device.pop(name, None)

    @property
    def due_us(self) -> int:
        """When the next traffic reaches the port behind, or a fault lets traffic go."""
        due_us = self._port.due_us
        for faults in (self._to_device, self._from_device):
            for fault in faults.values():
                if isinstance(fault, HoldingFault):
                    due_us = min(due_us, fault.due_us)
        return due_us

    def poll(self, now_us: int, /) -> W:
        """Take what has arrived and survived."""
        if (held := _released(self._from_device, now_us)) is not None:
            self._port.send(now_us, held)
        left = self._suffer(Mark.TO_DEVICE, self._to_device, now_us, self._port.poll(now_us))
        late = _released(self._to_device, now_us)
        return left if late is None else late + left  # type: ignore[operator] # bytes or frames

    def send(self, now_us: int, traffic: W, /) -> None:
        """Send what the faults leave of one tick's traffic."""
        left = self._suffer(Mark.FROM_DEVICE, self._from_device, now_us, traffic)
        self._port.send(now_us, left)

    def _suffer(self, mark: Mark, faults: Mapping[str, Fault[W]], now_us: int, traffic: W) -> W:
        if not (faults and traffic):
            return traffic
        left = traffic
        for fault in faults.values():
            if left:
                left = fault(now_us, left)
        if left != traffic:
            for hear in self.listeners:
                hear(now_us, mark, traffic, left)
        return left


def _released(faults: Mapping[str, Fault[W]], now_us: int) -> W | None:
    """Return what faults let go now; it meets those behind them as well."""
    released: W | None = None
    for fault in faults.values():
        if released:
            released = fault(now_us, released)
        if isinstance(fault, HoldingFault) and fault.due_us <= now_us:
            held = fault.release(now_us)
            if held is not None:
                released = held if released is None else released + held
    return released
