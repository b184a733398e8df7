"""A fault in one word: `NAME[=RATE][@FROM[-TO]]`, as command lines and scenarios write it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from tickrig.host.text.values import parse_time_us
from tickrig.wire.instant import NEVER

_SPEC: Final = re.compile(r"([\w/]+)(?:=([^@]*))?(?:@([^-]*)(?:-(.*))?)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class FaultSpec:
    """Which fault, how often, and when.

    Attributes:
        name: a fault of the wire, or a physical fault of the device.
        rate: probability per bit or byte; None if the fault is just there.
        from_us: when it begins, in the rig's time.
        to_us: when it ends; `NEVER` if it stays.
    """

    name: str
    rate: float | None = None
    from_us: int = 0
    to_us: int = NEVER

    def __post_init__(self) -> None:
        """Refuse a time span that is empty."""
        if self.to_us <= self.from_us:
            raise ValueError(f"fault {self.name} ends before it begins")


def _any_name(name: str) -> None:
    """Take any name."""


def parse_fault_spec(text: str, check_name: Callable[[str], object] = _any_name) -> FaultSpec:
    """Read a fault.

    Args:
        text: as `flip=0.001@5s-7s`.
        check_name: called with the name before rate and times are read; raises ValueError unless
            there is such a fault.

    Raises:
        ValueError: not of the form, or not a name.

    >>> parse_fault_spec("flip=0.001@5s-7s")
    FaultSpec(name='flip', rate=0.001, from_us=5000000, to_us=7000000)
    """
    match = _SPEC.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a fault: write NAME[=RATE][@FROM[-TO]], as cut@5s-7s")
    name, rate, start, stop = match.groups()
    try:
        check_name(name)
    except ValueError:
        if rate is not None and any(_is_named(x, check_name) for x in (rate, f"{name}/{rate}")):
            text = f"{rate!r} is not a rate; the fault {rate} of {name} is {name}/{rate}"
            raise ValueError(text) from None
        raise
    return FaultSpec(
        name,
        None if rate is None else _parse_rate(rate),
        parse_time_us(start) if start is not None else 0,
        parse_time_us(stop) if stop is not None else NEVER,
    )


def _is_named(name: str, check_name: Callable[[str], object]) -> bool:
    try:
        check_name(name)
    except ValueError:
        return False
    return True


def _parse_rate(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a rate: write a number up to 1, as 0.001") from None


# A fault that a test ordered, and when it is to come.


@dataclass(slots=True)
class FaultOrder:
    """A fault, ordered for a time or for what it waits for.

    Attributes:
        spec: the fault, by its full name.
        ordered_us: when it was ordered.
        for_us: how long it stays; as `spec` says if None.
        when: what it waits for, for people; empty if it waits for a time.
        due_us: when it begins; None as long as it waits.
        to_us: when it ends; `NEVER` if it stays.
    """

    spec: FaultSpec
    ordered_us: int
    for_us: int | None = None
    when: str = ""
    due_us: int | None = None
    to_us: int = NEVER

    def begin(self, now_us: int) -> FaultSpec:
        """Note that it has waited long enough; return the fault with its end."""
        self.due_us = max(now_us, self.spec.from_us)
        self.to_us = self.spec.to_us if self.for_us is None else self.due_us + self.for_us
        return replace(self.spec, to_us=self.to_us)
