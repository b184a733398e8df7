"""Read a rig file: return the bench, or all errors in the file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from tickrig.device.body import SIDES
from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.can.faults import CAN_FAULTS
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.body import SHAFTS, BodyPlan
from tickrig.emulators.canopen.choices import is_bus_node
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.faults import FaultForm, bind_arguments, near_fault
from tickrig.emulators.testing.rig_file.devices import (
    DeviceReader,
    DoorReader,
    check_wires,
    kind_of,
    read_wires,
)
from tickrig.emulators.testing.rig_file.keys import BODY, TOP
from tickrig.emulators.testing.rig_file.plan import (
    DeviceKind,
    DevicePlan,
    FaultPlan,
    RigFileError,
    RigPlan,
    WirePlan,
    WireType,
    seed_of,
)
from tickrig.emulators.testing.rig_file.probe import (
    UNKNOWN,
    Probe,
    Start,
    StartReader,
    WrongDevice,
    eds_cache,
    probe,
    read_safe,
)
from tickrig.host.text.names import near
from tickrig.host.text.section import Notes, Section, is_broken, shown, texts
from tickrig.host.text.toml_reader import BROKEN, Mistake, TomlDocument, TomlPath, read_toml
from tickrig.host.text.trace import BEGIN

# Files that are no rig file, and tables of files of before: what to write in their place.

_SYSTEM: Final = (
    "it is a system of RT components, of which nothing is emulated: tickrig rtc run FILE"
)
SCENARIO: Final = "it is a scenario: --scenario FILE plays it"
_TRACE: Final = "it is a trace: tickrig replay FILE, tickrig compare FILE"
EDS: Final = "it is an EDS or DCF: a rig file names it as the type of a device, type = FILE"
_URDF: Final = (
    "it is a URDF: a bus.yml names it, options: {tickrig: {urdf: FILE}}, and tickrig check of that"
    " checks both"
)
_NODE: Final = "[[node]] is a device now, one for each node-ID: {new}"
_DUT: Final = (
    'a real RRC is a device now: [device.rrc] with type = "rrc", [hardware.rrc] with port = "...";'
    " [tolerance] is [hardware.tolerance], [operator] is [hardware]"
)
_EDS: Final = re.compile(r"\s*\[(FileInfo|DeviceInfo|DeviceComissioning)\]", re.IGNORECASE)
_HEAD: Final = 2_000
"""Number of characters at the beginning of a file by which a URDF is recognised."""
_SCENARIO: Final = re.compile(
    r"(?:[^\S\n]*+(?:#.*+)?\n)*+[^\S\n]*+\+?[0-9][0-9.]*(s|ms|us)?[ \t]+[a-z]+\b(?!\s*=)"
)


def _no_rig_file(text: str) -> str:
    r"""Return the kind of file of a text that is not a rig file, or "" if unknown.

    >>> _no_rig_file("# drive\n0.1s press power_button\n")
    'it is a scenario: --scenario FILE plays it'
    """
    if text.startswith(BEGIN):
        return _TRACE
    if _EDS.match(text):
        return EDS
    head = text[:_HEAD].lstrip("\ufeff \t\r\n")
    if head.startswith("<") and "<robot" in head:
        return _URDF
    return SCENARIO if _SCENARIO.match(text) else ""


def _refuse_old_tables(top: Section) -> Section:
    """Return a rig file unchanged; record an error for each table of an earlier version.

    Args:
        top: content of the whole file.
    """
    given, before = top.values, len(top.notes.all)
    nodes = given.get("node")
    if isinstance(nodes, list):
        for at, node in enumerate(nodes):
            if node is not BROKEN:
                top.wrong(_NODE.format(new=_device(node, at + 1)), "node", at)
    if isinstance(given.get("dut"), dict):
        top.wrong(_DUT, "dut")
    if isinstance(given.get("component"), list):
        top.wrong(_SYSTEM, "component")
    if len(top.notes.all) > before or ("device" not in given and before):
        return Section(top.notes, (), {"device": {}})
    return top


def _device(node: object, number: int) -> str:
    """Return a table [[node]] as a table [device.NAME]."""
    old: dict[str, object] = node if isinstance(node, dict) else {}
    device = next((old[key] for key in ("eds", "model", "rtc") if key in old), "FILE.eds")
    keys = {"type": device, "node_id": old.get("id"), "profile": old.get("profile")}
    shown = ", ".join(f"{key} = {json.dumps(x)}" for key, x in keys.items() if x is not None)
    return f"[device.node{number}] with {shown}"


# A bus.yml in the words of rig files: each of its nodes is a device on the bus.

_BUS: Final = "bus"
"""The key of a rig file that names a bus.yml."""

_MISNAMED: Final = "it is a bus.yml: its name has to end in .yml or .yaml"
_TOML: Final = re.compile(rb"^[ \t]*+\[", re.MULTILINE)
_TABLE: Final = re.compile(rb"^[ \t]*+\[[\w.-]+\]", re.MULTILINE)
"""The header of a TOML table, which no bus.yml has."""


def _is_bus_yml(path: Path, data: bytes) -> bool:
    """Return whether a file is a bus.yml, valid or not; the name alone does not decide."""
    if _TABLE.search(data):
        return False
    return late.is_bus_file(data) or (_is_named(path) and not _TOML.search(data))


def _is_named(path: Path) -> bool:
    return path.suffix.lower() in (".yml", ".yaml")


def _bus_as_rig(path: Path) -> Section:
    """Return a bus.yml as if it were a rig file with only the nodes of the bus.

    Raises:
        OSError: the file cannot be read.
    """
    document = TomlDocument({_BUS: path.name}, {(_BUS,): 1})
    if not _is_named(path):
        return Section(Notes(document, [Mistake(1, _MISNAMED)]), (), {"device": {}})
    return _with_nodes(Section(Notes(document), (), document.values), path.parent, alone=True)


def _with_nodes(top: Section, folder: Path, *, alone: bool = False) -> Section:
    """Return a rig file in which each node of its bus.yml is a device.

    Keys of the file for a device with the same name are kept.

    Args:
        top: content of the whole file.
        folder: folder in which the bus.yml is searched.
        alone: whether there is only the bus.yml. An unreadable file then raises OSError.
    """
    given = top.values.get(_BUS)
    if given is None:
        return top
    if not isinstance(given, str) or not given or "\0" in given:
        top.wrong(f"it takes the name of a bus.yml, not {shown(given)}", _BUS)
        return top
    places: dict[str, int] = {}
    try:
        places = _places(top, folder / given, alone=alone)
    except OSError as error:
        if alone:
            raise
        top.wrong(f"{folder / given}: {error.strerror}", _BUS)
    return _merged(top, given, places)


def _places(top: Section, path: Path, *, alone: bool) -> dict[str, int]:
    """Return the line numbers of the nodes by name; record errors."""
    try:
        bus = late.read_bus(path, cache=eds_cache())
    except ImportError as error:
        top.wrong(str(error), _BUS)
        return {}
    except late.BusMistakesError as error:
        for place, text, _ in error.mistakes:
            own = alone and place.file == str(path)
            line = place.line if own else top.notes.document.line_of((_BUS,))
            top.notes.mistakes.append(Mistake(line, text if own else f"{place}: {text}"))
        return {}
    return {node.name: node.line for node in bus.nodes}


def _merged(top: Section, bus: str, nodes: dict[str, int]) -> Section:
    """Return the document with a device for each node."""
    old = top.notes.document
    devices: Any = top.values.get("device", {})
    if not isinstance(devices, dict):
        return top
    own = {name: devices.get(name, {}) for name in nodes}
    found = {
        name: {"type": f"{bus}:{name}", **table}
        for name, table in own.items()
        if isinstance(table, dict)
    }
    lines, names = dict(old.lines), dict[TomlPath, str]()
    for name in nodes:
        names["device", name] = f"{_BUS} {name}" if name not in devices else ""
        lines.setdefault(("device", name), old.line_of((_BUS,)))
    values = {key: each for key, each in top.values.items() if key != _BUS}
    values["device"] = {**found, **{k: v for k, v in devices.items() if k not in found}}
    document = TomlDocument(values, lines, old.mistakes, old.whole)
    return Section(Notes(document, top.notes.mistakes, names), (), values)


# `[fault]`: faults of devices and wires, each in a word as on command lines.

_Faults = Mapping[str, FaultForm]
"""The faults of a device or wire by name."""


def _read_faults(section: Section, owners: Mapping[str, _Faults | None]) -> Iterator[FaultPlan]:
    """Yield the valid faults.

    Args:
        section: table `[fault]`.
        owners: faults of devices and wires, by name of the owner. The value is None if the faults
            of an owner are unknown.
    """
    for owner, value in section.values.items():
        if owner not in owners:
            section.unknown(f"no device or wire {owner!r}; {near(owner, list(owners))}", owner)
        elif not is_broken(value):
            yield from _read(section, owner, value, owners[owner])


def _read(
    section: Section, owner: str, value: object, faults: _Faults | None
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
                bind_arguments(spec.name, faults[spec.name], spec.arguments)
        except ValueError as error:
            section.wrong(str(error), owner, *([at] if isinstance(value, list) else []))
        else:
            yield FaultPlan(owner, spec)


def _check_name(faults: _Faults, name: str) -> None:
    if name not in faults:
        raise ValueError(f"no fault {name!r}; {near_fault(name, faults)}")


# `[body]`: what the shafts of drives move.

_PARAMETERS: Final = ("wheel_radius_m", "tread_m", "mass_kg", "friction")


def _read_body(
    section: Section, devices: Mapping[str, HasSignals], node_ids: Mapping[int, str]
) -> BodyPlan | None:
    """Read the table `[body]`.

    Args:
        section: table `[body]`.
        devices: devices by name, including the drives.
        node_ids: names of nodes by their node-IDs. A drive may be given by its node-ID.

    Returns:
        The body, or None if it is invalid.
    """
    kind = section.values.get("kind")
    sides = SIDES.get(kind) if isinstance(kind, str) else None
    wheels = [wheel for side in sides for wheel in side] if sides else []
    others = wheels or [wheel for both in SIDES.values() for side in both for wheel in side]
    values = section.read(BODY, *others)
    drives = {wheel: _drive(section, wheel, devices, node_ids) for wheel in wheels}
    for wheel, drive in drives.items():
        first = next(each for each in drives if drives[each] == drive)
        if drive and first != wheel:
            section.wrong(f"{drive!r} drives {first} already", wheel)
    mirrored = _mirrored(section, values.get("mirrored", ()), wheels)
    needed = [key for key, each in BODY.items() if not each.default]
    if not sides or not all(drives.values()) or not all(key in values for key in needed):
        return None
    return BodyPlan(
        kind=values["kind"],
        drives={wheel: drive for wheel, drive in drives.items() if drive},
        mirrored=mirrored,
        parameters={key: float(values[key]) for key in _PARAMETERS if key in values},
    )


def _drive(
    section: Section,
    wheel: str,
    devices: Mapping[str, HasSignals],
    node_ids: Mapping[int, str],
) -> str | None:
    """Return the device of a wheel, or None if the device cannot drive a wheel."""
    value = section.values.get(wheel)
    if type(value) is int:
        value = node_ids.get(value, str(value))
    if value is None:
        section.wrong(f"no key {wheel!r}: the drive of this wheel, the name of a device")
    elif is_broken(value):
        return None
    elif not isinstance(value, str):
        section.wrong(f"it takes the name of a device, not {shown(value)}", wheel)
    elif value not in devices and UNKNOWN in devices.values() and value.isdecimal():
        return None  # it may be the node-ID of that one
    elif value not in devices:
        section.unknown(f"no device {value!r}; {near(value, list(devices))}", wheel)
    elif not any(angle in devices[value].outputs for angle, *_ in SHAFTS):
        section.wrong(f"{value!r} has no shaft: it is no CANopen drive", wheel)
    else:
        return value
    return None


def _mirrored(section: Section, names: tuple[str, ...], wheels: list[str]) -> tuple[str, ...]:
    if wheels:
        for name in names:
            if name not in wheels:
                section.wrong(f"no wheel {name!r}; {near(name, wheels)}", "mirrored")
    return names


_SEED: Final = "seed"
_MAX_MB: Final = 4
"""Largest size of a rig file, in MB of 2^20 bytes; larger files, such as logs, are refused."""


def read_rig_file(path: Path) -> RigPlan:
    """Read a rig file, or the bus.yml of a CANopen bus as a rig file.

    Args:
        path: path of the file. Names of other files are relative to its folder.

    Returns:
        The content of the file.

    Raises:
        OSError: the file cannot be read.
        RigFileError: the file has errors; the exception has all of them.
    """
    try:
        with path.open("rb") as file:
            data = file.read((_MAX_MB << 20) + 1)
    except FileNotFoundError as error:
        if is_bus_node(str(path)):
            text = f"no such file; it is a node of a bus.yml: Bench({str(path)!r}) has it alone"
            raise FileNotFoundError(error.errno, text, error.filename) from None
        if not _is_device(str(path)):
            raise
        hint = f"tickrig init --device {path} writes a rig file, Bench({str(path)!r}) needs none"
        text = f"no such file; it is the name of a device: {hint}"
        raise FileNotFoundError(error.errno, text, error.filename) from None
    return decode_rig_file(data, path)


def _is_device(text: str) -> bool:
    try:
        return kind_of(text, Path())[0] in (DeviceKind.SERIAL, DeviceKind.MODEL)
    except ValueError:
        return False


def decode_rig_file(data: bytes, path: Path) -> RigPlan:
    """Read the bytes of a rig file; see `read_rig_file`."""
    if _is_bus_yml(path, data):
        return _plan(_bus_as_rig(path), path)
    if len(data) > _MAX_MB << 20:
        head = data[:1_000].decode("utf-8", "replace")
        reason = _no_rig_file(head) or f"more than {_MAX_MB} MB: this is no rig file"
        raise RigFileError(str(path), (Mistake(1, reason),))
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        reason = f"the byte 0x{data[error.start]:02x} is no UTF-8: a rig file is a text"
        raise RigFileError(str(path), (Mistake(line, reason),)) from None
    return parse_rig_file(text, path)


def parse_rig_file(text: str, path: Path) -> RigPlan:
    """Parse the text of a rig file, as `read_rig_file` does with a file.

    Args:
        text: content of the file.
        path: path of the file, for messages and relative paths. The file need not exist.
    """
    if reason := _no_rig_file(text):
        raise RigFileError(str(path), (Mistake(1, reason),))
    document = read_toml(text)
    top = _refuse_old_tables(Section(Notes(document), (), document.values))
    return _plan(_with_nodes(top, path.parent), path)


def _plan(top: Section, path: Path) -> RigPlan:
    plan = _Reader(top, path).read()
    if top.notes.all:
        raise RigFileError(str(path), top.notes.all)
    return plan


class _Reader:
    """Reads a rig file."""

    def __init__(self, top: Section, path: Path) -> None:
        self._top, self._path, self._folder = top, path, path.parent
        self._wires = read_wires(top.sub("wire"))
        self._devices = DeviceReader(top.sub("device"), self._wires, self._folder)
        self._probes: dict[str, Probe | None] = {}
        self._physical: dict[str, HasSignals] = {}

    def read(self) -> RigPlan:
        """Read the whole file; record errors."""
        top = self._top
        seed = top.read({_SEED: TOP[_SEED]}, *(name for name in TOP if name != _SEED)).get(_SEED, 0)
        missing = "device" not in top.values or (not self._devices.plans and not top.notes.all)
        if missing and top.notes.document.whole:
            top.wrong("no device: a rig file has tables [device.NAME] with a type")
        self._devices.check_stores()
        plans = dict(self._devices.plans)  # those without a wire are checked too
        self._devices.put_on_wires()
        self._make_probes(plans, seed)
        check_wires(top, self._wires, self._devices.plans)
        node_ids = self._check_node_ids()
        starts = StartReader(self._folder)
        signals = starts.read_signals(section) if (section := top.sub("signal")) else {}
        devices = self._with_starts(starts)
        if top.notes.document.whole:
            starts.check(self._physical)
        doors = DoorReader(self._wires, self._devices.plans, self._folder)
        sections = map(top.sub, ("fault", "safe", "body", "real", "hardware"))
        fault, safe, body, real, hardware = sections
        return RigPlan(
            seed=seed,
            wires={name: self._with_rate(wire) for name, wire in self._wires.items() if wire},
            devices=devices,
            signals=signals,
            faults=tuple(_read_faults(fault, self._fault_owners())) if fault else (),
            safe=read_safe(safe, self._physical) if safe else {},
            body=_read_body(body, self._physical, node_ids) if body else None,
            real=doors.read_real(real) if real else RigPlan().real,
            hardware=doors.read_hardware(hardware) if hardware else None,
            path=self._path,
        )

    def _make_probes(self, plans: Mapping[str, DevicePlan | None], seed: int) -> None:
        """Make each device, but equal devices only once; a bench then uses the device."""
        made: dict[str, Probe | list[WrongDevice]] = {}
        alone = len(self._wires) == 1
        for name, plan in plans.items():
            found = None
            if plan is not None:
                key = f"{plan.kind} {plan.type} {plan.profile} {plan.config}"
                if key not in made:
                    wired = self._devices.plans[name]
                    wire = wired.wire if wired else ""
                    made[key] = probe(plan, seed_of(seed, wire, alone=alone))
                    if isinstance(first := made[key], Probe) and wired:
                        self._devices.plans[name] = replace(wired, made=first.made)
                found = made[key]
            if isinstance(found, list):
                for reason, keys in found:
                    self._devices.sections[name].wrong(reason, *keys)
                found = None
            self._probes[name] = found
            self._physical[name] = found.physical if found else UNKNOWN

    def _with_starts(self, starts: StartReader) -> dict[str, DevicePlan]:
        """Return the devices with their initial inputs."""
        found: dict[str, DevicePlan] = {}
        for name, plan in self._devices.plans.items():
            section = self._devices.sections.get(name)
            start: Start = dict(each.start) if (each := self._probes[name]) else {}
            if section and (table := section.sub("start")):
                start |= starts.read_start(name, table, self._physical[name])
            if plan:
                found[name] = replace(plan, start=start)
        return found

    def _check_node_ids(self) -> dict[int, str]:
        """Record nodes without a node-ID or with equal node-IDs; return the names by node-ID."""
        names: dict[int, str] = {}
        seen: dict[tuple[str, int], str] = {}
        for name, each in self._probes.items():
            plan, section = self._devices.plans[name], self._devices.sections.get(name)
            if not (section and each) or each.baud is not None:
                continue
            node_id = plan.node_id if plan and plan.node_id is not None else each.node_id
            if node_id is None:
                if "node_id" not in section.values:  # else its value was wrong
                    section.wrong("no key 'node_id': its file gives none; 1..127, or lss")
            elif node_id != UNCONFIGURED:
                first = seen.setdefault((plan.wire if plan else name, node_id), name)
                if first != name:
                    section.wrong(f"node-ID {node_id} is that of {first!r} already", "node_id")
                names.setdefault(node_id, name)
        return names

    def _with_rate(self, wire: WirePlan) -> WirePlan:
        """Return a bus with the bit rate of a DCF, if the rig file gives no bit rate."""
        if wire.type is not WireType.CAN or wire.bit_rate is not None:
            return wire
        nodes = [each for each in self._devices.plans.values() if each and each.wire == wire.name]
        probes = [found for node in nodes if (found := self._probes[node.name])]
        return replace(wire, bit_rate=next((x.bit_rate for x in probes if x.bit_rate), None))

    def _wire_faults(self, wire: WirePlan | None) -> _Faults | None:
        """Return the faults of a wire, or None if they are unknown."""
        if wire is None:
            return None
        faults: _Faults = CAN_FAULTS
        if wire.type is not WireType.CAN:
            plans = self._devices.plans.values()
            first = next((self._probes[x.name] for x in plans if x and x.wire == wire.name), None)
            if first is None:
                return None
            faults = first.wire_faults
        return faults

    def _fault_owners(self) -> dict[str, _Faults | None]:
        owners: dict[str, _Faults | None] = {
            name: self._wire_faults(wire) for name, wire in self._wires.items()
        }
        for name, each in self._probes.items():
            owners[name] = each.faults if each else None
        return owners
