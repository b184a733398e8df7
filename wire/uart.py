"""Characters of a UART on a serial line, and their reception with another setting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Literal

from tickrig.wire.errors import FieldError
from tickrig.wire.instant import NEVER

Parity = Literal["N", "E", "O", "M", "S"]
"""Parity of a setting: none, even, odd, mark (always 1), space (always 0)."""

PS_PER_US: Final = 1_000_000
PS_PER_S: Final = 1_000_000 * PS_PER_US
"""Number of picoseconds in a second. Times are in picoseconds, because a bit may be shorter than a
microsecond."""

_OVERSAMPLING: Final = 16
"""Number of samples per bit in a receiver."""

_MID_BIT: Final = _OVERSAMPLING // 2


@dataclass(frozen=True, slots=True)
class UartSetting:
    """The setting of a UART: bit rate and format of a character.

    Attributes:
        baud: bit rate in bit/s, at least 1.
        data_bits: number of data bits of a character, 5 to 8. The lowest bit is sent first.
        parity: parity bit after the data bits: "N" (none), "E" (even), "O" (odd), "M" (mark, 1) or
            "S" (space, 0).
        stop_bits: number of stop bits: 1, 1.5 or 2. A receiver checks only the first stop bit.

    Raises:
        FieldError: a value is out of range.

    >>> str(UartSetting(9_600, 7, "E", 2)), UartSetting(9_600, 7, "E", 2).frame_bits
    ('9600 7E2', 11)
    """

    baud: int = 115_200
    data_bits: int = 8
    parity: Parity = "N"
    stop_bits: int | float = 1

    def __post_init__(self) -> None:
        """Check the values."""
        if self.baud < 1:
            raise FieldError(f"{self.baud} bit/s: a UART has at least 1")
        if self.data_bits not in (5, 6, 7, 8):
            raise FieldError(f"{self.data_bits} data bits: a UART has 5, 6, 7 or 8")
        if self.parity not in ("N", "E", "O", "M", "S"):
            raise FieldError(f"parity {self.parity!r}: a UART has N, E, O, M or S")
        if self.stop_bits not in (1, 1.5, 2):
            raise FieldError(f"{self.stop_bits} stop bits: a UART has 1, 1.5 or 2")

    def __str__(self) -> str:
        """Return the usual notation: `115200 8N1`."""
        return f"{self.baud} {self.data_bits}{self.parity}{self.stop_bits:g}"

    @property
    def frame_bits(self) -> float:
        """Number of bits of a character on the line, from the start bit to the last stop bit."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits

    def duration_ps(self, characters: int = 1) -> int:
        """Compute the duration of characters sent back to back.

        Args:
            characters: number of characters.
        """
        # Count half bits, so that 1.5 stop bits stay whole numbers. The sum over all characters is
        # rounded once.
        return int(characters * 2 * self.frame_bits) * PS_PER_S // (2 * self.baud)

    def parity_bit(self, value: int) -> int:
        """Return the parity bit of a character.

        Without parity the result is 1, like the stop bit.

        Args:
            value: the character.
        """
        odd = value.bit_count() % 2
        return {"E": odd, "O": 1 - odd, "S": 0}.get(self.parity, 1)

    def bits(self, value: int) -> tuple[int, ...]:
        """Return the start bit, the data bits and the parity bit of a character.

        Args:
            value: the character. Bits above its data bits are not sent.
        """
        value &= (1 << self.data_bits) - 1
        data = tuple(value >> bit & 1 for bit in range(self.data_bits))
        parity = () if self.parity == "N" else (self.parity_bit(value),)
        return (0, *data, *parity)

    def levels(self, value: int, start_ps: int) -> Iterator[tuple[int, int]]:
        """Yield the levels of the line, 1 or 0, while a character is sent.

        Args:
            value: the character.
            start_ps: time at which the start bit begins, in ps.

        Yields:
            The levels, each with its end in ps. The stop bits are one level.
        """
        for number, bit in enumerate(self.bits(value), start=1):
            yield bit, start_ps + number * PS_PER_S // self.baud
        yield 1, start_ps + self.duration_ps()


@dataclass(frozen=True, slots=True)
class Character:
    """A character that a UART has received, with its errors.

    Attributes:
        value: sampled data bits.
        end_ps: end of the first stop bit, in ps.
        framing_error: whether the line was 0 in place of a stop bit.
        parity_error: whether the parity bit does not match the value.
        line_break: whether the line was 0 from the start bit to the stop bit. `framing_error` is
            then set, too.
    """

    value: int
    end_ps: int
    framing_error: bool = False
    parity_error: bool = False
    line_break: bool = False


