"""`[device.NAME]`: what each device is, and the wire that it is on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from tickrig.device.canopen.sdo import USUAL, SdoLimits
from tickrig.emulators.canopen.choices import MODELS, is_bus_node
from tickrig.emulators.canopen.store_file import StoreError, StoreFile
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan, WirePlan, WireType
from tickrig.emulators.testing.rig_file.schema import (
    CANOPEN_DEVICE,
    SERIAL_DEVICE,
    WIRES,
    check_name,
)
from tickrig.host.text.names import near
from tickrig.host.text.section import Schema, Section, shown
from tickrig.host.text.user_file import SUFFIX

_BUS: Final = "can"
"""The bus that a file leaves out."""

RESERVED: Final = ("control", "tolerance", "body", _BUS)
"""Names that mean something else beside those of devices."""

RIG_SUFFIXES: Final = (".toml", ".yml", ".yaml")
"""Of rig files, and of a bus.yml, which is one."""
EDS_SUFFIXES: Final = (".eds", ".dcf", ".xdd", ".xdc")
_DEVICE_KEYS: Final[Schema] = {**SERIAL_DEVICE, **CANOPEN_DEVICE}
_READ_LATER: Final = "start"

_Wires = dict[str, WirePlan | None]


class DeviceReader:
    """Reads the devices and puts them on wires.

    Args:
        section: `[device]`, None if there is none.
        wires: those of the file, None for one of which it is not known what it is; those that
            the file leaves out are entered.
        folder: where files are looked for.

    Attributes:
        plans: by name, None for a device of which it is not known what it is.
        sections: the table of each.
    """

    def __init__(self, section: Section | None, wires: _Wires, folder: Path) -> None:
        self._wires, self._folder = wires, folder
        self._given, self._types = dict(wires), cache(DEVICES.names)
        self.plans: dict[str, DevicePlan | None] = {}
        self.sections: dict[str, Section] = {}
        for name, table in section.subs() if section else ():
            self.plans[name] = None
            if table is not None:
                self.sections[name] = table
                if ("device", name) not in table.notes.names:
                    self._check_name(name, table)
                self.plans[name] = self._read(name, table)

    def check_stores(self) -> None:
        """Note files that are there and keep something else than what nodes store."""
        for name, plan in self.plans.items():
            if plan is not None and plan.store is not None:
                try:
                    if plan.store.exists() and not plan.store.is_file():
                        raise StoreError(f"{plan.store}: not a file")
                    StoreFile(plan.store)
                except StoreError as error:
                    self.sections[name].wrong(str(error), "store")
                except OSError as error:
                    self.sections[name].wrong(f"{plan.store}: {error.strerror}", "store")

    def put_on_wires(self) -> None:
        """Find the wire of each device, and note what is wrong with wires."""
        for name, plan in self.plans.items():
            if plan is not None:
                wire = self._wire_of(self.sections[name], plan)
                self.plans[name] = replace(plan, wire=wire) if wire else None

    def _check_name(self, name: str, section: Section) -> None:
        try:
            check_name(name)
            if name in self._given:
                raise ValueError("there is a wire of this name")
            if name in RESERVED:
                raise ValueError(f"{', '.join(RESERVED)} are no names of devices")
        except ValueError as error:
            section.wrong(str(error))

    def _read(self, name: str, section: Section) -> DevicePlan | None:
        given = section.values.get("type")
        kind, place = None, ""
        if isinstance(given, str) and given:
            try:
                kind, place = kind_of(given, self._folder, self._types)
            except ValueError as error:
                section.wrong(str(error), "type")
        schema = {None: _DEVICE_KEYS, DeviceKind.SERIAL: SERIAL_DEVICE}.get(kind, CANOPEN_DEVICE)
        values = section.read(schema, _READ_LATER)
        if (wire := values.get("wire", "")) and wire not in self._given:
            section.unknown(f"no wire {wire!r}; {near(wire, list(self._given))}", "wire")
        if kind is None:
            return None
        if "profile" in values and kind is not DeviceKind.EDS:
            section.wrong(f"it belongs to an EDS or DCF; {given!r} has its own", "profile")
        return DevicePlan(
            name=name,
            kind=kind,
            type=place,
            wire=values.get("wire", ""),
            config=_beside(values.get("config", {}), self._folder),
            node_id=values.get("node_id"),
            profile=values.get("profile"),
            store=self._folder / values["store"] if "store" in values else None,
            sdo=SdoLimits(
                values.get("sdo_timeout", USUAL.timeout_us),
                values.get("sdo_memory", USUAL.memory_bytes),
            ),
        )

    def _wire_of(self, section: Section, plan: DevicePlan) -> str | None:
        """Return the wire of a device; None if it cannot be said."""
        is_node = plan.kind is not DeviceKind.SERIAL
        if not plan.wire:
            return self._bus_of(section) if is_node else self._line_of(plan.name)
        wire = self._given.get(plan.wire)
        if wire is None:
            return None
        if (wire.type is WireType.CAN) != is_node:
            what = "a CANopen device" if is_node else "a device on a serial line"
            section.wrong(f"{plan.wire!r} is of type {wire.type.value}, and this {what}", "wire")
            return None
        return plan.wire

    def _bus_of(self, section: Section) -> str | None:
        """Return the only bus, made if the file has none."""
        if None in self._given.values():
            return None
        buses = [each.name for each in self._given.values() if each and each.type is WireType.CAN]
        if len(buses) > 1:
            section.wrong(f"no key 'wire': there are {' and '.join(buses)}")
            return None
        if not buses:
            self._wires.setdefault(_BUS, WirePlan(name=_BUS, type=WireType.CAN, given=False))
        return buses[0] if buses else _BUS

    def _line_of(self, name: str) -> str:
        """Return the line of a device's own."""
        self._wires.setdefault(name, WirePlan(name=name, given=False))
        return name


