"""The base of RH3 as a device type: `rh3-emu`, and its configuration in traces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, Final

from tickrig.device.modbus import Register
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.driver import TABLE
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.commands.device_type import ConfiguredDevice, DeviceType, check_config
from tickrig.emulators.rh3.fields import FIELDS
from tickrig.emulators.scenario import Send, Sender, parse_raw
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.host.text.names import near
from tickrig.host.text.trace import Config
from tickrig.wire import modbus
from tickrig.wire.errors import WireError

# Split the traffic of the line into frames, shown in hex without their CRC: `01 03 00 00 00 02`.

_CRC_BYTES = 2


class _FrameSplitter:
    """A splitter for which a frame is complete when its CRC matches; other bytes stay unchanged."""

    def __init__(self) -> None:
        self._begun, self._received_us = b"", 0

    def split(self, at_us: int, data: bytes) -> list[bytes]:
        out = []
        if self._begun and at_us - self._received_us >= modbus.SHORTEST_SILENCE_US:
            out.append(b"(no frame) " + _hex(self._begun))
            self._begun = b""
        self._received_us = at_us
        self._begun = (self._begun + data)[: modbus.MAX_FRAME_BYTES]
        try:
            modbus.parse_frame(self._begun)
        except WireError:
            return out
        whole, self._begun = self._begun, b""
        return [*out, _hex(whole[:-_CRC_BYTES])]


def _hex(data: bytes) -> bytes:
    return data.hex(" ").encode()


# Requests of a scenario to a base: `read status`, `write target_speed_left 71534`, `raw`.

_BY_NAME = {register.name: register for register in TABLE}
_WORD = 0xFFFF


def verbs(address: int) -> Mapping[str, Sender]:
    """Return the sending verbs for a slave address."""

    def read(rest: str) -> Send:
        words = rest.split()
        if len(words) == 1 and words[0] in _BY_NAME:
            register = _BY_NAME[words[0]]
            return _packed(address, modbus.Request(modbus.READ, (register.address, register.words)))
        if len(words) == 2:
            return _packed(
                address, modbus.Request(modbus.READ, (_register(words[0]), _whole(words[1])))
            )
        raise ValueError(f"read takes a register's name, or an address and a number, got {rest!r}")

    def write(rest: str) -> Send:
        name, *words = rest.split() or [""]
        if name in _BY_NAME and len(words) == 1:
            values = _split(_BY_NAME[name], _whole(words[0]))
        elif words:
            values = tuple(_whole(word) & _WORD for word in words)
        else:
            raise ValueError(f"write takes a register and its value, got {rest!r}")
        return _packed(address, modbus.Request(modbus.WRITE, write=(_register(name), values)))

    return {"read": read, "write": write, "raw": parse_raw}


def _packed(address: int, request: modbus.Request) -> Send:
    frame = modbus.encode_frame(address, modbus.encode_request(request))
    return Send(frame, frame[:-_CRC_BYTES].hex(" ").encode())


def _register(word: str) -> int:
    if word in _BY_NAME:
        return _BY_NAME[word].address
    try:
        value = int(word, 0)
    except ValueError:
        raise ValueError(f"no register {word!r}; {near(word, _BY_NAME)}") from None
    if not 0 <= value <= _WORD:
        raise ValueError(f"register {word} is not in 0..0xFFFF")
    return value


def _whole(word: str) -> int:
    try:
        return int(word, 0)
    except ValueError:
        raise ValueError(f"{word!r} is not a whole number") from None


def _split(register: Register, value: int) -> tuple[int, ...]:
    """Return the registers of a number, with the high half first."""
    return tuple(value >> 16 * place & _WORD for place in reversed(range(register.words)))


_CYCLE: Final = b"01 17 "
"""Periodic traffic, which -v omits."""


def _config_to_trace(parameters: BaseParameters) -> Config:
    """Return all parameters, including unchanged ones, because defaults may change."""
    settings = asdict(parameters)
    return {"ground_seed" if name == "seed" else name: v for name, v in settings.items()}


def _parameters_of(settings: Mapping[str, Any]) -> BaseParameters:
    """Return parameters; raise ValueError for a value of a wrong type or out of range."""
    defaults = asdict(BaseParameters())
    for name, value in settings.items():
        wanted = (int,) if type(defaults[name]) is int else (int, float)
        if not (type(value) in wanted or (name == "friction" and value is None)):
            kind = "a whole number" if wanted == (int,) else "a number"
            raise ValueError(f"{name} is {value!r}, expected is {kind}")
    return BaseParameters(**settings)


def read_parameters(options: Mapping[str, Any]) -> BaseParameters:
    """Return the parameters of an emulated RH3 base from options; missing options get defaults.

    Raises:
        ValueError: an option is invalid. A message about a parameter names its option.
    """
    try:
        return _parameters_of({name: v for name, v in options.items() if v is not None})
    except ValueError as error:
        name, blank, rest = str(error).partition(" ")
        word = next((f"--{each.word}" for each in FIELDS if each.name == name), name)
        raise ValueError(f"{word}{blank}{rest}") from None


def _build_rh3(config: Config) -> Rh3Base:
    """Build a base.

    Raises:
        ValueError: a base does not have the parameter, or does not accept the value.
    """
    settings: dict[str, Any] = dict(config)
    if "ground_seed" in settings:
        settings["seed"] = settings.pop("ground_seed")
    check_config(settings, asdict(BaseParameters()), "a base has no parameter", typed=False)
    return Rh3Base(_parameters_of(settings))


def _configure(base: DeviceType, options: Mapping[str, Any], seed: int) -> ConfiguredDevice:
    settings = dict(options)
    line = replace(base.line, baud=settings.pop("baud"))
    parameters = read_parameters({**settings, "seed": seed})
    address = parameters.address

    def talk(link: str, baud: int) -> str:
        return (
            f" Any Modbus RTU master can open this path, as address {address}."
            f" To address 1:\n  rh3 goto 1 0 0 --device {link} --baud {baud}"
        )

    base = replace(base, senders=verbs(address), line=line, talk=talk)
    return ConfiguredDevice(base, Rh3Base(parameters), _config_to_trace(parameters))


RH3_BASE: Final = DeviceType(
    name="rh3-base",
    title="RH3 base",
    build=_build_rh3,
    fields=FIELDS,
    configure=_configure,
    config_of=lambda base: _config_to_trace(base.parameters),
    line=LineSettings(splitter=lambda _: _FrameSplitter().split, wire=Rs485Line),
    is_event=lambda line: not line.data.startswith(_CYCLE),
)
