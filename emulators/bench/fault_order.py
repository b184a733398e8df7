"""A fault that a test ordered, and when it is to come."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.wire.instant import NEVER


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