def kind_of(
    text: str, folder: Path, types: Callable[[], list[str]] = DEVICES.names
) -> tuple[DeviceKind, str]:
    """Return what a type names, and the same with the path that it has for this program.

    Args:
        text: as the file has it.
        folder: where files are looked for.
        types: returns the names of all device types; called if it is none of ours.

    Raises:
        ValueError: it names nothing that there is.
    """
    if not text.isprintable():
        raise ValueError(f"no device {shown(text)}")
    if f"{SUFFIX}:" in text:
        return DeviceKind.DEVICE_RTC, str(folder / text)
    if is_bus_node(text):
        return DeviceKind.BUS_NODE, str(folder / text)
    if text.lower().endswith(EDS_SUFFIXES):
        return DeviceKind.EDS, str(folder / text)
    if text in MODELS:
        return DeviceKind.MODEL, text
    if text not in DEVICES.built_in and text not in (names := types()):
        hint = near(text, [*names, *MODELS])
        raise ValueError(f"no device {shown(text)}; {hint} (or an EDS or DCF file, FILE.py:Class)")
    return DeviceKind.SERIAL, text


def _beside(config: Mapping[str, Any], folder: Path) -> dict[str, object]:
    """Return options with `FILE.py:Class` found beside the rig file."""
    return {
        key: str(folder / value) if isinstance(value, str) and f"{SUFFIX}:" in value else value
        for key, value in config.items()
    }


# `[wire.NAME]`, and the wires that a file leaves out.

_WIRE_KEYS: Final[Schema] = {key: each for schema in WIRES.values() for key, each in schema.items()}
_OPTIONAL: Final = {"framing", "buffer_bytes", "echo", "bursts"}


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
        section.read(_WIRE_KEYS)
        return None
    values: Mapping[str, Any] = section.read(WIRES[wire_type])
    return WirePlan(
        name=name,
        type=wire_type,
        bit_rate=values.get("baud", values.get("bitrate")),
        **{key: values[key] for key in _OPTIONAL if key in values},
    )


def check_wires(
    top: Section,
    wires: Mapping[str, WirePlan | None],
    devices: Mapping[str, DevicePlan | None],
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
