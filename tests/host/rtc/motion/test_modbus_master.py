from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.modbus import ModbusSlave, Register, Registers
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.host.links.link import LinkClosed
from tickrig.host.rtc.motion.modbus_master import ModbusAnswer, ModbusMaster
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus import (
    READ,
    READ_WRITE,
    WRITE,
    WRITE_ONE,
    ExceptionCode,
    Request,
    encode_frame,
    encode_request,
)

READ_TWO = Request(READ, (0, 2))
TABLE = (
    Register(0, "first", "", initial=7, writable=True),
    Register(1, "second", "", initial=8),
)


class Slave:
    """A slave as a device of a rig."""

    tick_us = 1_000

    def __init__(self) -> None:
        self._slave = ModbusSlave(Registers(TABLE, {}), lambda values: None)

    @property
    def due_us(self) -> int:
        return self._slave.due_us

    def reset(self) -> None:
        self._slave.reset()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        return self._slave.tick(now_us, rx)


class Bench:
    """A master and a slave on a line of two wires."""

    def __init__(self, seed: int = 0, *, echo: bool = False) -> None:
        line = Rs485Line(115_200, echo=echo)
        self.port = FaultyPort(line.a, BYTE_FAULTS, seed)
        self.rig = Rig(Station(Slave(), self.port))
        self.link = SimLink(self.rig, line.b)
        self.master = ModbusMaster(self.link)

    def answers(self, request: Request, periods: int = 20) -> list[ModbusAnswer]:
        """Begin a request, and poll each 5 ms."""
        self.master.begin(request)
        out = []
        for _ in range(periods):
            self.rig.run_for(5_000)
            answer = self.master.poll()
            out += [answer] if answer else []
        return out


class Script:
    """A link that hears what a test says."""

    def __init__(self) -> None:
        self.now_us, self.sent, self.waiting = 0, list[bytes](), b""

    def send(self, traffic: bytes, /) -> None:
        self.sent.append(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        heard, self.waiting = self.waiting, b""
        return heard

    def close(self) -> None:
        self.now_us = NEVER


@pytest.mark.parametrize("echo", [False, True])
@pytest.mark.parametrize(
    ("request_", "values"),
    [
        (READ_TWO, (7, 8)),
        (Request(WRITE_ONE, write=(0, (5,))), ()),
        (Request(WRITE, write=(0, (5,))), ()),
        (Request(READ_WRITE, (0, 2), (0, (5,))), (5, 8)),
    ],
)
def test_each_function_is_answered(
    request_: Request, values: tuple[int, ...], *, echo: bool
) -> None:
    assert Bench(echo=echo).answers(request_) == [ModbusAnswer(request_, values)]


def test_an_echo_is_no_answer() -> None:
    link = Script()
    master = ModbusMaster(link)
    for request in (
        READ_TWO,
        Request(WRITE, write=(0, (5,))),
        Request(READ_WRITE, (0, 2), (0, (5,))),
    ):
        master.begin(request)
        link.waiting = link.sent[-1]
        assert master.poll() is None


def test_a_refusal_is_an_answer() -> None:
    request = Request(READ, (9, 1))
    refusal = ExceptionCode.ILLEGAL_DATA_ADDRESS
    assert Bench().answers(request) == [ModbusAnswer(request, refusal=refusal)]


def test_a_code_that_nobody_knows_stays_a_number() -> None:
    link = Script()
    master = ModbusMaster(link)
    master.begin(READ_TWO)
    link.waiting = encode_frame(1, b"\x83\x63")
    assert master.poll() == ModbusAnswer(READ_TWO, refusal=0x63)


@pytest.mark.parametrize("retries", [0, 1, 3])
def test_a_request_without_an_answer_is_made_again(retries: int) -> None:
    link = Script()
    master = ModbusMaster(link, retries=retries)
    master.begin(READ_TWO)
    for link.now_us in range(0, 100_000, 5_000):
        assert master.poll() is None
    assert link.sent == [encode_frame(1, encode_request(READ_TWO))] * (1 + retries)
    assert (master.pending, master.misses, master.lost) == (None, 1, 1 + retries)


def test_an_answer_is_awaited_for_20_ms() -> None:
    link = Script()
    master = ModbusMaster(link)
    master.begin(READ_TWO)
    link.now_us = 19_999
    master.poll()
    assert len(link.sent) == 1
    link.now_us = 20_000
    master.poll()
    assert len(link.sent) == 2


def test_an_answer_ends_a_row_of_misses() -> None:
    bench = Bench()
    bench.port.arm("cut")
    assert bench.answers(READ_TWO) == bench.answers(READ_TWO) == []
    assert bench.master.misses == 2
    bench.port.clear("cut")
    assert len(bench.answers(READ_TWO)) == 1
    assert (bench.master.misses, bench.master.lost) == (0, 4)


@pytest.mark.parametrize(
    "heard",
    [
        encode_frame(2, b"\x03\x04\x00\x07\x00\x08"),  # of somebody else
        encode_frame(1, b"\x10\x00\x00\x00\x01"),  # to another function
        encode_frame(1, b"\x03\x02\x00\x07"),  # too few registers
        encode_frame(1, b"\x03\x04\x00\x07\x00\x08")[:-1],
        encode_frame(1, b"\x03\x04\x00\x07\x00\x08")[:-1] + b"\x00",
        b"\x00" * 300,
    ],
)
def test_what_is_no_answer_is_passed_over(heard: bytes) -> None:
    link = Script()
    master = ModbusMaster(link)
    master.begin(READ_TWO)
    link.waiting = heard
    assert master.poll() is None
    assert master.pending is READ_TWO


def test_an_answer_may_come_in_pieces() -> None:
    link = Script()
    master = ModbusMaster(link)
    master.begin(READ_TWO)
    frame = encode_frame(1, b"\x03\x04\x00\x07\x00\x08")
    for place in range(len(frame)):
        link.waiting = frame[place : place + 1]
        answer = master.poll()
    assert answer == ModbusAnswer(READ_TWO, (7, 8))


def test_what_comes_without_a_request_is_dropped() -> None:
    link = Script()
    master = ModbusMaster(link)
    link.waiting = encode_frame(1, b"\x03\x04\x00\x07\x00\x08")
    assert master.poll() is None
    link.waiting = b"\x01\x03"
    master.begin(READ_TWO)
    assert master.poll() is None
    link.waiting = encode_frame(1, b"\x03\x04\x00\x07\x00\x08")
    assert master.poll() == ModbusAnswer(READ_TWO, (7, 8))


@given(st.integers(0, 10_000))
def test_noise_gives_the_right_answer_or_none(seed: int) -> None:
    bench = Bench(seed)
    bench.port.arm("flip", "0.01")
    assert bench.answers(READ_TWO) in ([], [ModbusAnswer(READ_TWO, (7, 8))])


def test_a_line_that_is_gone_is_told() -> None:
    bench = Bench()
    bench.master.close()
    with pytest.raises(LinkClosed):
        bench.master.begin(READ_TWO)
    with pytest.raises(LinkClosed):
        bench.master.poll()
