"""`[wire.NAME]`, and the wires that a file leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from tickrig.emulators.testing.rig_file.fields import check_name
from tickrig.emulators.testing.rig_file.plan import DevicePlan, WirePlan, WireType
from tickrig.emulators.testing.rig_file.schema import WIRES
from tickrig.emulators.testing.rig_file.section import Schema, Section

EVERYTHING: Final[Schema] = {key: each for schema in WIRES.values() for key, each in schema.items()}
OPTIONAL: Final = {"framing", "buffer_bytes", "echo", "bursts"}


def read_wires(section: Section | None) -> dict[str, WirePlan | None]:
    """Read all wires; None for one of which it is not known what it is."""
    wires: dict[str, WirePlan | None] = {}
    for name, table in section.subs() if section else ():
        try:
            check_name(name)
        except ValueError as error:
            section.wrong(str(error), name)  # type: ignore[union-attr]
        wires[name] = _read(name, table) if table else None
    return wires


def _read(name: str, section: Section) -> WirePlan | None:
    types = {each.value: each for each in WireType}
    given = section.values.get("type")
    wire_type = types.get(given) if isinstance(given, str) else None
    if wire_type is None:
        section.read(EVERYTHING)
        return None
    values: Mapping[str, Any] = section.read(WIRES[wire_type])
    return WirePlan(
        name=name,
        type=wire_type,
        bit_rate=values.get("baud", values.get("bitrate")),
        **{key: values[key] for key in OPTIONAL if key in values},
    )


def check_wires(
    top: Section, wires: Mapping[str, WirePlan | None], devices: Mapping[str, DevicePlan | None]
) -> None:
    """Note wires with nothing on them, and serial lines of several devices."""
    all_known = None not in devices.values() and top.notes.document.whole
    for name, wire in wires.items():
        if wire is None or not wire.given:
            continue
        on_it = [each.name for each in devices.values() if each and each.wire == name]
        if not on_it and all_known:
            top.wrong(f"no device is on it: write wire = {name!r} at one", "wire", name)
        if wire.type is WireType.SERIAL:
            for other in on_it[1:]:
                reason = f"{on_it[0]!r} is on this serial line; one of type rs485 takes several"
                top.wrong(reason, "device", other, "wire")
