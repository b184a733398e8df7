"""A stepper with AT-like commands, its host, and two faults: it stalls, and its answer is cut."""

import pytest
import serial

from tickrig import (
    NEVER,
    Bench,
    Copyable,
    InputBank,
    InputSignal,
    LineSplitter,
    OutputSignal,
    SignalType,
)

INPUTS = (InputSignal("stalled", "something holds the shaft", SignalType.FAULT),)
OUTPUTS = {"position": OutputSignal("position", "of the shaft", "steps")}
STEP_US = 1_000


class Stepper(Copyable):
    """`AT` OK; `AT+MOVE=N` OK, and `+DONE:POSITION` or `+ERR:STALL` later; `AT+POS?` a number."""

    tick_us = 1_000

    def __init__(self) -> None:
        self.inputs, self.outputs = InputBank(INPUTS), OUTPUTS
        self.reset()

    @property
    def due_us(self) -> int:
        if self.inputs.changed:
            return 0
        return self._from_us + abs(self._distance) * STEP_US if self._distance else NEVER

    def reset(self) -> None:
        self._position, self._distance, self._from_us = 0, 0, 0
        self._lines = LineSplitter()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        changed, self.inputs.changed = self.inputs.changed, False
        sent = b""
        if self._distance and changed and self.inputs["stalled"]:
            steps = min((now_us - self._from_us) // STEP_US, abs(self._distance))
            self._position += steps if self._distance > 0 else -steps
            self._distance = 0
            sent = b"+ERR:STALL\r\n"
        elif self._distance and now_us >= self.due_us:
            self._position, self._distance = self._position + self._distance, 0
            sent = b"+DONE:%d\r\n" % self._position
        return sent + b"".join([self._obey(now_us, line) for line in self._lines.push(rx)])

    def _obey(self, now_us: int, line: bytes) -> bytes:
        command, _, value = line.strip().partition(b"=")
        if command == b"AT+POS?":
            return b"+POS:%d\r\nOK\r\n" % self._position
        if command == b"AT+MOVE" and value.removeprefix(b"-").isdigit() and not self._distance:
            if self.inputs["stalled"]:
                return b"OK\r\n+ERR:STALL\r\n"
            self._distance, self._from_us = int(value), now_us
            return b"OK\r\n"
        return b"OK\r\n" if command == b"AT" else b"ERROR\r\n"

    def read(self, name: str, /) -> int:
        return {"position": self._position}[name]


class Host:
    """Moves the stepper, and says when it does not arrive."""

    def __init__(self, port: serial.SerialBase) -> None:
        self._port = port

    def move(self, steps: int) -> int:
        self._port.write(b"AT+MOVE=%d\r\n" % steps)
        self._expect(b"OK")
        return int(self._expect(b"+DONE:"))

    def _expect(self, begin: bytes) -> bytes:
        line = self._port.readline()
        if not line.endswith(b"\r\n"):  # half a number is a number, too
            raise TimeoutError(f"{line!r} does not end")
        if not line.startswith(begin):
            raise RuntimeError(line.strip().decode())
        return line[len(begin) :].strip()


@pytest.fixture
def bench_config() -> Stepper:
    return Stepper()


def test_it_moves_forth_and_back(bench: Bench) -> None:
    host = Host(bench.serial(timeout=1))
    assert (host.move(300), host.move(-100)) == (300, 200)
    assert bench.get("position") == 200


def test_a_stall_is_found_and_the_position_is_where_it_stopped(bench: Bench) -> None:
    host = Host(bench.serial(timeout=1))
    bench.fault("stalled@100ms")
    with pytest.raises(RuntimeError, match="STALL"):
        host.move(300)
    assert 90 <= int(bench.get("position")) <= 100


def test_half_a_number_is_not_believed(bench: Bench) -> None:
    host = Host(bench.serial(timeout=1))
    bench.fault("truncate=80%@200ms")
    with pytest.raises(TimeoutError, match="DONE:30"):
        host.move(300)