@dataclass(slots=True)
class UartReceiver:
    """Samples a line 16 times per bit, and assembles characters.

    A sample of 0 after a sample of 1 is the edge of a start bit. Half a bit later the line must
    still be 0. Then each bit is sampled once, in its middle (National Semiconductor PC16550D uses
    this clock of 16 times the baud rate). After a framing error or a break the line has to be 1
    again before a new start bit is possible. The PC16550D is different, because it treats the
    missing stop bit as a start bit.

    Not emulated: majority votes of several samples, FIFOs and their overrun.

    Args:
        setting: the UART setting of the receiver.
        now_ps: start of sampling, when the line is idle.
    """

    setting: UartSetting
    now_ps: int = 0
    _next: int = field(init=False)  # number of the next sample to be taken
    _sampled: list[int] | None = field(init=False, default=None)  # of a character, from its edge
    _idle: bool = field(init=False, default=True)  # the line was 1, a 0 is a start bit

    def __post_init__(self) -> None:
        """Start with the first sample at or after `now_ps`."""
        self._next = self._sample_from(self.now_ps)

    @property
    def due_ps(self) -> int:
        """Time at which the UART samples the stop bit of the character that it receives, in ps.

        It is `NEVER` if no character is being received.
        """
        if self._sampled is None:
            return NEVER
        left = self._frame_samples - len(self._sampled) - 1
        return self._time_of(self._next + left * _OVERSAMPLING)

    def push(self, level: int, until_ps: int) -> Iterator[Character]:
        """Receive a level of the line, which begins at the end of the previous level.

        Args:
            level: level of the line, 1 or 0.
            until_ps: time at which the level ends, in ps. If earlier calls have received the line
                up to this time already, this call has no effect.

        Yields:
            The characters that are completed by this level.
        """
        end = self._sample_from(until_ps)
        while self._next < end:
            if self._sampled is not None:
                yield from self._sample(self._sampled, level)
            # Nothing can begin: skip to the end of this level at once.
            elif level or not self._idle:
                self._idle, self._next = bool(level), end
            else:
                self._sampled = []
                self._next += _MID_BIT

    def _sample(self, frame: list[int], level: int) -> Iterator[Character]:
        """Sample the middle of a bit."""
        taken = self._next
        frame.append(level)
        self._next += _OVERSAMPLING
        false_start = len(frame) == 1 and level
        if false_start or len(frame) == self._frame_samples:
            # Look for an edge from the next sample on, in the middle of the stop bit. The next
            # character of a sender that is slightly fast begins slightly before the end of the stop
            # bit.
            self._next = taken + 1
            self._sampled, self._idle = None, bool(level)
            if not false_start:
                yield self._character(frame[1:], self._time_of(taken + _MID_BIT))

    @property
    def _frame_samples(self) -> int:
        """Number of samples of a frame: start bit, data bits, parity bit, stop bit."""
        return 2 + self.setting.data_bits + (self.setting.parity != "N")

    def _character(self, sampled: list[int], end_ps: int) -> Character:
        count = self.setting.data_bits
        value = sum(bit << place for place, bit in enumerate(sampled[:count]))
        parity = sampled[count:-1]
        return Character(
            value,
            end_ps,
            framing_error=not sampled[-1],
            parity_error=parity not in ([], [self.setting.parity_bit(value)]),
            line_break=not any(sampled),
        )

    def _sample_from(self, t_ps: int) -> int:
        """Return the number of the first sample at or after a time."""
        # Compute the time from the number of the sample and not step by step. The period of 16 x
        # 115 200 samples a second is not a whole number of picoseconds, so rounding errors would
        # add up.
        return -(-t_ps * _OVERSAMPLING * self.setting.baud // PS_PER_S)

    def _time_of(self, sample: int) -> int:
        """Return the time at which a sample is taken, in ps, rounded up."""
        return -(-sample * PS_PER_S // (_OVERSAMPLING * self.setting.baud))


def sample(
    data: bytes, sender: UartSetting, receiver: UartSetting, start_ps: int = 0
) -> tuple[Character, ...]:
    """Return what a UART receives if the sender has another setting, such as another bit rate.

    The bytes are sent back to back.

    Args:
        data: the sent bytes.
        sender: the setting of the sender.
        receiver: the setting of the receiver.
        start_ps: start of the first start bit, in ps.

    Returns:
        The received characters. Reception ends when the line has been idle for a character.

    >>> [hex(got.value) for got in sample(b"OK", UartSetting(115_200), UartSetting(115_200))]
    ['0x4f', '0x4b']
    >>> [hex(got.value) for got in sample(b"OK", UartSetting(115_200), UartSetting(57_600))]
    ['0xcc']
    """
    uart = UartReceiver(receiver, start_ps)
    received: list[Character] = []
    for value in data:
        for level, until_ps in sender.levels(value, start_ps):
            received += uart.push(level, until_ps)
        start_ps += sender.duration_ps()
    received += uart.push(1, start_ps + receiver.duration_ps(2))
    return tuple(received)
