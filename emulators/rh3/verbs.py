"""What a scenario can send to a base: `read status`, `write target_speed_left 71534`, `raw`."""

from __future__ import annotations

from collections.abc import Mapping

from tickrig.device.modbus.registers import Register
from tickrig.device.rh3.register_map import TABLE
from tickrig.emulators.rh3.frame_log import CRC_BYTES
from tickrig.emulators.scenario.scenario import Send, Sender, parse_raw
from tickrig.host.text.names import near
from tickrig.wire.modbus.requests import READ, WRITE, Request, encode_request
from tickrig.wire.modbus.rtu import encode_frame

_BY_NAME = {register.name: register for register in TABLE}
WORD = 0xFFFF


def verbs(address: int) -> Mapping[str, Sender]:
    """Return the verbs that send, to the slave of an address."""

    def read(rest: str) -> Send:
        words = rest.split()
        if len(words) == 1 and words[0] in _BY_NAME:
            register = _BY_NAME[words[0]]
            return _packed(address, Request(READ, (register.address, register.words)))
        if len(words) == 2:
            return _packed(address, Request(READ, (_register(words[0]), _whole(words[1]))))
        raise ValueError(f"read takes a register's name, or an address and a number, got {rest!r}")

    def write(rest: str) -> Send:
        name, *words = rest.split() or [""]
        if name in _BY_NAME and len(words) == 1:
            values = _split(_BY_NAME[name], _whole(words[0]))
        elif words:
            values = tuple(_whole(word) & WORD for word in words)
        else:
            raise ValueError(f"write takes a register and its value, got {rest!r}")
        return _packed(address, Request(WRITE, write=(_register(name), values)))

    return {"read": read, "write": write, "raw": parse_raw}


def _packed(address: int, request: Request) -> Send:
    frame = encode_frame(address, encode_request(request))
    return Send(frame, frame[:-CRC_BYTES].hex(" ").encode())


def _register(word: str) -> int:
    if word in _BY_NAME:
        return _BY_NAME[word].address
    try:
        value = int(word, 0)
    except ValueError:
        raise ValueError(f"no register {word!r}; {near(word, _BY_NAME)}") from None
    if not 0 <= value <= WORD:
        raise ValueError(f"register {word} is not in 0..0xFFFF")
    return value


def _whole(word: str) -> int:
    try:
        return int(word, 0)
    except ValueError:
        raise ValueError(f"{word!r} is not a whole number") from None


def _split(register: Register, value: int) -> tuple[int, ...]:
    """Return the registers of a number, high half first."""
    return tuple(value >> 16 * place & WORD for place in reversed(range(register.words)))
