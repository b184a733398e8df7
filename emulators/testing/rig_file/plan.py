"""The content of a rig file. The keys of its tables are in `keys.py`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import LSS
from tickrig.host.text.values import Setting, counted

if TYPE_CHECKING:
    from tickrig.device.canopen.sdo import SdoLimits
    from tickrig.emulators.canopen.body import BodyPlan
    from tickrig.emulators.testing.signals.sources import SignalSpec
    from tickrig.host.text.toml_reader import Mistake

# What a rig file says, as plain values: what is on the bench, and where it is.
#
# Paths of the file are already those of the running program: a relative one in the file begins
# beside the file.

_LATE_MS: Final = 50
_STICK_PCT: Final = 10


class WireType(Enum):
    """Type of a wire, as written in the file."""

    SERIAL = "serial"
    RS485 = "rs485"
    CAN = "can"


@dataclass(frozen=True, slots=True, kw_only=True)
class WirePlan:
    """A serial line or CAN bus, as described in a rig file.

    Attributes:
        name: name for faults, connections and messages. A wire that the file omits has the name of
            its device, or is `can`.
        type: type of the wire: serial line, RS485 or CAN bus.
        bit_rate: bit rate in bit/s, or None to use the rate of the device (`DeviceType.line`, or
            the rate of a DCF).
        framing: framing of a byte on a line: data bits, parity, stop bits.
        buffer_bytes: size of the receive buffer of a line, or None to use the size of the device
            type.
        echo: whether each end of an RS485 wire also receives its own bytes.
        bursts: whether bytes that are sent on RS485 without a gap arrive together, after the last
            byte.
        given: whether the file has a table for the wire. Without a table, `type` comes from the
            device, which makes the wire.
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
        """Number of bits of one character on the line, including start, parity and stop bits.

        With 1.5 stop bits, two stop bits are counted.

        >>> WirePlan(name="line", framing="7E2").frame_bits
        11
        """
        data, parity, stop = self.framing[0], self.framing[1], self.framing[2:]
        return 1 + int(data) + (parity != "N") + (1 if stop == "1" else 2)


class DeviceKind(Enum):
    """What the `type` of a device in a rig file names."""

    SERIAL = "device type"
    MODEL = "CANopen model"
    EDS = "EDS or DCF file"
    BUS_NODE = "node of a bus.yml"
    DEVICE_RTC = "DeviceRTC"


