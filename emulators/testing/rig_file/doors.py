"""`[real]` and `[hardware]`: where hosts find the wires, and where the real devices are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tickrig.emulators.serial.network import parse_serve_url
from tickrig.emulators.testing.rig_file import plan
from tickrig.emulators.testing.rig_file.schema import (
    HARDWARE,
    HARDWARE_BUS,
    HARDWARE_DEVICE,
    HARDWARE_LINE,
    REAL,
    REAL_BUS,
    REAL_LINE,
    TOLERANCE,
)
from tickrig.host.text.names import closest, near
from tickrig.host.text.section import Schema, Section

_CONTROL = "control"
_TOLERANCE_TABLE = "tolerance"


class DoorReader:
    """Reads both sections.

    Args:
        wires: by name, None for one of which it is not known what it is.
        devices: by name, None as well.
        folder: where files are looked for.
    """

    def __init__(
        self,
        wires: Mapping[str, plan.WirePlan | None],
        devices: Mapping[str, plan.DevicePlan | None],
        folder: Path,
    ) -> None:
        self._wires, self._devices, self._folder = wires, devices, folder

    def read_real(self, section: Section) -> plan.RealPlan:
        """Read `[real]`."""
        values = section.read(REAL, *(key for key in section.values if key not in REAL))
        doors: dict[str, plan.DoorPlan] = {}
        for name, wire, table in self._tables(section, _CONTROL):
            if wire is None:
                device = self._devices[name]
                shared = device.wire if device else "WIRE"
                table.wrong(f"the wire of {name!r} is {shared!r}, write [real.{shared}]")
            elif wire.name in doors:
                table.wrong(f"the doors of wire {wire.name!r} are given twice")
            else:
                doors[wire.name] = self._door(wire, table)
        self._check_twice(section, doors)
        return plan.RealPlan(control=self._file(values.get(_CONTROL)), doors=doors)

    def read_hardware(self, section: Section) -> plan.HardwarePlan:
        """Read `[hardware]`."""
        values = section.read(HARDWARE, *(key for key in section.values if key not in HARDWARE))
        control = {
            name: self._file(values[_CONTROL]) for name in self._devices if _CONTROL in values
        }
        ports: dict[str, plan.PortPlan] = {}
        buses: dict[str, plan.BusPlan] = {}
        power: dict[str, plan.PowerPlan] = {}
        for name, wire, table in self._tables(section, _CONTROL, _TOLERANCE_TABLE):
            schema = _hardware_schema(wire, is_device=name in self._devices)
            found = table.read(schema)
            if wire is not None and "port" in found:
                if wire.name in ports:
                    table.wrong(f"the port of wire {wire.name!r} is given twice", "port")
                ports[wire.name] = plan.PortPlan(port=found["port"], baud=found.get("baud"))
            if wire is not None and "interface" in found:
                buses[wire.name] = _bus(table, found)
            if name in self._devices and _CONTROL in found:
                control[name] = self._file(found[_CONTROL])
            if switched := _power(table, found):
                power[name] = switched
        return plan.HardwarePlan(
            control={name: path for name, path in control.items() if path},
            ports=ports,
            buses=buses,
            power=power,
            tolerance=_tolerance(section.sub(_TOLERANCE_TABLE)),
        )

    def _tables(
        self, section: Section, *but: str
    ) -> Iterator[tuple[str, plan.WirePlan | None, Section]]:
        """Yield each table with the wire of its name, or that of a device alone on its line."""
        names = [*self._devices, *(name for name in self._wires if name not in self._devices)]
        for name in section.values:
            if name in but:
                continue
            if name not in names:
                section.unknown(f"no device or wire {name!r}; {near(name, [*names, *but])}", name)
            elif (table := section.sub(name)) is not None:
                device = self._devices.get(name)
                if name in self._devices and device is None:
                    continue
                wire = self._wires.get(device.wire if device else name)
                if device is None and wire is None:
                    continue
                shared = device is not None and wire is not None and not self._alone(wire)
                yield name, None if shared else wire, table

    def _alone(self, wire: plan.WirePlan) -> bool:
        """Return whether a wire is a line of one device."""
        sharing = [each for each in self._devices.values() if each and each.wire == wire.name]
        return wire.type is not plan.WireType.CAN and len(sharing) == 1

    def _door(self, wire: plan.WirePlan, section: Section) -> plan.DoorPlan:
        if wire.type is plan.WireType.CAN:
            found = section.read(REAL_BUS)
            return plan.DoorPlan(bus=_bus(section, found) if "interface" in found else None)
        found = section.read(REAL_LINE)
        serve = [url for url in found.get("serve", ()) if _is_url(section, url)]
        return plan.DoorPlan(link=self._file(found.get("link")), serve=tuple(serve))

    def _check_twice(self, section: Section, doors: Mapping[str, plan.DoorPlan]) -> None:
        """Note links and addresses that two wires would have."""
        seen: dict[object, str] = {}
        for wire, door in doors.items():
            places: list[object] = [door.link] if door.link else []
            served = [url for url in map(parse_serve_url, door.serve) if url.port]
            places += [f"port {url.port} of {url.host}" for url in served]
            for place in places:
                if place in seen:
                    section.wrong(f"{place} is that of {seen[place]!r} already", wire)
                seen.setdefault(place, wire)

    def _file(self, name: str | None) -> Path | None:
        return None if name is None else self._folder / name


def _is_url(section: Section, url: str) -> bool:
    """Return whether a line can be served there; else it is noted."""
    try:
        parse_serve_url(url)
    except ValueError as error:
        section.wrong(str(error), "serve")
        return False
    return True


def _hardware_schema(wire: plan.WirePlan | None, *, is_device: bool) -> Schema:
    """Return the keys that a table of hardware can have."""
    of_device = HARDWARE_DEVICE if is_device else {}
    if wire is None:
        return of_device
    if wire.type is plan.WireType.CAN:
        return {**HARDWARE_BUS, **of_device}
    return {**HARDWARE_LINE, **of_device}


def _bus(section: Section, found: Mapping[str, Any]) -> plan.BusPlan:
    """Return a bus; a driver that is not here may be there on another machine."""
    from can import VALID_INTERFACES  # noqa: PLC0415 - slow

    name = found["interface"]
    if name not in VALID_INTERFACES and (meant := closest(name, sorted(VALID_INTERFACES))):
        section.wrong(f"no driver {name!r}; did you mean {meant[0]!r}?", "interface")
    return plan.BusPlan(
        interface=found["interface"],
        channel=found.get("channel"),
        bit_rate=found.get("bitrate"),
        options=found.get("options", {}),
    )


def _power(section: Section, found: Mapping[str, Any]) -> plan.PowerPlan | None:
    missing = [key for key in ("power_on", "power_off") if key not in section.values]
    if len(missing) == 1:
        section.wrong(f"no key {missing[0]!r}: power_on and power_off come together")
    if "power_on" in found and "power_off" in found:
        return plan.PowerPlan(on=found["power_on"], off=found["power_off"])
    return None


def _tolerance(section: Section | None) -> plan.Tolerances:
    found = section.read(TOLERANCE) if section else {}
    given: dict[str, Any] = {}
    if "stick_pct" in found:
        given["stick_pct"] = found["stick_pct"]
    if "time_ms" in found:
        given["time_us"] = round(found["time_ms"] * 1_000)
    return plan.Tolerances(**given)
