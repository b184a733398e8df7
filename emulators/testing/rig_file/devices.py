"""Reads each device of a rig file, its wire, and the places of hosts or real devices.

Tables `[wire]`, `[device]`, `[real]` and `[hardware]`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import MODELS, is_bus_node
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.testing.rig_file import plan
from tickrig.emulators.testing.rig_file.keys import (
    CANOPEN_DEVICE,
    HARDWARE,
    HARDWARE_BUS,
    HARDWARE_DEVICE,
    HARDWARE_LINE,
    REAL,
    REAL_BUS,
    REAL_LINE,
    SERIAL_DEVICE,
    TOLERANCE,
    WIRES,
    check_name,
)
from tickrig.host.text.names import closest, near
from tickrig.host.text.section import Schema, Section, shown
from tickrig.host.text.user_file import SUFFIX

if TYPE_CHECKING:
    from tickrig.device.canopen.sdo import SdoLimits
    from tickrig.emulators.serial import network
else:  # sockets and pyserial are slow
    network = LazyModule("tickrig.emulators.serial.network")

_BUS: Final = "can"
"""Name of the bus that a file may omit."""

RESERVED: Final = ("control", "tolerance", "body", _BUS)
"""Names that a device cannot have, because they have another meaning."""

RIG_SUFFIXES: Final = (".toml", ".yml", ".yaml")
"""Suffixes of rig files, and of a bus.yml, which counts as a rig file."""
EDS_SUFFIXES: Final = (".eds", ".dcf", ".xdd", ".xdc")
_DEVICE_KEYS: Final[Schema] = {**SERIAL_DEVICE, **CANOPEN_DEVICE}
_READ_LATER: Final = "start"

_Wires = dict[str, plan.WirePlan | None]


class DeviceReader:
    """Reads the tables `[device]` of a rig file: which devices there are, and on which wires.

    Args:
        section: table `[device]`, or None if the file has no such table.
        wires: wires of the file by name. The value is None for a wire of unknown type. If a device
            is on a wire that the file does not describe, the reader adds the wire to this mapping.
        folder: folder that relative paths start from.

    Attributes:
        plans: descriptions of the devices by name. The value is None for a device of unknown type.
        sections: tables of the devices by name.
    """

    def __init__(self, section: Section | None, wires: _Wires, folder: Path) -> None:
        self._wires, self._folder = wires, folder
        self._given, self._types = dict(wires), cache(DEVICES.names)
        self.plans: dict[str, plan.DevicePlan | None] = {}
        self.sections: dict[str, Section] = {}
        for name, table in section.subs() if section else ():
            self.plans[name] = None
            if table is not None:
                self.sections[name] = table
                if ("device", name) not in table.notes.names:
                    self._check_name(name, table)
                self.plans[name] = self._read(name, table)

    def check_stores(self) -> None:
        """Record the errors of store files that exist but have other content."""
        for name, device in self.plans.items():
            if device is not None and device.store is not None:
                try:
                    if device.store.exists() and not device.store.is_file():
                        raise late.StoreError(f"{device.store}: not a file")
                    late.StoreFile(device.store)
                except late.StoreError as error:
                    self.sections[name].wrong(str(error), "store")
                except OSError as error:
                    self.sections[name].wrong(f"{device.store}: {error.strerror}", "store")

    def put_on_wires(self) -> None:
        """Find the wire of each device, and record the errors of wires."""
        for name, device in self.plans.items():
            if device is not None:
                wire = self._wire_of(self.sections[name], device)
                self.plans[name] = replace(device, wire=wire) if wire else None

    def _check_name(self, name: str, section: Section) -> None:
        try:
            check_name(name)
            if name in self._given:
                raise ValueError("there is a wire of this name")
            if name in RESERVED:
                raise ValueError(f"{', '.join(RESERVED)} are no names of devices")
        except ValueError as error:
            section.wrong(str(error))

    def _read(self, name: str, section: Section) -> plan.DevicePlan | None:
        given = section.values.get("type")
        kind, place = None, ""
        if isinstance(given, str) and given:
            try:
                kind, place = kind_of(given, self._folder, self._types)
            except ValueError as error:
                section.wrong(str(error), "type")
        schema = {None: _DEVICE_KEYS, plan.DeviceKind.SERIAL: SERIAL_DEVICE}.get(
            kind, CANOPEN_DEVICE
        )
        values = section.read(schema, _READ_LATER)
        if (wire := values.get("wire", "")) and wire not in self._given:
            section.unknown(f"no wire {wire!r}; {near(wire, list(self._given))}", "wire")
        if kind is None:
            return None
        if "profile" in values and kind is not plan.DeviceKind.EDS:
            section.wrong(f"it belongs to an EDS or DCF; {given!r} has its own", "profile")
        return plan.DevicePlan(
            name=name,
            kind=kind,
            type=place,
            wire=values.get("wire", ""),
            config=_beside(values.get("config", {}), self._folder),
            node_id=values.get("node_id"),
            profile=values.get("profile"),
            store=self._folder / values["store"] if "store" in values else None,
            sdo=_sdo_limits(values),
        )

    def _wire_of(self, section: Section, device: plan.DevicePlan) -> str | None:
        """Return the wire of a device, or None if the wire is unknown."""
        is_node = device.kind is not plan.DeviceKind.SERIAL
        if not device.wire:
            return self._bus_of(section) if is_node else self._line_of(device.name)
        wire = self._given.get(device.wire)
        if wire is None:
            return None
        if (wire.type is plan.WireType.CAN) != is_node:
            what = "a CANopen device" if is_node else "a device on a serial line"
            section.wrong(f"{device.wire!r} is of type {wire.type.value}, and this {what}", "wire")
            return None
        return device.wire

    def _bus_of(self, section: Section) -> str | None:
        """Return the only bus; add a bus if the file has none."""
        if None in self._given.values():
            return None
        buses = [
            each.name for each in self._given.values() if each and each.type is plan.WireType.CAN
        ]
        if len(buses) > 1:
            section.wrong(f"no key 'wire': there are {' and '.join(buses)}")
            return None
        if not buses:
            self._wires.setdefault(
                _BUS, plan.WirePlan(name=_BUS, type=plan.WireType.CAN, given=False)
            )
        return buses[0] if buses else _BUS

    def _line_of(self, name: str) -> str:
        """Return the serial line that belongs to one device."""
        self._wires.setdefault(name, plan.WirePlan(name=name, given=False))
        return name


def _sdo_limits(values: Mapping[str, Any]) -> SdoLimits | None:
    if "sdo_timeout" not in values and "sdo_memory" not in values:
        return None
    usual = late.USUAL
    return late.SdoLimits(
        values.get("sdo_timeout", usual.timeout_us), values.get("sdo_memory", usual.memory_bytes)
    )


def kind_of(
    text: str, folder: Path, types: Callable[[], list[str]] = DEVICES.names
) -> tuple[plan.DeviceKind, str]:
    """Return what a device's key `type` names: a device type, an EDS, a model or Python code.

    Args:
        text: type as in the rig file.
        folder: folder in which files are searched.
        types: function that returns the names of all device types. It is called if the type is not
            built in.

    Returns:
        A pair: the kind of what is named, and the text of `type`. If the text is a file name, the
        folder is put in front, so that the file can be opened.

    Raises:
        ValueError: no such type or file exists.
    """
    if not text.isprintable():
        raise ValueError(f"no device {shown(text)}")
    if f"{SUFFIX}:" in text:
        return plan.DeviceKind.DEVICE_RTC, str(folder / text)
    if text in DEVICES.built_in:  # most are
        return plan.DeviceKind.SERIAL, text
    if is_bus_node(text):
        return plan.DeviceKind.BUS_NODE, str(folder / text)
    if text.lower().endswith(EDS_SUFFIXES):
        return plan.DeviceKind.EDS, str(folder / text)
    if text in MODELS:
        return plan.DeviceKind.MODEL, text
    if text not in (names := types()):
        hint = near(text, [*names, *MODELS])
        raise ValueError(f"no device {shown(text)}; {hint} (or an EDS or DCF file, FILE.py:Class)")
    return plan.DeviceKind.SERIAL, text


def _beside(config: Mapping[str, Any], folder: Path) -> dict[str, object]:
    """Return options; the path in `FILE.py:Class` is relative to the folder of the rig file."""
    return {
        key: str(folder / value) if isinstance(value, str) and f"{SUFFIX}:" in value else value
        for key, value in config.items()
    }


# `[wire.NAME]`, and the wires that a file leaves out.

_WIRE_KEYS: Final[Schema] = {key: each for schema in WIRES.values() for key, each in schema.items()}
_OPTIONAL: Final = {"framing", "buffer_bytes", "echo", "bursts"}


def read_wires(section: Section | None) -> dict[str, plan.WirePlan | None]:
    """Return all wires by name, with None for a wire of unknown type."""
    wires: dict[str, plan.WirePlan | None] = {}
    for name, table in section.subs() if section else ():
        try:
            check_name(name)
        except ValueError as error:
            section.wrong(str(error), name)  # type: ignore[union-attr]
        wires[name] = _read(name, table) if table else None
    return wires


def _read(name: str, section: Section) -> plan.WirePlan | None:
    types = {each.value: each for each in plan.WireType}
    given = section.values.get("type")
    wire_type = types.get(given) if isinstance(given, str) else None
    if wire_type is None:
        section.read(_WIRE_KEYS)
        return None
    values: Mapping[str, Any] = section.read(WIRES[wire_type])
    return plan.WirePlan(
        name=name,
        type=wire_type,
        bit_rate=values.get("baud", values.get("bitrate")),
        **{key: values[key] for key in _OPTIONAL if key in values},
    )


def check_wires(
    top: Section,
    wires: Mapping[str, plan.WirePlan | None],
    devices: Mapping[str, plan.DevicePlan | None],
) -> None:
    """Record the errors of wires without devices, and of serial lines with several devices."""
    all_known = None not in devices.values() and top.notes.document.whole
    for name, wire in wires.items():
        if wire is None or not wire.given:
            continue
        on_it = [each.name for each in devices.values() if each and each.wire == name]
        if not on_it and all_known:
            top.wrong(f"no device is on it: write wire = {name!r} at one", "wire", name)
        if wire.type is plan.WireType.SERIAL:
            for other in on_it[1:]:
                reason = f"{on_it[0]!r} is on this serial line; one of type rs485 takes several"
                top.wrong(reason, "device", other, "wire")


# `[real]` and `[hardware]`: where hosts find the wires, and where the real devices are.

_CONTROL = "control"
_TOLERANCE_TABLE = "tolerance"


class DoorReader:
    """Reads the tables `[real]` and `[hardware]` of a rig file.

    The table `[real]` has the addresses at which hosts find the emulated wires in real time. The
    table `[hardware]` has the addresses of real devices.

    Args:
        wires: wires by name. The value is None for a wire of unknown type.
        devices: devices by name. The value is None for a device of unknown type.
        folder: folder that relative paths start from.
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
        """Yield each table with the wire that it names, or with the line of the device it names."""
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
        """Record an error for each link or address that two wires have."""
        seen: dict[object, str] = {}
        for wire, door in doors.items():
            places: list[object] = [door.link] if door.link else []
            served = [url for url in map(network.parse_serve_url, door.serve) if url.port]
            places += [f"port {url.port} of {url.host}" for url in served]
            for place in places:
                if place in seen:
                    section.wrong(f"{place} is that of {seen[place]!r} already", wire)
                seen.setdefault(place, wire)

    def _file(self, name: str | None) -> Path | None:
        return None if name is None else self._folder / name


def _is_url(section: Section, url: str) -> bool:
    """Return whether a line can be served at a URL; record the error if not."""
    try:
        network.parse_serve_url(url)
    except ValueError as error:
        section.wrong(str(error), "serve")
        return False
    return True


def _hardware_schema(wire: plan.WirePlan | None, *, is_device: bool) -> Schema:
    """Return the keys that a table of `[hardware]` can have."""
    of_device = HARDWARE_DEVICE if is_device else {}
    if wire is None:
        return of_device
    if wire.type is plan.WireType.CAN:
        return {**HARDWARE_BUS, **of_device}
    return {**HARDWARE_LINE, **of_device}


def _bus(section: Section, found: Mapping[str, Any]) -> plan.BusPlan:
    """Return a bus; its driver may be missing here, and may exist on another machine."""
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
