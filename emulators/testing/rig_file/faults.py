"""`[fault]`: faults of devices and wires, each in a word as on command lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from tickrig.device.chance import check_rate
from tickrig.emulators.bench.fault_spec import parse_fault_spec
from tickrig.emulators.testing.rig_file.fields import texts
from tickrig.emulators.testing.rig_file.plan import FaultPlan
from tickrig.emulators.testing.rig_file.section import Section, is_broken
from tickrig.host.text.names import near

FaultRates = Mapping[str, bool]
"""Whether each fault of a device or wire wants a rate."""


def read_faults(section: Section, owners: Mapping[str, FaultRates | None]) -> Iterator[FaultPlan]:
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
    section: Section, owner: str, value: object, faults: FaultRates | None
) -> Iterator[FaultPlan]:
    try:
        specs = texts(value)
    except ValueError as error:
        section.wrong(f"{error}, as cut@2s-3s", owner)
        return
    for at, text in enumerate(specs):
        try:
            if faults is None:
                spec = parse_fault_spec(text)
            else:
                spec = parse_fault_spec(text, partial(_check_name, faults))
                check_rate(spec.name, spec.rate, rated=faults[spec.name])
        except ValueError as error:
            section.wrong(str(error), owner, *([at] if isinstance(value, list) else []))
        else:
            yield FaultPlan(owner, spec)


def _check_name(faults: FaultRates, name: str) -> None:
    if name not in faults:
        raise ValueError(f"no fault {name!r}; {near(name, faults)}")
