"""`[fault]`: faults of devices and wires, each in a word as on command lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tickrig.emulators.bench.fault_spec import parse_fault_spec
from tickrig.emulators.testing.rig_file.fields import texts
from tickrig.emulators.testing.rig_file.plan import FaultPlan
from tickrig.emulators.testing.rig_file.section import Section, is_broken
from tickrig.host.text.names import near

CheckFault = Callable[[str, float | None], None]
"""Raises ValueError unless there is a fault of this name, with this rate."""


def read_faults(section: Section, owners: dict[str, CheckFault | None]) -> Iterator[FaultPlan]:
    """Yield the faults that can be.

    Args:
        section: the table.
        owners: devices and wires by name; None for one whose faults are not known.
    """
    for owner, value in section.values.items():
        if owner not in owners:
            section.unknown(f"no device or wire {owner!r}; {near(owner, list(owners))}", owner)
        elif not is_broken(value):
            yield from _read(section, owner, value, owners[owner])


def _read(
    section: Section, owner: str, value: object, check: CheckFault | None
) -> Iterator[FaultPlan]:
    try:
        specs = texts(value)
    except ValueError as error:
        section.wrong(f"{error}, as cut@2s-3s", owner)
        return
    for at, text in enumerate(specs):
        try:
            spec = parse_fault_spec(text)
            if check is not None:
                check(spec.name, spec.rate)
        except ValueError as error:
            section.wrong(str(error), owner, *([at] if isinstance(value, list) else []))
        else:
            yield FaultPlan(owner, spec)