class MadeDevice:
    """Keeps a device that the check of a rig file has made; the first bench uses this device.

    A copy of this object, in this process or in another process, does not contain the device.

    Args:
        device: device made by `configure`, or a CANopen slave, or None if no device is kept.
        of: parameters with which the device was made. A bench gets the device only if it needs a
            device with equal parameters.
    """

    def __init__(self, device: object = None, of: object = None) -> None:
        self._device, self._of = device, of

    def take(self, of: object) -> Any:
        """Return the device once, if it was made with these parameters, or None otherwise."""
        if self._device is None or self._of != of:
            return None
        device, self._device = self._device, None
        return device

    def __reduce__(self) -> tuple[type[MadeDevice], tuple[()]]:
        """Make a copy that does not contain the device."""
        return MadeDevice, ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DevicePlan:
    """A device, as described in a rig file.

    Attributes:
        name: name of the device for tests and signals.
        kind: kind of the `type`.
        type: name of a device type (`DEVICES`) or of a model (`MODELS`), path of an EDS or DCF,
            `FILE.yml:NODE` or `FILE.py:Class`.
        wire: name of the wire, which is a key of `RigPlan.wires`.
        config: options of a device type by name, as in the file.
        node_id: node-ID 1..127, or `UNCONFIGURED`, or None to use the node-ID of the DCF or model.
        profile: profile of a device that a file describes, which is one of `choices.PROFILES`, or
            None for `auto`.
        store: file for the data that a CANopen node stores by object 1010h and LSS.
        sdo: limits of the SDO servers of a CANopen node, or None for the default limits.
        start: initial inputs by name, with the members of groups one by one. Each has a value, or
            the signal that drives the input.
        made: the device, if the reader has made it and no bench uses it yet.
    """

    name: str
    kind: DeviceKind
    type: str
    wire: str
    config: Mapping[str, object] = field(default_factory=dict)
    node_id: int | None = None
    profile: str | None = None
    store: Path | None = None
    sdo: SdoLimits | None = None
    start: Mapping[str, Setting | SignalSpec] = field(default_factory=dict)
    made: MadeDevice = field(default_factory=MadeDevice, compare=False, repr=False)

    def made_of(self, seed: int = 0) -> tuple[object, ...]:
        """Return the parameters with which a device of this description is made.

        `MadeDevice` keeps a device for a bench. It gives the device to the bench only if the device
        was made with equal parameters.

        Args:
            seed: seed of all random numbers, for a device on a serial line.
        """
        if self.kind is DeviceKind.SERIAL:
            return self.type, self.config, seed
        return self.type, self.profile, self.node_id, self.sdo, self.store


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """A fault that a rig file schedules, as read from the file.

    Attributes:
        owner: name of the device or wire that has the fault.
        spec: the fault with its rate and its time.
    """

    owner: str
    spec: FaultSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class BusPlan:
    """Settings of a python-can bus, as read from a rig file.

    Attributes:
        interface: name of the driver.
        channel: channel of the driver.
        bit_rate: bit rate in bit/s, or None if the driver does not set it.
        options: further options of the driver, by name.
    """

    interface: str
    channel: str | None = None
    bit_rate: int | None = None
    options: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorPlan:
    """Addresses at which hosts find a wire of a real-time bench, as read from a rig file.

    Attributes:
        link: symbolic link to the pty of a serial line, or None for no link.
        serve: additional URLs of a serial line: `rfc2217://`, `socket://`.
        bus: python-can bus that is connected with an emulated CAN bus.
    """

    link: Path | None = None
    serve: tuple[str, ...] = ()
    bus: BusPlan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RealPlan:
    """The table `[real]` of a rig file: settings for a bench in real time.

    Attributes:
        control: path of the control socket to serve.
        doors: addresses for hosts, by name of the wire. A serial line without an entry has a pty.
    """

    control: Path | None = None
    doors: Mapping[str, DoorPlan] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class PortPlan:
    """The port at which real devices on a serial line are connected, as read from a rig file.

    Attributes:
        port: device path, or URL of pyserial.
        baud: baud rate in bit/s, or None to use the rate of the wire.
    """

    port: str
    baud: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerPlan:
    """Commands that switch the supply of a real device, as read from a rig file.

    Without such commands the operator switches the device.

    Attributes:
        on: command line that switches the device on, as a list of words. No shell is used.
        off: command line that switches the device off, as a list of words.
    """

    on: tuple[str, ...]
    off: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """Permitted deviations in tests with real devices and a human operator.

    Attributes:
        stick_pct: deviation of a stick held by hand, in per cent.
        time_us: deviation of a time, in microseconds.
        values: deviations of further signals by name, in the unit of the signal.
    """

    stick_pct: float = _STICK_PCT
    time_us: int = _LATE_MS * 1_000
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwarePlan:
    """The table `[hardware]` of a rig file: addresses of the real devices, and their operators.

    Attributes:
        control: control sockets of emulators that stand in for devices, by name of the device. The
            operator of the other devices is a human at the terminal.
        ports: ports of serial lines, by name of the wire.
        buses: python-can buses of CAN wires, by name of the wire.
        power: commands that switch the supply of a device, by name of the device.
        tolerance: permitted deviations in tests.
    """

    control: Mapping[str, Path] = field(default_factory=dict)
    ports: Mapping[str, PortPlan] = field(default_factory=dict)
    buses: Mapping[str, BusPlan] = field(default_factory=dict)
    power: Mapping[str, PowerPlan] = field(default_factory=dict)
    tolerance: Tolerances = field(default_factory=Tolerances)


@dataclass(frozen=True, slots=True, kw_only=True)
class RigPlan:
    """The content of a rig file, which describes a bench.

    Attributes:
        seed: seed of all random numbers.
        wires: wires by name, including wires that the file omits.
        devices: devices by name, in the order of the file.
        signals: values that change with time, by name, for use in formulas.
        faults: scheduled faults, in the order of the file.
        safe: values that outputs must have at the end of a test, by device and output.
        body: mechanical body that drives move, or None if there is none.
        real: settings for the bench in real time.
        hardware: addresses of real devices, or None if the file has no such section.
        path: path of the file, for messages and relative paths, or None without a file.
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
            wire: name of the wire.
        """
        return tuple(device for device in self.devices.values() if device.wire == wire)


# What is on a bench, in a few lines for people.

_WIRES: Final = {WireType.SERIAL: "serial line", WireType.RS485: "RS485", WireType.CAN: "CAN"}


