"""A sensor on Modbus RTU, a master of pymodbus, and faults that its check has to find."""

from contextlib import suppress
from struct import pack, unpack

import crcmod
import pytest
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusException

from tickrig import (
    Bench,
    Copyable,
    DeviceType,
    InputSignal,
    LineSettings,
    OutputSignal,
    QuantityBank,
    by_gap,
)
from tickrig.testing import check_device, strategies

ADDRESS = 5
FRAMES = by_gap("4ms")
INPUTS = (
    InputSignal("temperature_c", "of the air", low=-40, high=80, initial=20, unit="C", real=True),
    InputSignal("humidity_pct", "of the air", high=100, initial=50, unit="%"),
)
crc16 = crcmod.mkCrcFun(0x1_8005, initCrc=0xFFFF, rev=True, xorOut=0)


def with_crc(frame: bytes) -> bytes:
    return frame + pack("<H", crc16(frame))


class Sensor(Copyable):
    """Input register 0: tenths of a degree, signed; 1: humidity in per cent."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs, self.outputs = QuantityBank(INPUTS), {"requests": OutputSignal("requests", "")}
        self.reset()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else self._frames.due_us

    def reset(self) -> None:
        self._frames, self._requests = FRAMES.splitter(), 0

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        return b"".join([self._answer(frame) for frame in self._frames.push(now_us, rx)])

    def _answer(self, frame: bytes) -> bytes:
        if len(frame) != 8 or with_crc(frame[:-2]) != frame or frame[0] != ADDRESS:
            return b""
        self._requests += 1
        function, first, count = unpack(">BHH", frame[1:6])
        if function != 4:
            return with_crc(bytes([ADDRESS, function | 0x80, 1]))
        if not (count >= 1 and first + count <= 2):
            return with_crc(bytes([ADDRESS, function | 0x80, 2]))
        tenths = round(self.inputs["temperature_c"] * 10)
        registers = pack(">hH", tenths, int(self.inputs["humidity_pct"]))
        data = registers[2 * first : 2 * (first + count)]
        return with_crc(bytes([ADDRESS, function, len(data)]) + data)

    def read(self, name: str, /) -> int:
        return {"requests": self._requests}[name]


SENSOR = DeviceType(
    name="sensor",
    title="Sensor",
    build=lambda config: Sensor(),
    line=LineSettings(baud=9_600, splitter=FRAMES),
)


@pytest.fixture
def bench_config() -> DeviceType:
    return SENSOR


@pytest.fixture
def master(bench: Bench, bench_time: None) -> ModbusSerialClient:
    """A master of pymodbus; the fixture `bench_time` lets its clock be the bench's."""
    master = ModbusSerialClient(bench.url, baudrate=9_600, timeout=0.2, retries=0)
    assert master.connect()
    return master


def test_it_is_a_device() -> None:
    request = with_crc(bytes([ADDRESS, 4, 0, 0, 0, 2]))
    check_device(SENSOR, traffic=strategies.chunks([request]), pauses=False)


def test_a_master_reads_temperature_and_humidity(bench: Bench, master: ModbusSerialClient) -> None:
    bench.set("temperature_c", -3.5)
    answer = master.read_input_registers(0, count=2, device_id=ADDRESS)
    assert [*answer.registers] == [0x1_0000 - 35, 50]
    assert master.read_input_registers(7, count=1, device_id=ADDRESS).isError()
    assert "> 05040000 0002704f" in bench.transcript()


@pytest.mark.parametrize("fault", ["parity", "truncate", "garbage", "delay=300ms", "split=300ms"])
def test_a_master_finds_a_fault_of_its_line(
    bench: Bench, master: ModbusSerialClient, fault: str
) -> None:
    bench.fault(fault)
    with suppress(ModbusException):
        assert master.read_input_registers(0, count=2, device_id=ADDRESS).isError()
