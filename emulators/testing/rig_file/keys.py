"""The keys of each table of a rig file; docs/reference/bench/rig-file.md shows them as here."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO, BODIES, LSS, PROFILES
from tickrig.emulators.testing.rig_file.plan import WireType
from tickrig.host.text.section import (
    Field,
    Schema,
    command,
    duration,
    flag,
    number,
    one_of,
    path,
    shown,
    size,
    table,
    text,
    texts,
    whole,
)

_LONGEST_NAME: Final = 40
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_FRAMING: Final = re.compile(r"[5-8][NEOMS](1|1\.5|2)")


def check_name(name: str) -> None:
    """Raise ValueError if a text cannot be the name of a device, wire or signal in a rig file."""
    if len(name) > _LONGEST_NAME:
        raise ValueError(f"a name of {len(name)} letters; {_LONGEST_NAME} are enough")
    if not _NAME.fullmatch(name):
        fitting = re.sub(r"\W", "_", name, flags=re.ASCII)
        hint = f", as {fitting}" if _NAME.fullmatch(fitting) else ""
        raise ValueError(f"a name is letters, digits and _, a letter first{hint}")


def framing(value: object) -> str:
    """Return data bits, parity and stop bits."""
    if isinstance(value, str) and _FRAMING.fullmatch(value):
        return value
    raise ValueError(f"it takes data bits, parity and stop bits as 8N1, not {shown(value)}")


def node_id(value: object) -> int:
    """Return a node-ID, or the word for a node that waits for a node-ID."""
    if value == LSS:
        return late.UNCONFIGURED
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 127:
        return value
    raise ValueError(f"it takes 1..127, or {LSS} for a node that waits for LSS, not {shown(value)}")


_MOST_BAUD: Final = 50_000_000
_NONE: Final = "none"
_ITS_DEVICE: Final = "that of its device"

_BAUD: Final = Field(whole(50, _MOST_BAUD), f"50..{_MOST_BAUD}", "bit rate, in bit/s", _ITS_DEVICE)
_BITRATE: Final = Field(
    whole(10_000, 1_000_000), "10000..1000000", "bit rate, in bit/s", "that of a DCF, or 1000000"
)
_TYPE: Final = {
    "type": Field(
        one_of(*(each.value for each in WireType)),
        ", ".join(f'"{each.value}"' for each in WireType),
        "what the wire is",
    )
}
_LINE: Final = {
    "baud": _BAUD,
    "framing": Field(framing, '"8N1", "7E2", ...', "data bits, parity, stop bits", '"8N1"'),
    "buffer_bytes": Field(
        whole(1, 1 << 24), f"1..{1 << 24}", "size of each transmit and receive buffer", _ITS_DEVICE
    ),
}
_RS485: Final = {
    "echo": Field(flag, "true, false", "each end also receives the bytes that it sends", "false"),
    "bursts": Field(
        flag,
        "true, false",
        "bytes without a gap between them arrive together, after the last one",
        "false",
    ),
}

WIRES: Final[Mapping[WireType, Schema]] = {
    WireType.SERIAL: _TYPE | _LINE,
    WireType.RS485: _TYPE | _LINE | _RS485,
    WireType.CAN: _TYPE | {"bitrate": _BITRATE},
}
"""The keys of `[wire.NAME]`."""

_DEVICE: Final = {
    "type": Field(
        text,
        "device type, CANopen model, EDS or DCF file, `FILE.yml:NODE`, `FILE.py:Class`",
        "what it is",
    ),
    "wire": Field(text, "name of a wire", "what it is connected to", "its own line; the only bus"),
    "start": Field(table, "a table", "its inputs at the start, see below", _NONE),
}

SERIAL_DEVICE: Final[Schema] = _DEVICE | {
    "config": Field(
        table, "a table", "options of `tickrig emu TYPE`: `--run-s` is `run-s` or `run_s`", _NONE
    )
}
CANOPEN_DEVICE: Final[Schema] = _DEVICE | {
    "node_id": Field(node_id, '1..127, "lss"', "its node-ID", "that of the DCF or model"),
    "profile": Field(
        one_of(*PROFILES),
        ", ".join(f'"{name}"' for name in PROFILES),
        "what it does with the objects of an EDS or DCF",
        f'"{AUTO}"',
    ),
    "store": Field(path, "a file", "where it keeps what 1010h and LSS store", _NONE),
    "sdo_timeout": Field(
        duration, '"500ms"', "silence of a client after which an SDO transfer is aborted", '"5s"'
    ),
    "sdo_memory": Field(size, '"64k"', "what its strings and domains hold together", '"64M"'),
}

BODY: Final[Schema] = {
    "kind": Field(one_of(*BODIES), ", ".join(f'"{name}"' for name in BODIES), "how it is driven"),
    "wheel_radius_m": Field(number(1e-4, 100), "above 0", "of each wheel, in m"),
    "tread_m": Field(number(1e-3, 1_000), "above 0", "between left and right wheels, in m"),
    "mass_kg": Field(number(0, 1e6), "0 or more", "mass on the driven wheels, in kg", "0"),
    "friction": Field(
        number(0, 10), "0..10", "friction between wheels and ground", "the wheels never slip"
    ),
    "mirrored": Field(
        texts, "a list of wheels", "wheels whose drive is mounted the other way round", _NONE
    ),
}
"""The keys of `[body]`, in addition to the wheels of its kind."""

_BUS: Final[Schema] = {
    "interface": Field(text, "a driver of python-can", "of the bus outside"),
    "channel": Field(text, "a text", "channel of the driver, such as can0", _NONE),
    "bitrate": Field(
        _BITRATE.field, _BITRATE.values, "bit rate that the driver sets", "not changed"
    ),
    "options": Field(table, "a table", "further options of the driver", _NONE),
}

REAL: Final[Schema] = {"control": Field(path, "a file", "control socket of the bench", _NONE)}
REAL_LINE: Final[Schema] = {
    "link": Field(path, "a file", "symbolic link to its pty", _NONE),
    "serve": Field(texts, "a URL or several", "`rfc2217://` or `socket://[HOST:]PORT`", _NONE),
}
REAL_BUS: Final[Schema] = _BUS

HARDWARE: Final[Schema] = {
    "control": Field(
        path, "a file", "control socket of an emulator as the operator", "the terminal"
    )
}
HARDWARE_LINE: Final[Schema] = {
    "port": Field(text, "a device path or URL", "where it is"),
    "baud": Field(_BAUD.field, _BAUD.values, _BAUD.text, "that of the wire"),
}
HARDWARE_BUS: Final[Schema] = _BUS
HARDWARE_DEVICE: Final[Schema] = {
    "control": Field(path, "a file", "as above, for this device", "that of all"),
    "power_on": Field(command, "a command line", "switches the device on", "the operator does it"),
    "power_off": Field(
        command, "a command line", "switches the device off", "the operator does it"
    ),
}
TOLERANCE: Final[Schema] = {
    "stick_pct": Field(
        number(0, 50), "0..50", "largest deviation of a stick that is held by hand, in %", "10"
    ),
    "time_ms": Field(number(0, 1_000), "0..1000", "largest deviation of a time, in ms", "50"),
}

TOP: Final[Schema] = {
    "seed": Field(whole(0, (1 << 63) - 1), "0 or more", "seed of all random numbers", "0"),
    "bus": Field(path, "a file", "bus.yml of ros2_canopen: each node is a device", _NONE),
    **{
        name: Field(table, "tables", meaning, _NONE)
        for name, meaning in (
            ("wire", "what connects devices and hosts"),
            ("device", "the devices"),
            ("signal", "signals that formulas can use"),
            ("fault", "faults of devices and wires"),
            ("safe", "outputs at the end of each test"),
            ("body", "a body that drives move"),
            ("real", "how hosts connect in real time"),
            ("hardware", "ports of the real devices"),
        )
    },
}

PAGE: Final[Mapping[str, Schema]] = {
    "the top": TOP,
    "`[wire.NAME]`, serial": WIRES[WireType.SERIAL],
    "`[wire.NAME]`, RS485": WIRES[WireType.RS485],
    "`[wire.NAME]`, CAN": WIRES[WireType.CAN],
    "`[device.NAME]`, on a serial line": SERIAL_DEVICE,
    "`[device.NAME]`, CANopen": CANOPEN_DEVICE,
    "`[body]`": BODY,
    "`[real]`": REAL,
    "`[real.NAME]`, of a line": REAL_LINE,
    "`[real.NAME]`, of a bus": REAL_BUS,
    "`[hardware]`": HARDWARE,
    "`[hardware.NAME]`, of a line": HARDWARE_LINE,
    "`[hardware.NAME]`, of a bus": HARDWARE_BUS,
    "`[hardware.NAME]`, of a device": HARDWARE_DEVICE,
    "`[hardware.tolerance]`": TOLERANCE,
}
"""The keys of all tables, by the name of the table on the page of the manual."""
