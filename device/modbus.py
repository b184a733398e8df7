"""A Modbus slave and its registers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Copyable, Immutable, Part
from tickrig.wire import modbus
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER

# Named holding registers; a number of 32 bits takes two, its high half first.

_WORD: Final = 0x1_0000


@dataclass(frozen=True, slots=True)
class Register(Immutable):
    """Description of a number that a Modbus master can read from the device.

    A number occupies one or two consecutive registers.

    Attributes:
        address: address of the first register of the number.
        name: name of the number in the device.
        text: description with the unit.
        words: number of registers, 1 or 2.
        signed: whether the number is in two's complement.
        low: smallest value that a master may write.
        high: largest value that a master may write.
        initial: value after power-up.
        writable: whether a master may write the number.
    """

    address: int
    name: str
    text: str
    words: int = 1
    signed: bool = False
    low: int = 0
    high: int = 0xFFFF
    initial: int = 0
    writable: bool = False


class Registers(Part):
    """The registers of a Modbus device, with the numbers that they contain.

    A number of 32 bits must be written as a whole. Writing half of it is refused as an illegal
    address.

    Args:
        table: descriptions of the numbers.
        measured: functions that compute numbers. The key of a function is the name of its number.
            The function is called each time a master reads the number.
    """

    def __init__(
        self, table: Iterable[Register], measured: Mapping[str, Callable[[], int]]
    ) -> None:
        self.table: Mapping[str, Register] = {register.name: register for register in table}
        self._at = {
            register.address + word: (register, word)
            for register in self.table.values()
            for word in range(register.words)
        }
        self._measured = measured
        self._values: dict[str, int] = {}
        self._latest_read, self._places = (0, 0), list[tuple[str, int]]()  # of the latest read
        self.reset()

    def reset(self) -> None:
        """Restore the values after power-up."""
        self._values = {name: register.initial for name, register in self.table.items()}

    def __getitem__(self, name: str) -> int:
        """Return a number."""
        measure = self._measured.get(name)
        return self._values[name] if measure is None else measure()

    def __setitem__(self, name: str, value: int) -> None:
        """Set a number from inside the device."""
        self._values[name] = value

    def check(self, first: int, count: int) -> None:
        """Raise Refusal if a register does not exist."""
        if (first, count) == self._latest_read:
            return
        found = [self._find(address) for address in range(first, first + count)]
        self._places = [(r.name, 16 * (r.words - 1 - word)) for r, word in found]
        self._latest_read = (first, count)

    def read(self, first: int, count: int) -> list[int]:
        """Return registers; raise Refusal if a register does not exist."""
        self.check(first, count)
        values = {name: self[name] for name in dict(self._places)}
        return [values[name] >> shift & 0xFFFF for name, shift in self._places]

    def write(self, first: int, values: Sequence[int]) -> dict[str, int]:
        """Write consecutive registers as a master does. If a register is refused, none is written.

        Args:
            first: address of the first register.
            values: values of the registers, 16 bits each.

        Returns:
            The numbers that were written, by their names. A number has one or two registers.

        Raises:
            Refusal: a register does not exist or is read-only, or the value of a number is out of
                range. It is also raised if a number has two registers, and only one of them would
                be written.
        """
        written: dict[str, int] = {}
        at = first
        while at < first + len(values):
            register, word = self._find(at)
            words = values[at - first : at - first + register.words]
            if word or len(words) < register.words or not register.writable:
                raise modbus.Refusal(modbus.ExceptionCode.ILLEGAL_DATA_ADDRESS)
            written[register.name] = _joined(register, words)
            at += register.words
        self._values.update(written)
        return written

    def _find(self, address: int) -> tuple[Register, int]:
        try:
            return self._at[address]
        except KeyError:
            raise modbus.Refusal(modbus.ExceptionCode.ILLEGAL_DATA_ADDRESS) from None


def _joined(register: Register, words: Sequence[int]) -> int:
    value = 0
    for word in words:
        value = value * _WORD + word
    top = _WORD**register.words
    if register.signed and value >= top // 2:
        value -= top
    if not register.low <= value <= register.high:
        raise modbus.Refusal(modbus.ExceptionCode.ILLEGAL_DATA_VALUE)
    return value


# The slave's side of a line: frames separated by silence, requests answered in order.


@mypyc_attr(allow_interpreted_subclasses=True)
class ModbusSlave(Copyable):
    """Answers a master on an RTU line.

    A frame ends with silence. The slave then serves the frame and sends the answer at once. It
    ignores invalid frames and frames for other slaves, as the standard requires.

    Not emulated: function codes other than 03, 06, 10h and 17h, diagnostics, the refusal of frames
    with a gap of 1.5 characters.

    Args:
        registers: the registers.
        written: function that is called with the numbers that a master wrote, by name.
        address: address of this slave, 1..247.
        silence_us: length of the silence that ends a frame.

    Attributes:
        served: number of requests for this slave that were answered or executed.
        garbled: number of frames with a wrong length or CRC.
        last_request_us: time at which the last request for this slave was served.
    """

    def __init__(
        self,
        registers: Registers,
        written: Callable[[Mapping[str, int]], None],
        address: int = 1,
        silence_us: int = modbus.SHORTEST_SILENCE_US,
    ) -> None:
        self._registers, self._written = registers, written
        self._address, self._silence_us = address, silence_us
        self.reset()

    def reset(self) -> None:
        """Drop the received bytes."""
        self._frame, self._last_us = b"", 0
        self.served = self.garbled = self.last_request_us = 0

    @property
    def due_us(self) -> int:
        """The time at which the present frame ends if no more bytes arrive."""
        return self._last_us + self._silence_us if self._frame else NEVER

    def tick(self, now_us: int, rx: bytes) -> bytes:
        """Receive bytes; return an answer."""
        answer = b""
        if now_us >= self.due_us:
            answer, self._frame = self._serve(now_us, self._frame), b""
        if rx:
            self._frame = (self._frame + rx)[: modbus.MAX_FRAME_BYTES + 1]
            self._last_us = now_us
        return answer

    def _serve(self, now_us: int, frame: bytes) -> bytes:
        try:
            address, message = modbus.parse_frame(frame)
        except WireError:
            self.garbled += 1
            return b""
        if address not in (modbus.BROADCAST, self._address):
            return b""
        self.served, self.last_request_us = self.served + 1, now_us
        answer = self._obey(message)
        return b"" if address == modbus.BROADCAST else modbus.encode_frame(address, answer)

    def _obey(self, message: bytes) -> bytes:
        registers, values = self._registers, list[int]()
        try:
            request = modbus.parse_request(message)
            if request.read is not None:
                registers.check(*request.read)  # nothing is written if this is refused
            if request.write is not None:
                self._written(registers.write(*request.write))
            if request.read is not None:
                values = registers.read(*request.read)
        except modbus.Refusal as refusal:
            return modbus.encode_exception(message[0], refusal.code)
        return modbus.encode_response(request, values)
