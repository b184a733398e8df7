"""What may happen on a bench beside the calls of a host: faults, hands at inputs, traffic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tickrig.emulators.testing.bench.bench import Bench
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting


class WorldInput(NamedTuple):
    """An input that may change.

    Attributes:
        name: of the input.
        type: `level`, `button`.
        low: its smallest value.
        high: its largest value.
    """

    name: str
    type: str
    low: float
    high: float


class World:
    """The faults and inputs of a bench, as far as they may happen.

    Args:
        bench: the bench, in virtual time.
        faults: names of faults that may come; all unless given.
        inputs: names of inputs that may change; all but the objects of nodes unless given.

    Attributes:
        faults: whether each takes a rate, by name.
        inputs: those that may change.

    Raises:
        ValueError: there is no such fault or input.
    """

    def __init__(
        self,
        bench: Bench,
        faults: Sequence[str] | None = None,
        inputs: Sequence[str] | None = None,
    ) -> None:
        self._bench, described = bench, bench.describe()
        rated = {name: fault.rated for name, fault in described.faults.items()}
        table = [
            WorldInput(name, item.type.value, item.low, item.high)
            for name, item in described.inputs.items()
        ]
        movable = {item.name: item for item in table if item.type in ("level", "button")}
        usual = [name for name in movable if not name.rpartition("/")[2].startswith("0x")]
        self.faults = {name: rated[name] for name in _known(faults, rated, rated, "fault")}
        self.inputs = [movable[name] for name in _known(inputs, usual, movable, "input")]
        self._wire_faults = [name for name in rated if name not in described.inputs]
        self._watched = [*usual, *(item.name for item in table if item.type == "fault")]
        self._before: Mapping[str, Setting] = {}

    def begin(self) -> None:
        """Note what inputs are now: `calm` puts them back to it."""
        self._before = {name: self._bench.get(name) for name in self._watched}

    def calm(self) -> None:
        """End all faults, and put all inputs back."""
        for name in self._wire_faults:
            self._bench.clear(name)
        for name, value in self._before.items():
            if self._bench.get(name) != value:
                self._bench.set(name, value)


def _known(
    wanted: Sequence[str] | None,
    usual: Sequence[str] | Mapping[str, Any],
    known: Mapping[str, Any],
    noun: str,
) -> list[str]:
    """Return the wanted names, the usual ones if none are given."""
    if wanted is None:
        return list(usual)
    if isinstance(wanted, str):
        raise ValueError(f"{noun}s is a tuple of names: ({wanted!r},), not {wanted!r}")
    for name in wanted:
        if name not in known:
            bare, rate, _ = name.partition("=")
            if rate and bare in known:
                raise ValueError(
                    f"{noun} {name!r}: the search draws rates, so name {bare!r}; for a rate of"
                    f" yours write a host_rule with self.bench.fault({name!r}, for_='1s')"
                )
            raise ValueError(f"no {noun} {name!r}; {near(name, known)}")
    return list(wanted)
