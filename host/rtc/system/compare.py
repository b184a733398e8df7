"""What a running system lacks of the one that a file describes."""

from __future__ import annotations

from collections.abc import Iterator

from tickrig.host.rtc.system.system import ComponentEntry, ConnectionEntry, System


def differences(wanted: System, found: System) -> Iterator[str]:
    """Yield what is not as wanted, a line each; what is there beside it does not matter."""
    there = {entry.name: entry for entry in found.components}
    for entry in wanted.components:
        if entry.name not in there:
            yield f"{entry.name} is not there"
        else:
            yield from _component(entry, there[entry.name])
    joined = {frozenset(entry.ports): entry for entry in found.connections}
    for connection in wanted.connections:
        ends = " and ".join(connection.ports)
        if (other := joined.get(frozenset(connection.ports))) is None:
            yield f"{ends} are not connected"
        else:
            yield from _properties(ends, connection, other)


def _component(wanted: ComponentEntry, found: ComponentEntry) -> Iterator[str]:
    if found.type_name != wanted.type_name:
        yield f"{wanted.name} is a {found.type_name}, not a {wanted.type_name}"
    if found.rate_hz != wanted.rate_hz:
        yield f"{wanted.name} runs at {found.rate_hz:g} Hz, not at {wanted.rate_hz:g} Hz"
    if found.active != wanted.active:
        yield f"{wanted.name} is {'' if found.active else 'not '}Active"
    if found.configuration_set != wanted.configuration_set:
        sets = f"{found.configuration_set}, not {wanted.configuration_set}"
        yield f"{wanted.name} has the set {sets}"
    for set_id, values in wanted.configuration.items():
        for name, value in values.items():
            other = found.configuration.get(set_id, {}).get(name)
            if other != value:
                is_ = "is not there" if other is None else f"is {other}, not {value}"
                yield f"{wanted.name}: {name} of the set {set_id} {is_}"


def _properties(ends: str, wanted: ConnectionEntry, found: ConnectionEntry) -> Iterator[str]:
    for key, value in wanted.properties.items():
        if (other := found.properties.get(key)) != value:
            yield f"{ends}: {key} is {other or 'not there'}, not {value}"
