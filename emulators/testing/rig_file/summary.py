"""What is on a bench, in a few lines for people."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tickrig.device.canopen.core.slave import UNCONFIGURED
from tickrig.emulators.canopen.node.node_spec import LSS
from tickrig.emulators.testing.rig_file.plan import BusPlan, DevicePlan, RigPlan, WirePlan, WireType

WIRES: Final = {WireType.SERIAL: "serial line", WireType.RS485: "RS485", WireType.CAN: "CAN"}


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
        yield f"  {wire.name:{width}}  {wire_text(wire)}: {devices or 'nothing'}"
        if places := "; ".join(_places(plan, wire.name)):
            yield f"  {'':{width}}  {places}"


def wire_text(wire: WirePlan) -> str:
    """Say what a wire is, as far as the file says it.

    >>> wire_text(WirePlan(name="a", bit_rate=9600))
    'serial line 9600 8N1'
    """
    words = [WIRES[wire.type]]
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
    return f"{number} {what}{'s' if number > 1 else ''}" if number else ""
