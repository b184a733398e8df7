"""Servos on a half-duplex bus with a checksum, as Dynamixels are, and a host that has to repeat."""

import pytest
import serial

from tickrig import (
    Bench,
    Copyable,
    DeviceType,
    InputBank,
    InputSignal,
    LineSettings,
    OutputSignal,
    Rs485Line,
    SignalType,
    by_length,
)

HEADER = b"\xff\xff"
FRAMES = by_length(HEADER, at=3, extra=4, gap="10ms")
IDS = (1, 2)
READ, WRITE = 2, 3
GOAL, PRESENT = 30, 36
CHECKSUM_ERROR, RANGE_ERROR = 0x10, 0x08


def packet(number: int, code: int, data: bytes = b"") -> bytes:
    """Write a packet: to a servo with an instruction, from one with its errors."""
    body = bytes([number, len(data) + 2, code]) + data
    return HEADER + body + bytes([~sum(body) & 0xFF])


def body_of(frame: bytes) -> tuple[int, int, bytes]:
    """Return number, code and data of a packet; ValueError if it is none."""
    if frame[:2] != HEADER or len(frame) < 6 or packet(frame[2], frame[4], frame[5:-1]) != frame:
        raise ValueError(f"wrong checksum: {frame.hex(' ')}")
    return frame[2], frame[4], frame[5:-1]


class ServoBus(Copyable):
    """Two servos that share a line; a servo is where it was sent at once."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs = InputBank([InputSignal("blocked", "servo 1 is stuck", SignalType.FAULT)])
        self.outputs = {f"servo{n}": OutputSignal(f"servo{n}", "place", "1/1024") for n in IDS}
        self.reset()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else self._frames.due_us

    def reset(self) -> None:
        self._frames, self._places = FRAMES.splitter(), dict.fromkeys(IDS, 512)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        return b"".join([self._answer(frame) for frame in self._frames.push(now_us, rx)])

    def _answer(self, frame: bytes) -> bytes:
        number = frame[2] if len(frame) > 2 else 0
        if number not in IDS:
            return b""
        try:
            _, code, data = body_of(frame)
        except ValueError:
            return packet(number, CHECKSUM_ERROR)
        if code == READ and data == bytes([PRESENT, 2]):
            return packet(number, 0, self._places[number].to_bytes(2, "little"))
        if code == WRITE and len(data) == 3 and data[0] == GOAL:
            place = int.from_bytes(data[1:], "little")
            if place > 1_023:
                return packet(number, RANGE_ERROR)
            if not (number == 1 and self.inputs["blocked"]):
                self._places[number] = place
        return packet(number, 0)

    def read(self, name: str, /) -> int:
        return self._places[int(name.removeprefix("servo"))]


def ask(port: serial.Serial, request: bytes, size: int, tries: int = 8) -> bytes:
    """Ask a servo, and again if the answer is wrong."""
    for _ in range(tries):
        port.reset_input_buffer()
        port.write(request)
        try:
            number, errors, data = body_of(port.read(6 + size))
        except ValueError:
            continue
        if (number, errors, len(data)) == (request[2], 0, size):
            return data
    raise TimeoutError(f"no answer to {request.hex(' ')}")


def turn(port: serial.Serial, number: int, place: int) -> int:
    """Send a servo somewhere; return where it is."""
    ask(port, packet(number, WRITE, bytes([GOAL]) + place.to_bytes(2, "little")), 0)
    return int.from_bytes(ask(port, packet(number, READ, bytes([PRESENT, 2])), 2), "little")


@pytest.fixture
def bench_config() -> DeviceType:
    line = LineSettings(57_600, splitter=FRAMES, wire=Rs485Line)
    return DeviceType(name="servos", title="", build=lambda config: ServoBus(), line=line)


@pytest.mark.parametrize("fault", ["", "parity=rate=0.03", "garbage=rate=0.4", "truncate=rate=0.4"])
def test_servos_turn_on_a_noisy_bus_too(bench: Bench, fault: str) -> None:
    if fault:
        bench.fault(fault)
    port = bench.serial(timeout=0.02)
    assert [turn(port, number, 300 * number) for number in IDS] == [300, 600]


def test_a_blocked_servo_is_found(bench: Bench) -> None:
    bench.fault("blocked")
    assert turn(bench.serial(timeout=0.02), 1, 700) == 512