def summary(plan: RigPlan) -> Iterator[str]:
    """Yield a summary of a rig file as lines of text, as `tickrig check` prints it.

    The first line has the number of devices, wires and other parts. Then each wire follows with its
    devices and addresses.

    Args:
        plan: content of the rig file.
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
    ideal = _ideal_motors(plan)
    width = max(map(len, [*plan.wires, *([_BODY] if ideal else [])]), default=0)
    on_wires: dict[str, list[str]] = {name: [] for name in plan.wires}
    for device in plan.devices.values():
        on_wires[device.wire].append(device_text(device))
    for wire in plan.wires.values():
        devices = ", ".join(on_wires[wire.name])
        yield f"  {wire.name:{width}}  {_wire_text(wire)}: {devices or 'nothing'}"
        if places := "; ".join(_places(plan, wire.name)):
            yield f"  {'':{width}}  {places}"
    if ideal:
        yield f"  {_BODY:{width}}  {ideal}"


_BODY: Final = "body"
_IDEAL_COUNTS: Final = 2_000
"""`IdealMotor.counts_per_turn`, for a check that needs no drive."""


def _ideal_motors(plan: RigPlan) -> str:
    """Return which drives of the body have an ideal motor, and its limits; empty if none has."""
    drives = plan.body.drives.values() if plan.body else ()
    ideal = [name for name in drives if plan.devices[name].kind is DeviceKind.EDS]
    if not ideal:
        return ""
    motors = "ideal motor" if len(ideal) == 1 else "ideal motors"
    limits = f"no load, no gear, {_IDEAL_COUNTS} counts in a turn of the wheel"
    return f"{motors} of {', '.join(ideal)}: {limits}"


def _wire_text(wire: WirePlan) -> str:
    """Return a description of the wire, with the properties that the file defines.

    >>> _wire_text(WirePlan(name="a", bit_rate=9600))
    'serial line 9600 8N1'
    """
    words = [_WIRES[wire.type]]
    if wire.bit_rate:
        words.append(str(wire.bit_rate))
        words.append("bit/s" if wire.type is WireType.CAN else wire.framing)
    return " ".join(words)


def device_text(device: DevicePlan) -> str:
    """Return a description of the device.

    >>> from tickrig.emulators.testing.rig_file.plan import DeviceKind
    >>> device_text(DevicePlan(name="left", kind=DeviceKind.MODEL, type="epos", wire="a"))
    'left (epos)'
    """
    about = ""
    if device.node_id is not None:
        waits = device.node_id == late.UNCONFIGURED
        about = f", waits for {LSS.upper()}" if waits else f", node-ID {device.node_id}"
    return f"{device.name} ({Path(device.type).name}{about})"


def _places(plan: RigPlan, wire: str) -> Iterator[str]:
    """Yield the places of a wire in real time and on hardware that the file defines."""
    if door := plan.real.doors.get(wire):
        bus = [bus_text(door.bus)] if door.bus else []
        yield f"real: {', '.join([*([str(door.link)] if door.link else []), *door.serve, *bus])}"
    if plan.hardware is not None:
        port, outside = plan.hardware.ports.get(wire), plan.hardware.buses.get(wire)
        place = port.port if port else bus_text(outside) if outside else "not said where"
        yield f"hardware: {place}"


def bus_text(bus: BusPlan) -> str:
    """Return a description of the bus of python-can.

    >>> bus_text(BusPlan(interface="socketcan", channel="can0"))
    'socketcan can0'
    """
    return bus.interface if bus.channel is None else f"{bus.interface} {bus.channel}"


def _driven(device: DevicePlan) -> int:
    return sum(not isinstance(value, int | float | str) for value in device.start.values())


def _count(number: int, what: str) -> str:
    return counted(number, what) if number else ""


def seed_of(seed: int, name: str, *, alone: bool) -> int:
    """Return the seed of a wire; random numbers of different wires are independent."""
    return seed if alone else seed ^ crc32(name.encode())


class RigFileError(ValueError):
    """Raised if a rig file has errors; the message has one line per error.

    Attributes:
        file: name of the file.
        mistakes: errors in the order of their lines.
    """

    __module__ = "tickrig"

    def __init__(self, file: str, mistakes: tuple[Mistake, ...]) -> None:
        self.file, self.mistakes = file, mistakes
        super().__init__("\n".join(f"{file}:{line}: {reason}" for line, reason in mistakes))
