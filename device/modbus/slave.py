"""The slave's side of a line: frames parted by silence, requests answered in turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tickrig._compiled import mypyc_attr
from tickrig.device.modbus.registers import Registers
from tickrig.device.twin import Copyable
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus.requests import (
    Refusal,
    encode_exception,
    encode_response,
    parse_request,
)
from tickrig.wire.modbus.rtu import (
    BROADCAST,
    MAX_FRAME_BYTES,
    SHORTEST_SILENCE_US,
    encode_frame,
    parse_frame,
)


@mypyc_attr(allow_interpreted_subclasses=True)
class ModbusSlave(Copyable):
    """Answers a master on an RTU line.

    A frame ends with silence; it is served then, and the answer leaves at once. What is
    no frame, or for somebody else, is passed over, as the standard says.

    Not emulated: function codes beside 03, 06, 10h and 17h, diagnostics, the
    refusal of frames with a gap of 1.5 characters.

    Args:
        registers: what it holds.
        written: called with what a master wrote, by name.
        address: 1..247.
        silence_us: what ends a frame.

    Attributes:
        served: requests for this slave that were answered or obeyed.
        garbled: frames with a wrong length or CRC.
        last_request_us: when the last request for this slave was served.
    """

    def __init__(
        self,
        registers: Registers,
        written: Callable[[Mapping[str, int]], None],
        address: int = 1,
        silence_us: int = SHORTEST_SILENCE_US,
    ) -> None:
        self._registers, self._written = registers, written
        self._address, self._silence_us = address, silence_us
        self.reset()

    def reset(self) -> None:
        """Forget what was heard."""
        self._frame, self._last_us = b"", 0
        self.served = self.garbled = self.last_request_us = 0

    @property
    def due_us(self) -> int:
        """When the frame that has begun ends, if nothing more comes."""
        return self._last_us + self._silence_us if self._frame else NEVER

    def tick(self, now_us: int, rx: bytes) -> bytes:
        """Take bytes; return an answer."""
        answer = b""
        if now_us >= self.due_us:
            answer, self._frame = self._serve(now_us, self._frame), b""
        if rx:
            self._frame = (self._frame + rx)[: MAX_FRAME_BYTES + 1]
            self._last_us = now_us
        return answer

    def _serve(self, now_us: int, frame: bytes) -> bytes:
        try:
            address, message = parse_frame(frame)
        except WireError:
            self.garbled += 1
            return b""
        if address not in (BROADCAST, self._address):
            return b""
        self.served, self.last_request_us = self.served + 1, now_us
        answer = self._obey(message)
        return b"" if address == BROADCAST else encode_frame(address, answer)

    def _obey(self, message: bytes) -> bytes:
        registers, values = self._registers, list[int]()
        try:
            request = parse_request(message)
            if request.read is not None:
                registers.check(*request.read)  # nothing is written if this is refused
            if request.write is not None:
                self._written(registers.write(*request.write))
            if request.read is not None:
                values = registers.read(*request.read)
        except Refusal as refusal:
            return encode_exception(message[0], refusal.code)
        return encode_response(request, values)
