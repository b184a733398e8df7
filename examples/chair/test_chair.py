"""A host of a wheelchair, and its tests: `pytest examples/chair`."""

import pytest
import serial

from tickrig import Bench

TRIES = 20


def drive(port: serial.Serial, percent: int) -> None:
    """Drive forward: your host. It knows pyserial, and nothing of tickrig."""
    for _ in range(TRIES):
        port.reset_input_buffer()
        port.write(b"output%02x00\n" % percent)
        if port.readline() == b"OK:output\n":
            return
    raise TimeoutError("no OK")


@pytest.fixture
def port(bench: Bench) -> serial.Serial:
    bench.press("power_button")
    bench.run_for("1s")
    return bench.serial(timeout=0.5)


def test_it_drives(bench: Bench, port: serial.Serial) -> None:
    drive(port, 30)
    assert bench.get("out_v_pct") == 30


def test_it_drives_on_a_noisy_line(bench: Bench, port: serial.Serial) -> None:
    bench.fault("flip=0.01")
    drive(port, 30)
    bench.clear("flip")
    assert bench.get("out_v_pct") == 30
