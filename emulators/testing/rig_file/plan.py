"""What a rig file says, as plain values: what is on the bench, and where it is.

Paths of the file are already those of the running program: a relative one in the file begins
beside the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, Final
from zlib import crc32

from tickrig.device.canopen.sdo import USUAL, SdoLimits
from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.bench.fault_spec import FaultSpec
from tickrig.emulators.canopen.body import BodyPlan
from tickrig.emulators.canopen.node_spec import LSS
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.host.text.values import Setting, counted

_LATE_MS: Final = 50
_STICK_PCT: Final = 10


class WireType(Enum):
    """What a wire is, as the file writes it."""

    SERIAL = "serial"
    RS485 = "rs485"
    CAN = "can"


@dataclass(frozen=True, slots=True, kw_only=True)
class WirePlan:
    """One wire.

    Attributes:
        name: what faults, doors and messages call it. A wire that the file leaves out has the
            name of its device, or is `can`.
        type: serial line, RS485 or CAN.
        bit_rate: in bit/s; None for that of its device: `DeviceType.line`, or a DCF's.
        framing: of a byte on a line: data bits, parity, stop bits.
        buffer_bytes: room of a receiver on a line; None for that of its device.
        echo: on RS485, each end hears its own bytes too.
        bursts: on RS485, a receiver takes what was sent back to back when it has ended.
        given: whether the file has a table for it; if not, it is of `type` because its device
            is, and the device makes it.
    """

    name: str
    type: WireType = WireType.SERIAL
    bit_rate: int | None = None
    framing: str = "8N1"
    buffer_bytes: int | None = None
    echo: bool = False
    bursts: bool = False
    given: bool = True

    @property
    def frame_bits(self) -> int:
        """Bits of a byte on a line, its start bit among them; half a stop bit counts as one.

        >>> WirePlan(name="line", framing="7E2").frame_bits
        11
        """
        data, parity, stop = self.framing[0], self.framing[1], self.framing[2:]
        return 1 + int(data) + (parity != "N") + (1 if stop == "1" else 2)


class DeviceKind(Enum):
    """What the type of a device names."""

    SERIAL = "device type"
    MODEL = "CANopen model"
    EDS = "EDS or DCF file"
    BUS_NODE = "node of a bus.yml"
    DEVICE_RTC = "DeviceRTC"


class MadeDevice:
    """The device that a reader has made to check the file; the first bench takes it.

    A copy, in this process or in another, holds none.

    Args:
        device: a device as `configure` makes it, or a slave.
        of: what it was made of; it is taken only for the same.
    """

    def __init__(self, device: object = None, of: object = None) -> None:
        self._device, self._of = device, of

    def take(self, of: object) -> Any:
        """Return the device once, if it was made of this; else None."""
        if self._device is None or self._of != of:
            return None
        device, self._device = self._device, None
        return device

    def __reduce__(self) -> tuple[type[MadeDevice], tuple[()]]:
        """Leave the device behind."""
        return MadeDevice, ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DevicePlan:
    """One device.

    Attributes:
        name: what tests and its signals call it.
        kind: what `type` names.
        type: name of a device type (`DEVICES`) or of a model (`MODELS`), path of an EDS or DCF,
            `FILE.yml:NODE` or `FILE.py:Class`.
        wire: name of its wire, of `RigPlan.wires`.
        config: of a device type, its options by name, as the file has them.
        node_id: 1..127, `UNCONFIGURED`, or None for that of the DCF or model.
        profile: of a file: `choices.PROFILES`; None for `auto`.
        store: file in which a CANopen node keeps what 1010h and LSS store.
        sdo: what the SDO servers of a CANopen node put up with.
        start: inputs at the start by name, members of groups each for itself: a value, or the
            signal that drives it.
        made: the device, if the reader has made it and no bench has taken it.
    """

    name: str
    kind: DeviceKind
    type: str
    wire: str
    config: Mapping[str, object] = field(default_factory=dict)
    node_id: int | None = None
    profile: str | None = None
    store: Path | None = None
    sdo: SdoLimits = USUAL
    start: Mapping[str, Setting | SignalSpec] = field(default_factory=dict)
    made: MadeDevice = field(default_factory=MadeDevice, compare=False, repr=False)

    def made_of(self, seed: int = 0) -> tuple[object, ...]:
        """Return all that decides what the device is like when it is made.

        Args:
            seed: of all chance, for a device on a serial line.
        """
        if self.kind is DeviceKind.SERIAL:
            return self.type, self.config, seed
        return self.type, self.profile, self.node_id, self.sdo, self.store


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """One fault.

    Attributes:
        owner: name of the device or wire that has it.
        spec: which, how often, and when.
    """

    owner: str
    spec: FaultSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class BusPlan:
    """A bus of python-can.

    Attributes:
        interface: its driver.
        channel: of the driver.
        bit_rate: in bit/s, where the driver sets it.
        options: more for the driver, by name.
    """

    interface: str
    channel: str | None = None
    bit_rate: int | None = None
    options: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorPlan:
    """Where a host finds a wire in real time.

    Attributes:
        link: of a line, the symbolic link to make to its pty; None for the pty alone.
        serve: of a line, the URLs at which it is served too: `rfc2217://`, `socket://`.
        bus: of a CAN bus, the one outside that it is joined with.
    """

    link: Path | None = None
    serve: tuple[str, ...] = ()
    bus: BusPlan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RealPlan:
    """The bench in real time.

    Attributes:
        control: control socket to serve.
        doors: by the name of the wire; one that is not there has a pty.
    """

    control: Path | None = None
    doors: Mapping[str, DoorPlan] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class PortPlan:
    """Where a line of real hardware is.

    Attributes:
        port: device path, or URL of pyserial.
        baud: in bit/s; None for that of the wire.
    """

    port: str
    baud: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerPlan:
    """Commands that switch a device; the operator does it where there is none.

    Attributes:
        on: command line that switches it on, word by word; no shell reads it.
        off: command line that switches it off.
    """

    on: tuple[str, ...]
    off: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """How exact an operator and a real device are.

    Attributes:
        stick_pct: how far a stick held by hand may be off.
        time_us: how far a time may be off.
        values: further ones by the name of a signal, in its unit.
    """

    stick_pct: float = _STICK_PCT
    time_us: int = _LATE_MS * 1_000
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwarePlan:
    """Where the real devices are.

    Attributes:
        control: control socket of an emulator that stands in for the operator, by the name of
            the device; the operator of the others is at the terminal.
        ports: of lines, by the name of the wire.
        buses: of CAN buses, by the name of the wire.
        power: how a device is switched, by its name.
        tolerance: what is still right.
    """

    control: Mapping[str, Path] = field(default_factory=dict)
    ports: Mapping[str, PortPlan] = field(default_factory=dict)
    buses: Mapping[str, BusPlan] = field(default_factory=dict)
    power: Mapping[str, PowerPlan] = field(default_factory=dict)
    tolerance: Tolerances = field(default_factory=Tolerances)


@dataclass(frozen=True, slots=True, kw_only=True)
class RigPlan:
    """A whole rig file.

    Attributes:
        seed: of all chance.
        wires: by name, those that the file leaves out too.
        devices: by name, in the order of the file.
        signals: by name, for formulas.
        faults: in the order of the file.
        safe: for each device outputs, and what they are when a test is over.
        body: what drives move, None if nothing.
        real: the bench in real time.
        hardware: the bench of real devices, None if the file tells none.
        path: of the file, for messages and relative paths; None if there is none.
    """

    seed: int = 0
    wires: Mapping[str, WirePlan] = field(default_factory=dict)
    devices: Mapping[str, DevicePlan] = field(default_factory=dict)
    signals: Mapping[str, SignalSpec] = field(default_factory=dict)
    faults: tuple[FaultPlan, ...] = ()
    safe: Mapping[str, Mapping[str, Setting]] = field(default_factory=dict)
    body: BodyPlan | None = None
    real: RealPlan = field(default_factory=RealPlan)
    hardware: HardwarePlan | None = None
    path: Path | None = None

    def devices_on(self, wire: str) -> tuple[DevicePlan, ...]:
        """Return the devices on a wire, in the order of the file.

        Args:
            wire: its name.
        """
        return tuple(device for device in self.devices.values() if device.wire == wire)


# What is on a bench, in a few lines for people.

_WIRES: Final = {WireType.SERIAL: "serial line", WireType.RS485: "RS485", WireType.CAN: "CAN"}


def summary(plan: RigPlan) -> Iterator[str]:
    """Yield how much there is, then a line for each wire with what is on it.

    Args:
        plan: the bench.
    """
    counts = [
        _count(len(plan.devices), "device"),
        _count(len(plan.wires), "wire"),
        _count(len(plan.signals) + sum(_driven(each) for each in plan.devices.values()), "signal"),
        _count(len(plan.faults), "fault"),
        _count(sum(map(len, plan.safe.values())), "safe output"),
        "1 body" if plan.body else "",
        "hardware" if plan.hardware else "",
    ]
    yield ", ".join(filter(None, counts))
    width = max((len(name) for name in plan.wires), default=0)
    on_wires: dict[str, list[str]] = {name: [] for name in plan.wires}
    for device in plan.devices.values():
        on_wires[device.wire].append(device_text(device))
    for wire in plan.wires.values():
        devices = ", ".join(on_wires[wire.name])
        yield f"  {wire.name:{width}}  {_wire_text(wire)}: {devices or 'nothing'}"
        if places := "; ".join(_places(plan, wire.name)):
            yield f"  {'':{width}}  {places}"


def _wire_text(wire: WirePlan) -> str:
    """Say what a wire is, as far as the file says it.

    >>> _wire_text(WirePlan(name="a", bit_rate=9600))
    'serial line 9600 8N1'
    """
    words = [_WIRES[wire.type]]
    if wire.bit_rate:
        words.append(str(wire.bit_rate))
        words.append("bit/s" if wire.type is WireType.CAN else wire.framing)
    return " ".join(words)


def device_text(device: DevicePlan) -> str:
    """Say what a device is.

    >>> from tickrig.emulators.testing.rig_file.plan import DeviceKind
    >>> device_text(DevicePlan(name="left", kind=DeviceKind.MODEL, type="epos", wire="a"))
    'left (epos)'
    """
    node = {None: "", UNCONFIGURED: f", waits for {LSS.upper()}"}
    about = node.get(device.node_id, f", node-ID {device.node_id}")
    return f"{device.name} ({Path(device.type).name}{about})"


def _places(plan: RigPlan, wire: str) -> Iterator[str]:
    """Yield where a wire is in real time and on hardware, as far as the file says it."""
    if door := plan.real.doors.get(wire):
        bus = [bus_text(door.bus)] if door.bus else []
        yield f"real: {', '.join([*([str(door.link)] if door.link else []), *door.serve, *bus])}"
    if plan.hardware is not None:
        port, outside = plan.hardware.ports.get(wire), plan.hardware.buses.get(wire)
        place = port.port if port else bus_text(outside) if outside else "not said where"
        yield f"hardware: {place}"


def bus_text(bus: BusPlan) -> str:
    """Say which bus of python-can it is.

    >>> bus_text(BusPlan(interface="socketcan", channel="can0"))
    'socketcan can0'
    """
    return bus.interface if bus.channel is None else f"{bus.interface} {bus.channel}"


def _driven(device: DevicePlan) -> int:
    return sum(not isinstance(value, int | float | str) for value in device.start.values())


def _count(number: int, what: str) -> str:
    return counted(number, what) if number else ""


def seed_of(seed: int, name: str, *, alone: bool) -> int:
    """Return the seed of a wire: chance on one wire has nothing to do with that on another."""
    return seed if alone else seed ^ crc32(name.encode())
