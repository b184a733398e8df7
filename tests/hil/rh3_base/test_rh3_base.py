"""The base of Reference Hardware 3 on RS485: registers, motion, watchdog, emergency stop."""

from __future__ import annotations

import struct
from math import hypot
from pathlib import Path

import pytest

from tests.hil.line_host import PATIENCE, LineHost
from tests.hil.rigs import RIGS
from tickrig import Bench
from tickrig.wire.modbus import (
    DEVICE_ID,
    READ,
    WRITE,
    Address,
    Command,
    Mode,
    Request,
    encode_frame,
    encode_request,
    parse_frame,
)

pytestmark = pytest.mark.needs("device:rh3_base")

ADDRESS = 1
ENABLED, MOVING, FAULT, WATCHDOG = 1, 2, 4, 8
SPEED = 20_000
"""Counts/s."""

PLACE = ("x_m", "y_m", "angle_left_rad")


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "rh3_base.toml"


class Master(LineHost):
    """A Modbus RTU master."""

    def read(self, first: int, count: int = 1) -> tuple[int, ...]:
        """Read registers."""
        data = self._ask(Request(READ, read=(first, count)), 5 + 2 * count)[2:]
        return struct.unpack(f">{count}H", data)

    def read_wide(self, first: int) -> int:
        """Read a signed number of 32 bits."""
        high, low = self.read(first, 2)
        number: int = struct.unpack(">i", struct.pack(">HH", high, low))[0]
        return number

    def write(self, first: int, *values: int) -> None:
        """Write registers."""
        self._ask(Request(WRITE, write=(first, values)), 8)

    def write_wide(self, first: int, *values: int) -> None:
        """Write signed numbers of 32 bits."""
        data = struct.pack(f">{len(values)}i", *values)
        self.write(first, *struct.unpack(f">{2 * len(values)}H", data))

    def _ask(self, request: Request, length: int) -> bytes:
        self.bench.run_for("5ms")  # silence between frames
        self.heard = b""
        self.listen()
        self.heard = b""
        self.send(encode_frame(ADDRESS, encode_request(request)))
        frame = self.answer(lambda data: (data[:length], b"") if len(data) >= length else None)
        address, message = parse_frame(frame)
        assert (address, message[0]) == (ADDRESS, request.function)
        return message


@pytest.fixture
def base(bench: Bench) -> Master:
    bench.run_for("50ms")
    return Master(bench)


def status(base: Master) -> int:
    return base.read(Address.STATUS)[0]


def speeds(base: Master) -> tuple[int, int]:
    return base.read_wide(Address.SPEED_LEFT), base.read_wide(Address.SPEED_RIGHT)


def drive(base: Master, left: int, right: int) -> None:
    """Drive at speeds, without a watchdog."""
    base.write(Address.WATCHDOG_MS, 0)
    base.write(Address.MODE, Mode.VELOCITY)
    base.write(Address.COMMAND, Command.ENABLE)
    base.write_wide(Address.TARGET_SPEED_LEFT, left, right)
    assert base.bench.wait_until(
        lambda: (
            max(abs(is_ - want) for is_, want in zip(speeds(base), (left, right), strict=True))
            < 0.05 * SPEED
        ),
        within="5s",
    )


def stands(base: Master) -> bool:
    return base.bench.wait_until(lambda: max(map(abs, speeds(base))) < 0.01 * SPEED, within="5s")


def test_it_says_what_it_is(base: Master) -> None:
    assert base.read(Address.DEVICE_ID, 2) == (DEVICE_ID, 0x0100)


def test_it_drives_forward(base: Master) -> None:
    before = base.read_wide(Address.POSITION_LEFT)
    drive(base, SPEED, SPEED)
    assert base.bench.wait_until(
        lambda: base.read_wide(Address.POSITION_LEFT) > before + SPEED // 2, within=PATIENCE
    )


def test_it_turns_on_the_spot(base: Master) -> None:
    drive(base, -SPEED, SPEED)


def test_stop_stops_it(base: Master) -> None:
    drive(base, SPEED, SPEED)
    base.write(Address.COMMAND, Command.STOP)
    assert stands(base)


def test_a_silent_host_stops_it(base: Master) -> None:
    drive(base, SPEED, SPEED)
    base.write(Address.WATCHDOG_MS, 300)
    base.bench.run_for("1s")
    assert status(base) & WATCHDOG
    assert stands(base)


@pytest.mark.needs("fault:emergency_stop")
def test_the_red_button_stops_it_until_it_is_cleared(base: Master) -> None:
    drive(base, SPEED, SPEED)
    base.bench.fault("emergency_stop")
    assert base.bench.wait_until(lambda: bool(status(base) & FAULT), within=PATIENCE)
    assert stands(base)
    base.bench.clear("emergency_stop")
    base.bench.run_for("50ms")
    assert status(base) & FAULT
    base.write(Address.COMMAND, Command.CLEAR_FAULT)
    assert base.bench.wait_until(lambda: not status(base) & FAULT, within=PATIENCE)
    drive(base, SPEED, SPEED)


@pytest.mark.needs("fault:encoder_unplugged_left")
def test_a_pulled_encoder_stops_both_wheels(base: Master) -> None:
    drive(base, SPEED, SPEED)
    base.bench.fault("encoder_unplugged_left", for_="2s")
    assert base.bench.wait_until(lambda: bool(status(base) & FAULT), within=PATIENCE)
    assert base.bench.wait_until(
        lambda: abs(base.read_wide(Address.SPEED_RIGHT)) < 0.01 * SPEED, within="5s"
    )


def test_a_frame_with_a_wrong_crc_is_not_answered(base: Master) -> None:
    frame = bytearray(encode_frame(ADDRESS, encode_request(Request(READ, read=(0, 1)))))
    frame[-1] ^= 1
    base.send(bytes(frame))
    base.bench.run_for("200ms")
    assert base.listen() == b""
    assert base.read(Address.DEVICE_ID) == (DEVICE_ID,)


@pytest.mark.needs("fault:cut")
def test_a_cut_line_stops_it_by_its_watchdog(base: Master) -> None:
    drive(base, SPEED, SPEED)
    base.write(Address.WATCHDOG_MS, 200)
    base.bench.fault("cut", for_="1s")
    base.bench.run_for("1200ms")
    assert status(base) & WATCHDOG
    assert stands(base)


@pytest.mark.needs("output:x_m")
def test_it_is_where_its_wheels_say(base: Master) -> None:
    x_m, y_m, angle_rad = (float(base.bench.get(name)) for name in PLACE)
    drive(base, SPEED, SPEED)
    base.write(Address.COMMAND, Command.STOP)
    assert stands(base)
    now_x_m, now_y_m, now_angle_rad = (float(base.bench.get(name)) for name in PLACE)
    way_m = hypot(now_x_m - x_m, now_y_m - y_m)
    assert way_m == pytest.approx(0.0995 * (now_angle_rad - angle_rad), rel=0.05)
