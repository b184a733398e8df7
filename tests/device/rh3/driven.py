"""A base with a master beside it, without a line."""

from __future__ import annotations

from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.driver import TABLE
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, BaseParameters
from tickrig.wire.modbus import (
    READ,
    WRITE,
    Command,
    Mode,
    Request,
    encode_frame,
    encode_request,
    parse_frame,
)

BY_NAME = {register.name: register for register in TABLE}
M_S = COUNTS_PER_RAD / 0.0995
"""Counts/s of a metre a second."""


class Driven:
    """A base under a master that takes 4 ms for each request."""

    def __init__(self, parameters: BaseParameters | None = None, *, dense: bool = True) -> None:
        self.base, self.now_us, self._dense = Rh3Base(parameters), 0, dense
        self.sent: list[tuple[int, bytes]] = []

    def run(self, duration_ms: int, rx: bytes = b"") -> bytes:
        """Let time pass; return what the base sent."""
        out = b""
        for _ in range(duration_ms):
            self.now_us += 1_000
            if self._dense or rx or self.base.due_us <= self.now_us:
                answer = self.base.tick(self.now_us, rx)
                self.sent += [(self.now_us, answer)] if answer else []
                out += answer
                rx = b""
        return out

    def ask(self, message: bytes, address: int = 1) -> str:
        """Make a request; return the answer in hex, empty if there is none."""
        answer = self.run(4, encode_frame(address, message))
        return parse_frame(answer)[1].hex(" ", 2) if answer else ""

    def read(self, name: str) -> int:
        """Read a register."""
        register = BY_NAME[name]
        request = Request(READ, (register.address, register.words))
        answer = bytes.fromhex(self.ask(encode_request(request)).replace(" ", ""))
        return int.from_bytes(answer[2:], "big", signed=register.signed)

    def write(self, **values: int) -> None:
        """Write registers, each in a request of its own; they must be taken."""
        for name, value in values.items():
            register = BY_NAME[name]
            data = (value & 2 ** (16 * register.words) - 1).to_bytes(2 * register.words, "big")
            split = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
            answer = self.ask(encode_request(Request(WRITE, write=(register.address, split))))
            assert answer.startswith("10"), answer

    def enable(self, mode: Mode = Mode.VELOCITY) -> None:
        """Give the motors power."""
        self.write(mode=mode, command=Command.ENABLE)

    def drive(self, left: float, right: float) -> None:
        """Want rim speeds in m/s."""
        self.write(target_speed_left=round(left * M_S), target_speed_right=round(right * M_S))

    def see(self, name: str) -> float:
        """Look at the base, after it has been looked at."""
        self.run(10)
        return self.base.read(name)
