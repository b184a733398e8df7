"""The first line of a trace of version 2: the devices of the bench, and how to rebuild them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from tickrig.host.text.trace import Config, TraceError

_VERSION: Final = 2
PREFIX: Final = f"# tickrig-trace v{_VERSION} "

NAME: Final = re.compile(r"\w[\w./:-]{0,99}", re.ASCII)
"""Allowed names of devices and wires in a trace."""


class WireType(StrEnum):
    """Kind of traffic on a wire."""

    SERIAL = "serial"
    CAN = "can"


class Place(StrEnum):
    """Where a trace was recorded: at the emulated devices, or at the port of the host.

    At the devices (`DEVICE`), the times in the trace are the times of ticks (the time steps of the
    devices). At the port with which a host is connected (`PORT`), they are the times of the traffic
    at this port.
    """

    DEVICE = "device"
    PORT = "port"


@dataclass(frozen=True, slots=True)
class WireEntry:
    """Description of one wire (a bus or serial line) in the header of a trace.

    Attributes:
        type: type of the wire, which defines its traffic: CAN frames or bytes.
        config: settings of the wire, such as the bit rate.
    """

    type: WireType
    config: Config = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DeviceEntry:
    """Description of one device in the header of a trace, from which a replay rebuilds the device.

    Attributes:
        wire: name of the wire to which the device is connected.
        type: device type, model, EDS or DCF file, or `FILE.py:Class`. The text is empty for a
            device object that was made by Python code. A replay cannot rebuild such a device.
        config: settings of the device.
        node_id: node-ID of a CANopen node, or None for another device.
        sha256: SHA-256 of the file in `type`.
        files: SHA-256 of each file that the file in `type` references, by name.
        stored: content of the device's non-volatile memory.
    """

    wire: str
    type: str = ""
    config: Config = field(default_factory=dict)
    node_id: int | None = None
    sha256: str = ""
    files: Mapping[str, Any] = field(default_factory=dict)
    stored: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class BenchHeader:
    """First line of a trace: the devices and wires of the recorded bench, for a replay.

    Attributes:
        devices: devices by name.
        wires: wires by name.
        seed: seed of all random numbers in the run.
        place: whether the trace was recorded at the devices or at the host's port.

    Raises:
        ValueError: a name is invalid, or a device refers to an unknown wire.
    """

    devices: Mapping[str, DeviceEntry]
    wires: Mapping[str, WireEntry]
    seed: int = 0
    place: Place = Place.DEVICE

    def __post_init__(self) -> None:
        """Check the names."""
        for name in (*self.devices, *self.wires):
            if not NAME.fullmatch(name):
                raise ValueError(f"{name!r:.60} cannot stand in a trace: letters, digits and _./:-")
        for name, device in self.devices.items():
            if device.wire not in self.wires:
                raise ValueError(
                    f"device {name} is on wire {device.wire!r:.60}, which is not there"
                )

    def on_can(self, name: str) -> bool:
        """Return whether a device receives CAN frames instead of bytes."""
        return self.wires[self.devices[name].wire].type is WireType.CAN

    def encode(self) -> str:
        """Return the first line without LF."""
        header: dict[str, object] = {"seed": self.seed}
        if self.place is not Place.DEVICE:
            header["place"] = self.place
        header["wires"] = {
            name: {"type": wire.type, **wire.config} for name, wire in self.wires.items()
        }
        header["devices"] = {name: _written(device) for name, device in self.devices.items()}
        return PREFIX + json.dumps(header)


def _written(device: DeviceEntry) -> dict[str, object]:
    """Return the entry of a device, without empty fields."""
    fields = ("wire", "type", "config", "node_id", "sha256", "files", "stored")
    found = {name: getattr(device, name) for name in fields}
    return {name: value for name, value in found.items() if value not in ("", None, {})}


def parse_bench_header(line: str) -> BenchHeader:
    """Read the first line. Raise TraceError if it is not a valid header."""
    if not line.startswith(PREFIX):
        raise TraceError(f"line 1 is not '{PREFIX}{{HEADER}}': {line!r:.60}")
    try:
        header = json.loads(line.removeprefix(PREFIX))
        found = _Reader(header, "the header")
        wires = found.table("wires")
        return BenchHeader(
            {name: _device(name, table) for name, table in found.table("devices").items()},
            {name: _wire(name, table) for name, table in wires.items()},
            found.take("seed", int, 0),
            Place(found.take("place", str, Place.DEVICE)),
        )
    except (ValueError, RecursionError) as error:
        raise TraceError(f"line 1: {error}") from None


def _device(name: str, table: object) -> DeviceEntry:
    found = _Reader(table, f"device {name!r:.60}")
    config = found.table("config", {})
    for key, value in config.items():
        if not isinstance(value, str | int | float | None):
            raise ValueError(f"device {name!r:.60}: {key!r:.60} is {value!r:.60}")
    return DeviceEntry(
        found.take("wire", str),
        found.take("type", str, ""),
        config,
        found.take("node_id", int, None),
        found.take("sha256", str, ""),
        found.table("files", {}),
        found.table("stored", {}),
    )


def _wire(name: str, table: object) -> WireEntry:
    found = _Reader(table, f"wire {name!r:.60}")
    config = {key: value for key, value in found.values.items() if key != "type"}
    return WireEntry(WireType(found.take("type", str)), config)


class _Reader:
    """A reader of values in a JSON object from an untrusted source."""

    def __init__(self, values: object, owner: str) -> None:
        if not isinstance(values, dict):
            raise ValueError(f"{owner} is no JSON object: {values!r:.60}")
        self.values, self._owner = values, owner

    def take(self, name: str, expected: type, *default: Any) -> Any:
        """Return a value of the header after checking its type, or the default if it is missing.

        Raises:
            ValueError: the value has another type, or is missing and has no default.
        """
        value = self.values.get(name, *default)
        if type(value) is not expected and not (default and value == default[0]):
            raise ValueError(f"{self._owner} has no {name}, or a bad one: {value!r:.60}")
        return value

    def table(self, name: str, *default: Any) -> dict[str, Any]:
        """Return a JSON object."""
        return dict(self.take(name, dict, *default))
