"""A fault in one word: `NAME[=ARGUMENT[,ARGUMENT]][@FROM[-TO]]`, as people write it everywhere."""

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
    """Which fault, with which arguments, and when.

    Attributes:
        name: a fault of the wire, or a physical fault of the device.
        arguments: as they were written; `bind_arguments` of rig/faults.py reads them.
        from_us: when it begins, in the rig's time.
        to_us: when it ends; `NEVER` if it stays.
    """

    name: str
    arguments: tuple[str, ...] = ()
    from_us: int = 0
    to_us: int = NEVER

    def __post_init__(self) -> None:
        """Refuse a time span that is empty."""
        if self.to_us <= self.from_us:
            raise ValueError(f"fault {self.name} ends before it begins")

    @property
    def text(self) -> str:
        """Name and arguments as people write them.

        >>> FaultSpec("sdo_slow", ("1s", "rate=0.1")).text
        'sdo_slow=1s,rate=0.1'
        """
        return f"{self.name}={','.join(self.arguments)}" if self.arguments else self.name


def _any_name(name: str) -> None:
    """Take any name."""


def parse_fault_spec(text: str, check_name: Callable[[str], object] = _any_name) -> FaultSpec:
    """Read a fault.

    Args:
        text: as `flip=0.001@5s-7s`.
        check_name: called with the name before the times are read; raises ValueError unless there
            is such a fault.

    Raises:
        ValueError: not of the form, or not a name.

    >>> parse_fault_spec("flip=0.001@5s-7s")
    FaultSpec(name='flip', arguments=('0.001',), from_us=5000000, to_us=7000000)
    """
    match = _SPEC.fullmatch(text)
    if match is None:
        form = "NAME[=ARGUMENT[,ARGUMENT]][@FROM[-TO]]"
        raise ValueError(f"{text!r} is not a fault: write {form}, as cut@5s-7s")
    name, argument, start, stop = match.groups()
    try:
        check_name(name)
    except ValueError:
        names = (argument, f"{name}/{argument}")
        if argument is not None and any(_is_named(each, check_name) for each in names):
            text = f"{argument!r} is not a rate; the fault {argument} of {name} is {names[1]}"
            raise ValueError(text) from None
        raise
    return FaultSpec(
        name,
        () if argument is None else tuple(argument.split(",")),
        parse_time_us(start) if start is not None else 0,
        parse_time_us(stop) if stop is not None else NEVER,
    )


def _is_named(name: str, check_name: Callable[[str], object]) -> bool:
    try:
        check_name(name)
    except ValueError:
        return False
    return True


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
