"""An SCPI power supply, its host, and a fault that the host has to find: an answer that is late."""

import pytest
import serial

from tickrig import NEVER, Bench, Copyable, InputBank, InputSignal, LineSplitter, OutputSignal

INPUTS = (InputSignal("load_ohm", "what is connected", low=1, high=10_000, initial=10, unit="ohm"),)
OUTPUTS = {
    "voltage_mv": OutputSignal("voltage_mv", "at the terminals", "mV"),
    "current_ma": OutputSignal("current_ma", "through the load", "mA"),
}
LIMIT_MA = 3_000


class PowerSupply(Copyable):
    """A lab supply with a current limit; lines end with LF."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs, self.outputs = InputBank(INPUTS), OUTPUTS
        self.reset()

    @property
    def due_us(self) -> int:
        return 0 if self.inputs.changed else NEVER

    def reset(self) -> None:
        self._set_mv, self._on = 0, False
        self._errors = list[bytes]()
        self._lines = LineSplitter()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        self.inputs.changed = False
        return b"".join([self._obey(line.strip().upper()) for line in self._lines.push(rx)])

    def _obey(self, line: bytes) -> bytes:
        command, _, value = line.partition(b" ")
        match command:
            case b"*IDN?":
                return b"TICKRIG,PSU-1,0,1.0\n"
            case b"MEAS:VOLT?":
                return b"%.3f\n" % (self.read("voltage_mv") / 1_000)
            case b"MEAS:CURR?":
                return b"%.3f\n" % (self.read("current_ma") / 1_000)
            case b"SYST:ERR?":
                return (self._errors.pop(0) if self._errors else b'0,"No error"') + b"\n"
            case b"OUTP" if value in (b"ON", b"OFF"):
                self._on = value == b"ON"
            case b"VOLT" if value.replace(b".", b"", 1).isdigit() and float(value) <= 30:
                self._set_mv = round(float(value) * 1_000)
            case b"VOLT":
                self._errors.append(b'-222,"Data out of range"')
            case _:
                self._errors.append(b'-113,"Undefined header"')
        return b""

    def read(self, name: str, /) -> int:
        current_ma = min(self._set_mv // self.inputs["load_ohm"], LIMIT_MA) if self._on else 0
        voltage_mv = min(self._set_mv, current_ma * self.inputs["load_ohm"])
        return {"voltage_mv": voltage_mv, "current_ma": current_ma}[name]


class Host:
    """A careful host: drops what is late, and asks for errors."""

    def __init__(self, port: serial.Serial) -> None:
        self._port = port

    def ask(self, question: bytes) -> bytes:
        self._port.write(question + b"\n")
        answer = self._port.readline()
        if not answer.endswith(b"\n"):
            raise TimeoutError(question.decode())
        return answer.strip()

    def set_voltage(self, volt: float) -> None:
        self._port.write(b"VOLT %.3f\nOUTP ON\n" % volt)
        error = self.ask(b"SYST:ERR?")
        if not error.startswith(b"0,"):
            raise ValueError(error.decode())

    def measure(self, what: bytes) -> float:
        self._port.reset_input_buffer()
        value = float(self.ask(b"MEAS:" + what + b"?"))
        if self.ask(b"*IDN?").count(b",") != 3:  # else the answers are one question behind
            raise TimeoutError("the answers are late")
        return value


@pytest.fixture
def bench_config() -> PowerSupply:
    return PowerSupply()


def test_it_limits_the_current(bench: Bench) -> None:
    host = Host(bench.serial(timeout=0.1))
    host.set_voltage(12)
    assert (host.measure(b"VOLT"), host.measure(b"CURR")) == (12, 1.2)
    bench.set("load_ohm", 2)
    assert (host.measure(b"VOLT"), host.measure(b"CURR")) == (6, 3)
    with pytest.raises(ValueError, match="out of range"):
        host.set_voltage(31)


def test_an_answer_that_comes_late_is_not_taken_for_the_next(bench: Bench) -> None:
    port = bench.serial(timeout=0.1)
    host = Host(port)
    host.set_voltage(12)
    bench.fault("delay=150ms,count=1")
    with pytest.raises(TimeoutError):
        host.measure(b"VOLT")
    assert float(host.ask(b"MEAS:CURR?")) == 12  # a careless host takes the volts for amperes
    bench.run_for("100ms")
    assert host.measure(b"CURR") == 1.2
